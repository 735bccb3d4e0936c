"""Checks of a body: human lengths and proportions of the limbs, and an upright posture along z.

Symbols
-------
``leg``    length of thigh and shank, median over time, mean over sides, mm; proportions are relative to it
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
"""Typical leg length of an adult, mm."""

MIN_DEPTH_MM = 1.0
"""Smallest accepted range of joint coordinates along each axis, mm; keypoints of a video have no depth."""

MAX_CHANGE = 0.4
"""Largest accepted interquartile range of the length of a limb over time, relative to its median length.

The steadier of thighs and shanks is tested.

It is at most .05 in 107 recordings, and at least .5 if the values are velocities."""

UNEVEN = (0.15, 0.35)
"""Relative differences between left and right limb lengths that cause a remark and a rejection.

Above the first, a remark is added; above the second, the recording is rejected.
"""

MAX_PELVIS_DISTANCE = 0.02
"""Distance of a hip from the pelvis, in leg lengths, below which it counts as mapped to the pelvis centre."""

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
    """Distance between two joints, in leg lengths, with its usual and its possible range.

    Outside `usual`, a remark is added; outside `possible`, the recording is rejected.
    """

    code: str
    ends: tuple[tuple[str, str], ...]
    usual: tuple[float, float]
    possible: tuple[float, float]
    below: str
    above: str


_MARKER = "is a marker mapped as a joint?"
_PROPORTIONS = (
    _Proportion(
        "hip_width", (("left_hip", "right_hip"),), (0.10, 0.30), (0.06, 0.45),
        "is the centre of the pelvis mapped as a hip?",
        "these look like markers on the skin, not joint centres: map them as trochanters (skeleton=trochanters)",
    ),
    _Proportion(
        "thigh", (("left_hip", "left_knee"), ("right_hip", "right_knee")), (0.40, 0.60), (0.30, 0.70),
        _MARKER, _MARKER,
    ),
    _Proportion(
        "shoulder_width", (("left_shoulder", "right_shoulder"),), (0.20, 0.70), (0.12, 1.0), _MARKER, _MARKER,
    ),
    _Proportion("pelvis_to_head", (("pelvis", "head"),), (0.55, 1.20), (0.35, 1.6), _MARKER, _MARKER),
)  # fmt: skip
"""Usual and possible ranges of human body proportions.

In 63 recordings, hip width is .13–.29, thigh .43–.56, shoulder width .21–.60, and pelvis to head .60–1.05.
"""


def accepted(
    positions: np.ndarray,
    valid: np.ndarray,
    frame_rate_hz: float,
    *,
    walk: bool,
    up: UpAxis = UpAxis.auto,
) -> list[str]:
    """Check a body and return remarks on it as sentences.

    Parameters
    ----------
    positions, valid, frame_rate_hz, walk, up
        Arguments of `check`.

    Raises
    ------
    InvalidInput
        If a complaint rejects the recording; the message is that of the first one.
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
    """Return the complaints about a body; the first ones cause the rejection of the recording.

    The list is empty for a normal body.

    Parameters
    ----------
    positions : (T, 15, 3)
        Joint positions, mm, z up.
    valid : (T, 15) bool
        True for measured samples; joints without any are left out.
    frame_rate_hz : float
    walk : bool
        True if the recording must be a walk: upright, with legs that are not bent, at a human cadence.
    up : UpAxis
        Axis that the user stated; a body that is not upright then only gets a remark.
    """
    body = np.where(valid[..., None], positions, np.nan)
    if complaints := _unusable(body):
        return complaints
    leg = sum(float(np.mean(_medians(body, *_LIMBS[limb]))) for limb in ("thigh", "shank"))
    complaints = not_upright(body, walk and up == UpAxis.auto)
    upright = not complaints
    complaints += [*_changing(body), *_proportions(body, leg), *_uneven(body), *_exchanged(body)]
    if upright:
        complaints += bent_knees(body, leg, walk)
    if upright and walk:
        complaints += [*crouched(body, leg), *cadence(body, frame_rate_hz)]
    return sorted(complaints, key=lambda complaint: not complaint.rejects)


def _lengths(body: np.ndarray, upper: int, lower: int) -> np.ndarray:
    """Return the distance between two joints in each frame in which both joints were measured."""
    lengths = np.asarray(np.linalg.norm(body[:, upper] - body[:, lower], axis=-1))
    return lengths[np.isfinite(lengths)]


