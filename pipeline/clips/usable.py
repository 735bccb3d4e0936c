"""Selection of the usable part of a clip, and report on used and rejected clips."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.core import walking
from pipeline.skeleton import PELVIS, WALKER15
from pipeline.skeleton.body import accepted
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.validation import InvalidInput

MIN_MOTION_MM = 10.0
"""Smallest rms motion relative to the pelvis, mm, of the joint that moves most.

A person who stands still sways less than this.
"""

MAX_SPEED_M_S = 20.0
"""Largest plausible speed of the pelvis, m/s; sprinters reach 12 m/s."""


@dataclass(frozen=True)
class RawClip:
    """Clip before its usable part is selected.

    Attributes
    ----------
    row : dict
        Incomplete row of the report.
    positions : (T, 15, 3)
        Millimetres.
    frame_rate_hz : float
    valid : (T, 15) bool or None
        Measured samples; None for all finite positions.
    notes : sequence of str
        Remarks of the reader of the file.
    up : UpAxis
        Axis of the file that points up, if the user stated it.
    """

    row: dict[str, Any]
    positions: np.ndarray
    frame_rate_hz: float
    valid: np.ndarray | None = None
    notes: Sequence[str] = ()
    up: UpAxis = UpAxis.auto


@dataclass(frozen=True)
class PreparedClip:
    """Usable part of a clip, or the report row of a rejected clip.

    Attributes
    ----------
    row : dict
        Row of the report.
    positions : (T, 15, 3) or None
        Millimetres; None if the clip is rejected.
    frame_rate_hz : float
    stature_mm : float
        Stature, for a walk without positions.
    reduced : object
        Result of the `Reducer`, for a walk without positions.
    """

    row: dict[str, Any]
    positions: np.ndarray | None = None
    frame_rate_hz: float = 0.0
    stature_mm: float = 0.0
    reduced: Any = None


def report_row(columns: Sequence[str], **values: Any) -> dict[str, Any]:
    """Return a row of the report on clips; columns without a value contain an empty string.

    ``code`` and ``values`` of the error or remark are added for other code; they are not columns of the table.
    """
    return {name: values.get(name, "") for name in columns} | {"code": "", "values": {}}


def refused(row: dict[str, Any], refusal: InvalidInput, reason: str = "") -> PreparedClip:
    """Return a rejected clip, whose report row contains the reason, the error code and the error's values."""
    values = {name: value for name, value in refusal.values.items() if _is_plain(value)}
    reason = reason or str(refusal)
    return PreparedClip(
        row | {"verdict": "refused", "reason": reason, "code": refusal.code, "values": values}
    )


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(map(_is_plain, value))
    return isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value))


class NoUsableClips(InvalidInput):
    """Error that is raised if too few clips are usable.

    Attributes
    ----------
    report : list of dict
        A row per clip, with the reason for its rejection.
    columns : list of str
        Columns of the report in order.
    """

    report: list[dict[str, Any]]
    columns: list[str]


def prepare(
    raw: RawClip,
    gap_s: float,
    select: Callable[[walking.BridgedClip, dict[str, Any]], np.ndarray],
    *,
    may_lack_joints: bool = False,
) -> PreparedClip:
    """Check the body of a clip, fill gaps of at most `gap_s` seconds, and select the clip's usable part.

    Parameters
    ----------
    raw : RawClip
    gap_s : float
    select : callable
        Function of the bridged clip and the row.  It returns the positions to keep, (T', 15, 3) mm, and adds its
        results to the row.  It raises InvalidInput to reject the clip.
    may_lack_joints : bool
        True if joints above the legs may be missing in all frames, as for walks.  They stay NaN, and frames count as
        complete without them.
    """
    row = raw.row | {"frames": len(raw.positions), "verdict": "refused"}
    valid = np.isfinite(raw.positions).all(axis=-1) if raw.valid is None else raw.valid
    try:
        remarks = accepted(raw.positions, valid, raw.frame_rate_hz, walk=may_lack_joints, up=raw.up)
        row["reason"] = "; ".join(remarks)
        row["leg_length_mm"] = walking.leg_length(raw.positions)
        observed = np.asarray(valid.any(axis=0))
        if lacking := ", ".join(
            joint for joint, is_observed in zip(WALKER15.joints, observed, strict=True) if not is_observed
        ):
            if not may_lack_joints:
                raise InvalidInput(
                    "joints are missing, and missing joints are estimated only for walks",
                    received=lacking,
                    code="missing_joints",
                )
            row["missing_joints"] = lacking
        bridged = walking.bridge_gaps(
            raw.positions[:, observed], valid[:, observed], raw.frame_rate_hz, gap_s=gap_s
        )
        positions = np.array(raw.positions, float)
        positions[:, observed] = bridged.positions
        bridged = walking.BridgedClip(positions, bridged.whole, bridged.n_filled)
        row["bridged_values"] = bridged.n_filled
        selected = select(bridged, row)
    except InvalidInput as refusal:
        return refused(row, refusal)
    return PreparedClip(row | {"verdict": "kept"}, selected, raw.frame_rate_hz)


