"""Check of a body: joints of a person have human lengths and proportions and stand upright along z.

Symbols
-------
``leg``    thigh and shank of a person, median over time, mean over sides, mm; proportions are relative to it
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.joints import (
    ANKLES,
    LEFT_LEG,
    LEG_LENGTH_MM,
    PELVIS,
    RIGHT_LEG,
    WALKER15,
    leg_length,
)
from pipeline.skeleton.recorded import MILLIMETRES
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.skeleton.upright import bent_knees, cadence, crouched, not_upright
from pipeline.validation import InvalidInput, told_apart

ADULT_LEG_MM = 850.0

LEAST_DEPTH_MM = 1.0
"""Least extent of the joints along every axis: joints of a film have no depth."""

MOST_CHANGE = 0.4
"""Distance of the quartiles of thighs' and shanks' lengths over the median, of the steadiest: of 107 recordings up to
.05, of velocities from .5."""

UNEVEN = (0.15, 0.35)
"""Shares by which a limb may be longer than that of the other side: more is remarked, and more is rejected."""

AT_PELVIS = 0.02
"""Distance of a hip from the pelvis, in legs, up to which it is the centre of the pelvis."""

_HIPS, _KNEES = ([leg[k] for leg in (LEFT_LEG, RIGHT_LEG)] for k in (0, 1))
_SHOULDERS, _ELBOWS, _WRISTS = (
    [WALKER15.index(f"{side}_{part}") for side in ("left", "right")]
    for part in ("shoulder", "elbow", "wrist")
)
_LIMBS = {
    "thigh": (_HIPS, _KNEES),
    "shank": (_KNEES, list(ANKLES)),
    "upper arm": (_SHOULDERS, _ELBOWS),
    "forearm": (_ELBOWS, _WRISTS),
}
_UNITS = {"m": "metres", "cm": "centimetres", "in": "inches", "ft": "feet"}


@dataclass(frozen=True)
class _Proportion:
    """Distance of two joints in legs: outside of `usual` it is remarked, outside of `possible` it rejects."""

    code: str
    ends: tuple[tuple[str, str], ...]
    usual: tuple[float, float]
    possible: tuple[float, float]
    below: str
    above: str


_ANOTHER = "was a marker taken for a joint?"
_PROPORTIONS = (
    _Proportion(
        "hip_width", (("left_hip", "right_hip"),), (0.10, 0.30), (0.06, 0.45),
        "is the centre of the pelvis taken for a hip?",
        "these look like markers on the skin, not joint centres: map them as trochanters (skeleton=trochanters)",
    ),
    _Proportion(
        "thigh", (("left_hip", "left_knee"), ("right_hip", "right_knee")), (0.40, 0.60), (0.30, 0.70),
        _ANOTHER, _ANOTHER,
    ),
    _Proportion(
        "shoulder_width", (("left_shoulder", "right_shoulder"),), (0.20, 0.70), (0.12, 1.0), _ANOTHER, _ANOTHER,
    ),
    _Proportion("pelvis_to_head", (("pelvis", "head"),), (0.55, 1.20), (0.35, 1.6), _ANOTHER, _ANOTHER),
)  # fmt: skip
"""Proportions of 63 recordings: hips .13 to .29, thigh .43 to .56, shoulders .21 to .60, pelvis to head .60 to 1.05."""


def accepted(
    positions: np.ndarray,
    valid: np.ndarray,
    frame_rate_hz: float,
    *,
    walk: bool,
    up: UpAxis = UpAxis.auto,
) -> list[str]:
    """Return the remarks of `check`, one sentence each.

    Parameters
    ----------
    positions, valid, frame_rate_hz, walk, up
        As for `check`.

    Raises
    ------
    InvalidInput
        With the first complaint that rejects the recording.
    """
    complaints = check(positions, valid, frame_rate_hz, walk=walk, up=up)
    for complaint in complaints:
        if complaint.rejects:
            raise InvalidInput(
                complaint.sentence, code=complaint.code, joints=[*complaint.where], **complaint.values
            )
    return [complaint.sentence for complaint in complaints]


def check(
    positions: np.ndarray,
    valid: np.ndarray,
    frame_rate_hz: float,
    *,
    walk: bool,
    up: UpAxis = UpAxis.auto,
) -> list[Complaint]:
    """Return the complaints about a body, the gravest first; an empty list if it is a person's.

    Parameters
    ----------
    positions : (T, 15, 3)
        mm, z up.
    valid : (T, 15) bool
        Where a joint was measured; joints that never were are left out.
    frame_rate_hz : float
    walk : bool
        Whether the recording is to be a walk: upright, on legs that are not bent, at the cadence of people.
    up : UpAxis
        Axis that the user stated: the order of the levels along z is then a remark, whatever is recorded.
    """
    body = np.where(valid[..., None], positions, np.nan)
    if complaints := _unusable(body):
        return complaints
    leg = sum(float(np.mean(_medians(body, *_LIMBS[limb]))) for limb in ("thigh", "shank"))
    found = not_upright(body, walk and up == UpAxis.auto)
    upright = not found
    found += [*_changing(body), *_proportions(body, leg), *_uneven(body), *_exchanged(body)]
    if upright:
        found += bent_knees(body, leg, walk)
    if upright and walk:
        found += [*crouched(body, leg), *cadence(body, frame_rate_hz)]
    return sorted(found, key=lambda complaint: not complaint.rejects)


def _lengths(body: np.ndarray, upper: int, lower: int) -> np.ndarray:
    """Distances of two joints in the frames that show both."""
    lengths = np.asarray(np.linalg.norm(body[:, upper] - body[:, lower], axis=-1))
    return lengths[np.isfinite(lengths)]


def _medians(body: np.ndarray, upper: Sequence[int], lower: Sequence[int]) -> list[float]:
    """Median distances of pairs of joints; NaN of a pair that no frame shows."""
    pairs = (_lengths(body, *pair) for pair in zip(upper, lower, strict=True))
    return [float(np.median(lengths)) if len(lengths) else np.nan for lengths in pairs]


def _change(lengths: np.ndarray) -> float:
    """Distance of the quartiles of lengths over their median."""
    low, middle, high = np.quantile(lengths, [0.25, 0.5, 0.75])
    return float((high - low) / middle)


def _unit(leg: float) -> tuple[str, str, float]:
    """Words on the unit in which a leg of this length is human, its short name, and the factor to millimetres.

    Without a unit the name is empty, and the factor NaN or a power of ten.
    """
    if not leg > 0:
        return "", "", np.nan
    # Ranges overlap (legs of 36 are inches or a child's centimetres): the unit nearest to an adult's leg.
    unit = min(_UNITS, key=lambda unit: abs(np.log(leg * MILLIMETRES[unit] / ADULT_LEG_MM)))
    mm = MILLIMETRES[unit]
    low, high = LEG_LENGTH_MM
    if low <= leg * mm <= high:
        return f": it looks like {_UNITS[unit]}, multiply by {mm:g}", unit, mm
    factor = 10.0 ** np.floor(np.log10(high / leg))
    return (f": multiply by {factor:g}", "", factor) if leg * factor >= low else ("", "", np.nan)


def _unusable(body: np.ndarray) -> list[Complaint]:
    """The complaint that makes all others pointless: legs never seen whole, another unit, no depth."""
    length = leg_length(body)
    if not np.isfinite(length):
        return [Complaint("legs_unseen", "the legs were never seen whole", rejects=True)]
    low, high = LEG_LENGTH_MM
    if not low <= length <= high:
        looks, unit, factor = _unit(length)
        received = f"{length:.3g}" if length < 100 else told_apart(length, low if length < low else high, 0)
        sentence = str(
            InvalidInput(
                f"the unit of length is wrong{looks}",
                expected=f"legs of {low:g} to {high:g} mm",
                received=f"{received} mm",
            )
        )
        values = {"leg_mm": length, "unit": unit, "factor": factor}
        return [Complaint("unit", sentence, values=values, rejects=True)]
    if np.min(np.nanmax(body, axis=(0, 1)) - np.nanmin(body, axis=(0, 1))) < LEAST_DEPTH_MM:
        sentence = "all joints lie in one plane: keypoints of a film go to `reconstruct`"
        return [Complaint("plane", sentence, rejects=True)]
    return []


def _proportions(body: np.ndarray, leg: float) -> list[Complaint]:
    """Complaints about distances of joints that are not a person's, and hips at the centre of the pelvis."""
    found = []
    for one in _PROPORTIONS:
        ends = [[WALKER15.index(joint) for joint in pair] for pair in zip(*one.ends, strict=True)]
        length = float(np.mean(_medians(body, *ends)))
        share, (low, high) = length / leg, one.usual
        if not np.isfinite(share) or low <= share <= high:
            continue
        below = share < low
        where = " and ".join("–".join(pair) if len(one.ends) > 1 else " to ".join(pair) for pair in one.ends)
        sentence = (
            f"{where}: {length:.0f} mm, {told_apart(share, low if below else high, 2)} of the leg of {leg:.0f} mm"
            f" (usual {low:.2f} to {high:.2f}); {one.below if below else one.above}"
        )
        rejects = not one.possible[0] <= share <= one.possible[1]
        joints = tuple(dict.fromkeys(joint for pair in one.ends for joint in pair))
        found.append(Complaint(one.code, sentence, joints, {"length_mm": length, "share": share}, rejects))
    away = dict(zip(_HIPS, _medians(body, [PELVIS, PELVIS], _HIPS), strict=True))
    joints = tuple(WALKER15.joints[hip] for hip in _HIPS if away[hip] < AT_PELVIS * leg)
    if joints:
        nearest = min(away.values())
        sentence = (
            f"{' and '.join(joints)}: {nearest:.0f} mm from the pelvis, whose centre is mapped to a hip"
        )
        found.append(Complaint("hip_at_pelvis", sentence, joints, {"distance_mm": nearest}, rejects=True))
    return found


