"""Biovision hierarchies (BVH): channels in, positions of joints out.

Conventions
-----------
- A point is the origin of a joint; an ``End Site`` is called ``<parent>_end``.
- A joint's rotations multiply in the order of its channels: ``Zrotation Xrotation Yrotation`` is Rz·Rx·Ry.
- Position channels take the place of the joint's ``OFFSET``, axis by axis, at the root and elsewhere:
  exporters write there where the joint is, so adding the two would count the offset twice.
- The format has no unit of length: the caller says which.
- Fewer or more frames than declared are read and noted; a frame that is not whole is refused, because the
  file was cut or damaged there.  A decimal comma is read if no number of the file has a decimal point.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.refusal import Refusal
from pipeline.skeleton import MILLIMETRES, MotionCapture

_LARGEST = 1e9
"""No length or angle of a recording is larger; a damaged file's may be, and would overflow later."""

_CHANNEL = re.compile(r"([xyz])(position|rotation)", re.IGNORECASE)


@dataclass(frozen=True)
class BvhSkeleton:
    """Joints of a BVH file; parents come before children.

    Attributes
    ----------
    names : tuple of str
        P points: joints and end sites in the order of the file.
    parents : tuple of int
        Index of each point's parent; -1 for a root.
    offsets_mm : (P, 3) float64
        From the parent, in the parent's frame, where no position channel takes its place.
    channels : tuple of tuple of str
        Channels of each point in the order of the file: ``tx ty tz rx ry rz``.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets_mm: np.ndarray
    channels: tuple[tuple[str, ...], ...]


def read(path: str | Path, *, units: str = "cm") -> MotionCapture:
    """Positions of the joints and end sites in a BVH file, in the file's axes.

    Parameters
    ----------
    path : str or Path
    units : str
        Unit of length of the file's numbers: ``"mm"``, ``"cm"``, ``"m"``, ``"in"``…, or one of these divided
        by a number (``"in/0.45"`` for conversions of the CMU recordings).  Noted: the file cannot confirm it.

    Returns
    -------
    MotionCapture
        `channels` are the rotations in the order of the file, e.g. ``"LeftLeg.rx"``.  A NaN in the file makes
        the points that depend on it invalid, and is noted.

    Raises
    ------
    Refusal
        If the file is missing, not a BVH, cut short in a frame, or contradicts itself.
    """
    path = Path(path)
    millimetres = _millimetres(units, path.name)
    lines = _text(path).split("\n")
    joints, motion = _hierarchy(lines, path.name)
    declared, interval, first = _motion_header(lines, motion, path.name)
    labels = [(joint.name, channel) for joint in joints for channel in joint.channels]
    rows = _rows(lines, first, labels, path.name)
    notes = [f"A BVH file declares no unit of length; its numbers were read as {units}."]

    numbers = [*(word for joint in joints for word in joint.offset), interval, *lines[first:]]
    if any("," in words for words in numbers):
        if any("." in words or re.search(r",(?!\d)", words) for words in numbers):
            raise Refusal(
                "a comma cannot be told for a decimal comma",
                where=path.name,
                expected="no decimal points beside commas, and a digit after each comma",
            )
        rows = [(number, [word.replace(",", ".") for word in words]) for number, words in rows]
        interval = interval.replace(",", ".")
        for joint in joints:
            joint.offset = [word.replace(",", ".") for word in joint.offset]
        notes.append("Decimal commas were read as decimal points.")
    skeleton = BvhSkeleton(
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        offsets_mm=np.array([_offset(joint, path.name) for joint in joints]) * millimetres,
        channels=tuple(tuple(joint.channels) for joint in joints),
    )
    values = _values(rows, labels, path.name)
    seconds = float(interval) if _is_number(interval) else 0.0
    if not 1e-6 <= seconds <= 1e6:
        raise Refusal(
            "the frame time cannot be used",
            where=f"{path.name}, Frame Time",
            expected="seconds > 0",
            received=interval[:40],
        )
    if declared != len(rows):
        notes.append(f"The file declares {declared} frames and has {len(rows)}; all {len(rows)} were read.")
    notes.extend(_notes_on_positions(skeleton))

    is_turn = np.array([channel.startswith("r") for _, channel in labels])
    positions = forward_kinematics(skeleton, values * np.where(is_turn, np.pi / 180, millimetres))
    valid = np.isfinite(positions).all(axis=-1)
    if not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(f"{gaps} of {len(rows)} frames have NaN; the points that depend on them are invalid.")
    positions[~valid] = np.nan
    return MotionCapture(
        names=skeleton.names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=1.0 / seconds,
        units=units,
        channels=tuple(f"{name}.{channel}" for name, channel in labels if channel.startswith("r")),
        angles_deg=values[:, is_turn],
        notes=tuple(notes),
    )


def forward_kinematics(skeleton: BvhSkeleton, values: np.ndarray) -> np.ndarray:
    """Positions of joints and end sites.

    Parameters
    ----------
    skeleton : BvhSkeleton
    values : (T, C) float64
        All channels in the order of the file: millimetres and radians.

    Returns
    -------
    (T, P, 3) float64
        Millimetres, in the order of `skeleton.names`.
    """
    frames = len(values)
    positions = np.empty((frames, len(skeleton.names), 3))
    rotations = np.empty((len(skeleton.names), frames, 3, 3))
    column = 0
    for p, (parent, channels) in enumerate(zip(skeleton.parents, skeleton.channels, strict=True)):
        shift = np.repeat(skeleton.offsets_mm[p][None], frames, axis=0)
        turn = rotations[p]
        turn[:] = np.eye(3) if parent < 0 else rotations[parent]
        for channel in channels:
            axis = "xyz".index(channel[1])
            if channel.startswith("t"):
                shift[:, axis] = values[:, column]
            else:
                # A rotation from the right about x mixes columns y and z, and so on in a cycle.
                i, j = (axis + 1) % 3, (axis + 2) % 3
                cosine, sine = np.cos(values[:, column, None]), np.sin(values[:, column, None])
                column_i, column_j = turn[:, :, i].copy(), turn[:, :, j].copy()
                turn[:, :, i] = cosine * column_i + sine * column_j
                turn[:, :, j] = cosine * column_j - sine * column_i
            column += 1
        if parent < 0:
            positions[:, p] = shift
        else:
            moved = rotations[parent] @ shift[:, :, None]
            positions[:, p] = positions[:, parent] + moved[:, :, 0]
    return positions


@dataclass
class _Joint:
    """A joint while the hierarchy is read."""

    name: str
    parent: int
    line: int
    offset: list[str] = field(default_factory=list)
    channels: list[str] = field(default_factory=list)
    is_end: bool = False


def _hierarchy(lines: list[str], where: str) -> tuple[list[_Joint], int]:
    """Joints in the order of the file, and the index of the line ``MOTION``."""
    joints: list[_Joint] = []
    names: set[str] = set()
    open_joints: list[int] = []
    awaits_brace = False
    started = False
    for number, line in enumerate(lines, start=1):
        place = f"{where}, line {number}"
        for part in filter(None, map(str.strip, re.split(r"([{}])", line))):
            key, *words = part.split()
            key = key.upper()
            if not started:
                if key != "HIERARCHY" or words:
                    raise Refusal(
                        "not a BVH file", where=place, expected="HIERARCHY", received=repr(part[:40])
                    )
                started = True
            elif awaits_brace != (key == "{"):
                raise Refusal(
                    "braces do not match",
                    where=place,
                    expected="{" if awaits_brace else "no {",
                    received=repr(part[:40]),
                )
            elif key == "{":
                awaits_brace = False
            elif key == "}":
                if not open_joints:
                    raise Refusal("a } too many", where=place)
                open_joints.pop()
            elif key == "MOTION":
                if open_joints:
                    lost = joints[open_joints[-1]]
                    raise Refusal(
                        f"the brace of {lost.name!r} (line {lost.line}) is not closed",
                        where=place,
                        expected="}",
                    )
                return joints, number - 1
            elif key in ("ROOT", "JOINT", "END"):
                joint = _new_joint(joints, open_joints, names, key, " ".join(words), place, number)
                open_joints.append(len(joints))
                joints.append(joint)
                awaits_brace = True
            elif key in ("OFFSET", "CHANNELS") and open_joints:
                _describe(joints[open_joints[-1]], key, words, place)
            else:
                raise Refusal(
                    "the hierarchy has a line that cannot be read",
                    where=place,
                    expected="ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION",
                    received=repr(part[:40]),
                )
    raise Refusal("the file is cut short: no MOTION", where=where)


def _new_joint(
    joints: list[_Joint],
    open_joints: list[int],
    names: set[str],
    key: str,
    name: str,
    place: str,
    number: int,
) -> _Joint:
    """A joint or end site under the joint whose brace is open."""
    if (key == "ROOT") == bool(open_joints):
        raise Refusal(
            f"{key} stands {'inside' if open_joints else 'outside'} a joint",
            where=place,
            expected="ROOT around JOINT and End Site",
        )
    parent = open_joints[-1] if open_joints else -1
    if key == "END":
        # More than one end of the same joint is legal: the second is `<parent>_end2`.
        base = f"{joints[parent].name}_end"
        count = sum(joint.is_end and joint.parent == parent for joint in joints)
        name = base if count == 0 else f"{base}{count + 1}"
    if parent >= 0 and joints[parent].is_end:
        raise Refusal("a joint stands inside an End Site", where=place, received=name)
    if not name or name in names:
        raise Refusal(
            "a joint has no name of its own", where=place, expected="a new name", received=repr(name[:40])
        )
    names.add(name)
    return _Joint(name=name, parent=parent, line=number, is_end=key == "END")


def _describe(joint: _Joint, key: str, words: list[str], place: str) -> None:
    """Store the offset or the channels of a joint."""
    if key == "OFFSET":
        if joint.offset or len(words) != 3:
            raise Refusal(
                f"the offset of {joint.name!r} cannot be read",
                where=place,
                expected="three numbers, once",
                received=" ".join(words)[:60],
            )
        joint.offset = words
        return
    found = [_CHANNEL.fullmatch(word) for word in words[1:]]
    channels = [("r" if m[2].lower() == "rotation" else "t") + m[1].lower() for m in found if m]
    is_counted = bool(words) and words[0] == str(len(words) - 1)
    if joint.is_end or joint.channels or not is_counted or len(set(channels)) != len(words) - 1:
        raise Refusal(
            f"the channels of {joint.name!r} cannot be read",
            where=place,
            expected="their count, then each of Xposition … Zrotation at most once",
            received=" ".join(words)[:80],
        )
    joint.channels = channels


def _motion_header(lines: list[str], motion: int, where: str) -> tuple[int, str, int]:
    """Declared number of frames, frame time as written, and the index of the line after them."""
    found: list[str] = []
    for i in range(motion + 1, len(lines)):
        if not lines[i].strip():
            continue
        wanted = ("Frames", "Frame Time")[len(found)]
        match = re.fullmatch(wanted.replace(" ", r"\s+") + r"\s*:\s*(\S+)", lines[i].strip(), re.IGNORECASE)
        if match is None or (not found and not re.fullmatch(r"[0-9]{1,9}", match[1])):
            raise Refusal(
                "the motion's header cannot be read",
                where=f"{where}, line {i + 1}",
                expected=f"{wanted}: a number",
                received=repr(lines[i].strip()[:40]),
            )
        found.append(match[1])
        if len(found) == 2:
            return int(found[0]), found[1], i + 1
    raise Refusal("the file is cut short in the motion's header", where=where)


def _rows(
    lines: list[str], first: int, labels: list[tuple[str, str]], where: str
) -> list[tuple[int, list[str]]]:
    """Line number and words of each frame, all of the right width."""
    rows = [(i, words) for i, line in enumerate(lines[first:], start=first + 1) if (words := line.split())]
    if not rows or not labels:
        raise Refusal("no frames" if labels else "no joint has channels", where=where)
    for number, words in rows:
        if len(words) != len(labels):
            is_cut = number == rows[-1][0] and len(words) < len(labels)
            raise Refusal(
                "the file is cut short: the last frame is not whole"
                if is_cut
                else "a frame has a wrong number of values",
                where=f"{where}, line {number}",
                expected=f"{len(labels)} values",
                received=str(len(words)),
            )
    return rows


def _values(rows: list[tuple[int, list[str]]], labels: list[tuple[str, str]], where: str) -> np.ndarray:
    """(T, C) float64; NaN stays."""
    try:
        values = np.array([_parse(words) for _, words in rows])
        wrong = np.argwhere(np.abs(values) > _LARGEST)
    except ValueError:
        wrong = np.array(
            [(t, c) for t, (_, words) in enumerate(rows) for c, w in enumerate(words) if not _is_number(w)]
        )
    if wrong.size:
        t, c = wrong[0]
        raise Refusal(
            "a value cannot be used",
            where=f"{where}, line {rows[t][0]}, channel {'.'.join(labels[c])}",
            expected=f"a number of at most {_LARGEST:g}",
            received=repr(rows[t][1][c][:40]),
        )
    return values


def _offset(joint: _Joint, where: str) -> list[float]:
    """The offset as three finite numbers."""
    numbers = _parse(joint.offset) if joint.offset and all(map(_is_number, joint.offset)) else []
    if not numbers or not all(abs(number) <= _LARGEST for number in numbers):
        raise Refusal(
            f"the joint {joint.name!r} has no usable OFFSET",
            where=f"{where}, line {joint.line}",
            expected="three numbers",
            received=" ".join(joint.offset)[:60] or "nothing",
        )
    return numbers


def _notes_on_positions(skeleton: BvhSkeleton) -> list[str]:
    """A note if position channels take the place of offsets that are not zero."""
    replaced = [
        name
        for name, offset, channels in zip(skeleton.names, skeleton.offsets_mm, skeleton.channels, strict=True)
        if np.any(offset) and any(channel.startswith("t") for channel in channels)
    ]
    if not replaced:
        return []
    count = f" and {len(replaced) - 1} more" if len(replaced) > 1 else ""
    return [f"Position channels take the place of the OFFSET of {replaced[0]}{count}."]


def _parse(words: Sequence[str]) -> list[float]:
    """Numbers as a data file writes them: not Python's ``1_000`` nor digits of other scripts."""
    joined = "".join(words)
    if "_" in joined or not joined.isascii():
        raise ValueError
    return list(map(float, words))


def _is_number(word: str) -> bool:
    """Whether `_parse` takes the word."""
    try:
        _parse([word])
    except ValueError:
        return False
    return True


def _millimetres(units: str, where: str) -> float:
    """Millimetres in the unit of length that the caller gave."""
    name, slash, divisor = units.partition("/")
    divided_by = float(divisor) if _is_number(divisor) else 0.0 if slash else 1.0
    millimetres = MILLIMETRES[name] / divided_by if name in MILLIMETRES and divided_by > 0 else np.nan
    if not 1e-6 < millimetres < 1e6:
        raise Refusal(
            "the unit of length is unknown",
            where=where,
            expected="one of " + ", ".join(MILLIMETRES) + ", or e.g. in/0.45",
            received=units,
        )
    return millimetres


def _text(path: Path) -> str:
    """The file's text, lines ended by one character."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Refusal("the file cannot be read", where=path.name, received=error.strerror or "") from None
    if not data.strip():
        raise Refusal("the file is empty", where=path.name)
    return data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
