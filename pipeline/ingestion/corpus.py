"""Recordings that a data set names: those of the table of public recordings, or of the user's folder."""

from __future__ import annotations

import fnmatch
import functools
import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from pipeline import fetch, formats, mappings
from pipeline.formats import acclaim
from pipeline.formats.points.csv import bids
from pipeline.resources import DATA
from pipeline.skeleton.complaint import Remark
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.validation import InvalidInput

MOST_TRIED = 10
"""Other recordings of a person that are tried where none is named a static trial."""

_NAMED = re.compile(
    r"static|standing|calib|(?<![a-z])(stand|stat|cal|neutral|[tna][-_ ]?pose)(?![a-z])", re.IGNORECASE
)

_NO_FAULT = Remark("")
_UNPRINTABLE = Remark("the file's name contains unprintable characters: rename it", "unprintable_name")
_NOBODY = Remark("data.person finds nobody in the file's name", "unclear_person")


@dataclass(frozen=True)
class Clip:
    """One recording to be ingested.

    Attributes
    ----------
    name, person, source, action : str
    path : Path or None
        None if the file is listed but not on this machine.
    sha256 : str
        Digest of the file (an AMC with its ASF) when it was found; empty if it is not on this machine.
    mapping : SourceMapping or None
        None: the one that ships and fits best.
    frame_rate_hz : float
        0: the file's own.
    units : str
        Empty: the file's own.
    subject : str
        Who, in a file of several people.
    mismatch : Remark
        Why the file is not the recording that the table lists; empty if it is.
    statics : tuple of Path
        What may be its static trial, for markers that it lacks.
    up : UpAxis
        ``auto``: the axis along which its joints stand.
    """

    name: str
    person: str
    source: str
    action: str
    path: Path | None
    sha256: str
    mapping: SourceMapping | None
    frame_rate_hz: float
    units: str
    mismatch: Remark = _NO_FAULT
    subject: str = ""
    statics: tuple[Path, ...] = ()
    up: UpAxis = UpAxis.auto

    @property
    def identity(self) -> dict[str, Any]:
        """What an artefact made of this clip depends on, which the folder of the file is not."""
        mapping = self.mapping or mappings.shipped()
        return {
            **asdict(self),
            "path": self.path.name if self.path else None,
            "mapping": mapping,
            "statics": [digest(path) for path in self.statics],
        }


@dataclass(frozen=True)
class Listing:
    """The table of public recordings and the folders that may hold them.

    Attributes
    ----------
    table : Path
        ``data/sources.csv``.
    raw : Path
        Folder of ``make data``.
    mirror : sequence of Path
        Folders of the same files, used for those that `raw` lacks.
    skeletons : mapping of str to SourceMapping
        By the table's skeleton column.
    same_person : sequence of sequence of str
        Subjects that are one person.
    """

    table: Path
    raw: Path
    mirror: Sequence[Path]
    skeletons: Mapping[str, SourceMapping]
    same_person: Sequence[Sequence[str]] = ()


def listing_table(named: str) -> Path:
    """Return the table of recordings: the one named, or where there is none, the one of the package."""
    table = Path(named)
    return table if table.is_file() or table.parent != Path("data") else DATA / table.name


def mirror_folders(mirror: str) -> list[Path]:
    """Return the folders of the mirror, which are separated as in PATH."""
    return [Path(folder) for folder in mirror.split(os.pathsep) if folder]


def listed_clips(listing: Listing, sources: Sequence[str], action: str) -> tuple[list[Clip], list[Clip]]:
    """Return the clips of the table that are on this machine, in order, and those that are not, as listed.

    Parameters
    ----------
    listing : Listing
    sources : sequence of str
        Names, or patterns of them.
    action : str
        The beginning of the table's action up to a colon, or the whole of it.

    Raises
    ------
    InvalidInput
        If the table lists none, or none is on this machine.
    """
    listed = fetch.read_sources(listing.table)
    digests = {row["path"]: row["sha256"] for row in listed}
    rows = [
        row
        for row in listed
        if any(fnmatch.fnmatchcase(row["source"], source) for source in sources)
        and (row["action"] == action or row["action"].startswith(f"{action}:"))
        and row["skeleton"] in listing.skeletons
    ]
    if not rows:
        raise InvalidInput(
            f"no recording of {action or 'an action without a name'} by these sources is listed",
            listing.table,
            ", ".join(sources),
            code="nothing_listed",
        )
    same = {subject: group[0] for group in listing.same_person for subject in group}
    paths = [fetch.resolve(row, raw=listing.raw, mirror=listing.mirror) for row in rows]
    clips = [
        Clip(
            name=row["trial"],
            person=same.get(row["subject"], row["subject"]),
            source=row["source"],
            action=row["action"].partition(":")[2].strip() or row["action"],
            path=path,
            sha256=digest(path) if path else "",
            mapping=listing.skeletons[row["skeleton"]],
            frame_rate_hz=float(row["frame_rate_hz"]),
            units="",
            mismatch=_mismatch(path, row["path"], digests) if path else _NO_FAULT,
        )
        for row, path in zip(rows, paths, strict=True)
    ]
    present = [clip for clip in clips if clip.path]
    if not present:
        raise InvalidInput(
            f"none of the {len(clips)} recordings is on this machine",
            listing.raw,
            "`make data` to fetch them, or data.mirror= (or MOCAP_MIRROR) naming a folder that has them",
            code="not_fetched",
        )
    absent = [clip for clip in clips if not clip.path]
    return sorted(present, key=lambda c: (c.source, c.person, c.name)), absent


