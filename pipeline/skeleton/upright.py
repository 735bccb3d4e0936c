"""Checks of posture and gait: upward axis, bend of the knees, height of the hips, and stride frequency.

Positions are (T, 15, 3), mm, NaN where a joint was not measured, and z up except for the search of the upward axis.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.joints import ANKLES, LEFT_LEG, RIGHT_LEG, WALKER15
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.validation import InvalidInput, told_apart

NEAR_RATIO = 1.5
"""Largest ratio of a body's extents along two axes for which the mapping decides which axis points up."""

CROUCHED = 0.8
"""Height of the hips above the ankles, in leg lengths, below which a walker is crouched.

In 63 recordings this height is .82 to .98.
"""

MAX_STRIDES_HZ = 1.6
"""Largest stride frequency of a human walk, Hz."""

STRIDES_HZ = (0.3, 8.0)
"""Range, Hz, of the search for the stride frequency.

It includes recordings that state four times their true frame rate.
"""

MAX_PADDED = 1 << 16
"""Largest number of samples after zero padding, which gives a finer spectrum."""

MIN_BEND = 0.05
"""Distance of a knee from the line between hip and ankle, in leg lengths, above which the knee counts as bent."""

MIN_BALANCE = -0.5
"""Mean direction of knee bends, from -1 (backward) to 1 (forward), below which left and right are exchanged."""

_HIPS, _KNEES = ([leg[k] for leg in (LEFT_LEG, RIGHT_LEG)] for k in (0, 1))
_SHOULDERS = [WALKER15.index("left_shoulder"), WALKER15.index("right_shoulder")]
_LEVELS = ([WALKER15.index("head")], _SHOULDERS, _HIPS, _KNEES, list(ANKLES))


def axis_up(positions: np.ndarray, fixed: UpAxis = UpAxis.auto) -> tuple[UpAxis, bool]:
    """Return the axis along which a person stands, with sign, and True if the joints are in the order of a body.

    Parameters
    ----------
    positions : (T, 15, 3)
        Joint positions in any unit; NaN where not measured.
    fixed : UpAxis
        Axis of the mapping, used if the data do not determine the axis.

    Notes
    -----
    The median levels of head, shoulders, hips, knees and ankles must decrease in this order.  Among several such axes,
    the one with the largest height is returned, or `fixed` if its height is within `NEAR_RATIO` of that.
    """
    levels = [positions[:, joints].mean(axis=1) for joints in _LEVELS]
    levels = [level for level in levels if np.isfinite(level).all(axis=-1).any()]
    steps = [upper - lower for upper, lower in pairwise(levels)]
    steps = [step[np.isfinite(step).all(axis=1)] for step in steps]
    drops = np.array([np.median(step, axis=0) for step in steps if len(step)]).reshape(-1, 3)
    heights = {
        UpAxis(sign + "xyz"[k]): abs(float(drops[:, k].sum()))
        for k in range(3)
        for sign in ("", "-")
        if len(drops) and (drops[:, k] * (-1 if sign else 1) > 0).all()
    }
    if heights:
        highest = max(heights, key=heights.__getitem__)
        near = fixed in heights and NEAR_RATIO * heights[fixed] >= heights[highest]
        return (fixed if near else highest), True
    if fixed != UpAxis.auto:
        return fixed, False
    legs = (positions[:, _HIPS] - positions[:, ANKLES]).reshape(-1, 3)
    legs = legs[np.isfinite(legs).all(axis=1)]
    if not len(legs):
        return UpAxis.z, False
    mean = legs.mean(axis=0)
    axis = int(np.abs(mean).argmax())
    return UpAxis(("-" if mean[axis] < 0 else "") + "xyz"[axis]), False


