"""Acclaim motions (AMC): joint angles in, positions of bone ends out, by the skeleton (ASF) beside them.

The conventions are those of `pipeline.formats.acclaim.asf`; the root's translation is in the skeleton's unit of
length.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from pipeline.formats.acclaim.asf import SHIFTS, AsfSkeleton, forward_kinematics, read_skeleton
from pipeline.formats.acclaim.sections import text_without_comments
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, motion_capture
from pipeline.formats.text import read_numbers
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import require_range

FRAME_RATE_HZ = 120.0
"""Frame rate of the public recordings in this format, which does not state it."""

_FRAME_NUMBER = re.compile(r"^[ \t]*(\d{1,9})[ \t]*$", re.MULTILINE)


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read positions of the bone ends from an AMC file and its skeleton, in the file's axes.

    Parameters
    ----------
    path : str or Path
        The motion (.amc); `skeleton_of` says which skeleton belongs to it.
    frame_rate_hz : float, optional
        Frames per second; `FRAME_RATE_HZ` if not given.
    units : str, optional
        Unit of length to use in place of the skeleton's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Returns
    -------
    MotionCapture
        Points: ``root``, then the bones as the skeleton lists them.  A NaN in the file makes the points that depend
        on it invalid, and is noted.

    Raises
    ------
    InvalidInput
        If either file is missing, cut short or contradicts itself or the other.
    """
    path = Path(path)
    rate = FRAME_RATE_HZ if frame_rate_hz is None else frame_rate_hz
    require_range(f"{path.name}, option frame_rate_hz", rate, above=0, unit="Hz")
    text, notes = text_without_comments(path)
    skeleton = read_skeleton(skeleton_of(path), units=units)
    first = _FRAME_NUMBER.search(text)
    if first is None:
        raise damaged("no frame found", path.name, "an AMC motion with numbered frames")
    radians = _header(text[: first.start()], skeleton.radians, path.name, notes)
    body = text[first.start() :]
    layout = _layout(body, skeleton, path.name)
    numbers, columns = _columns_by_line(body, layout, path.name)
    start = _check_numbering(numbers, path.name)
    values = _values(columns, layout, start, path.name)
    require_points(len(values), len(skeleton.names), path.name)
    if start != 1:
        notes.append(f"Frames are numbered from {start}.")

    # The motion lists its bones in any order: its columns are put in the skeleton's order for the kinematics.
    written = [f"{name}.{freedom}" for name, freedoms in layout for freedom in freedoms]
    at = {channel: c for c, channel in enumerate(written)}
    angles = values[:, [at[channel] for channel in skeleton.channels]] * radians
    root_mm = np.zeros((len(values), 3))
    for axis, shift in enumerate(SHIFTS):
        if f"root.{shift}" in at:
            root_mm[:, axis] = values[:, at[f"root.{shift}"]] * skeleton.millimetres
    return motion_capture(
        skeleton.names,
        forward_kinematics(skeleton, angles, root_mm),
        rate,
        skeleton.units,
        notes,
        of_angles=True,
    )


def skeleton_of(path: Path) -> Path:
    """Find the skeleton (.asf) of a motion (.amc): in its folder, one folder up, or in ``asf/`` beside its folder.

    It is the only one there, or the one whose name is the longest beginning of the motion's name (``16.asf`` for
    ``16_11.amc``).  In ``asf/`` its name begins with the same number (``07-walk.asf`` for ``07_01-walk.amc``).

    Raises
    ------
    InvalidInput
        If there is none, several may be meant, or a folder cannot be read.
    """
    found: list[Path] = []
    beside = path.parent.parent / "asf"
    for folder in (path.parent, path.parent.parent, beside):
        try:
            if folder is beside and not folder.is_dir():
                continue
            found = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".asf")
        except OSError as error:
            what, received = "the folder of its skeleton cannot be read", error.strerror or ""
            raise damaged(what, path.name, received=received) from None
        if folder is beside:  # which holds the skeletons of everybody
            found = [p for p in found if _number(p) == _number(path)]
        if found:
            break
    if len(found) > 1:
        begins = [p for p in found if path.stem.lower().startswith(p.stem.lower())]
        longest = max((len(p.stem) for p in begins), default=0)
        found = [p for p in begins if len(p.stem) == longest] or found
    if len(found) != 1:
        names, expected = (
            ", ".join(p.name for p in found) or "none",
            "one .asf beside it, one folder up or in asf/",
        )
        raise damaged("the skeleton of this motion is not clear", path.name, expected, names)
    return found[0]