def _mismatch(path: Path, name: str, digests: Mapping[str, str]) -> Remark:
    """Return how a file, or the skeleton read with it, differs from what the table lists; empty if it does not."""
    top = path.parents[len(PurePosixPath(name).parts) - 1]
    for file in _read_together(path):
        listed_as = Path(os.path.relpath(file, top)).as_posix()
        expected, received = digests.get(listed_as, ""), file_digest(file)
        if received != expected:
            sentence = str(
                InvalidInput(
                    "the file is not the recording that the table lists (`make data` fetches it again)",
                    listed_as,
                    f"sha256 {expected[:12]}…" if expected else "a file that the table lists",
                    f"{received[:12]}…",
                )
            )
            return Remark(sentence, "another_file")
    return _NO_FAULT


def folder_clips(
    path: str,
    pattern: str,
    person: str,
    *,
    skeleton: SourceMapping | None = None,
    frame_rate_hz: float = 0.0,
    units: str = "",
    subject: str = "",
    up: UpAxis = UpAxis.auto,
    source: str = "folder",
) -> list[Clip]:
    """Return the readable files below the user's folder.

    Parameters
    ----------
    path, pattern : str
        The folder, and the pattern of files below it.
    person : str
        Regular expression on the file's name, or on its path below the folder if there is a / in it; its first group
        names the person.
    skeleton : SourceMapping or None
        None: for each file the one that ships and fits best.
    frame_rate_hz : float
        For files that do not say; 0: the file's own.
    units : str
        For files that do not say.
    subject : str
        Who, in files of several people.
    up : UpAxis
        Axis that points up; ``auto``: for each file the one along which its joints stand.
    source : str
        Name of the laboratory.

    Raises
    ------
    InvalidInput
        If there is no such folder, no motion capture in it, or a pattern is not one.
    """
    folder = Path(path)
    if not path or not folder.is_dir():
        expected = "the folder of the recordings; data.pattern=NAME chooses among them"
        raise InvalidInput(
            "must be a folder that exists", "data.path", expected, path or "nothing", code="no_folder"
        )
    try:
        files = sorted(p for p in folder.glob(pattern) if p.is_file() and not p.name.startswith("."))
    except (ValueError, NotImplementedError, IndexError):  # how glob refuses differs between Pythons
        wrong = "must be a pattern such as **/*.c3d"
        raise InvalidInput(wrong, "data.pattern", received=pattern, code="bad_pattern", typed=True) from None
    readable = [p for p in files if formats.is_recording(p)]
    if not readable:
        raise InvalidInput(
            "no motion capture in the folder",
            f"{path}/{pattern}",
            "files ending in " + " ".join(formats.READERS),
            ", ".join(sorted({p.suffix or p.name for p in files})[:5]) or "an empty folder",
            code="no_recordings",
        )
    try:
        names = re.compile(person)
    except re.error as error:
        wrong = f"not a regular expression: {error}"
        raise InvalidInput(wrong, "data.person", received=person, code="bad_pattern", typed=True) from None
    clips = []
    for file in readable:
        name = file.relative_to(folder).as_posix()
        found = names.search(name if "/" in person else file.stem)
        who = found.group(1 if found.groups() else 0) if found else ""
        # What a table cannot hold: bytes that are no UTF-8, line breaks and other control characters.
        plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
        who = "" if plain != name else who
        clips.append(
            Clip(
                name=plain,
                person=who or PurePosixPath(plain).stem,
                source=source,
                action="",
                path=file,
                sha256=digest(file),
                mapping=skeleton,
                frame_rate_hz=frame_rate_hz,
                units=units,
                subject=subject,
                up=up,
                mismatch=_UNPRINTABLE if plain != name else _NO_FAULT if found else _NOBODY,
            )
        )
    statics = static_trials({clip.path: clip.person for clip in clips if clip.path})
    return [replace(clip, statics=statics[clip.path]) for clip in clips if clip.path]


def static_trials(files: Mapping[Path, str]) -> dict[Path, tuple[Path, ...]]:
    """Return for each recording those that may be its static trial.

    Parameters
    ----------
    files : mapping of Path to str
        Recordings, and whom each shows.

    Returns
    -------
    dict
        Files of the same person that are named so, and those of the same folder that name nobody (``static.c3d``);
        without any, the first `MOST_TRIED` others of the person.
    """
    of_person: dict[str, list[Path]] = {}
    of_folder: dict[Path, list[Path]] = {}
    for path, who in files.items():
        of_person.setdefault(who, []).append(path)
        if _NAMED.match(who):
            of_folder.setdefault(path.parent, []).append(path)
    found = {}
    for path, who in files.items():
        others = [other for other in of_person[who] if other != path]
        named = [other for other in others if _NAMED.search(other.stem)]
        named += [other for other in of_folder.get(path.parent, []) if other not in (path, *named)]
        found[path] = tuple(named or others[:MOST_TRIED])
    return found


def digest(path: Path) -> str:
    """Return the sha256 of a recording; of an AMC, of it and its skeleton."""
    digests = [file_digest(file) for file in _read_together(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def _read_together(path: Path) -> list[Path]:
    """Return the files that a recording is read from: itself and, for an AMC, its skeleton, for BIDS, its titles."""
    files = [path, *bids.beside(path)]
    if path.suffix.lower() == ".amc":
        with suppress(InvalidInput):  # a missing skeleton is refused when the clip is read
            files.append(acclaim.skeleton_of(path))
    return files


def file_digest(path: Path) -> str:
    """Return the sha256 of a file, cached by its size and time of change."""
    try:
        stat = path.stat()
        return _sha256_of_version(path, stat.st_size, stat.st_mtime_ns)
    except OSError as error:
        raise InvalidInput(
            f"cannot be read: {error.strerror}", error.filename or path, code="unreadable"
        ) from None


@functools.cache
def _sha256_of_version(path: Path, size: int, mtime_ns: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
