"""Who walks: published means and spreads of bodies and of gait, each with its source, and a person drawn.

Every number that `pipeline.core.synthetic` uses stands here.  Three grades of support, marked at each:

- *published*: a mean or standard deviation that the source prints;
- *read*: a landmark of a curve that the source plots, or an order of size in its text: right to a degree or
  two and a hundredth or two of a cycle; not digitised anew;
- *assumed*: the source gives the direction only; the number is ours.

A tick ✓ marks a number looked up when this was written; the others stand as they are commonly quoted.  None
was chosen by looking at what the linear model or a Fourier fit makes of the result.

Legend
------
Phases are fractions of a leg's own cycle, 0 at its initial contact; angles in degrees; lengths as fractions
of stature H unless said otherwise.  Forward, upward and flexed are positive.

Sources
-------
Age and body
    zhang2007 section 2 (ages); Gordon et al. 1989 (US Army survey: stature, biacromial breadth); Kuczmarski
    et al. 2002 (growth charts); Drillis & Contini 1966, as in Winter 2009 figure 4.1 (segment lengths);
    Bell et al. 1990 and Seidel et al. 1995 (hip joint centres); Knutson 2005 (leg length inequality).
Speed and rhythm
    Alexander 1984 (speed by the root of leg length); Dal et al. 2010 (comfortable belt speed is below
    overground speed); Öberg et al. 1993 (spread of speed and cadence); Grieve & Gear 1966 (frequency by speed
    and stature; Umberger & Martin 2007 agree: 54.3 strides/min ✓); Murray et al. 1964 (stance); Hausdorff et
    al. 1995 and Hausdorff 2007 (stride to stride); Sadeghi et al. 2000 (asymmetry); Owings & Grabiner 2004
    (step width on a treadmill).
Angles
    Perry 1992; Winter 1991; Kadaba et al. 1990 (legs, pelvis, foot); Smith et al. 2002 (pelvic obliquity by
    sex); Murray et al. 1967 (arms, thorax); Thorstensson et al. 1984 and Crosbie et al. 1997 (trunk);
    Hirasaki et al. 1999 (head); Saunders et al. 1953 and Orendurff et al. 2004 (sway of the pelvis).
    Troje 2002, Mather & Murdoch 1994 and Bruening et al. 2015 (sex).  Curves as splines through key events:
    Koopman et al. 2014.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class Spread:
    """How a curve differs between people, standard deviations.

    Attributes
    ----------
    offset_deg : float
        The whole curve up or down: on both sides alike, or to one side where the curve is `opposed`.
    gain : float
        Excursion about the middle, as a fraction.
    shape_deg, side_deg : float
        Each landmark by itself: on both sides alike, and left against right.
    timing : float
        Earlier or later, in cycles.
    """

    offset_deg: float
    gain: float
    shape_deg: float
    side_deg: float
    timing: float


@dataclass(frozen=True)
class NormativeCurve:
    """A periodic angle through published landmarks.

    Attributes
    ----------
    phases, mean_deg : tuple of float
        Landmarks: fractions of the cycle in [0, 1), and the angle there.
    spread : Spread
    opposed : bool
        Whether the body part turns by half of (right − left): it then changes sign when the sides do.
    """

    phases: tuple[float, ...]
    mean_deg: tuple[float, ...]
    spread: Spread
    opposed: bool = False

    @cached_property
    def basis(self) -> CubicSpline:
        """Periodic cubic spline whose values times the landmark values are the curve: (…,) → (…, n)."""
        knots = np.append(self.phases, self.phases[0] + 1.0)
        cardinal = np.eye(len(self.phases))
        return CubicSpline(knots, np.vstack([cardinal, cardinal[:1]]), bc_type="periodic")


# --- age and body -----------------------------------------------------------------------------------------

AGE_RANGE_YEARS = (13.0, 59.0)
AGE_BETA = (1.7, 4.3)
"""Ages 13–59 with mean 26 ✓ [zhang2007 section 2]: beta on the range, mean 13 + 46 · 1.7/6.
Shape assumed."""

STATURE_MM = {True: (1755.8, 66.8), False: (1629.4, 63.6)}
"""Mean and SD by sex (male: True).  Published: Gordon et al. 1989 (men ✓)."""

GROWTH_AGE_YEARS = (13.0, 14.0, 15.0, 16.0, 17.0, 18.0)
GROWTH = {
    True: (0.886, 0.930, 0.964, 0.985, 0.995, 1.0),
    False: (0.964, 0.984, 0.993, 0.997, 1.0, 1.0),
}
"""Median stature over adult median.  Read: Kuczmarski et al. 2002 (growth charts)."""

SEGMENTS = {"thigh": 0.245, "shank": 0.246, "ankle_height": 0.039, "upper_arm": 0.186, "forearm": 0.146}
"""Published: Drillis & Contini 1966."""

TRUNK, NECK_AND_HEAD, SHOULDER_DROP = 0.295, 0.105, 0.015
"""Hip axis to the virtual sternum (midway between C7 and the notch, 0.825 H), sternum to the centre of the
head (0.93 H), and how far the shoulder centres lie below the sternum.  Read: Drillis & Contini 1966 heights
(hip 0.530, shoulder 0.818, chin 0.870)."""

LEG_SHARE_CV, TRUNK_SHARE_CV, ARM_SHARE_CV, SEGMENT_CV, HEAD_CV = 0.025, 0.02, 0.025, 0.012, 0.05
"""Spread of proportions at equal stature: the whole leg (trunk moves against it), the arm, and one segment
against its neighbour.  Assumed from Gordon et al. 1989 (crotch height, sleeve: residual SD 2–3 %)."""

BIACROMIAL_MM = {True: (397.0, 18.0), False: (362.6, 17.4)}
BIACROMIAL_TO_SHOULDER_CENTRES = 0.90
"""Breadth: published, Gordon et al. 1989.  The joint centres lie some 18 mm inside each acromion: assumed."""

HIP_CENTRES_MM = {True: (172.0, 9.0), False: (172.0, 9.0)}
"""Distance of hip joint centres, alike in men and women, so wider for stature in women.  Read: Bell et al.
1990; Seidel et al. 1995."""

BREADTH_STATURE_CORRELATION = 0.4
"""Of breadths with stature.  Read: Gordon et al. 1989 (0.3–0.5)."""

LEG_INEQUALITY_SD_MM = 5.0
"""Right less left.  Published order: Knutson 2005 (mean magnitude 5.2 mm)."""

FOOT_HEEL, FOOT_BALL = 0.026, 0.073
"""Floor point of the heel behind, and of the ball ahead of, the ankle.  Read: Winter 1991; Drillis & Contini
1966 (foot length 0.152)."""

# --- speed and rhythm -------------------------------------------------------------------------------------

DIMENSIONLESS_SPEED = (0.42, 0.042)
"""v / √(g · leg length).  Read: Alexander 1984 scaling; comfortable on a belt about a tenth below the
overground 0.45 (Dal et al. 2010); spread of a tenth, Öberg et al. 1993."""

STRIDES_PER_MINUTE, SPEED_EXPONENT, FREQUENCY_CV = 64.8, 0.57, 0.03
"""f = 64.8 (v/H)^0.57 strides a minute, v/H in statures a second.  Published: Grieve & Gear 1966.
Spread at equal speed: what Öberg et al. 1993 leave (6–7 % in all, 6 % of it from speed and stature)."""

TOE_OFF = 0.62
"""End of stance.  Published: Murray et al. 1964; Perry 1992."""

STEP_TIME_ASYMMETRY_SD = 0.006
"""Right contact less half a cycle after the left one, cycles.  Read: Sadeghi et al. 2000 (a few percent of
step time)."""

STRIDE_TIME_CV, STRIDE_MEMORY = 0.017, 0.5
"""Published range 1–2 %; successive strides are correlated.  Hausdorff et al. 1995; Hausdorff 2007."""

STRIDE_GAIN_CV = {"leg": 0.02, "arm": 0.06, "trunk": 0.08}
"""Stride-to-stride spread of excursions.  Legs: Winter 1991 (within-subject 1–2°).  Others assumed."""

STEP_WIDTH_MM, STEP_WIDTH_SD_MM, STEP_WIDTH_LEAST_MM = 115.0, 25.0, 55.0
FOOT_PLACEMENT_SD_MM = 12.0
"""Distance of the ankles' lines; stride-to-stride SD of one foot.  Read: Owings & Grabiner 2004."""

