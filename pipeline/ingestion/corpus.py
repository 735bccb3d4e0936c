"""Recordings of a data set, from the table of public recordings or from a user's folder."""

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

MAX_STATIC_CANDIDATES = 10
"""Largest number of other recordings of a person that are tried if no file name suggests a static trial."""

_STATIC = re.compile(
    r"static|standing|calib|(?<![a-z])(stand|stat|cal|neutral|[tna][-_ ]?pose)(?![a-z])", re.IGNORECASE
)
"""Pattern of words in a file name that suggest a static trial."""

_NO_FAULT = Remark("")
_UNPRINTABLE = Remark("the file name contains unprintable characters: rename the file", "unprintable_name")
_NO_PERSON = Remark("data.person does not match the file name", "unclear_person")


@dataclass(frozen=True)
class Clip:
    """Recording of a data set, before it is read.

    Attributes
    ----------
    name, person, source, action : str
    path : Path or None
        Path of the file; None if the file is listed but not available on this machine.
    sha256 : str
        Digest of the file (of an AMC with its ASF) when it was listed; empty if the file is not available.
    mapping : SourceMapping or None
        Mapping of its points to joints; None for the best shipped one.
    frame_rate_hz : float
        Frames per second, if the file does not state them; 0 if not given.
    units : str
        Unit of length, if the file does not state it; empty if not given.
    subject : str
        Person to read, in a file with several people.
    mismatch : Remark
        Difference of the file from the listed recording; empty if they are equal.
    statics : tuple of Path
        Candidates for its static trial, which may add missing markers.
    up : UpAxis
        Axis that points up; ``auto`` to infer it from the upright body.
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
        """Values that identify this clip in the cache; they do not include the folder of the file."""
        mapping = self.mapping or mappings.shipped()
        return {
            **asdict(self),
            "path": self.path.name if self.path else None,
            "mapping": mapping,
            "statics": [digest(path) for path in self.statics],
        }


@dataclass(frozen=True)
class Listing:
    """Table of public recordings, and the folders that may contain the files.

    Attributes
    ----------
    table : Path
        Path of the table, ``data/sources.csv`` by default.
    raw : Path
        Folder to which ``make data`` downloads.
    mirror : sequence of Path
        Folders with copies of the files, for files that `raw` lacks.
    skeletons : mapping of str to SourceMapping
        Mappings, by the skeleton column of the table.
    same_person : sequence of sequence of str
        Groups of subjects that are the same person.
    """

    table: Path
    raw: Path
    mirror: Sequence[Path]
    skeletons: Mapping[str, SourceMapping]
    same_person: Sequence[Sequence[str]] = ()


def listing_table(option: str) -> Path:
    """Return the path of the table of recordings: the option's path, or the packaged table if it does not exist."""
    table = Path(option)
    return table if table.is_file() or table.parent != Path("data") else DATA / table.name


def mirror_folders(mirror: str) -> list[Path]:
    """Return the folders in the option `mirror`, which are separated as in the variable PATH."""
    return [Path(folder) for folder in mirror.split(os.pathsep) if folder]


