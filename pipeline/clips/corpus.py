"""Which recordings a data set names, and where they are: the table of public ones, or the user's folder.

A data set names a corpus for each purpose: walks, performances of one action, clips of varied motion.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import fetch, formats
from pipeline.formats.acclaim import amc as asf_amc
from pipeline.skeleton import MotionCapture, SourceMapping, map_joints
from pipeline.storage import tables
from pipeline.studies.options import Data, FolderData, RecordedData
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Clip:
    """One recording to be ingested."""

    name: str
    person: str
    source: str
    action: str
    path: Path | None  # None: listed, but not on this machine
    sha256: str
    mapping: SourceMapping
    frame_rate_hz: float
    units: str

    @property
    def identity(self) -> dict[str, Any]:
        """What an artefact made of this clip depends on; where it lies on this machine is no part of it."""
        return {**asdict(self), "path": self.path.name if self.path else None, "mapping": self.mapping}


def read_clip(clip: Clip) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """What the file holds, and its joints: positions (T, 15, 3) mm and where they are valid (T, 15)."""
    if clip.path is None:
        raise InvalidInput("not on this machine", expected="`make data` to fetch it")
    motion = formats.read(clip.path, frame_rate_hz=clip.frame_rate_hz or None, units=clip.units or None)
    return motion, *map_joints(motion, clip.mapping)


def require(data: Data, purpose: str) -> None:
    """Nothing; a InvalidInput if a data set holds nothing for this purpose (walks, performances or clips)."""
    if not isinstance(data, RecordedData):
        return
    sources = {
        "walks": data.sources,
        "performances": data.performances.sources,
        "clips": data.clips.sources,
    }[purpose]
    if not sources:
        what = {"walks": "walks", "performances": "performances of one action", "clips": "varied motion"}
        raise InvalidInput(f"the data set {data.name} holds no {what[purpose]}", where="data")


def clips_of(options: Data, skeleton: SourceMapping, purpose: str) -> list[Clip]:
    """The recordings that a data set names for a purpose, those that are not on this machine last."""
    require(options, purpose)
    match options, purpose:
        case RecordedData(), "walks":
            present, absent = _listed(options, options.sources, options.action)
            return _first_people(present, options.walkers) + absent
        case RecordedData(), _:
            corpus = options.performances if purpose == "performances" else options.clips
            present, absent = _listed(options, corpus.sources, corpus.action)
            return in_turn(present, corpus.limit) + absent
        case FolderData(), "walks":
            return _first_people(folder_clips(options, skeleton), options.walkers)
        case FolderData(), _:
            corpus = options.performances if purpose == "performances" else options.clips
            return in_turn(folder_clips(options, skeleton), corpus.limit)
        case _:
            raise TypeError(f"no recordings for {type(options).__name__}")


def _listed(options: RecordedData, sources: Sequence[str], action: str) -> tuple[list[Clip], list[Clip]]:
    """Clips of the table that are on this machine, in order, and those that are not, as the table has them."""
    clips = _clips_of_table(options, sources, action)
    present = [clip for clip in clips if clip.path]
    if not present:
        raise InvalidInput(
            f"none of the {len(clips)} recordings is on this machine",
            where=options.raw,
            expected="`make data` to fetch them, or data.mirror= (or MOCAP_MIRROR) naming a folder that has them",
        )
    absent = [clip for clip in clips if not clip.path]
    return sorted(present, key=lambda c: (c.source, c.person, c.name)), absent


def _clips_of_table(options: RecordedData, sources: Sequence[str], action: str) -> list[Clip]:
    """Clips of the table, each of those on this machine with its digest, which reads the whole file."""
    rows = [
        row
        for row in tables.read_rows(Path(options.table))
        if row["source"] in sources
        and (row["action"] == action or row["action"].startswith(f"{action}:"))
        and row["skeleton"] in options.skeletons
    ]
    if not rows:
        raise InvalidInput(
            f"no recording of {action or 'an action without a name'} by these sources is listed",
            where=options.table,
            expected=", ".join(sources),
        )
    same = {subject: group[0] for group in options.same_person for subject in group}
    mirror = Path(options.mirror) if options.mirror else None
    clips: list[Clip] = []
    for row in rows:
        path = fetch.resolve(row, raw=Path(options.raw), mirror=mirror)
        clips.append(
            Clip(
                name=row["trial"],
                person=same.get(row["subject"], row["subject"]),
                source=row["source"],
                action=row["action"].partition(":")[2].strip() or row["action"],
                path=path,
                sha256=_digest(path) if path else "",
                mapping=options.skeletons[row["skeleton"]],
                frame_rate_hz=float(row["frame_rate_hz"]),
                units="",
            )
        )
    return clips


def folder_clips(options: FolderData, skeleton: SourceMapping) -> list[Clip]:
    """Readable files below the user's folder."""
    if not options.path:
        raise InvalidInput("no folder is given", expected="data.path=<folder>", received="nothing")
    folder = Path(options.path)
    if not folder.is_dir():
        raise InvalidInput("there is no such folder", where=options.path)
    try:
        files = sorted(p for p in folder.glob(options.pattern) if p.is_file() and not p.name.startswith("."))
    except (ValueError, NotImplementedError, IndexError):  # how glob refuses differs between Pythons
        raise InvalidInput(
            "not a pattern below the folder",
            where="data.pattern",
            expected="**/*.c3d, say",
            received=options.pattern,
        ) from None
    readable = [p for p in files if p.suffix.lower() in formats.READERS]
    if not readable:
        raise InvalidInput(
            "no motion capture in the folder",
            where=f"{options.path}/{options.pattern}",
            expected="files ending in " + " ".join(formats.READERS),
            received=", ".join(sorted({p.suffix or p.name for p in files})[:5]) or "an empty folder",
        )
    try:
        pattern = re.compile(options.person)
    except re.error as error:
        raise InvalidInput(
            f"not a regular expression: {error}", where="data.person", received=options.person
        ) from None
    clips = []
    for path in readable:
        found = pattern.search(path.stem)
        person = (found.group(1) if found.groups() else found.group(0)) if found else ""
        clips.append(
            Clip(
                name=str(path.relative_to(folder)),
                person=person or path.stem,
                source="folder",
                action="",
                path=path,
                sha256=_digest(path),
                mapping=skeleton,
                frame_rate_hz=options.frame_rate_hz,
                units=options.units,
            )
        )
    return clips