def _medians(body: np.ndarray, upper: Sequence[int], lower: Sequence[int]) -> list[float]:
    """Return the median distance of each pair of joints, NaN for joints that were never measured together."""
    pairs = (_lengths(body, *pair) for pair in zip(upper, lower, strict=True))
    return [float(np.median(lengths)) if len(lengths) else np.nan for lengths in pairs]


def _change(lengths: np.ndarray) -> float:
    """Return the interquartile range of lengths over time, relative to the median length."""
    low, middle, high = np.quantile(lengths, [0.25, 0.5, 0.75])
    return float((high - low) / middle)


def unit_of_leg(leg: float) -> str:
    """Return the probable unit of a file, such as ``m``, in which its leg length is that of a human.

    The number is the leg length relative to an adult's leg, 1 for millimetres.

    Examples
    --------
    >>> unit_of_leg(0.85), unit_of_leg(850.0), unit_of_leg(200.0)
    ('m', 'mm/1', 'mm/0.24')
    """
    return (_unit(leg)[1] or f"mm/{leg / ADULT_LEG_MM:.2g}") if leg > 0 else ""


def _unit(leg: float) -> tuple[str, str, float]:
    """Return advice on the unit of a leg length, with the unit's short name and its size in millimetres.

    The unit is guessed.

    Without a suitable unit the name is empty, and the factor is NaN or a power of ten.
    """
    if not leg > 0:
        return "", "", np.nan
    # Ranges overlap (a leg of 36 may be in inches, or a child's in centimetres): an adult's leg is assumed.
    unit = min(_UNITS, key=lambda unit: abs(np.log(leg * MILLIMETRES[unit] / ADULT_LEG_MM)))
    mm = MILLIMETRES[unit]
    low, high = LEG_LENGTH_MM
    if low <= leg * mm <= high:
        return f": it looks like {_UNITS[unit]}, multiply by {mm:g}", unit, mm
    factor = 10.0 ** np.floor(np.log10(high / leg))
    return (f": multiply by {factor:g}", "", factor) if leg * factor >= low else ("", "", np.nan)


def _unusable(body: np.ndarray) -> list[Complaint]:
    """Complaint after which no other check is useful: no complete leg, a wrong unit, or no depth."""
    length = leg_length(body)
    if not np.isfinite(length):
        return [Complaint("legs_unseen", "the legs were never measured completely", rejects=True)]
    low, high = LEG_LENGTH_MM
    if not low <= length <= high:
        advice, unit, factor = _unit(length)
        received = f"{length:.3g}" if length < 100 else told_apart(length, low if length < low else high, 0)
        sentence = str(
            InvalidInput(
                f"the unit of length is wrong{advice}",
                expected=f"legs of {low:g} to {high:g} mm",
                received=f"{received} mm",
            )
        )
        values = {"leg_mm": length, "unit": unit, "factor": factor}
        return [Complaint("unit", sentence, values=values, rejects=True)]
    if np.min(np.nanmax(body, axis=(0, 1)) - np.nanmin(body, axis=(0, 1))) < MIN_DEPTH_MM:
        sentence = "all joints lie in one plane: run `reconstruct` on keypoints of a video"
        return [Complaint("plane", sentence, rejects=True)]
    return []


def _proportions(body: np.ndarray, leg: float) -> list[Complaint]:
    """Complaints about unusual body proportions, and about hips that are mapped to the pelvis centre."""
    complaints = []
    for proportion in _PROPORTIONS:
        ends = [[WALKER15.index(joint) for joint in pair] for pair in zip(*proportion.ends, strict=True)]
        length = float(np.mean(_medians(body, *ends)))
        share, (low, high) = length / leg, proportion.usual
        if not np.isfinite(share) or low <= share <= high:
            continue
        below = share < low
        where = " and ".join(
            "–".join(pair) if len(proportion.ends) > 1 else " to ".join(pair) for pair in proportion.ends
        )
        sentence = (
            f"{where}: {length:.0f} mm, {told_apart(share, low if below else high, 2)} of the leg of {leg:.0f} mm"
            f" (usual {low:.2f} to {high:.2f}); {proportion.below if below else proportion.above}"
        )
        rejects = not proportion.possible[0] <= share <= proportion.possible[1]
        joints = tuple(dict.fromkeys(joint for pair in proportion.ends for joint in pair))
        values = {"length_mm": length, "share": share}
        complaints.append(Complaint(proportion.code, sentence, joints, values, rejects))
    distances = dict(zip(_HIPS, _medians(body, [PELVIS, PELVIS], _HIPS), strict=True))
    joints = tuple(WALKER15.joints[hip] for hip in _HIPS if distances[hip] < MAX_PELVIS_DISTANCE * leg)
    if joints:
        nearest = min(distances.values())
        names = " and ".join(joints)
        sentence = (
            f"{names}: only {nearest:.0f} mm from the pelvis; map the hip joint, not the centre of the pelvis"
        )
        complaints.append(
            Complaint("hip_at_pelvis", sentence, joints, {"distance_mm": nearest}, rejects=True)
        )
    return complaints