def not_upright(body: np.ndarray, rejects: bool) -> list[Complaint]:
    """Return a complaint about a body that does not stand along z, or an empty list."""
    axis, ordered = axis_up(body, UpAxis.z)
    if ordered and axis == UpAxis.z:
        return []
    posture = f"the body stands along {axis}" if ordered else "the body stands along no axis"
    sentence = str(
        InvalidInput(
            f"{posture}: state the axis that points up (data.up=…), or map the points to the right joints",
            expected="head, shoulders, hips, knees and ankles in this order along z",
        )
    )
    return [Complaint("axis", sentence, rejects=rejects)]


def _forward(body: np.ndarray) -> np.ndarray:
    """Return horizontal unit vectors (T, 3) in the direction that the hips face."""
    right = body[:, _HIPS[1]] - body[:, _HIPS[0]]
    forward = np.stack([-right[:, 1], right[:, 0], np.zeros(len(body))], axis=-1)
    return forward / np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), np.finfo(float).tiny)


def bent_knees(body: np.ndarray, leg: float, rejects: bool) -> list[Complaint]:
    """Return a complaint about knees that bend backwards relative to the direction that the hips face."""
    hips, knees, ankles = (body[:, part] for part in (_HIPS, _KNEES, ANKLES))
    along = ankles - hips
    share = ((knees - hips) * along).sum(axis=-1) / np.maximum((along**2).sum(axis=-1), np.finfo(float).tiny)
    offset = knees - hips - share[..., None] * along
    forward = (offset * _forward(body)[:, None]).sum(axis=-1) / leg
    bent = forward[np.abs(forward) > MIN_BEND]  # NaN compares false
    balance = float(bent.sum() / np.abs(bent).sum()) if len(bent) else 0.0
    if balance >= MIN_BALANCE:
        return []
    sentence = (
        "the knees bend backwards, relative to the direction that the hips face: left and right are exchanged in the"
        " point names"
    )
    return [Complaint("mirrored", sentence, values={"balance": balance}, rejects=rejects)]


def crouched(body: np.ndarray, leg: float) -> list[Complaint]:
    """Return a remark on a walker who is crouched, which means that the hips are low above the ankles."""
    heights = (body[:, _HIPS, 2] - body[:, ANKLES, 2]).mean(axis=1)
    heights = heights[np.isfinite(heights)]
    height = float(np.median(heights)) if len(heights) else np.nan
    if not height < CROUCHED * leg:
        return []
    share = height / leg
    sentence = (
        f"crouched: the hips are {height:.0f} mm above the ankles, {told_apart(share, CROUCHED, 2)} of the leg of"
        f" {leg:.0f} mm (usual {CROUCHED:.2f} or more)"
    )
    return [Complaint("crouched", sentence, tuple(WALKER15.joints[j] for j in _HIPS), {"share": share})]


def cadence(body: np.ndarray, frame_rate_hz: float) -> list[Complaint]:
    """Return a remark on a stride frequency above the human range.

    The frequency is estimated from the fore-aft distance between the ankles.
    """
    distance = ((body[:, ANKLES[0]] - body[:, ANKLES[1]]) * _forward(body)).sum(axis=-1)
    measured = np.flatnonzero(np.isfinite(distance))
    if len(measured) < 8:
        return []
    distance = np.interp(np.arange(measured[0], measured[-1] + 1), measured, distance[measured])
    size = max(len(distance), min(8 * len(distance), MAX_PADDED))
    power = np.abs(np.fft.rfft(distance - distance.mean(), size)) ** 2
    frequencies = np.fft.rfftfreq(size, 1.0 / frame_rate_hz)
    power[(frequencies < STRIDES_HZ[0]) | (frequencies > STRIDES_HZ[1])] = 0.0
    strides = float(frequencies[power.argmax()])
    if strides <= MAX_STRIDES_HZ:
        return []
    rate = frame_rate_hz / strides
    sentence = (
        f"{strides:.1f} strides per second are too many for a walk: is the frame rate {frame_rate_hz:g} Hz?"
        f" At {rate:.0f} Hz there would be one stride per second"
    )
    return [Complaint("rate", sentence, values={"strides_hz": strides, "frame_rate_hz": rate})]