def _changing(body: np.ndarray) -> list[Complaint]:
    """A complaint about thighs and shanks that change their length."""
    change = min(
        _change(np.concatenate([_lengths(body, *ends) for ends in zip(*_LIMBS[limb], strict=True)]))
        for limb in ("thigh", "shank")
    )
    if change <= MOST_CHANGE:
        return []
    sentence = str(
        InvalidInput(
            "thighs and shanks change their length: velocities, or angles, in place of positions?",
            expected=f"quartiles of a length within {100 * MOST_CHANGE:.0f} % of its median",
            received=f"{100 * change:.0f} %",
        )
    )
    return [Complaint("changing", sentence, values={"share": change}, rejects=True)]


def _uneven(body: np.ndarray) -> list[Complaint]:
    """Complaints about limbs that are longer than those of the other side.

    Only a limb of steady length rejects: one that changes has a joint that was lost in tracking, which walks estimate.
    """
    found = []
    for limb, (upper, lower) in _LIMBS.items():
        left, right = _medians(body, upper, lower)
        share = max(left, right) / max(min(left, right), np.finfo(float).tiny) - 1.0
        if not share > UNEVEN[0]:  # NaN where a side was not measured
            continue
        sizes = f"the left {limb} is {left:.0f} mm long, the right {right:.0f}"
        sentence = f"{sizes}: is a marker or a name in the wrong place?"
        where = tuple(WALKER15.joints[j] for j in (*upper, *lower))
        values = {"left_mm": left, "right_mm": right, "share": share}
        steady = all(_change(_lengths(body, *ends)) <= MOST_CHANGE for ends in zip(upper, lower, strict=True))
        found.append(Complaint("uneven", sentence, where, values, rejects=share > UNEVEN[1] and steady))
    return found


