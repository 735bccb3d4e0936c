"""Means and standard deviations of gait speed, stride frequency and joint angles, with their sources.

Synthetic walkers use these numbers and those of `core.anthropometry`.  Each number has a grade of support:

- *published*: a mean or standard deviation printed in the source;
- *read*: a landmark of a plotted curve, or an order of magnitude from the text, correct to about two degrees and two
  hundredths of a cycle; not digitised;
- *assumed*: the source gives only the direction; the number is ours.

A tick ✓ marks a number that was checked in the source; the others are as commonly quoted.  No number was chosen by the
results of the linear model or of a Fourier fit.

Legend
------
Phases are fractions of the cycle of the same leg, 0 at its initial contact; angles in degrees; lengths as fractions
of stature H unless stated otherwise.  Forward, upward and flexed are positive.

Sources
-------
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

import numpy as np
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class Spread:
    """Standard deviations over people of the parameters of a joint-angle curve, such as its offset.

    Attributes
    ----------
    offset_deg : float
        Shift of the complete curve: equal on both sides, or to one side if the curve is `opposed`.
    gain : float
        Relative change of the excursion about the mean.
    shape_deg, side_deg : float
        Change of each landmark: equal on both sides, and left against right.
    timing : float
        Shift in time, in cycles.
    """

    offset_deg: float
    gain: float
    shape_deg: float
    side_deg: float
    timing: float


@dataclass(frozen=True)
class NormativeCurve:
    """Joint angle over the gait cycle as a periodic curve through published values, the landmarks.

    Attributes
    ----------
    phases, mean_deg : tuple of float
        Landmarks: fractions of the cycle in [0, 1), and angles.
    spread : Spread
    opposed : bool
        True if the angle of the body part is half of (right − left), which changes sign when the sides are exchanged.
    """

    phases: tuple[float, ...]
    mean_deg: tuple[float, ...]
    spread: Spread
    opposed: bool = False

    @cached_property
    def basis(self) -> CubicSpline:
        """Periodic cubic spline that returns, at phases (…), the weights (…, n) of the n landmark values of a curve."""
        knots = np.append(self.phases, self.phases[0] + 1.0)
        cardinal = np.eye(len(self.phases))
        return CubicSpline(knots, np.vstack([cardinal, cardinal[:1]]), bc_type="periodic")


# --- speed and rhythm -------------------------------------------------------------------------------------

DIMENSIONLESS_SPEED = (0.42, 0.042)
"""Mean and SD over people of the dimensionless walking speed v / √(g · leg length).

Read: Alexander 1984 scaling; comfortable on a belt about a tenth below the overground 0.45 (Dal et al. 2010); spread of
a tenth, Öberg et al. 1993."""

STRIDES_PER_MINUTE, SPEED_EXPONENT, FREQUENCY_CV = 64.8, 0.57, 0.03
"""Factor and exponent of the stride frequency, 64.8 (v/H)^0.57 per minute, and its variation at equal speed.

v/H is the speed in statures per second.  The variation is a coefficient of variation.

Published: Grieve & Gear 1966.  The spread at equal speed is the remainder in Öberg et al. 1993 (6–7 % in total, 6 %
of it from speed and stature)."""

TOE_OFF = 0.62
"""Phase of toe-off, in cycles. Published: Murray et al. 1964; Perry 1992."""

STEP_TIME_ASYMMETRY_SD = 0.006
"""SD over people of the asymmetry of step times, in cycles.

The asymmetry is the time from left to right contact, minus half a cycle.

Read: Sadeghi et al. 2000 (a few percent of step time)."""

STRIDE_TIME_CV, STRIDE_MEMORY = 0.017, 0.5
"""Coefficient of variation of the stride time, and correlation between the times of successive strides.

The published range is 1–2 %: Hausdorff et al. 1995; Hausdorff 2007."""

STRIDE_GAIN_CV = {"leg": 0.02, "arm": 0.06, "trunk": 0.08}
"""Coefficients of variation from stride to stride of the ranges of joint angles.

