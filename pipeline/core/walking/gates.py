"""Checks that a motion is a walk, which reject runs and motion on the spot (kicks, bends, grabs).

Symbols
-------
``Fr``     Froude number, ``v² / (g leg)``: people run from about 0.5, and a leg that is a pendulum stays below 1
``w``      stride frequency times ``√(leg / g)``, over (stride / leg)^0.7: people lengthen and quicken strides together
``lift``   how far the ankle rises in swing, in lengths of the leg; a runner's heel rises to the knee
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import ANKLES, PELVIS, WALKER15
from pipeline.validation import InvalidInput, told_apart

GRAVITY_MM_S2 = 9806.65
FASTEST_FROUDE, RUNNING_FROUDE, RUNNING_LIFT = 0.8, 0.4, 0.38
"""Limits beyond which a motion is a run: a Froude number, or a lower Froude number together with a lift of the ankle.

In 109 recorded walks they are at most 0.44 and 0.3, in four runs at least 0.97 and 0.42.
"""
ALTERNATION = -0.5
"""Largest correlation between the fore-aft motions of the two ankles in a walk.

Recorded walks have at most -0.84, bends at least -0.3.
"""
LEAST_STANCE, SLOWEST_MM_S = 0.15, 100.0
"""Smallest fraction of time in which each foot is the lower one, and smallest backward speed of that foot, in a walk.
"""
BOW_DEG = 25.0
"""Largest range of the trunk's pitch (5th to 95th percentile) in a walk.

Recorded walks have 10 degrees, bends at least 50.
"""

USUAL_W, STRIDE_POWER = (0.115, 0.25), 0.7
"""Usual range of the normalised stride frequency ``w``, and exponent of the stride length in its definition.

120 recorded walks have ``w`` from 0.118 to 0.209.  At half or double the frame rate nearly all are outside.
"""

_SHOULDERS = [WALKER15.index("left_shoulder"), WALKER15.index("right_shoulder")]


def require_walk(level: np.ndarray, frame_rate_hz: float, *, leg_mm: float, speed_mm_s: float) -> None:
    """Check that a motion is a walk: alternating feet, stance and swing, an upright trunk, and no running.

    Parameters
    ----------
    level : (T, 15, 3)
        Treadmill equivalent, mm.
    frame_rate_hz, leg_mm : float
    speed_mm_s : float
        Of the pelvis; 0 on a treadmill, where the lower foot tells the speed.

    Raises
    ------
    InvalidInput
        With the number that speaks against it.
    """
    ankles = level[:, ANKLES]
    fore = ankles[..., 1] - ankles[..., 1].mean(axis=0)
    power = np.sqrt((fore**2).sum(axis=0).prod())
    together = (fore.prod(axis=1).sum() / power) if power > 0 else 1.0
    if together > ALTERNATION:
        raise InvalidInput(
            "not a walk: the feet do not alternate",
            expected=f"a correlation of the ankles' fore-aft motions of {ALTERNATION:g} or less",
            received=told_apart(together, ALTERNATION, 2),
            code="feet_do_not_alternate",
        )
    lower, belt = _stance(ankles, frame_rate_hz)
    share = min((lower == 0).mean(), (lower == 1).mean())
    if belt < SLOWEST_MM_S or share < LEAST_STANCE:
        raise InvalidInput(
            "not a walk: the feet do not alternate between stance and swing",
            expected=f"each foot the lower one in {LEAST_STANCE:.0%} of frames, moving back at {SLOWEST_MM_S:g} mm/s",
            received=f"{share:.0%}, {belt:.0f} mm/s",
            code="no_stance_and_swing",
        )
    trunk = level[:, _SHOULDERS].mean(axis=1) - level[:, PELVIS]
    low, high = np.percentile(np.degrees(np.arctan2(trunk[:, 1], trunk[:, 2])), [5, 95])
    if high - low > BOW_DEG:
        raise InvalidInput(
            "not a walk: the trunk bends forwards",
            expected=f"a range of the trunk's pitch of at most {BOW_DEG:g}°",
            received=f"{told_apart(high - low, BOW_DEG, 0)}°",
            code="trunk_bows",
        )
    froude = (speed_mm_s or belt) ** 2 / (GRAVITY_MM_S2 * leg_mm)
    lift = np.ptp(ankles[..., 2], axis=0).min() / leg_mm
    if froude > FASTEST_FROUDE or (froude > RUNNING_FROUDE and lift > RUNNING_LIFT):
        raise InvalidInput(
            "not a walk: the motion is a run",
            expected=f"a Froude number up to {FASTEST_FROUDE:g}, or {RUNNING_FROUDE:g} if the ankles rise by more than "
            f"{RUNNING_LIFT:.0%} of the leg length",
            received=f"{froude:.2f}, ankles that rise by {lift:.0%} of the leg length",
            code="running",
            froude=froude,
            lift=lift,
        )


def _stance(ankles: np.ndarray, frame_rate_hz: float) -> tuple[np.ndarray, float]:
    """Return the index (T,) of the lower ankle, and its median backward speed, mm/s, from ankles (T, 2, 3)."""
    lower = ankles[..., 2].argmin(axis=1)
    back = -np.gradient(ankles[..., 1], axis=0)[np.arange(len(lower)), lower] * frame_rate_hz
    return lower, np.median(back)


def unusual_cadence(
    level: np.ndarray, frame_rate_hz: float, *, leg_mm: float, speed_mm_s: float, frequency_hz: float
) -> str:
    """Return a warning if the cadence is unusual for the step length, else an empty string.

    Parameters
    ----------
    level, frame_rate_hz, leg_mm, speed_mm_s
        As for `require_walk`.
    frequency_hz : float
        Of strides.
    """
    stride_mm = (speed_mm_s or _stance(level[:, ANKLES], frame_rate_hz)[1]) / frequency_hz
    # The length of a stride does not depend on the frame rate.
    unit_hz = np.sqrt(GRAVITY_MM_S2 / leg_mm) * (stride_mm / leg_mm) ** STRIDE_POWER
    low, high = (120 * w * unit_hz for w in USUAL_W)
    cadence = 120 * frequency_hz
    if low <= cadence <= high:
        return ""
    other = frame_rate_hz * (2.0 if cadence < low else 0.5)
    return (
        f"{cadence:.0f} steps a minute of {stride_mm / 2:.0f} mm are unusual, {low:.0f} to {high:.0f} usual for legs of"
        f" {leg_mm:.0f} mm: is the frame rate {frame_rate_hz:g} Hz, or {other:g} Hz?"
    )
