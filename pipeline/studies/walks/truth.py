"""Checks of the walkers' ground truth: proportions, symmetry, body size, power of the motion, phase and heading.

An error of the input changes every number, but no comparison reveals it.  These columns are the conditions of the
claims of figures 3 and 5.  The ranges are those of published bodies, not of the people in the data.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from pipeline.clips.kinds import Walks
from pipeline.core import fourier, linear_model
from pipeline.core.walking import step_heading
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import tidy

LEG_MM = (300.0, 1300.0)
"""Accepted range of leg length, thigh plus shank, mm."""

PROPORTIONS = {
    "hips": (0.10, 0.30),
    "thigh": (0.40, 0.60),
    "shoulders": (0.20, 0.70),
    "pelvis to head": (0.55, 1.20),
    "sternum to head": (0.08, 0.50),
}
"""Accepted ranges of body lengths relative to leg length [Drillis & Contini 1966; Gordon et al. 1989].

The ranges include adults and children, with a margin for the definitions of joints.  For the last range, the height of
the head above the sternum is used.
"""

LIMBS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
"""Joints at the ends of those limbs whose left and right lengths are compared."""

DECIMALS = 9
"""Number of decimals to which angles in degrees are rounded; further digits are rounding errors."""

INSTANTS = 24
"""Number of instants of a gait cycle at which lengths are measured."""


def truth_table(data: FourierSamples, clips: Walks) -> pd.DataFrame:
    """Return ``table_truth``, with the results of all checks in one row for each walker.

    Proportions and sides leave out joints that were not measured.

    Parameters
    ----------
    data : FourierSamples
    clips : Walks
        Recordings of the samples.
    """
    postures = np.stack([_cycle(of_walker) for of_walker in data.coefficients])  # (R, T, 15, 3)
    measured = ~data.unmeasured
    recorded = clips.stature_mm[data.walk] * data.scale
    of_series = np.array([_height(of_walker[0]) for of_walker in data.coefficients]) / recorded
    series = 0.5 * np.square(data.coefficients[:, 1:]).sum(axis=(1, 2, 3))
    residual, whole = (
        np.trace(covariance, axis1=-2, axis2=-1).sum(axis=-1)
        for covariance in (data.residual_covariance, data.temporal_covariance)
    )
    phase, heading = _phases(data.coefficients), np.array([step_heading(c) for c in data.coefficients])
    columns = {
        "person": data.person,
        "walker": data.clip,
        "proportions_outside": [_outside(p, m) for p, m in zip(postures, measured, strict=True)],
        "sides_apart": [_sides_apart(p, m) for p, m in zip(postures, measured, strict=True)],
        "size_off": np.abs(of_series / np.median(of_series) - 1.0),
        "residual_share": residual / whole,
        "power_off": np.abs((series + residual) / whole - 1.0),
        "fundamental_share": 0.5 * np.square(data.coefficients[:, 1:3]).sum(axis=(1, 2, 3)) / whole,
        "phase_off_deg": _from_the_mean_deg(phase),
        "heading_off_deg": _from_the_mean_deg(heading),
    }
    return tidy(columns, by=["walker"])


def along_table(data: FourierSamples, model: Eigenwalkers) -> pd.DataFrame:
    """Return ``table_along`` with the size of held-out walkers' coefficients for each eigenvector [zhang2007 3.11].

    ``squared``: over the eigenvalue of the model without the walker.  ``fourth_power``: of the coefficients over their
    root mean square over walkers; mean over the eigenvectors.
    """
    along = np.stack(
        [
            linear_model.coefficients(fold, model.samples[r : r + 1], measured=~data.unmeasured[r])[0]
            / np.sqrt(fold.eigenvalues)
            for r in range(len(model.samples))
            for fold in [model.fold(r)]
        ]
    )
    squared = along**2
    columns = {
        "person": data.person,
        "walker": data.clip,
        "squared": squared.mean(axis=1),
        "fourth_power": (squared**2 / np.square(squared.mean(axis=0))).mean(axis=1),
    }
    return tidy(columns, by=["walker"])


def _cycle(coefficients: np.ndarray) -> np.ndarray:
    """Return the postures (T, 15, 3), mm, of one gait cycle."""
    return fourier.synthesise(coefficients, 1.0, np.arange(INSTANTS) / INSTANTS)


def _outside(postures: np.ndarray, measured: np.ndarray) -> int:
    """Return the number of body proportions and leg lengths of a walker that are outside the accepted ranges."""
    mean = postures.mean(axis=0)
    leg = 0.5 * sum(
        _length(postures, f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in LIMBS[:2]
    )
    lengths = {
        "hips": (("left_hip", "right_hip"), _length(postures, "left_hip", "right_hip")),
        "thigh": (("left_hip", "left_knee"), _length(postures, "left_hip", "left_knee")),
        "shoulders": (
            ("left_shoulder", "right_shoulder"),
            _length(postures, "left_shoulder", "right_shoulder"),
        ),
        "pelvis to head": (("pelvis", "head"), _length(postures, "pelvis", "head")),
        "sternum to head": (("sternum", "head"), _above(mean, "head", "sternum")),
    }
    outside = [
        not low <= lengths[name][1] / leg <= high
        for name, (low, high) in PROPORTIONS.items()
        if all(measured[WALKER15.index(joint)] for joint in lengths[name][0])
    ]
    return sum(outside) + (not LEG_MM[0] <= leg <= LEG_MM[1])


def _sides_apart(postures: np.ndarray, measured: np.ndarray) -> float:
    """Return the largest relative difference between left and right limb lengths; 0 if no limb is measured."""
    differences = [0.0]
    for ends in LIMBS:
        names = [[f"{side}_{end}" for end in ends] for side in ("left", "right")]
        if all(measured[WALKER15.index(name)] for side in names for name in side):
            left, right = (_length(postures, *side) for side in names)
            differences.append(abs(left - right) / (0.5 * (left + right)))
    return max(differences)


def _length(postures: np.ndarray, one: str, other: str) -> float:
    """Return the root mean square distance, mm, between two joints over a gait cycle.

    The mean over the instants does not depend on the phase at which the cycle begins.
    """
    between = postures[:, WALKER15.index(one)] - postures[:, WALKER15.index(other)]
    return float(np.sqrt(np.square(between).sum(axis=-1).mean()))


def _above(posture: np.ndarray, one: str, other: str) -> float:
    """Return the height of one joint above another joint in a posture, mm."""
    return float(posture[WALKER15.index(one), 2] - posture[WALKER15.index(other), 2])


def _height(mean: np.ndarray) -> float:
    """Return the height of the head above the ankles, mm, in the mean posture."""
    return 0.5 * (_above(mean, "head", "left_ankle") + _above(mean, "head", "right_ankle"))


def _phases(coefficients: np.ndarray) -> np.ndarray:
    """Return the phase (R,), rad, of the distance between left and right ankle along the walking direction.

    The phase is that of the fundamental.
    """
    left, right = (WALKER15.index(f"{side}_ankle") for side in ("left", "right"))
    sine, cosine = (coefficients[:, k, left, 1] - coefficients[:, k, right, 1] for k in (1, 2))
    return np.arctan2(cosine, sine)


def _from_the_mean_deg(angles: np.ndarray) -> np.ndarray:
    """Return the absolute difference (R,), degrees, of angles (R,), rad, from their circular mean."""
    mean = np.angle(np.exp(1j * angles).mean())
    return np.abs(np.degrees(np.angle(np.exp(1j * (angles - mean))))).round(DECIMALS)
