"""Checks and repairs of a clip before steady walking is searched for: units of length, short gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.skeleton import ANKLES, LEFT_LEG, RIGHT_LEG, WALKER15
from pipeline.validation import InvalidInput, told_apart

_HEAD = WALKER15.index("head")
_ACROSS = [[WALKER15.index(f"{side}_{joint}") for joint in ("hip", "shoulder")] for side in ("left", "right")]

LEG_LENGTH_MM = (250.0, 1300.0)
"""Hip to knee to ankle of a child of one year who walks and of a very tall adult: outside of it the unit is wrong."""

LEAST_DEPTH_MM = 1.0
"""What joints take up at least along every axis: those of a film have no depth."""

MOST_UNLIKE = 2.0
"""Ratio of the longer of thigh and shank to the shorter that no person has; thighs of 103 recordings: .74 to 1.29."""

MOST_CHANGE = 0.4
"""Distance of the quartiles of thighs' and shanks' lengths over the median, of the steadiest: of 107 recordings up to
.05, of velocities from .5."""

UNEVEN = 0.1
"""How much longer than the other one thigh or shank may be."""

_UNITS_MM = {"metres": 1000.0, "centimetres": 10.0, "inches": 25.4, "feet": 304.8}


def leg_length(positions: np.ndarray) -> float:
    """Hip to knee to ankle in mm, mean over sides and the frames that show them; NaN where none does."""
    lengths = np.stack(
        [
            np.linalg.norm(np.diff(positions[:, side], axis=1), axis=-1).sum(axis=1)
            for side in (LEFT_LEG, RIGHT_LEG)
        ]
    )
    seen = np.isfinite(lengths)
    if not seen.any(axis=1).all():
        return np.nan
    return float(np.mean([side[known].mean() for side, known in zip(lengths, seen, strict=True)]))


def uneven_legs(positions: np.ndarray) -> list[str]:
    """Return a sentence on thighs, and one on shanks, whose median lengths differ by more than `UNEVEN`.

    Parameters
    ----------
    positions : (T, 15, 3)
        mm; NaN where a joint is not known.
    """
    lengths = [np.linalg.norm(np.diff(positions[:, side], axis=1), axis=-1) for side in (LEFT_LEG, RIGHT_LEG)]
    remarks = []
    for n, segment in enumerate(("thigh", "shank")):
        seen = [of[np.isfinite(of)] for of in (side[:, n] for side in lengths)]
        left, right = (np.median(of) if len(of) else 0.0 for of in seen)
        if all(map(len, seen)) and max(left, right) > (1 + UNEVEN) * min(left, right):
            remarks.append(
                f"The left {segment} is {left:.0f} mm long, the right {right:.0f}:"
                " is a marker or a name in the wrong place?"
            )
    return remarks


def stature(positions: np.ndarray) -> float:
    """Height of the centre of the head above the lowest ankle, mm: a stand-in for stature; (T, 15, 3) in."""
    ankles = positions[:, ANKLES, 2]
    return np.nanmean(positions[:, _HEAD, 2]) - np.nanpercentile(ankles, 2)


def require_millimetres(positions: np.ndarray) -> None:
    """Require legs of human length in millimetres, with thighs and shanks alike.

    Parameters
    ----------
    positions : (T, 15, 3)
        NaN where a joint is not known.

    Raises
    ------
    InvalidInput
        If their mean length is outside of `LEG_LENGTH_MM`; the sentence names the unit that it looks like.  If thigh
        and shank are as unlike as no person's or change their length, left and right are exchanged along a limb, or
        all joints lie in one plane.
    """
    length = leg_length(positions)
    if not np.isfinite(length):
        raise InvalidInput("the legs were never seen whole")
    if LEG_LENGTH_MM[0] <= length <= LEG_LENGTH_MM[1]:
        if np.min(np.nanmax(positions, axis=(0, 1)) - np.nanmin(positions, axis=(0, 1))) < LEAST_DEPTH_MM:
            raise InvalidInput("all joints lie in one plane: keypoints of a film go to `reconstruct`")
        segments = np.diff(positions[:, [LEFT_LEG, RIGHT_LEG]], axis=2)
        lengths = np.linalg.norm(segments, axis=-1)
        low, middle, high = np.nanquantile(lengths, [0.25, 0.5, 0.75], axis=(0, 1))
        thigh, shank = middle
        if max(thigh, shank) >= MOST_UNLIKE * min(thigh, shank):
            raise InvalidInput(
                "hip, knee and ankle are no person's: a marker was taken for a joint",
                expected=f"thigh and shank of which neither is {MOST_UNLIKE:g} times as long as the other",
                received=f"{thigh:.0f} and {shank:.0f} mm",
            )
        if (changes := ((high - low) / middle).min()) > MOST_CHANGE:
            raise InvalidInput(
                "thighs and shanks change their length: velocities, or angles, in place of positions?",
                expected=f"quartiles of a length within {100 * MOST_CHANGE:.0f} % of its median",
                received=f"{100 * changes:.0f} %",
            )
        _require_sides(positions)
        return
    bound = LEG_LENGTH_MM[length > LEG_LENGTH_MM[1]]
    # Ranges overlap (legs of 36 are inches or a child's centimetres): the unit nearest to an adult's 850 mm.
    ratio = {unit: abs(np.log(length * mm / 850.0)) for unit, mm in _UNITS_MM.items()} if length > 0 else {}
    guess = min(ratio, key=ratio.__getitem__, default="")
    human = guess and LEG_LENGTH_MM[0] <= length * _UNITS_MM[guess] <= LEG_LENGTH_MM[1]
    raise InvalidInput(
        "the unit of length is wrong" + (f": it looks like {guess}" if human else ""),
        expected="legs of 250 to 1300 mm",
        received=f"{length:.3g} mm" if length < 100 else f"{told_apart(length, bound, 0)} mm",
    )


def _require_sides(positions: np.ndarray) -> None:
    """Refuse limbs that would be shorter with the lower ends of the other side, and steadier.

    Limbs that cross, as folded arms and legs that scissor do, would not.  Thighs and upper arms that cross by half the
    width of hips or shoulders need be steady as their own only: skin moves.  Where shoulders face away from hips, whole
    arms are those of the other side: of 180 recordings none has them apart by more than 27° in the median.
    """
    hips, shoulders = np.moveaxis(positions[:, _ACROSS[1]] - positions[:, _ACROSS[0]], 1, 0)
    if np.nansum(hips * shoulders) < 0:
        raise InvalidInput("left and right are exchanged in the names of points, at the shoulders or hips")
    mirror = WALKER15.mirror
    for upper, lower in WALKER15.bones:
        if upper == mirror[upper] or lower > mirror[lower]:  # of both sides at once
            continue
        ends = positions[:, [[lower, mirror[lower]], [mirror[lower], lower]]]
        lengths = np.linalg.norm(ends - positions[:, None, [upper, mirror[upper]]], axis=-1)
        lengths = lengths[np.isfinite(lengths).all(axis=(1, 2))]
        own, across = np.square(lengths).sum(axis=(0, 2))
        if own > across:
            varies, steady = lengths.std(axis=0).mean(axis=1)
            trunk = WALKER15.parents[upper]
            width = np.square(positions[:, upper] - positions[:, mirror[upper]]).sum(axis=1)
            wide = trunk == mirror[trunk] and own - across > len(lengths) * np.nanmean(width)
            if varies > (0.8 if wide else 1.2) * steady + 0.1:
                raise InvalidInput(
                    f"left and right are exchanged in the names of points, at {WALKER15.joints[lower]} or above"
                )


@dataclass(frozen=True)
class BridgedClip:
    """A clip with its short gaps filled.

    Attributes
    ----------
    positions : (T, J, 3)
        mm.
    whole : (T,) bool
        Frames in which every joint is known.
    n_filled : int
        Values filled in.
    """

    positions: np.ndarray
    whole: np.ndarray
    n_filled: int


def bridge_gaps(
    positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, *, gap_s: float
) -> BridgedClip:
    """A clip in which every gap of at most `gap_s` between measured frames is filled; nothing is extrapolated.

    Parameters
    ----------
    positions : (T, J, 3)
        mm.
    valid : (T, J) bool
        Where a joint was measured.
    frame_rate_hz, gap_s : float

    Notes
    -----
    By a cubic spline through the joint's measured frames.
    """
    filled = np.array(positions, float)
    known = np.array(valid, bool)
    longest = int(np.floor(gap_s * frame_rate_hz + 1e-9))  # 0.29 s at 100 Hz is 29 frames
    count = 0
    for joint in range(filled.shape[1]):
        seen = np.flatnonzero(known[:, joint])
        if len(seen) == len(filled) or len(seen) < 4:
            continue
        short = [g for g in np.flatnonzero(np.diff(seen) > 1) if seen[g + 1] - seen[g] - 1 <= longest]
        if not short:
            continue
        spline = CubicSpline(seen, filled[seen, joint])
        for g in short:
            frames = np.arange(seen[g] + 1, seen[g + 1])
            filled[frames, joint] = spline(frames)
            known[frames, joint] = True
            count += len(frames)
    return BridgedClip(filled, np.all(known, axis=1), count)