BELT_WANDER_SD_MM, BELT_WANDER_MEMORY, BELT_RETURN_S = 8.0, 0.9, 3.0
"""Slow sideways wandering, and the time in which a walker makes good a drift along the belt.  Assumed."""

# --- angles: legs -----------------------------------------------------------------------------------------

THIGH = NormativeCurve(
    (0.0, 0.12, 0.21, 0.30, 0.42, 0.52, 0.62, 0.74, 0.86, 0.94),
    (23.5, 19.0, 10.0, 1.0, -11.0, -17.5, -10.0, 13.0, 25.0, 25.0),
    Spread(offset_deg=2.5, gain=0.0, shape_deg=1.2, side_deg=0.6, timing=0.006),
)
"""Thigh from the vertical: hip flexion less pelvic tilt (tilting about the hip axis moves no joint).
Read: Perry 1992; Kadaba et al. 1990 (hip flexion 35° at contact, −7° at 52 %, tilt 11–12°).  Its excursion
is then scaled so that the stride fits the belt, hence no spread of gain."""

KNEE = NormativeCurve(
    (0.0, 0.14, 0.27, 0.40, 0.51, 0.61, 0.72, 0.84, 0.95),
    (5.0, 18.0, 10.5, 5.0, 12.0, 37.0, 61.0, 34.0, 4.0),
    Spread(offset_deg=2.5, gain=0.05, shape_deg=2.0, side_deg=1.0, timing=0.006),
)
"""Knee flexion.  Read: Perry 1992; Winter 1991; Kadaba et al. 1990; SD 4–6° between people there."""