Legs: Winter 1991 (within-subject 1–2°).  Others assumed.
"""

STEP_WIDTH_MM, STEP_WIDTH_SD_MM, STEP_WIDTH_MIN_MM = 115.0, 25.0, 55.0
FOOT_PLACEMENT_SD_MM = 12.0
"""Mean, SD and minimum of the step width, and SD of lateral foot placement between strides, mm.

Read: Owings & Grabiner 2004."""

BELT_WANDER_SD_MM, BELT_WANDER_MEMORY, BELT_RETURN_S = 8.0, 0.9, 3.0
"""SD, mm, and stride-to-stride correlation of lateral drift on the belt, and time constant of the return, s.

Assumed.
"""

# --- angles: legs -----------------------------------------------------------------------------------------

THIGH = NormativeCurve(
    (0.0, 0.12, 0.21, 0.30, 0.42, 0.52, 0.62, 0.74, 0.86, 0.94),
    (23.5, 19.0, 10.0, 1.0, -11.0, -17.5, -10.0, 13.0, 25.0, 25.0),
    Spread(offset_deg=2.5, gain=0.0, shape_deg=1.2, side_deg=0.6, timing=0.006),
)
"""Angle of the thigh from the vertical, degrees: hip flexion minus pelvic tilt.

A tilt of the pelvis about the hip axis moves no joint centre.

Read: Perry 1992; Kadaba et al. 1990 (hip flexion 35° at contact, −7° at 52 %, tilt 11–12°).  The excursion is scaled so
that the stride fits the belt, and therefore has no spread of gain."""

KNEE = NormativeCurve(
    (0.0, 0.14, 0.27, 0.40, 0.51, 0.61, 0.72, 0.84, 0.95),
    (5.0, 18.0, 10.5, 5.0, 12.0, 37.0, 61.0, 34.0, 4.0),
    Spread(offset_deg=2.5, gain=0.05, shape_deg=2.0, side_deg=1.0, timing=0.006),
)
"""Flexion of the knee over the gait cycle, degrees.

Read: Perry 1992; Winter 1991; Kadaba et al. 1990, with an SD of 4–6° between people.
"""

FLOOR_UNTIL, FLOOR_SD_MM = 0.58, 2.0
CORRECTION_SD_DEG = {"thigh": 2.0, "knee": 3.0}
CORRECTION_SCALE_SD = 0.3
SURGE_MM, SURGE_SD_MM = (0.0, 0.0, 9.7, -2.4), 4.0
BOB_SD_MM = (4.0, 4.0, 25.0, 25.0, 4.0, 4.0)
"""Parameters of the correction that keeps the feet of a synthetic walker on the floor.

Floor: last phase at which the foot rotates about ball or heel (then the toes bend), and tolerance.  Corrections:
standard deviations of the landmarks.  All are assumed.  Surge of the pelvis on the belt: sine and cosine of the first
and second harmonic of the stride, 10 mm in the second, fastest just after each contact.  Read: Winter 1991 (forward
velocity ±0.1 m/s).  Bob: spread of harmonics 1, 2 and 4; the second, twice per stride, is determined by the legs."""

KNEE_STOP_DEG, ELBOW_STOP_DEG, STOP_SOFTNESS_DEG = -2.0, 2.0, 1.5
"""Angles at which the extension of knee and elbow stops, and softness of the stop, degrees.

Assumed, within the norm of a few degrees."""

FOOT_PHASES = (0.0, 0.08, 0.33, 0.42, 0.50, 0.56, 0.62, 0.72, 0.88, 1.0)
FOOT_PITCH_DEG = (20.0, 0.0, 0.0, -8.0, -22.0, -40.0, -60.0, -45.0, 8.0, 20.0)
FOOT_GAIN_CV = 0.12
"""Pitch of the foot over the gait cycle, degrees, and its variation; toes up is positive.

