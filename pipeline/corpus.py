"""Which recordings a data set names, and where they are: the table of public ones, or the user's folder."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from pipeline import fetch, formats, tables
from pipeline.config import FolderData, RecordedData
from pipeline.refusal import Refusal
from pipeline.skeleton import SourceMapping


@dataclass(frozen=True)
class Clip:
    """One recording to be ingested."""

    name: str
    person: str
    source: str
    path: Path | None  # None: listed, but not on this machine
    sha256: str
    mapping: SourceMapping
    frame_rate_hz: float
    units: str


def recorded_clips(options: RecordedData) -> list[Clip]:
    """Clips of the table, people limited to the first `walkers`; last those that are not on this machine."""
    rows = [
        row
        for row in tables.read_rows(Path(options.table))
        if row["source"] in options.sources and row["action"] == options.action
    ]
    rows = [row for row in rows if row["skeleton"] in options.skeletons]
    if not rows:
        raise Refusal(
            "no recording of these sources is listed",
            where=options.table,
            expected=", ".join(options.sources),
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
                path=path,
                sha256=_digest(path) if path else "",
                mapping=options.skeletons[row["skeleton"]],
                frame_rate_hz=float(row["frame_rate_hz"]),
                units="",
            )
        )
    present = [clip for clip in clips if clip.path]
    if not present:
        raise Refusal(
            f"none of the {len(rows)} recordings is on this machine",
            where=options.raw,
            expected="`make data` to fetch them, or data.mirror= (or MOCAP_MIRROR) naming a folder that has them",
        )
    present.sort(key=lambda c: (c.source, c.person, c.name))
    return _first_people(present, options.walkers) + [clip for clip in clips if not clip.path]


def folder_clips(options: FolderData, skeleton: SourceMapping) -> list[Clip]:
    """Readable files below the user's folder."""
    if not options.path:
        raise Refusal("no folder is given", expected="data.path=<folder>", received="nothing")
    folder = Path(options.path)
    if not folder.is_dir():
        raise Refusal("there is no such folder", where=options.path)
    try:
        files = sorted(p for p in folder.glob(options.pattern) if p.is_file() and not p.name.startswith("."))
    except (ValueError, NotImplementedError, IndexError):  # how glob refuses differs between Pythons
        raise Refusal(
            "not a pattern below the folder",
            where="data.pattern",
            expected="**/*.c3d, say",
            received=options.pattern,
        ) from None
    readable = [p for p in files if p.suffix.lower() in formats.READERS]
    if not readable:
        raise Refusal(
            "no motion capture in the folder",
            where=f"{options.path}/{options.pattern}",
            expected="files ending in " + " ".join(formats.READERS),
            received=", ".join(sorted({p.suffix or p.name for p in files})[:5]) or "an empty folder",
        )
    try:
        pattern = re.compile(options.person)
    except re.error as error:
        raise Refusal(
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
                path=path,
                sha256=_digest(path),
                mapping=skeleton,
                frame_rate_hz=options.frame_rate_hz,
                units=options.units,
            )
        )
    return _first_people(clips, options.walkers)


def _first_people(clips: list[Clip], limit: int) -> list[Clip]:
    people = list(dict.fromkeys(clip.person for clip in clips))
    chosen = set(people[:limit] if limit > 0 else people)
    return [clip for clip in clips if clip.person in chosen]


def _digest(path: Path) -> str:
    """sha256 of a recording; of an AMC together with the skeletons beside it, which it cannot be read without."""
    try:
        total = hashlib.sha256(path.read_bytes())
        if path.suffix.lower() == ".amc":
            for skeleton in sorted(path.parent.glob("*.[aA][sS][fF]")):
                total.update(skeleton.read_bytes())
    except OSError as error:
        raise Refusal(f"cannot be read: {error.strerror}", where=str(error.filename or path)) from None
    return total.hexdigest()
