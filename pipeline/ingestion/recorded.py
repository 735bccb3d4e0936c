"""Reading of recordings, and their preparation as walks, performances or varied clips."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.clips import one_person, performances, varied, walks
from pipeline.clips.kinds import Performances, VariedClips, Walks
from pipeline.clips.options import Missing, Steady
from pipeline.clips.usable import PreparedClip, RawClip, collect, refused, report_row
from pipeline.core.likeness import Likeness, likeness
from pipeline.ingestion.corpus import Clip
from pipeline.ingestion.joints import read_clip
from pipeline.processes import map_processes
from pipeline.validation import InvalidInput


def recorded_walks(clips: Sequence[Clip], steady: Steady, workers: int, missing: Missing) -> Walks:
    """Return the steady walks in recordings; `Missing.drop` leaves out of all walks each joint that a walk lacks."""
    prepared = read_and_prepare(
        clips, walks.REPORT_COLUMNS, lambda raw: walks.steady_walk(raw, steady), workers
    )
    steady_walks = walks.walks_of(walks.compared(prepared, steady.frequency_ratio), _digests(clips))
    if missing is not Missing.drop:
        return steady_walks
    return replace(steady_walks, dropped=np.any(steady_walks.estimated, axis=0))


def recorded_performances(
    clips: Sequence[Clip], steady: Steady, workers: int, *, cycles: bool
) -> Performances:
    """Return recorded performances: complete recordings, or the middle cycle of each recorded walk."""

    def prepare_one(raw: RawClip) -> PreparedClip:
        return (
            performances.middle_cycle(raw, steady) if cycles else performances.whole_clip(raw, steady.gap_s)
        )

    columns = performances.REPORT_COLUMNS
    prepared = read_and_prepare(clips, columns, prepare_one, workers)
    min_count = performances.MIN_PERFORMANCES
    return Performances(**collect(prepared, columns, _digests(clips), at_least=min_count))


def recorded_clips(clips: Sequence[Clip], gap_s: float, workers: int) -> VariedClips:
    """Return, for each recording, the longest stretch in which all joints are measured."""
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
    """Read and prepare recordings; a recording that cannot be read is rejected in the report.

    Identical points under the names of two people are rejected in both recordings, because the person is unclear.
    Other recordings that may be of the same person get a remark, see `one_person`.
    """

    def read_one(clip: Clip) -> tuple[PreparedClip, str, Likeness | None]:
        row = report_row(columns, clip=clip.name, person=clip.person, source=clip.source, action=clip.action)
        try:
            motion, positions, valid = read_clip(clip)
            prepared = prepare_one(
                RawClip(row, positions, motion.frame_rate_hz, valid, motion.notes, motion.up)
            )
            # Positions rounded to a micrometre: copies in different formats have the same digest.
            digest = hashlib.sha256((np.round(positions, 3) + 0.0).tobytes()).hexdigest()
            if prepared.positions is None:
                return prepared, digest, None
            person_likeness = likeness(positions, valid, motion.frame_rate_hz)
            return _remarked(prepared, *motion.notes), digest, person_likeness
        except InvalidInput as refusal:
            # The path in the reader's message must not get into a published report.
            reason = str(refusal).replace(str(clip.path), clip.name)
            return refused(row, refusal, reason), "", None

    read = map_processes(read_one, clips, workers)
    alike: dict[str, list[dict[str, Any]]] = {}
    for prepared, digest, _ in read:
        alike.setdefault(digest, []).append(prepared.row)
    results: list[PreparedClip] = []
    usable: dict[int, Likeness] = {}
    for n, (prepared, digest, person_likeness) in enumerate(read):
        row = prepared.row
        others = [other for other in alike[digest] if digest and other["person"] != row["person"]]
        if others:
            reason = InvalidInput(
                f"the recording has the same points as {others[0]['clip']},"
                f" which is listed under the name of {others[0]['person']}",
                f"{row['clip']} of {row['person']}",
                "a recording of one person under one name",
                code="same_points",
                clip=others[0]["clip"],
                person=others[0]["person"],
            )
            prepared = refused(row, reason)
        results.append(prepared)
        if person_likeness is not None and not others:
            usable[n] = person_likeness
    people, names = ([results[n].row[column] for n in usable] for column in ("person", "clip"))
    for n, remark in zip(usable, one_person.remarks(people, names, [*usable.values()]), strict=True):
        results[n] = _remarked(results[n], remark)
    return results


def _remarked(clip: PreparedClip, *remarks: str) -> PreparedClip:
    """Return a clip whose row of the report contains further remarks."""
    reason = "; ".join(filter(None, [clip.row["reason"], *remarks]))
    return replace(clip, row=clip.row | {"reason": reason})
