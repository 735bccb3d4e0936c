"""Which recordings a data set names, and where they are: the table of public ones, or the user's folder."""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from pipeline import fetch, formats
from pipeline.formats import acclaim
from pipeline.skeleton import MotionCapture, SourceMapping, map_joints
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Clip:
    """One recording to be ingested; `mismatch` says how it is not the one that the table lists, if it is not."""

    name: str
    person: str
    source: str
    action: str
    path: Path | None  # None: listed, but not on this machine
    sha256: str
    mapping: SourceMapping
    frame_rate_hz: float
    units: str
    mismatch: str = ""

    @property
    def identity(self) -> dict[str, Any]:
        """What an artefact made of this clip depends on; where it lies on this machine is no part of it."""
        return {**asdict(self), "path": self.path.name if self.path else None, "mapping": self.mapping}


def read_clip(clip: Clip) -> tuple[MotionCapture, np.ndarray, np.ndarray]:
    """What the file holds, and its joints: positions (T, 15, 3) mm and where they are valid (T, 15)."""
    if clip.path is None:
        raise InvalidInput("not on this machine", expected="`make data` to fetch it")
    if clip.mismatch:
        raise InvalidInput(clip.mismatch)
    if _digest(clip.path) != clip.sha256:
        raise InvalidInput("the file changed during this run", where=clip.name)
    motion = formats.read(clip.path, frame_rate_hz=clip.frame_rate_hz or None, units=clip.units or None)
    return motion, *map_joints(motion, clip.mapping)


@dataclass(frozen=True)
class Listing:
    """The table of public recordings, and where they may lie on this machine.

    Attributes
    ----------
    table : Path
        ``data/sources.csv``.
    raw : Path
        Folder that ``make data`` fills.
    mirror : Path or None
        A folder that holds the same files; read where `raw` lacks one.
    skeletons : mapping of str to SourceMapping
        By the table's skeleton column.
    same_person : sequence of sequence of str
        Subjects that are one person.
    """

    table: Path
    raw: Path
    mirror: Path | None
    skeletons: Mapping[str, SourceMapping]
    same_person: Sequence[Sequence[str]] = ()


def listed_clips(listing: Listing, sources: Sequence[str], action: str) -> tuple[list[Clip], list[Clip]]:
    """Return the clips of the table that are on this machine, in order, and those that are not, as listed.

    Parameters
    ----------
    listing : Listing
    sources : sequence of str
    action : str
        The beginning of the table's action up to a colon, or the whole of it.

    Raises
    ------
    InvalidInput
        If the table lists none, or none is on this machine.
    """
    clips = _clips_of_table(listing, sources, action)
    present = [clip for clip in clips if clip.path]
    if not present:
        raise InvalidInput(
            f"none of the {len(clips)} recordings is on this machine",
            where=str(listing.raw),
            expected="`make data` to fetch them, or data.mirror= (or MOCAP_MIRROR) naming a folder that has them",
        )
    absent = [clip for clip in clips if not clip.path]
    return sorted(present, key=lambda c: (c.source, c.person, c.name)), absent


def _clips_of_table(listing: Listing, sources: Sequence[str], action: str) -> list[Clip]:
    """Clips of the table, each of those on this machine with its digest, which reads the whole file."""
    listed = fetch.read_sources(listing.table)
    digests = {row["path"]: row["sha256"] for row in listed}
    rows = [
        row
        for row in listed
        if row["source"] in sources
        and (row["action"] == action or row["action"].startswith(f"{action}:"))
        and row["skeleton"] in listing.skeletons
    ]
    if not rows:
        raise InvalidInput(
            f"no recording of {action or 'an action without a name'} by these sources is listed",
            where=str(listing.table),
            expected=", ".join(sources),
        )
    same = {subject: group[0] for group in listing.same_person for subject in group}
    clips: list[Clip] = []
    for row in rows:
        path = fetch.resolve(row, raw=listing.raw, mirror=listing.mirror)
        clips.append(
            Clip(
                name=row["trial"],
                person=same.get(row["subject"], row["subject"]),
                source=row["source"],
                action=row["action"].partition(":")[2].strip() or row["action"],
                path=path,
                sha256=_digest(path) if path else "",
                mapping=listing.skeletons[row["skeleton"]],
                frame_rate_hz=float(row["frame_rate_hz"]),
                units="",
                mismatch=_mismatch(path, row["path"], digests) if path else "",
            )
        )
    return clips