def _exchanged(body: np.ndarray) -> list[Complaint]:
    """A complaint about limbs that would be shorter with the lower ends of the other side, and steadier.

    Limbs that cross, as folded arms and legs that scissor do, would not.  Thighs and upper arms that cross by half the
    width of hips or shoulders need be steady as their own only: skin moves.  Where shoulders face away from hips, whole
    arms are those of the other side: of 180 recordings none has them apart by more than 27° in the median.
    """
    exchanged = "left and right are exchanged in the names of points, at "
    hips, shoulders = (body[:, pair[1]] - body[:, pair[0]] for pair in (_HIPS, _SHOULDERS))
    if np.nansum(hips * shoulders) < 0:
        return [Complaint("exchanged", f"{exchanged}the shoulders or hips", rejects=True)]
    mirror = WALKER15.mirror
    for upper, lower in WALKER15.bones:
        if upper == mirror[upper] or lower > mirror[lower]:  # of both sides at once
            continue
        ends = body[:, [[lower, mirror[lower]], [mirror[lower], lower]]]
        lengths = np.linalg.norm(ends - body[:, None, [upper, mirror[upper]]], axis=-1)
        lengths = lengths[np.isfinite(lengths).all(axis=(1, 2))]
        own, across = np.square(lengths).sum(axis=(0, 2))
        if own > across:
            varies, steady = lengths.std(axis=0).mean(axis=1)
            trunk = WALKER15.parents[upper]
            width = np.square(body[:, upper] - body[:, mirror[upper]]).sum(axis=1)
            wide = trunk == mirror[trunk] and own - across > len(lengths) * np.nanmean(width)
            if varies > (0.8 if wide else 1.2) * steady + 0.1:
                joint = WALKER15.joints[lower]
                return [Complaint("exchanged", f"{exchanged}{joint} or above", (joint,), rejects=True)]
    return []