def _changing(body: np.ndarray) -> list[Complaint]:
    """Complaint about thighs and shanks whose length changes over time."""
    change = min(
        _change(np.concatenate([_lengths(body, *ends) for ends in zip(*_LIMBS[limb], strict=True)]))
        for limb in ("thigh", "shank")
    )
    if change <= MAX_CHANGE:
        return []
    sentence = str(
        InvalidInput(
            "thighs and shanks change their length: are these velocities or angles instead of positions?",
            expected=f"an interquartile range of up to {100 * MAX_CHANGE:.0f} % of the median length",
            received=f"{100 * change:.0f} %",
        )
    )
    return [Complaint("changing", sentence, values={"share": change}, rejects=True)]


def _uneven(body: np.ndarray) -> list[Complaint]:
    """Complaints about limbs that are longer than the same limb on the other side.

    Only limbs of steady length reject a recording.  A limb of changing length has a badly tracked joint, which walks
    estimate.
    """
    complaints = []
    for limb, (upper, lower) in _LIMBS.items():
        left, right = _medians(body, upper, lower)
        share = max(left, right) / max(min(left, right), np.finfo(float).tiny) - 1.0
        if not share > UNEVEN[0]:  # NaN where a side was not measured
            continue
        sizes = f"the left {limb} is {left:.0f} mm long, the right {right:.0f}"
        sentence = f"{sizes}: is a marker misplaced or mislabelled?"
        where = tuple(WALKER15.joints[j] for j in (*upper, *lower))
        values = {"left_mm": left, "right_mm": right, "share": share}
        steady = all(_change(_lengths(body, *ends)) <= MAX_CHANGE for ends in zip(upper, lower, strict=True))
        complaints.append(Complaint("uneven", sentence, where, values, rejects=share > UNEVEN[1] and steady))
    return complaints


def _exchanged(body: np.ndarray) -> list[Complaint]:
    """Complaint about limbs that are shorter and of steadier length if their left and right ends are exchanged.

    Crossing limbs, such as folded arms, would not be steadier.  Thighs and upper arms that cross by half the width of
    hips or shoulders need to be only as steady as their own, because skin moves.  If shoulders and hips face opposite
    ways, complete arms are exchanged; the median angle between them is at most 27° in 180 recordings.
    """
    exchanged = "left and right are exchanged in the names of points, at "
    hips, shoulders = (body[:, pair[1]] - body[:, pair[0]] for pair in (_HIPS, _SHOULDERS))
    if np.nansum(hips * shoulders) < 0:
        return [Complaint("exchanged", f"{exchanged}the shoulders or hips", rejects=True)]
    mirror = WALKER15.mirror
    for upper, lower in WALKER15.bones:
        if upper == mirror[upper] or lower > mirror[lower]:  # each pair of sides is checked once
            continue
        ends = body[:, [[lower, mirror[lower]], [mirror[lower], lower]]]
        lengths = np.linalg.norm(ends - body[:, None, [upper, mirror[upper]]], axis=-1)
        lengths = lengths[np.isfinite(lengths).all(axis=(1, 2))]
        straight, crossed = np.square(lengths).sum(axis=(0, 2))
        if straight > crossed:
            varies, steady = lengths.std(axis=0).mean(axis=1)
            trunk = WALKER15.parents[upper]
            width = np.square(body[:, upper] - body[:, mirror[upper]]).sum(axis=1)
            wide = trunk == mirror[trunk] and straight - crossed > len(lengths) * np.nanmean(width)
            if varies > (0.8 if wide else 1.2) * steady + 0.1:
                joint = WALKER15.joints[lower]
                return [Complaint("exchanged", f"{exchanged}{joint} or above", (joint,), rejects=True)]
    return []