FLOOR_UNTIL, FLOOR_SD_MM = 0.58, 2.0
SETTLING_SD_DEG = {"thigh": 2.0, "knee": 3.0}
SETTLING_SCALE_SD = 0.3
SURGE_MM, SURGE_SD_MM = (0.0, 0.0, 9.7, -2.4), 4.0
BOB_SD_MM = (4.0, 4.0, 25.0, 25.0, 4.0, 4.0)
"""How a drawn person is settled on the floor: until when the foot turns about ball or heel (then the toes
bend), how exactly, and by how much each landmark may move: assumed.  Surge of the pelvis on the belt: sine
and cosine of the first and second harmonic of the stride, 10 mm in the second, fastest just after each
contact; read: Winter 1991 (forward velocity ±0.1 m/s).  Bob: spread of harmonics 1, 2 and 4; the second, two
to a stride, is left to the legs."""

KNEE_STOP_DEG, ELBOW_STOP_DEG, STOP_SOFTNESS_DEG = -2.0, 2.0, 1.5
"""Extension ends smoothly here (capsule, olecranon).  Assumed, within the norm of a few degrees."""

FOOT_PHASES = (0.0, 0.08, 0.33, 0.42, 0.50, 0.56, 0.62, 0.72, 0.88, 1.0)
FOOT_PITCH_DEG = (20.0, 0.0, 0.0, -8.0, -22.0, -40.0, -60.0, -45.0, 8.0, 20.0)
FOOT_GAIN_CV = 0.12
"""Foot from the floor, toes up positive: heel contact, flat, heel off at a third, push-off.  Read: Winter
1991.  Monotone between landmarks, so that the foot lies flat; spread read there too."""

KNEE_TURNED_OUT_DEG = (4.0, 5.0)
"""The leg's plane, turned out about the line hip–ankle: mean and SD.  Read: Murray et al. 1964 (feet turned
out by 6.7°; half of it in the thigh assumed)."""

# --- angles: pelvis and trunk -----------------------------------------------------------------------------
# One side's curve; the body part's is half of (right − left) if opposed, else the mean of the sides.
# Spread of posture (`offset_deg`) assumed throughout.

PELVIC_ROTATION = NormativeCurve(
    (0.0, 0.10, 0.30, 0.50, 0.60, 0.80),
    (4.5, 4.2, 0.5, -4.5, -4.2, -0.5),
    Spread(offset_deg=2.0, gain=0.35, shape_deg=0.5, side_deg=0.5, timing=0.02),
    opposed=True,
)
"""Own side forward.  Read: Kadaba et al. 1990; Perry 1992 (5° each way)."""

PELVIC_OBLIQUITY = NormativeCurve(
    (0.0, 0.14, 0.30, 0.50, 0.64, 0.80),
    (0.5, 4.2, 2.0, -0.5, -4.2, -2.0),
    Spread(offset_deg=0.7, gain=0.40, shape_deg=0.4, side_deg=0.4, timing=0.015),
    opposed=True,
)
"""Own side up.  Shape read: Kadaba et al. 1990."""