def _mismatch(path: Path, name: str, digests: Mapping[str, str]) -> str:
    """How a file, or the skeleton read with it, differs from what the table lists as `name`; empty if not."""
    top = path.parents[len(PurePosixPath(name).parts) - 1]
    for file in _read_together(path):
        listed_as = Path(os.path.relpath(file, top)).as_posix()
        expected, received = digests.get(listed_as, ""), _sha256_of(file)
        if received != expected:
            return str(
                InvalidInput(
                    "the file is not the recording that the table lists (`make data` fetches it again)",
                    where=listed_as,
                    expected=f"sha256 {expected[:12]}…" if expected else "a file that the table lists",
                    received=f"{received[:12]}…",
                )
            )
    return ""


def folder_clips(
    path: str, pattern: str, person: str, *, skeleton: SourceMapping, frame_rate_hz: float, units: str
) -> list[Clip]:
    """Return the readable files below the user's folder.

    Parameters
    ----------
    path, pattern : str
        The folder, and the pattern of files below it.
    person : str
        Regular expression on the file's name; its first group names the person.
    skeleton : SourceMapping
    frame_rate_hz : float
        For files that do not say; 0: the file's own.
    units : str
        For files that do not say.

    Raises
    ------
    InvalidInput
        If there is no such folder, no motion capture in it, or a pattern is not one.
    """
    if not path:
        raise InvalidInput("no folder is given", expected="data.path=<folder>", received="nothing")
    folder = Path(path)
    if not folder.is_dir():
        raise InvalidInput("there is no such folder", where=path)
    try:
        files = sorted(p for p in folder.glob(pattern) if p.is_file() and not p.name.startswith("."))
    except (ValueError, NotImplementedError, IndexError):  # how glob refuses differs between Pythons
        raise InvalidInput(
            "not a pattern below the folder",
            where="data.pattern",
            expected="**/*.c3d, say",
            received=pattern,
        ) from None
    readable = [p for p in files if p.suffix.lower() in formats.READERS]
    if not readable:
        raise InvalidInput(
            "no motion capture in the folder",
            where=f"{path}/{pattern}",
            expected="files ending in " + " ".join(formats.READERS),
            received=", ".join(sorted({p.suffix or p.name for p in files})[:5]) or "an empty folder",
        )
    try:
        names = re.compile(person)
    except re.error as error:
        raise InvalidInput(
            f"not a regular expression: {error}", where="data.person", received=person
        ) from None
    clips = []
    for file in readable:
        found = names.search(file.stem)
        who = (found.group(1) if found.groups() else found.group(0)) if found else ""
        clips.append(
            Clip(
                name=str(file.relative_to(folder)),
                person=who or file.stem,
                source="folder",
                action="",
                path=file,
                sha256=_digest(file),
                mapping=skeleton,
                frame_rate_hz=frame_rate_hz,
                units=units,
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


def first_people(clips: list[Clip], limit: int) -> list[Clip]:
    """Return the clips of the first so many people; all if there is no limit."""
    people = list(dict.fromkeys(clip.person for clip in clips))
    chosen = set(people[:limit] if limit > 0 else people)
    return [clip for clip in clips if clip.person in chosen]


def _digest(path: Path) -> str:
    """sha256 of a recording; of an AMC together with its skeleton, which it cannot be read without."""
    digests = [_sha256_of(file) for file in _read_together(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def _read_together(path: Path) -> list[Path]:
    """The files that a recording is read from: itself, and of an AMC its skeleton."""
    files = [path]
    if path.suffix.lower() == ".amc":
        with suppress(InvalidInput):  # without its skeleton the clip is refused when it is read, by name
            files.append(acclaim.skeleton_of(path))
    return files


def _sha256_of(path: Path) -> str:
    """sha256 of a file, read once in a process as long as its size and time of change stay the same."""
    try:
        stat = path.stat()
        return _sha256_of_version(path, stat.st_size, stat.st_mtime_ns)
    except OSError as error:
        raise InvalidInput(f"cannot be read: {error.strerror}", where=str(error.filename or path)) from None


@functools.cache
def _sha256_of_version(path: Path, size: int, mtime_ns: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