Read, with its spread: Winter 1991.  The curve is monotone between landmarks, so that the foot lies flat."""

KNEE_TURNED_OUT_DEG = (4.0, 5.0)
"""Mean and SD of the outward rotation of the knee about the line from hip to ankle, degrees.

Read: Murray et al. 1964 (feet turned out by 6.7°; half of it in the thigh is assumed)."""

# --- angles: pelvis and trunk -----------------------------------------------------------------------------
# Curves of one side; the angle of the body part is half of (right − left) if opposed, else the mean of the sides.
# The spread of posture (`offset_deg`) is assumed throughout.

PELVIC_ROTATION = NormativeCurve(
    (0.0, 0.10, 0.30, 0.50, 0.60, 0.80),
    (4.5, 4.2, 0.5, -4.5, -4.2, -0.5),
    Spread(offset_deg=2.0, gain=0.35, shape_deg=0.5, side_deg=0.5, timing=0.02),
    opposed=True,
)
"""Axial rotation of the pelvis, degrees; positive if the pelvis is forward on the side of the leg.

Read: Kadaba et al. 1990; Perry 1992 (5° each way).
"""

PELVIC_OBLIQUITY = NormativeCurve(
    (0.0, 0.14, 0.30, 0.50, 0.64, 0.80),
    (0.5, 4.2, 2.0, -0.5, -4.2, -2.0),
    Spread(offset_deg=0.7, gain=0.40, shape_deg=0.4, side_deg=0.4, timing=0.015),
    opposed=True,
)
"""Obliquity of the pelvis, degrees; positive if the pelvis is higher on the side of the leg.

Shape read: Kadaba et al. 1990.
"""

PELVIC_OBLIQUITY_BY_SEX = {True: 7.4 / 8.4, False: 9.4 / 8.4}
"""Factors of the pelvic obliquity curve for men (True) and women; the curve has a range of 8.4°.

The excursion is 7.4° (SD 3.4) in men and 9.4° (SD 3.5) in women ✓.

Published: Smith et al. 2002."""

PELVIC_SWAY = NormativeCurve(
    (0.06, 0.17, 0.31, 0.45, 0.56, 0.67, 0.81, 0.95),
    (0.0, 0.70, 1.0, 0.70, 0.0, -0.70, -1.0, -0.70),
    Spread(offset_deg=0.0, gain=0.0, shape_deg=0.06, side_deg=0.03, timing=0.01),
    opposed=True,
)
"""Sideways motion of the pelvis, in units of `SWAY_MM`; positive towards the side of the leg.

The pelvis is over the standing foot in mid-stance.

Read: Orendurff et al. 2004 (timing)."""

SWAY_MM = (22.0, 5.0)
"""Mean and SD of the amplitude of the sideways motion of the pelvis, mm.

Published: Saunders et al. 1953 (about 45 mm in all); spread read from Orendurff et al. 2004."""

THORAX_ROTATION = NormativeCurve(
    (0.02, 0.14, 0.33, 0.52, 0.64, 0.83),
    (-3.5, -3.0, 0.3, 3.5, 3.0, -0.3),
    Spread(offset_deg=2.0, gain=0.35, shape_deg=0.4, side_deg=0.4, timing=0.03),
    opposed=True,
)
"""Axial rotation of the thorax, opposite to the pelvis, degrees; positive if forward on the side of the leg.

Read: Murray et al. 1967 (7° in all).
"""

THORAX_OBLIQUITY = NormativeCurve(
    (0.05, 0.18, 0.35, 0.55, 0.68, 0.85),
    (-0.6, -1.8, -0.9, 0.6, 1.8, 0.9),
    Spread(offset_deg=1.0, gain=0.40, shape_deg=0.3, side_deg=0.3, timing=0.02),
    opposed=True,
)
"""Obliquity of the thorax, opposite to the pelvis, degrees; positive if the shoulder is up on the side of the leg.

