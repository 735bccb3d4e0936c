"""Which part of a clip is usable, of whatever kind it is, and the report on those that are refused."""

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

LEAST_MOTION_MM = 10.0
"""About the pelvis, rms over time, of the joint that moves most: who stands still sways less."""

FASTEST_M_S = 20.0
"""Of a pelvis: sprinters reach 12."""


@dataclass(frozen=True)
class RawClip:
    """A clip before its usable part is selected.

    Attributes
    ----------
    row : dict
        Its row of the report so far.
    positions : (T, 15, 3)
        Millimetres.
    frame_rate_hz : float
    valid : (T, 15) bool or None
        None: where the positions are finite.
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
    """A usable clip, or the report row of a refused one.

    Attributes
    ----------
    row : dict
        Its row of the report.
    positions : (T, 15, 3) or None
        Millimetres; None if the clip is refused.
    frame_rate_hz : float
    stature_mm : float
    kept : object
        Of a walk whose positions were let go: its stature, and what is kept in their place.
    """

    row: dict[str, Any]
    positions: np.ndarray | None = None
    frame_rate_hz: float = 0.0
    stature_mm: float = 0.0
    kept: Any = None


def report_row(columns: Sequence[str], **known: Any) -> dict[str, Any]:
    """Return a row of the report: what is known of its columns, and nothing in all others.

    ``code`` and ``values`` are those of the refusal or remark, for other code: they are no columns of the table.
    """
    return {name: known.get(name, "") for name in columns} | {"code": "", "values": {}}


def refused(row: dict[str, Any], refusal: InvalidInput, reason: str = "") -> PreparedClip:
    """Return a refused clip: its row with the sentence or `reason`, the code and those values that a store keeps."""
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
    """Too few clips can be used.

    Attributes
    ----------
    report : list of dict
        One row per clip, with the reason why it is refused.
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
    """Check the body of a clip, bridge its gaps of at most `gap_s` seconds, and select its usable part.

    Parameters
    ----------
    raw : RawClip
    gap_s : float
    select : callable
        Given the bridged clip and the row, returns the positions to keep, (T', 15, 3) mm, and enters what it finds
        into the row; raises InvalidInput to refuse the clip.
    may_lack_joints : bool
        Whether joints above the legs may be missing throughout, as of walks: they stay NaN, and frames are whole
        without them.
    """
    row = raw.row | {"frames": len(raw.positions), "verdict": "refused"}
    valid = np.isfinite(raw.positions).all(axis=-1) if raw.valid is None else raw.valid
    try:
        remarks = accepted(raw.positions, valid, raw.frame_rate_hz, walk=may_lack_joints, up=raw.up)
        row["reason"] = "; ".join(remarks)
        row["leg_length_mm"] = walking.leg_length(raw.positions)
        observed = np.asarray(valid.any(axis=0))
        if lacking := ", ".join(
            joint for joint, is_seen in zip(WALKER15.joints, observed, strict=True) if not is_seen
        ):
            if not may_lack_joints:
                raise InvalidInput(
                    "joints are missing, which are estimated for walks only",
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
    """Raise InvalidInput if nobody moves, or the pelvis faster than anybody can: in positions (T, 15, 3), mm."""
    moved = np.sqrt((positions - positions[:, [PELVIS]]).var(axis=0).sum(axis=-1)).max()
    if moved < LEAST_MOTION_MM:
        raise InvalidInput(
            "nobody moves",
            expected=f"a joint that moves {LEAST_MOTION_MM:g} mm",
            received=f"{moved:.2g} mm",
            code="nobody_moves",
        )
    speed = np.linalg.norm(np.diff(positions[:, PELVIS], axis=0), axis=-1) * frame_rate_hz / 1000.0
    if speed.max() > FASTEST_M_S:
        raise InvalidInput(
            "the pelvis jumps: lost in tracking, or another frame rate",
            f"frame {first_frame + int(speed.argmax())}",
            f"up to {FASTEST_M_S:g} m/s",
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
    """Return the fields of `Clips`.

    Parameters
    ----------
    prepared : sequence of PreparedClip
    columns : sequence of str
        Columns of the report.
    inputs : mapping, optional
        sha256 of each recording that was read, by clip.
    at_least : int
        Fewer usable clips are refused.

    Raises
    ------
    NoUsableClips
        If there are fewer; the sentence gives the reasons of the first three refusals.
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
