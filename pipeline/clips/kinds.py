"""The kinds of clips that a figure may be made of, and what all of them have in common.

A data set names a corpus for each kind: walks (zhang2004, zhang2007), performances of one action (mozerov2006),
varied motion (park2011).  The module of each kind decides which part of a clip is usable.  Every clip gets a row in
the report, kept or refused, with the reason.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.clips import one_person
from pipeline.clips.corpus import Clip, read_clip
from pipeline.core import walking
from pipeline.core.likeness import Likeness, likeness
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput


@dataclass(frozen=True, kw_only=True)
class Clips:
    """Usable clips, concatenated in time, and the report on all clips.

    Attributes
    ----------
    positions : (sum of T, 15, 3)
        Millimetres.
    first : (W + 1,) int
        First frame of each clip, and the number of all frames.
    frame_rate_hz, leg_length_mm : (W,)
    person, clip, source : (W,) text
    report : list of dict
        One row per clip, kept or refused, with the reason.
    report_columns : list of str
        Columns of the report in order.
    inputs : dict
        sha256 of each recording, by clip.
    """

    positions: np.ndarray
    first: np.ndarray
    frame_rate_hz: np.ndarray
    leg_length_mm: np.ndarray
    person: np.ndarray
    clip: np.ndarray
    source: np.ndarray
    report: list[dict[str, Any]]
    report_columns: list[str]
    inputs: dict[str, str]

    def __len__(self) -> int:
        return len(self.first) - 1

    def motion(self, number: int) -> np.ndarray:
        """Return the positions of one clip, (T, 15, 3) mm."""
        return self.positions[self.first[number] : self.first[number + 1]]


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
    """

    row: dict[str, Any]
    positions: np.ndarray
    frame_rate_hz: float
    valid: np.ndarray | None = None
    notes: Sequence[str] = ()


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
    """

    row: dict[str, Any]
    positions: np.ndarray | None = None
    frame_rate_hz: float = 0.0


@dataclass(frozen=True)
class Request:
    """A request to the ingest stage.

    Attributes
    ----------
    options : dict
        Everything that the result depends on.
    make : callable
        Returns the clips.
    """

    options: dict[str, Any]
    make: Callable[[], Clips]


class Corpus(ABC):
    """One kind of clips.

    Attributes
    ----------
    name : str
        ``"walks"``, ``"performances"`` or ``"clips"``: the option of a data set that chooses them.
    words : str
        Plural noun for messages.
    sample : str
        Name of the array of clip names in ``arrays.npz``.
    world : str
        Description of the world frame in recordings.
    """

    name: str
    words: str
    sample: str
    world: str

    @property
    @abstractmethod
    def result(self) -> type[Clips]:
        """Class of the clips."""

    @abstractmethod
    def synthetic(self, data: Any, seed: int, workers: int) -> Request:
        """Return the request for synthetic clips."""

    @abstractmethod
    def recorded(self, data: Any, clips: Sequence[Clip], workers: int, missing: str = "estimate") -> Request:
        """Return the request for recorded clips; `missing` says what becomes of joints that a file does not give."""


def report_row(columns: Sequence[str], **known: Any) -> dict[str, Any]:
    """Return a row of the report: what is known of its columns, and nothing in all others."""
    return {name: known.get(name, "") for name in columns}


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
    """Bridge the gaps of a clip that are no longer than `gap_s` seconds, and select its usable part.

    Parameters
    ----------
    raw : RawClip
    gap_s : float
    select : callable
        Given the bridged clip and the row, returns the positions to keep, (T', 15, 3) mm, and enters what it finds
        into the row; raises InvalidInput to refuse the clip.
    may_lack_joints : bool
        Whether joints above the legs may be missing throughout: they stay NaN, and frames are whole without them.
    """
    row = raw.row | {"frames": len(raw.positions), "verdict": "refused"}
    valid = np.isfinite(raw.positions).all(axis=-1) if raw.valid is None else raw.valid
    try:
        walking.require_millimetres(raw.positions)
        row["leg_length_mm"] = walking.leg_length(raw.positions)
        seen = np.asarray(valid.any(axis=0))
        if lacking := ", ".join(
            joint for joint, is_seen in zip(WALKER15.joints, seen, strict=True) if not is_seen
        ):
            if not may_lack_joints:
                raise InvalidInput("joints are missing, which are estimated for walks only", received=lacking)
            row["missing_joints"] = lacking
        bridged = walking.bridge_gaps(raw.positions[:, seen], valid[:, seen], raw.frame_rate_hz, gap_s=gap_s)
        positions = np.array(raw.positions, dtype=float)
        positions[:, seen] = bridged.positions
        bridged = walking.BridgedClip(positions, bridged.whole, bridged.n_filled)
        row["bridged_values"] = bridged.n_filled
        kept = select(bridged, row)
    except InvalidInput as refusal:
        return PreparedClip(row | {"reason": str(refusal)})
    return PreparedClip(row | {"verdict": "kept"}, kept, raw.frame_rate_hz)


def read_and_prepare(
    clips: Iterable[Clip],
    columns: Sequence[str],
    prepare_one: Callable[[RawClip], PreparedClip],
    workers: int,
) -> list[PreparedClip]:
    """Read recordings and prepare each; one that cannot be read becomes a refused row of the report.

    Recordings of the same points under different people's names are refused, each naming the other: whoever it was,
    it was not two people.  A recording that may be another's for other reasons bears a remark, see `one_person`.
    """

    def one(clip: Clip) -> _Read:
        row = report_row(columns, clip=clip.name, person=clip.person, source=clip.source, action=clip.action)
        try:
            motion, positions, valid = read_clip(clip)
            prepared = prepare_one(RawClip(row, positions, motion.frame_rate_hz, valid, motion.notes))
            notes = () if prepared.positions is None else motion.notes
            reason = "; ".join(filter(None, [prepared.row["reason"], *notes]))
            return _Read(
                replace(prepared, row=prepared.row | {"reason": reason}),
                _digest_of_points(positions),
                None if prepared.positions is None else likeness(positions, valid, motion.frame_rate_hz),
            )
        except InvalidInput as refusal:
            # Readers name the file by its path, which must not get into a published report.
            reason = str(refusal).replace(str(clip.path), clip.name)
            return _Read(PreparedClip(row | {"verdict": "refused", "reason": reason}))

    return _with_remarks(_without_copies(map_processes(one, clips, workers)))


@dataclass(frozen=True)
class _Read:
    """A recording that was read.

    Attributes
    ----------
    prepared : PreparedClip
    digest : str
        Of its points; empty if it could not be read.
    shown : Likeness or None
        What it shows of the person; None if it is refused.
    """

    prepared: PreparedClip
    digest: str = ""
    shown: Likeness | None = None


def _digest_of_points(positions: np.ndarray) -> str:
    """Return the sha256 of positions to a thousandth of a millimetre: equal for copies in whatever format."""
    return hashlib.sha256((np.round(positions, 3) + 0.0).tobytes()).hexdigest()


def _without_copies(read: Sequence[_Read]) -> list[_Read]:
    """Refuse recordings that are equal to one of another person."""
    alike: dict[str, list[dict[str, Any]]] = {}
    for one in read:
        if one.digest:
            alike.setdefault(one.digest, []).append(one.prepared.row)

    def judged(one: _Read) -> _Read:
        row = one.prepared.row
        others = [other for other in alike.get(one.digest, []) if other["person"] != row["person"]]
        if not others:
            return one
        reason = InvalidInput(
            f"the same points as {others[0]['clip']}, which bears the name of {others[0]['person']}",
            where=f"{row['clip']} of {row['person']}",
            expected="a recording of one person under one name",
        )
        return _Read(PreparedClip(row | {"verdict": "refused", "reason": str(reason)}))

    return [judged(one) for one in read]


def _with_remarks(read: Sequence[_Read]) -> list[PreparedClip]:
    """Remark on usable recordings that may show a person of another name."""
    shown = [(n, one.shown) for n, one in enumerate(read) if one.shown is not None]
    rows = [read[n].prepared.row for n, _ in shown]
    made = one_person.remarks(
        [row["person"] for row in rows], [row["clip"] for row in rows], [one for _, one in shown]
    )
    remark = {n: text for (n, _), text in zip(shown, made, strict=True) if text}

    def remarked(n: int, clip: PreparedClip) -> PreparedClip:
        reasons = "; ".join(filter(None, [clip.row["reason"], remark.get(n)]))
        return replace(clip, row=clip.row | {"reason": reasons})

    return [remarked(n, one.prepared) for n, one in enumerate(read)]


def collect(
    prepared: Sequence[PreparedClip], columns: Sequence[str], clips: Sequence[Clip] = (), *, at_least: int = 1
) -> dict[str, Any]:
    """Return the fields of `Clips`.

    Parameters
    ----------
    prepared : sequence of PreparedClip
    columns : sequence of str
        Columns of the report.
    clips : sequence of Clip
        The recordings that were read.
    at_least : int
        Fewer usable clips are refused.

    Raises
    ------
    NoUsableClips
        If there are fewer; the sentence gives the reasons of the first three refusals.
    """
    kept = [clip for clip in prepared if clip.positions is not None]
    rows = [clip.row for clip in kept]
    if len(kept) < at_least:
        refused = [f"{clip.row['clip']}: {clip.row['reason']}" for clip in prepared if clip.positions is None]
        reasons = "; ".join(refused[:3]) + (f"; and {len(refused) - 3} more" if len(refused) > 3 else "")
        refusal = NoUsableClips(
            f"{len(kept) or 'none'} of the {len(prepared)} clips can be used",
            expected=f"{at_least} or more",
            received=reasons,
        )
        refusal.report, refusal.columns = [clip.row for clip in prepared], list(columns)
        raise refusal
    positions = [clip.positions for clip in kept if clip.positions is not None]
    return {
        "positions": np.concatenate(positions),
        "first": np.concatenate([[0], np.cumsum([len(p) for p in positions])]),
        "frame_rate_hz": np.array([clip.frame_rate_hz for clip in kept]),
        **{
            name: np.array([row[name] for row in rows])
            for name in ("person", "clip", "source", "leg_length_mm")
        },
        "report": [clip.row for clip in prepared],
        "report_columns": list(columns),
        "inputs": {clip.name: clip.sha256 for clip in clips if clip.path},
    }