PELVIC_OBLIQUITY_BY_SEX = {True: 7.4 / 8.4, False: 9.4 / 8.4}
"""Range 7.4° (SD 3.4) in men, 9.4° (3.5) in women ✓, over the curve's 8.4°.  Published: Smith et al. 2002."""

PELVIC_SWAY = NormativeCurve(
    (0.06, 0.17, 0.31, 0.45, 0.56, 0.67, 0.81, 0.95),
    (0.0, 0.70, 1.0, 0.70, 0.0, -0.70, -1.0, -0.70),
    Spread(offset_deg=0.0, gain=0.0, shape_deg=0.06, side_deg=0.03, timing=0.01),
    opposed=True,
)
"""Towards the own side, in units of `SWAY_MM`: over the standing foot in mid-stance.  Read: Orendurff et al.
2004 (timing)."""

SWAY_MM = (22.0, 5.0)
"""Half the sideways excursion.  Published: Saunders et al. 1953 (about 45 mm in all); spread read from
Orendurff et al. 2004."""

THORAX_ROTATION = NormativeCurve(
    (0.02, 0.14, 0.33, 0.52, 0.64, 0.83),
    (-3.5, -3.0, 0.3, 3.5, 3.0, -0.3),
    Spread(offset_deg=2.0, gain=0.35, shape_deg=0.4, side_deg=0.4, timing=0.03),
    opposed=True,
)
"""Own side forward: against the pelvis.  Read: Murray et al. 1967 (7° in all)."""

THORAX_OBLIQUITY = NormativeCurve(
    (0.05, 0.18, 0.35, 0.55, 0.68, 0.85),
    (-0.6, -1.8, -0.9, 0.6, 1.8, 0.9),
    Spread(offset_deg=1.0, gain=0.40, shape_deg=0.3, side_deg=0.3, timing=0.02),
    opposed=True,
)
"""Own shoulder up: against the pelvis.  Read: Crosbie et al. 1997."""

TRUNK_SWAY = NormativeCurve(
    (0.06, 0.17, 0.31, 0.45, 0.56, 0.67, 0.81, 0.95),
    (0.0, 0.70, 1.0, 0.70, 0.0, -0.70, -1.0, -0.70),
    Spread(offset_deg=0.7, gain=0.60, shape_deg=0.15, side_deg=0.1, timing=0.03),
    opposed=True,
)
"""Lean to the own side, of the line from hips to sternum.  Read: Thorstensson et al. 1984."""

TRUNK_SWAY_BY_SEX = {True: 0.9, False: 0.5}
"""Mean 0.7°, so that with the pelvis's sway the head moves some 60 mm from side to side (read: Murray et al.
1964, 59 mm).  Men sway more above, women roll more below: direction, Mather & Murdoch 1994; Bruening et al.
2015 ✓; size assumed."""

TRUNK_LEAN = NormativeCurve(
    (0.0, 0.12, 0.25, 0.38, 0.50, 0.62, 0.75, 0.88),
    (2.9, 2.7, 1.5, 1.3, 2.9, 2.7, 1.5, 1.3),
    Spread(offset_deg=2.5, gain=0.35, shape_deg=0.2, side_deg=0.1, timing=0.02),
)
"""Forward, of the line from hips to sternum; most near each contact.  Read: Thorstensson et al. 1984."""

HEAD_LEAN = NormativeCurve(
    (0.0, 0.12, 0.25, 0.38, 0.50, 0.62, 0.75, 0.88),
    (7.0, 7.6, 9.0, 8.4, 7.0, 7.6, 9.0, 8.4),
    Spread(offset_deg=5.0, gain=0.40, shape_deg=0.3, side_deg=0.15, timing=0.03),
)
"""Forward, of the line from sternum to head; it nods down as the body rises.  Read: Hirasaki et al. 1999;
mean and spread of posture assumed."""

# --- angles: arms -----------------------------------------------------------------------------------------

UPPER_ARM = NormativeCurve(
    (0.02, 0.15, 0.28, 0.40, 0.52, 0.65, 0.78, 0.90),
    (-20.0, -15.5, -4.5, 5.0, 9.5, 4.5, -6.0, -15.5),
    Spread(offset_deg=4.0, gain=0.35, shape_deg=1.0, side_deg=2.0, timing=0.02),
)
"""Upper arm from the vertical, forward positive, on the cycle of the same side's leg: back at its contact.
Read: Murray et al. 1967 (arc about 30°)."""

