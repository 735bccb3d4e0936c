"""Walkers drawn from published distributions of body size, walking speed and joint angles.

The numbers are in `core.anthropometry` (bodies) and `normative_gait` (gait).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.core import anthropometry as body
from pipeline.synthetic.walkers import normative_gait as norm

GRAVITY_MM_S2 = 9806.65
SIDE = np.array([[-1.0], [1.0]])
"""Sign of the x coordinate on the left (-1) and on the right side (+1), as a column."""


@dataclass(frozen=True)
class Manner:
    """Parameters of a person's joint-angle curve: landmark values (2, n), radians, and phase shift, cycles."""

    values: np.ndarray
    shift: float


@dataclass(frozen=True)
class Body:
    """Body lengths of a walker, mm; lengths of left and right limbs are columns (2, 1)."""

    stature: float
    thigh: np.ndarray
    shank: np.ndarray
    trunk: float
    head: float
    shoulder_drop: float
    half_hips: float
    half_shoulders: float
    upper_arm: float
    forearm: float

    @property
    def leg_length(self) -> float:
        """Leg length from hip to floor, mm, the mean of left and right."""
        return np.mean(self.thigh + self.shank) + body.SEGMENTS["ankle_height"] * self.stature


@dataclass(frozen=True)
class Person:
    """Synthetic walker: body lengths, speed (mm/s), stride frequency (Hz) and joint-angle curves (radians).

    Lengths are in mm.  Left and right are columns (2, 1).

    `foot_gains` (2,) scales the toes-up and heel-up excursions of the foot.
    """

    male: bool
    age_years: float
    body: Body
    speed: float
    frequency: float
    start_phase: float
    step_asymmetry: float
    ankle_lines: np.ndarray
    sway: float
    foot_gains: np.ndarray
    knee_out: np.ndarray
    arm_out: np.ndarray
    forearm_in: np.ndarray
    manner: dict[str, Manner]

    def basis(self, name: str, phase: np.ndarray) -> np.ndarray:
        """Return the weights (P, n) of the n landmark values of an angle curve at phases (P,), cycles."""
        return norm.CURVES[name].basis((phase + self.manner[name].shift) % 1.0)

    def curve(self, name: str, phase: np.ndarray, gain: np.ndarray | float = 1.0) -> np.ndarray:
        """Return a joint angle (2, T), radians, of left and right side, at phases (2, T), cycles.

        The deviation of the angle from its mean is multiplied by `gain`.
        """
        values, shift = self.manner[name].values, self.manner[name].shift
        centre = values.mean(axis=1, keepdims=True)
        # Splines of the two sides: the polynomials of the basis weighted by the landmark values.
        spline = norm.CURVES[name].basis
        coefficients = spline.c @ (values - centre).T
        shifted = phase + (shift - spline.x[0])
        within = shifted - np.floor(shifted) + spline.x[0]
        piece = np.searchsorted(spline.x[1:-1], within, side="right")
        past = within - spline.x[piece]
        c3, c2, c1, c0 = coefficients.reshape(4, -1).take(2 * piece + [[0], [1]], axis=1)
        return centre + gain * (((c3 * past + c2) * past + c1) * past + c0)

    def opposed(self, name: str, phase: np.ndarray) -> np.ndarray:
        """Return half the difference (T,) of an angle, right minus left; exchanging the sides changes its sign."""
        left, right = self.curve(name, phase)
        return (right - left) / 2.0

    def shared(self, name: str, phase: np.ndarray) -> np.ndarray:
        """Return the mean (T,) of an angle over left and right, which is periodic with each step."""
        left, right = self.curve(name, phase)
        return (left + right) / 2.0

    def hips(self, phase: np.ndarray) -> np.ndarray:
        """Return the positions of the hips relative to the pelvis, (3, 2, T), mm."""
        yaw = self.opposed("pelvic_rotation", phase)
        roll = self.opposed("pelvic_obliquity", phase)
        axis = np.stack([np.cos(yaw) * np.cos(roll), np.sin(yaw) * np.cos(roll), np.sin(roll)])
        return self.body.half_hips * SIDE * axis[:, None]

    def sideways(self, phase: np.ndarray) -> np.ndarray:
        """Return the sideways motion (T,) of the pelvis, mm."""
        return self.sway * np.degrees(self.opposed("pelvic_sway", phase))


def leaning(forward: np.ndarray, sideways: np.ndarray) -> np.ndarray:
    """Return unit vectors (3, T) that lean forward and to the right from the vertical by angles (T,), radians."""
    return np.stack(
        [np.sin(sideways), np.sin(forward) * np.cos(sideways), np.cos(forward) * np.cos(sideways)]
    )


def _positive(rng: np.random.Generator, mean: float, cv: float, size: int | None = None) -> Any:
    return mean * np.exp(cv * rng.standard_normal(size))