def require_action(positions: np.ndarray, frame_rate_hz: float, first_frame: int) -> None:
    """Raise InvalidInput if a person (T, 15, 3), mm, does not move, or if the pelvis moves too fast."""
    moved = np.sqrt((positions - positions[:, [PELVIS]]).var(axis=0).sum(axis=-1)).max()
    if moved < MIN_MOTION_MM:
        raise InvalidInput(
            "the person does not move",
            expected=f"a joint that moves by {MIN_MOTION_MM:g} mm",
            received=f"{moved:.2g} mm",
            code="nobody_moves",
        )
    speed = np.linalg.norm(np.diff(positions[:, PELVIS], axis=0), axis=-1) * frame_rate_hz / 1000.0
    if speed.max() > MAX_SPEED_M_S:
        raise InvalidInput(
            "the pelvis jumps: it was lost in tracking, or the frame rate is wrong",
            f"frame {first_frame + int(speed.argmax())}",
            f"up to {MAX_SPEED_M_S:g} m/s",
            f"{speed.max():.0f} m/s",
            code="pelvis_jumps",
        )


def collect(
    prepared: Sequence[PreparedClip],
    columns: Sequence[str],
    inputs: Mapping[str, str] | None = None,
    *,
    at_least: int = 1,
) -> dict[str, Any]:
    """Return the fields of `Clips`, collected from the usable and the rejected clips.

    Parameters
    ----------
    prepared : sequence of PreparedClip
    columns : sequence of str
        Columns of the report.
    inputs : mapping, optional
        sha256 of each recording that was read, by clip.
    at_least : int
        Smallest number of usable clips.

    Raises
    ------
    NoUsableClips
        If there are fewer; the message gives the reasons of the first three rejections.
    """
    usable = [clip for clip in prepared if clip.positions is not None]
    rows = [clip.row for clip in usable]
    if len(usable) < at_least:
        refused = [f"{clip.row['clip']}: {clip.row['reason']}" for clip in prepared if clip.positions is None]
        reasons = "; ".join(refused[:3]) + (f"; and {len(refused) - 3} more" if len(refused) > 3 else "")
        refusal = NoUsableClips(
            f"{len(usable) or 'none'} of the {len(prepared)} clips can be used",
            expected=f"{at_least} or more",
            received=reasons,
            code="too_few_clips",
            needed=at_least,
            count=len(usable),
        )
        refusal.report, refusal.columns = [clip.row for clip in prepared], list(columns)
        raise refusal
    positions = [clip.positions for clip in usable if clip.positions is not None]
    return {
        "positions": np.concatenate(positions),
        "first": np.concatenate([[0], np.cumsum([len(p) for p in positions])]),
        "frame_rate_hz": np.array([clip.frame_rate_hz for clip in usable]),
        **{
            name: np.array([row[name] for row in rows])
            for name in ("person", "clip", "source", "leg_length_mm")
        },
        "report": [clip.row for clip in prepared],
        "report_columns": list(columns),
        "inputs": dict(inputs or {}),
    }
