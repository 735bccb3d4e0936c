"""Recordings of each kind, read and prepared as usable clips."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.clips import one_person, performances, varied, walks
from pipeline.clips.kinds import Performances, VariedClips, Walks
from pipeline.clips.options import Missing, Steady
from pipeline.clips.usable import PreparedClip, RawClip, collect, report_row
from pipeline.core.likeness import Likeness, likeness
from pipeline.ingestion.corpus import Clip, read_clip
from pipeline.processes import map_processes
from pipeline.validation import InvalidInput


def recorded_walks(
    clips: Sequence[Clip], steady: Steady, workers: int, missing: Missing = Missing.estimate
) -> Walks:
    """Return the steady walks in recordings; with `Missing.drop`, joints that one of them lacks are left out."""
    prepared = read_and_prepare(
        clips, walks.REPORT_COLUMNS, lambda raw: walks.steady_walk(raw, steady), workers
    )
    found = walks.walks_of(prepared, steady, _digests(clips))
    return (
        dataclasses.replace(found, dropped=np.asarray(found.estimated.any(axis=0)))
        if missing is Missing.drop
        else found
    )


def recorded_performances(
    clips: Sequence[Clip], steady: Steady, workers: int, *, cycles: bool = False
) -> Performances:
    """Return recorded performances: whole recordings, or the middle cycle of each walk."""

    def one(raw: RawClip) -> PreparedClip:
        return (
            performances.middle_cycle(raw, steady) if cycles else performances.whole_clip(raw, steady.gap_s)
        )

    columns = performances.REPORT_COLUMNS
    prepared = read_and_prepare(clips, columns, one, workers)
    fewest = performances.LEAST_PERFORMANCES
    return Performances(**collect(prepared, columns, _digests(clips), at_least=fewest))


def recorded_clips(clips: Sequence[Clip], gap_s: float, workers: int) -> VariedClips:
    """Return the longest stretch of each recording that shows all joints."""
    prepared = read_and_prepare(
        clips, varied.REPORT_COLUMNS, lambda raw: varied.longest_stretch(raw, gap_s), workers
    )
    return varied.varied_of(prepared, _digests(clips))


def _digests(clips: Sequence[Clip]) -> dict[str, str]:
    return {clip.name: clip.sha256 for clip in clips if clip.path}


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
            f"{row['clip']} of {row['person']}",
            "a recording of one person under one name",
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