def _number(path: Path) -> str:
    """The number that a name begins with, empty if there is none."""
    return path.stem[: len(path.stem) - len(path.stem.lstrip("0123456789"))].lstrip("0")


def _header(header: str, radians: float, where: str, notes: list[str]) -> float:
    """Radians in one unit of angle of the motion; lines that are not used are noted."""
    for line in filter(None, map(str.strip, header.split("\n"))):
        if not line.startswith(":"):
            expected = ":FULLY-SPECIFIED, :DEGREES, then the number of a frame"
            raise damaged("the header has a line that is no keyword", where, expected, f"{line!r:.40}")
        keyword = line.upper()
        if keyword in (":DEGREES", ":RADIANS"):
            radians = np.pi / 180 if keyword == ":DEGREES" else 1.0
        elif keyword != ":FULLY-SPECIFIED":
            notes.append(f"The header line {line!r} is not used.")
    return radians


_Layout = list[tuple[str, tuple[str, ...]]]


def _layout(body: str, skeleton: AsfSkeleton, where: str) -> _Layout:
    """Bones (as the skeleton spells them) and their degrees of freedom, in the order of the first frame."""
    start = _FRAME_NUMBER.match(body)
    assert start is not None  # `body` begins with the line that this expression found
    end = _FRAME_NUMBER.search(body, start.end())
    place = f"{where}, frame {start[1]}"
    known = {name.lower(): p for p, name in enumerate(skeleton.names)}
    layout: _Layout = []
    for line in body[start.end() : end.start() if end else len(body)].split("\n"):
        if words := line.split():
            p = known.get(words[0].lower())
            if p is None:
                raise damaged("the skeleton has no such bone", place, received=f"{words[0]!r:.40}")
            layout.append((skeleton.names[p], skeleton.freedoms[p]))
    names = [name for name, _ in layout]
    for name, freedoms in zip(skeleton.names, skeleton.freedoms, strict=True):
        if names.count(name) > 1 or (freedoms and name not in names):
            raise damaged(
                "a bone is missing or stands twice", place, f"one line for {name}", names.count(name)
            )
    return layout


def _columns_by_line(body: str, layout: _Layout, where: str) -> tuple[list[str], list[list[str]]]:
    """Frame numbers and one column of words per channel, line by line: bones in any order."""
    bones = {name.lower(): (name, len(freedoms)) for name, freedoms in layout}
    numbers: list[str] = []
    frames: list[dict[str, list[str]]] = []
    for line in body.split("\n"):
        words = line.split()
        if not words:
            continue
        if _FRAME_NUMBER.fullmatch(line):
            numbers.append(words[0])
            frames.append({})
            continue
        place = f"{where}, frame {numbers[-1]}"
        if words[0].lower() not in bones:
            raise damaged("no such bone in the first frame", place, received=f"{words[0]!r:.40}")
        name, width = bones[words[0].lower()]
        if name in frames[-1]:
            raise damaged("a bone stands twice", f"{place}, bone {name}")
        if len(words) != 1 + width:
            place += f", bone {name}"
            raise damaged("a bone has a wrong number of values", place, width, len(words) - 1)
        frames[-1][name] = words[1:]
    for number, frame in zip(numbers, frames, strict=True):
        missing = [name for name, _ in layout if name not in frame]
        if missing:
            what = "the file is cut short" if frame is frames[-1] else "the frame is not whole"
            raise damaged(f"{what}: a bone is missing", f"{where}, frame {number}, bone {missing[0]}")
    return numbers, [
        [frame[name][k] for frame in frames] for name, freedoms in layout for k in range(len(freedoms))
    ]


def _check_numbering(words: list[str], where: str) -> int:
    """Return the first frame's number.  Raises InvalidInput if frames are missing or repeated."""
    numbers = [int(word) for word in words]
    for before, after in itertools.pairwise(numbers):
        if after != before + 1:
            place = f"{where}, after frame {before}"
            raise damaged("frames are missing or repeated", place, before + 1, after)
    return numbers[0]


def _values(columns: list[list[str]], layout: _Layout, start: int, where: str) -> np.ndarray:
    """(T, C) float64 from columns of words; NaN stays."""
    labels = [f"bone {name}, {freedom}" for name, freedoms in layout for freedom in freedoms]
    if not labels:
        raise damaged("nothing moves: the skeleton has no degrees of freedom", where)
    frames = len(columns[0])

    def place(n: int) -> str:
        return f"{where}, frame {start + n % frames}, {labels[n // frames]}"

    return read_numbers(list(itertools.chain(*columns)), place).reshape(-1, frames).T