def in_turn(clips: list[Clip], limit: int) -> list[Clip]:
    """At most so many clips, people taking turns, in the order given; all if there is no limit."""
    if limit <= 0 or limit >= len(clips):
        return clips
    turns: dict[str, int] = {}
    order = []
    for place, clip in enumerate(clips):
        turn = turns[clip.person] = turns.get(clip.person, -1) + 1
        order.append((turn, place))
    chosen = {place for _, place in sorted(order)[:limit]}
    return [clip for place, clip in enumerate(clips) if place in chosen]


def _first_people(clips: list[Clip], limit: int) -> list[Clip]:
    people = list(dict.fromkeys(clip.person for clip in clips))
    chosen = set(people[:limit] if limit > 0 else people)
    return [clip for clip in clips if clip.person in chosen]


def _digest(path: Path) -> str:
    """sha256 of a recording; of an AMC together with its skeleton, which it cannot be read without."""
    try:
        total = hashlib.sha256(path.read_bytes())
        if path.suffix.lower() == ".amc":
            with suppress(InvalidInput):  # without its skeleton the clip is refused when it is read, by name
                total.update(asf_amc.skeleton_of(path).read_bytes())
    except OSError as error:
        raise InvalidInput(f"cannot be read: {error.strerror}", where=str(error.filename or path)) from None
    return total.hexdigest()