Read: Crosbie et al. 1997.
"""

TRUNK_SWAY = NormativeCurve(
    (0.06, 0.17, 0.31, 0.45, 0.56, 0.67, 0.81, 0.95),
    (0.0, 0.70, 1.0, 0.70, 0.0, -0.70, -1.0, -0.70),
    Spread(offset_deg=0.7, gain=0.60, shape_deg=0.15, side_deg=0.1, timing=0.03),
    opposed=True,
)
"""Sideways lean of the line from hips to sternum, degrees; positive towards the side of the leg.

Read: Thorstensson et al. 1984.
"""

TRUNK_SWAY_BY_SEX = {True: 0.9, False: 0.5}
"""Factors of the sideways lean of the trunk for men (True) and women.

With their mean of 0.7 and the sway of the pelvis, the head moves about 60 mm from side to side (read: Murray et al.
1964, 59 mm).  Men sway more in the trunk, women roll more in the pelvis: direction, Mather & Murdoch 1994; Bruening
et al. 2015 ✓; size assumed."""

TRUNK_LEAN = NormativeCurve(
    (0.0, 0.12, 0.25, 0.38, 0.50, 0.62, 0.75, 0.88),
    (2.9, 2.7, 1.5, 1.3, 2.9, 2.7, 1.5, 1.3),
    Spread(offset_deg=2.5, gain=0.35, shape_deg=0.2, side_deg=0.1, timing=0.02),
)
"""Forward lean of the line from hips to sternum, degrees; it is largest near each foot contact.

Read: Thorstensson et al. 1984.
"""

HEAD_LEAN = NormativeCurve(
    (0.0, 0.12, 0.25, 0.38, 0.50, 0.62, 0.75, 0.88),
    (7.0, 7.6, 9.0, 8.4, 7.0, 7.6, 9.0, 8.4),
    Spread(offset_deg=5.0, gain=0.40, shape_deg=0.3, side_deg=0.15, timing=0.03),
)
"""Forward lean of the line from sternum to head, degrees; the head nods down while the body rises.

Read: Hirasaki et al. 1999; mean and spread of posture assumed."""

# --- angles: arms -----------------------------------------------------------------------------------------

UPPER_ARM = NormativeCurve(
    (0.02, 0.15, 0.28, 0.40, 0.52, 0.65, 0.78, 0.90),
    (-20.0, -15.5, -4.5, 5.0, 9.5, 4.5, -6.0, -15.5),
    Spread(offset_deg=4.0, gain=0.35, shape_deg=1.0, side_deg=2.0, timing=0.02),
)
"""Angle of the upper arm from the vertical, degrees, forward positive, over the gait cycle of the same side.

The arm is at the back when this leg makes contact.

Read: Murray et al. 1967 (arc about 30°)."""

ELBOW = NormativeCurve(
    (0.05, 0.20, 0.37, 0.54, 0.70, 0.88),
    (17.0, 19.5, 29.0, 38.0, 31.0, 20.0),
    Spread(offset_deg=6.0, gain=0.35, shape_deg=1.2, side_deg=2.0, timing=0.02),
)
"""Flexion of the elbow, degrees, over the gait cycle of the leg on the same side.

Read: Murray et al. 1967; Perry 1992.
"""

ARM_SPEED_REFERENCE = 0.45
"""Dimensionless walking speed at which the arm angles were measured; arm swing is proportional to speed.

Direction: Murray et al. 1967.  Proportionality assumed."""

ARM_ABDUCTION_DEG = {True: (10.0, 3.0), False: (8.0, 3.0)}
FOREARM_TURNED_IN_DEG = (18.0, 10.0)
"""Mean and SD of arm abduction in men (True) and women, and of inward rotation of the forearm, degrees.

Men hold the elbows wider (Troje 2002).  Sizes assumed."""

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


def stopped(angle: np.ndarray, stop_deg: float) -> np.ndarray:
    """Limit the extension of a joint, smoothly, to a smallest flexion angle; angles are in radians."""
    stop, soft = np.radians(stop_deg), np.radians(STOP_SOFTNESS_DEG)
    return stop + soft * np.logaddexp(0.0, (angle - stop) / soft)