ELBOW = NormativeCurve(
    (0.05, 0.20, 0.37, 0.54, 0.70, 0.88),
    (17.0, 19.5, 29.0, 38.0, 31.0, 20.0),
    Spread(offset_deg=6.0, gain=0.35, shape_deg=1.2, side_deg=2.0, timing=0.02),
)
"""Elbow flexion.  Read: Murray et al. 1967; Perry 1992."""

ARM_SPEED_REFERENCE = 0.45
"""Arm swing grows with speed, in proportion here; the curves are those of the overground dimensionless speed.
Direction: Murray et al. 1967.  Proportion assumed."""

ARM_ABDUCTION_DEG = {True: (10.0, 3.0), False: (8.0, 3.0)}
FOREARM_TURNED_IN_DEG = (18.0, 10.0)
"""Mean and SD.  Men hold the elbows wider (Troje 2002).  Sizes assumed."""

CURVES = {
    "thigh": THIGH,
    "knee": KNEE,
    "pelvic_rotation": PELVIC_ROTATION,
    "pelvic_obliquity": PELVIC_OBLIQUITY,
    "pelvic_sway": PELVIC_SWAY,
    "thorax_rotation": THORAX_ROTATION,
    "thorax_obliquity": THORAX_OBLIQUITY,
    "trunk_sway": TRUNK_SWAY,
    "trunk_lean": TRUNK_LEAN,
    "head_lean": HEAD_LEAN,
    "upper_arm": UPPER_ARM,
    "elbow": ELBOW,
}

# --- a person ---------------------------------------------------------------------------------------------

GRAVITY_MM_S2 = 9806.65
SIDE = np.array([[-1.0], [1.0]])
"""Sign of x on the left and on the right, a column."""


@dataclass(frozen=True)
class Manner:
    """One person's own curve: landmark values (2, n) in radians, and how much earlier it comes, in cycles."""

    values: np.ndarray
    shift: float


@dataclass(frozen=True)
class Person:
    """One walker: lengths in mm, angles in radians; left and right as columns (2, 1).

    `foot_gains` (2,) scales the foot's toes-up and heel-up excursions.
    """

    male: bool
    age_years: float
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

    @property
    def leg_length(self) -> float:
        """Hip to floor, mean of the sides, mm."""
        return float(np.mean(self.thigh + self.shank)) + SEGMENTS["ankle_height"] * self.stature

    def basis(self, name: str, phase: np.ndarray) -> np.ndarray:
        """What each landmark value weighs at these phases: (P,) cycles → (P, n)."""
        return np.asarray(CURVES[name].basis((phase + self.manner[name].shift) % 1.0))

    def curve(self, name: str, phase: np.ndarray, gain: np.ndarray | float = 1.0) -> np.ndarray:
        """Each side's angle at its own phase, its excursion times `gain`: (2, T) cycles → (2, T) radians."""
        values, shift = self.manner[name].values, self.manner[name].shift
        centre = values.mean(axis=1, keepdims=True)
        # The person's own two splines: the basis's polynomials weighted by the landmark values.
        spline = CURVES[name].basis
        own = spline.c @ (values - centre).T
        place = phase + (shift - spline.x[0])
        within = place - np.floor(place) + spline.x[0]
        piece = np.searchsorted(spline.x[1:-1], within, side="right")
        past = within - spline.x[piece]
        c3, c2, c1, c0 = own.reshape(4, -1).take(2 * piece + [[0], [1]], axis=1)
        return centre + gain * (((c3 * past + c2) * past + c1) * past + c0)


