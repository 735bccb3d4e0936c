"""Acclaim motions (AMC): joint angles in, positions of bone ends out, by the skeleton beside them.

The conventions are those of `pipeline.formats.asf`; the root's translation is in the skeleton's unit of length.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from pipeline.formats.acclaim.asf import SHIFTS, TURNS, AsfSkeleton, forward_kinematics, read_skeleton
from pipeline.formats.acclaim.sections import text_without_comments
from pipeline.formats.text import LARGEST, is_number, parse_numbers
from pipeline.skeleton import MotionCapture
from pipeline.validation import InvalidInput

_FRAME_NUMBER = re.compile(r"^[ \t]*(\d{1,9})[ \t]*$", re.MULTILINE)


def read(
    path: str | Path,
    *,
    skeleton_path: str | Path | None = None,
    frame_rate_hz: float = 120.0,
    units: str | None = None,
) -> MotionCapture:
    """Positions of the bone ends in an AMC file, in the file's axes.

    Parameters
    ----------
    path : str or Path
        The motion (.amc).
    skeleton_path : str or Path, optional
        The skeleton (.asf).  By default the one beside the motion, or else one folder up: the only one, or the
        one whose name is the longest beginning of the motion's name (``16.asf`` for ``16_11.amc``).
    frame_rate_hz : float
        The format does not state it.
    units : str, optional
        Unit of length to use in place of the skeleton's own, e.g. ``"cm"`` or ``"in/0.45"``.

    Returns
    -------
    MotionCapture
        Points ``root`` and the bones as the skeleton lists them; `channels` in the order in which the motion
        lists them, angles as written (converted to degrees if in radians), root translation left out
        because it is the position of ``root``.  A NaN in the file makes the points that depend on it
        invalid, and is noted.

    Raises
    ------
    InvalidInput
        If either file is missing, cut short or contradicts itself or the other.
    """
    path = Path(path)
    if not (np.isfinite(frame_rate_hz) and frame_rate_hz > 0):
        raise InvalidInput(
            "the frame rate is not positive", where=path.name, expected="hertz", received=str(frame_rate_hz)
        )
    skeleton = read_skeleton(skeleton_path or skeleton_of(path), units=units)
    text = text_without_comments(path)
    first = _FRAME_NUMBER.search(text)
    if first is None:
        raise InvalidInput("no frame found", where=path.name, expected="an AMC motion with numbered frames")
    radians, notes = _header(text[: first.start()], skeleton.radians, path.name)
    body = text[first.start() :]
    layout = _layout(body, skeleton, path.name)
    found = _columns_at_fixed_places(body, layout) or _columns_by_line(body, layout, path.name)
    numbers, columns = found
    start = _check_numbering(numbers, path.name)
    values = _values(columns, layout, start, path.name)
    if start != 1:
        notes.append(f"Frames are numbered from {start}.")
    if not text.endswith("\n"):
        notes.append("The file does not end with a line break; its last number may have been cut short.")

    # The motion lists its bones in any order: its columns are put in the skeleton's order for the kinematics.
    written = [f"{name}.{freedom}" for name, freedoms in layout for freedom in freedoms]
    at = {channel: c for c, channel in enumerate(written)}
    angles = values[:, [at[channel] for channel in skeleton.channels]] * radians
    root_mm = np.zeros((len(values), 3))
    for axis, shift in enumerate(SHIFTS):
        if f"root.{shift}" in at:
            root_mm[:, axis] = values[:, at[f"root.{shift}"]] * skeleton.millimetres
    positions = forward_kinematics(skeleton, angles, root_mm)
    valid = np.isfinite(positions).all(axis=-1)
    if not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(f"{gaps} of {len(values)} frames have NaN; the points that depend on them are invalid.")
    positions[~valid] = np.nan
    turns = [c for c, channel in enumerate(written) if channel[-2:] in TURNS]
    return MotionCapture(
        names=skeleton.names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=float(frame_rate_hz),
        units=skeleton.units,
        channels=tuple(written[c] for c in turns),
        angles_deg=values[:, turns] * (1.0 if radians == np.pi / 180 else np.degrees(radians)),
        notes=tuple(notes),
    )


def skeleton_of(path: Path) -> Path:
    """The skeleton that belongs to a motion: in its folder, or else one folder up.

    Parameters
    ----------
    path : Path
        The motion (.amc).

    Raises
    ------
    InvalidInput
        If there is none, several may be meant, or a folder cannot be read.
    """
    found: list[Path] = []
    for folder in (path.parent, path.parent.parent):
        try:
            found = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".asf")
        except OSError as error:
            raise InvalidInput("the folder cannot be read", where=str(folder), received=str(error)) from None
        if found:
            break
    if len(found) > 1:
        begins = [p for p in found if path.stem.lower().startswith(p.stem.lower())]
        longest = max((len(p.stem) for p in begins), default=0)
        found = [p for p in begins if len(p.stem) == longest] or found
    if len(found) != 1:
        raise InvalidInput(
            "the skeleton of this motion is not clear",
            where=path.name,
            expected="one .asf beside it or one folder up, or `skeleton_path`",
            received=", ".join(p.name for p in found) or "none",
        )
    return found[0]


def _header(header: str, radians: float, where: str) -> tuple[float, list[str]]:
    """Radians in one unit of angle of the motion, and notes on lines that are not used."""
    notes = []
    for line in filter(None, map(str.strip, header.split("\n"))):
        if not line.startswith(":"):
            raise InvalidInput(
                "the header has a line that is no keyword",
                where=where,
                expected=":FULLY-SPECIFIED, :DEGREES, then the frame's number",
                received=repr(line[:40]),
            )
        keyword = line.upper()
        if keyword in (":DEGREES", ":RADIANS"):
            radians = np.pi / 180 if keyword == ":DEGREES" else 1.0
        elif keyword != ":FULLY-SPECIFIED":
            notes.append(f"The header line {line!r} is not used.")
    return radians, notes


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
                raise InvalidInput("the skeleton has no such bone", where=place, received=repr(words[0][:40]))
            layout.append((skeleton.names[p], skeleton.freedoms[p]))
    names = [name for name, _ in layout]
    for name, freedoms in zip(skeleton.names, skeleton.freedoms, strict=True):
        if names.count(name) > 1 or (freedoms and name not in names):
            raise InvalidInput(
                "a bone is missing or stands twice",
                where=place,
                expected=f"one line for {name}",
                received=str(names.count(name)),
            )
    return layout


def _columns_at_fixed_places(body: str, layout: _Layout) -> tuple[list[str], list[list[str]]] | None:
    """Frame numbers and one column of words per channel, if every frame is built like the first; else None.

    The words of all frames are sliced by column, several times faster than a walk by line.
    """
    words = body.split()
    width = 1 + sum(1 + len(freedoms) for _, freedoms in layout)
    if len(words) % width:
        return None
    frames = len(words) // width
    numbers, at = words[::width], 1
    columns: list[list[str]] = []
    if not all(word.isdecimal() and len(word) <= 9 for word in numbers):
        return None
    for name, freedoms in layout:
        heads = words[at::width]
        if heads.count(heads[0]) != frames or heads[0].lower() != name.lower():
            return None
        columns.extend(words[at + k :: width] for k in range(1, 1 + len(freedoms)))
        at += 1 + len(freedoms)
    return numbers, columns


def _columns_by_line(body: str, layout: _Layout, where: str) -> tuple[list[str], list[list[str]]]:
    """Frame numbers and one column of words per channel, line by line: bones in any order, or a InvalidInput."""
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
            raise InvalidInput("no such bone in the first frame", where=place, received=repr(words[0][:40]))
        name, width = bones[words[0].lower()]
        if name in frames[-1] or len(words) != 1 + width:
            raise InvalidInput(
                "a bone stands twice" if name in frames[-1] else "a bone has a wrong number of values",
                where=f"{place}, bone {name}",
                expected=str(width),
                received=str(len(words) - 1),
            )
        frames[-1][name] = words[1:]
    for number, frame in zip(numbers, frames, strict=True):
        missing = [name for name, _ in layout if name not in frame]
        if missing:
            is_last = frame is frames[-1]
            raise InvalidInput(
                "the file is cut short: the last frame is not whole" if is_last else "a bone is missing",
                where=f"{where}, frame {number}, bone {missing[0]}",
            )
    return numbers, [
        [frame[name][k] for frame in frames] for name, freedoms in layout for k in range(len(freedoms))
    ]


def _check_numbering(words: list[str], where: str) -> int:
    """The first frame's number; frames that are missing or repeated are refused, never closed up."""
    numbers = [int(word) for word in words]
    for before, after in itertools.pairwise(numbers):
        if after != before + 1:
            raise InvalidInput(
                "frames are missing or repeated",
                where=f"{where}, after frame {before}",
                expected=str(before + 1),
                received=str(after),
            )
    return numbers[0]


def _values(columns: list[list[str]], layout: _Layout, start: int, where: str) -> np.ndarray:
    """(T, C) float64 from columns of words; NaN stays."""
    labels = [(name, freedom) for name, freedoms in layout for freedom in freedoms]
    if not labels:
        raise InvalidInput("nothing moves: the skeleton has no degrees of freedom", where=where)
    values = np.empty((len(columns[0]), len(columns)))
    for c, column in enumerate(columns):
        try:
            values[:, c] = parse_numbers(column)
            wrong = np.flatnonzero(np.abs(values[:, c]) > LARGEST)
        except ValueError:
            wrong = np.array([t for t, word in enumerate(column) if not is_number(word)])
        if wrong.size:
            name, freedom = labels[c]
            raise InvalidInput(
                "a value cannot be used",
                where=f"{where}, frame {start + wrong[0]}, bone {name}, {freedom}",
                expected=f"a number of at most {LARGEST:g}",
                received=repr(column[wrong[0]][:40]),
            )
    return values