def _draw_manner(rng: np.random.Generator, male: bool, pace: float, offsets: float) -> dict[str, Manner]:
    """Draw all joint-angle curves of a person with dimensionless walking speed `pace`."""
    gains = {
        "pelvic_obliquity": norm.PELVIC_OBLIQUITY_BY_SEX[male],
        "trunk_sway": norm.TRUNK_SWAY_BY_SEX[male],
        "upper_arm": pace / norm.ARM_SPEED_REFERENCE,
        "elbow": pace / norm.ARM_SPEED_REFERENCE,
    }
    manner: dict[str, Manner] = {}
    for name, curve in norm.CURVES.items():
        spread, mean_deg = curve.spread, np.array(curve.mean_deg)
        middle = mean_deg.mean()
        gain = gains.get(name, 1.0) * _positive(rng, 1.0, spread.gain)
        landmarks = middle + gain * (mean_deg - middle)
        posture = offsets * spread.offset_deg * rng.standard_normal() * (SIDE if curve.opposed else 1.0)
        landmarks = landmarks + spread.shape_deg * rng.standard_normal(landmarks.size)
        asymmetry = SIDE * spread.side_deg * rng.standard_normal(landmarks.size)
        values = np.radians(landmarks + posture + asymmetry)
        manner[name] = Manner(values, spread.timing * rng.standard_normal())
    return manner


def draw_person(rng: np.random.Generator, male: bool, offsets: float = 1.0) -> Person:
    """Draw a synthetic walker; each walker uses the same number of random draws.

    Parameters
    ----------
    rng : numpy.random.Generator
    male : bool
    offsets : float
        Factor on the assumed standard deviations of constant offsets of joint angles.
    """

    low, high = body.AGE_RANGE_YEARS
    age = low + (high - low) * rng.beta(*body.AGE_BETA)
    growth = np.interp(age, body.GROWTH_AGE_YEARS, body.GROWTH[male])
    build = rng.standard_normal()
    mean, sd = body.STATURE_MM[male]
    stature = growth * (mean + sd * build)

    # At equal stature, longer legs go with a shorter trunk; the sides differ by a few millimetres.
    leg = rng.standard_normal()
    knee_height = body.SEGMENT_CV * rng.standard_normal()
    unequal = np.sqrt(0.125) * body.LEG_INEQUALITY_SD_MM * rng.standard_normal(2)
    share = stature * np.exp(body.LEG_SHARE_CV * leg)
    thigh = share * body.SEGMENTS["thigh"] * np.exp(-knee_height) + unequal[0] * SIDE
    shank = share * body.SEGMENTS["shank"] * np.exp(knee_height) + unequal[1] * SIDE
    trunk = stature * body.TRUNK * np.exp(body.TRUNK_SHARE_CV * (0.4 * rng.standard_normal() - 0.9 * leg))
    arm = stature * _positive(rng, 1.0, body.ARM_SHARE_CV)
    elbow = body.SEGMENT_CV * rng.standard_normal()

    def breadth(table: dict[bool, tuple[float, float]]) -> float:
        mean, sd = table[male]
        c = body.BREADTH_STATURE_CORRELATION
        return growth * (mean + sd * (c * build + np.sqrt(1 - c**2) * rng.standard_normal()))

    hips, shoulders = breadth(body.HIP_CENTRES_MM), breadth(body.BIACROMIAL_MM)

    pace = rng.normal(*norm.DIMENSIONLESS_SPEED)
    leg_length = np.mean(thigh + shank) + body.SEGMENTS["ankle_height"] * stature
    speed = pace * np.sqrt(GRAVITY_MM_S2 * leg_length)
    cadence = norm.STRIDES_PER_MINUTE * (speed / stature) ** norm.SPEED_EXPONENT
    frequency = cadence / 60.0 * _positive(rng, 1.0, norm.FREQUENCY_CV)

    manner = _draw_manner(rng, male, pace, offsets)
    width = max(norm.STEP_WIDTH_MIN_MM, rng.normal(norm.STEP_WIDTH_MM, norm.STEP_WIDTH_SD_MM))

    def pair(mean: float, sd: float) -> np.ndarray:
        # The sides of one person correlate: 0.8² = 0.64.
        return np.radians(mean + sd * (0.8 * rng.standard_normal() + 0.6 * rng.standard_normal((2, 1))))

    return Person(
        male=male,
        age_years=float(age),
        body=Body(
            stature=float(stature),
            thigh=thigh,
            shank=shank,
            trunk=float(trunk),
            head=stature * body.NECK_AND_HEAD * _positive(rng, 1.0, body.HEAD_CV),
            shoulder_drop=stature * body.SHOULDER_DROP * _positive(rng, 1.0, 0.3),
            half_hips=hips / 2.0,
            half_shoulders=shoulders * body.BIACROMIAL_TO_SHOULDER_CENTRES / 2.0,
            upper_arm=arm * body.SEGMENTS["upper_arm"] * np.exp(-elbow),
            forearm=arm * body.SEGMENTS["forearm"] * np.exp(elbow),
        ),
        speed=speed,
        frequency=frequency,
        start_phase=rng.uniform(),
        step_asymmetry=norm.STEP_TIME_ASYMMETRY_SD * rng.standard_normal(),
        ankle_lines=SIDE * width / 2.0,
        sway=_positive(rng, norm.SWAY_MM[0], norm.SWAY_MM[1] / norm.SWAY_MM[0]),
        foot_gains=_positive(rng, 1.0, norm.FOOT_GAIN_CV, 2),
        knee_out=pair(*norm.KNEE_TURNED_OUT_DEG),
        arm_out=pair(*norm.ARM_ABDUCTION_DEG[male]),
        forearm_in=pair(*norm.FOREARM_TURNED_IN_DEG),
        manner=manner,
    )