def draw_person(rng: np.random.Generator, male: bool) -> Person:
    """A person's body, pace and manner; the number of draws is the same for everyone."""

    def positive(mean: float, cv: float, size: int | None = None) -> Any:
        return mean * np.exp(cv * rng.standard_normal(size))

    low, high = AGE_RANGE_YEARS
    age = low + (high - low) * rng.beta(*AGE_BETA)
    growth = float(np.interp(age, GROWTH_AGE_YEARS, GROWTH[male]))
    build = rng.standard_normal()
    mean, sd = STATURE_MM[male]
    stature = growth * (mean + sd * build)

    # Longer legs mean a shorter trunk at the same stature; the sides differ by a few millimetres.
    leg = rng.standard_normal()
    knee_height = SEGMENT_CV * rng.standard_normal()
    unequal = np.sqrt(0.125) * LEG_INEQUALITY_SD_MM * rng.standard_normal(2)
    share = stature * np.exp(LEG_SHARE_CV * leg)
    thigh = share * SEGMENTS["thigh"] * np.exp(-knee_height) + unequal[0] * SIDE
    shank = share * SEGMENTS["shank"] * np.exp(knee_height) + unequal[1] * SIDE
    trunk = stature * TRUNK * np.exp(TRUNK_SHARE_CV * (0.4 * rng.standard_normal() - 0.9 * leg))
    arm = stature * positive(1.0, ARM_SHARE_CV)
    elbow = SEGMENT_CV * rng.standard_normal()

    def breadth(table: dict[bool, tuple[float, float]]) -> float:
        mean, sd = table[male]
        c = BREADTH_STATURE_CORRELATION
        return growth * (mean + sd * (c * build + np.sqrt(1 - c**2) * rng.standard_normal()))

    hips, shoulders = breadth(HIP_CENTRES_MM), breadth(BIACROMIAL_MM)

    pace = rng.normal(*DIMENSIONLESS_SPEED)
    leg_length = np.mean(thigh + shank) + SEGMENTS["ankle_height"] * stature
    speed = float(pace * np.sqrt(GRAVITY_MM_S2 * leg_length))
    cadence = STRIDES_PER_MINUTE * (speed / stature) ** SPEED_EXPONENT
    frequency = float(cadence / 60.0 * positive(1.0, FREQUENCY_CV))

    gains = {
        "pelvic_obliquity": PELVIC_OBLIQUITY_BY_SEX[male],
        "trunk_sway": TRUNK_SWAY_BY_SEX[male],
        "upper_arm": pace / ARM_SPEED_REFERENCE,
        "elbow": pace / ARM_SPEED_REFERENCE,
    }
    manner: dict[str, Manner] = {}
    for name, curve in CURVES.items():
        spread, mean_deg = curve.spread, np.array(curve.mean_deg)
        middle = mean_deg.mean()
        gain = gains.get(name, 1.0) * positive(1.0, spread.gain)
        own = middle + gain * (mean_deg - middle)
        posture = spread.offset_deg * rng.standard_normal() * (SIDE if curve.opposed else 1.0)
        own = own + spread.shape_deg * rng.standard_normal(own.size)
        apart = SIDE * spread.side_deg * rng.standard_normal(own.size)
        manner[name] = Manner(np.radians(own + posture + apart), spread.timing * rng.standard_normal())

    width = max(STEP_WIDTH_LEAST_MM, rng.normal(STEP_WIDTH_MM, STEP_WIDTH_SD_MM))

    def pair(mean: float, sd: float) -> np.ndarray:
        # The sides of one person correlate: 0.8² = 0.64.
        return np.radians(mean + sd * (0.8 * rng.standard_normal() + 0.6 * rng.standard_normal((2, 1))))

    return Person(
        male=male,
        age_years=float(age),
        stature=float(stature),
        thigh=thigh,
        shank=shank,
        trunk=float(trunk),
        head=float(stature * NECK_AND_HEAD * positive(1.0, HEAD_CV)),
        shoulder_drop=float(stature * SHOULDER_DROP * positive(1.0, 0.3)),
        half_hips=hips / 2.0,
        half_shoulders=shoulders * BIACROMIAL_TO_SHOULDER_CENTRES / 2.0,
        upper_arm=float(arm * SEGMENTS["upper_arm"] * np.exp(-elbow)),
        forearm=float(arm * SEGMENTS["forearm"] * np.exp(elbow)),
        speed=speed,
        frequency=frequency,
        start_phase=float(rng.uniform()),
        step_asymmetry=float(STEP_TIME_ASYMMETRY_SD * rng.standard_normal()),
        ankle_lines=SIDE * width / 2.0,
        sway=float(positive(SWAY_MM[0], SWAY_MM[1] / SWAY_MM[0])),
        foot_gains=positive(1.0, FOOT_GAIN_CV, 2),
        knee_out=pair(*KNEE_TURNED_OUT_DEG),
        arm_out=pair(*ARM_ABDUCTION_DEG[male]),
        forearm_in=pair(*FOREARM_TURNED_IN_DEG),
        manner=manner,
    )