def listed_clips(listing: Listing, sources: Sequence[str], action: str) -> tuple[list[Clip], list[Clip]]:
    """Return the clips available on this machine, sorted, and the unavailable clips in the table's order.

    Parameters
    ----------
    listing : Listing
    sources : sequence of str
        Names of sources, or patterns.
    action : str
        Action in the table, complete or up to a colon.

    Raises
    ------
    InvalidInput
        If the table lists no such clip, or none is available.
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
            f"the table lists no recording of {action or 'an action without a name'} from the selected sources",
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
            f"none of the {len(clips)} recordings is available on this machine: run `make data` to fetch them,"
            " or name their folder in data.mirror= or MOCAP_MIRROR",
            listing.raw,
            code="not_fetched",
        )
    absent = [clip for clip in clips if not clip.path]
    return sorted(present, key=lambda c: (c.source, c.person, c.name)), absent


def _mismatch(path: Path, name: str, digests: Mapping[str, str]) -> Remark:
    """Return a remark if a recording, or a file read with it, differs from the table; otherwise an empty remark."""
    top = path.parents[len(PurePosixPath(name).parts) - 1]
    for file in _read_together(path):
        listed_as = Path(os.path.relpath(file, top)).as_posix()
        expected, received = digests.get(listed_as, ""), file_digest(file)
        if received != expected:
            sentence = str(
                InvalidInput(
                    "the file differs from the table of recordings: run `make data` to fetch it again",
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
    """Return the recordings in a user's folder and its subfolders.

    Parameters
    ----------
    path, pattern : str
        Folder, and pattern of the file names in it.
    person : str
        Regular expression for the file name, or for the path below the folder if it contains a slash.  Its first group
        is the person.
    skeleton : SourceMapping or None
        Mapping of the points; None for the best shipped one of each file.
    frame_rate_hz : float
        Frames per second for files that do not state them; 0 if not given.
    units : str
        Unit of length for files that do not state it.
    subject : str
        Person to read, in files with several people.
    up : UpAxis
        Axis that points up; ``auto`` to infer it for each file.
    source : str
        Name of the laboratory.

    Raises
    ------
    InvalidInput
        If the folder does not exist or has no motion capture files, or a pattern is invalid.
    """
    folder = Path(path)
    if not path or not folder.is_dir():
        expected = "the folder of the recordings; data.pattern=NAME selects files in it"
        raise InvalidInput(
            "must be an existing folder", "data.path", expected, path or "nothing", code="no_folder"
        )
    try:
        files = sorted(p for p in folder.glob(pattern) if p.is_file() and not p.name.startswith("."))
    except (ValueError, NotImplementedError, IndexError):  # the error of glob depends on the Python version
        message = "must be a pattern such as **/*.c3d"
        raise InvalidInput(
            message, "data.pattern", received=pattern, code="bad_pattern", typed=True
        ) from None
    readable = [p for p in files if formats.is_recording(p)]
    if not readable:
        raise InvalidInput(
            "the folder has no motion capture files",
            f"{path}/{pattern}",
            "files ending in " + " ".join(formats.READERS),
            ", ".join(sorted({p.suffix or p.name for p in files})[:5]) or "an empty folder",
            code="no_recordings",
        )
    try:
        names = re.compile(person)
    except re.error as error:
        message = f"not a regular expression: {error}"
        raise InvalidInput(message, "data.person", received=person, code="bad_pattern", typed=True) from None
    clips = []
    for file in readable:
        name = file.relative_to(folder).as_posix()
        match = names.search(name if "/" in person else file.stem)
        subject_name = match.group(1 if match.groups() else 0) if match else ""
        # Tables cannot store bytes that are not UTF-8, line breaks and other control characters.
        plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
        subject_name = "" if plain != name else subject_name
        clips.append(
            Clip(
                name=plain,
                person=subject_name or PurePosixPath(plain).stem,
                source=source,
                action="",
                path=file,
                sha256=digest(file),
                mapping=skeleton,
                frame_rate_hz=frame_rate_hz,
                units=units,
                subject=subject,
                up=up,
                mismatch=_UNPRINTABLE if plain != name else _NO_FAULT if match else _NO_PERSON,
            )
        )
    statics = static_trials({clip.path: clip.person for clip in clips if clip.path})
    return [replace(clip, statics=statics[clip.path]) for clip in clips if clip.path]


def static_trials(files: Mapping[Path, str]) -> dict[Path, tuple[Path, ...]]:
    """Return, for each recording, the files that may be its static trial.

    Parameters
    ----------
    files : mapping of Path to str
        Recordings, and the person in each.

    Returns
    -------
    dict
        Files of the same person with a name such as ``static``, and such files of the folder without a person's name
        (``static.c3d``).  Without any, the first `MAX_STATIC_CANDIDATES` other files of the person.
    """
    files_by_person: dict[str, list[Path]] = {}
    static_by_folder: dict[Path, list[Path]] = {}
    for path, person in files.items():
        files_by_person.setdefault(person, []).append(path)
        if _STATIC.match(person):
            static_by_folder.setdefault(path.parent, []).append(path)
    candidates = {}
    for path, person in files.items():
        others = [other for other in files_by_person[person] if other != path]
        statics = [other for other in others if _STATIC.search(other.stem)]
        statics += [other for other in static_by_folder.get(path.parent, []) if other not in (path, *statics)]
        candidates[path] = tuple(statics or others[:MAX_STATIC_CANDIDATES])
    return candidates


def digest(path: Path) -> str:
    """Return the sha256 of a recording, including all files that are read together with it."""
    digests = [file_digest(file) for file in _read_together(path)]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def _read_together(path: Path) -> list[Path]:
    """Return the files of a recording: the file itself, the skeleton of an AMC file, the sidecar files of BIDS."""
    files = [path, *bids.sidecar_files(path)]
    if path.suffix.lower() == ".amc":
        with suppress(InvalidInput):  # a missing skeleton raises when the clip is read
            files.append(acclaim.skeleton_of(path))
    return files


def file_digest(path: Path) -> str:
    """Return the sha256 of a file, cached by size and modification time."""
    try:
        stat = path.stat()
        return _sha256_of_version(path, stat.st_size, stat.st_mtime_ns)
    except OSError as error:
        raise InvalidInput(
            f"the file cannot be read: {error.strerror}", error.filename or path, code="unreadable"
        ) from None


@functools.cache
def _sha256_of_version(path: Path, size: int, mtime_ns: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
