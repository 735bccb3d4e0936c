"""Biovision hierarchies with motion (BVH): channels in, positions of joints out.

Conventions
-----------
- What a joint's offset and channels do is told in `pipeline.formats.bvh_hierarchy`.
- The format has no unit of length: the caller says which.
- Fewer or more frames than declared are read and noted; a frame that is not whole is refused, because the
  file was cut or damaged there.  A decimal comma is read if no number of the file has a decimal point.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pipeline.formats.bvh.hierarchy import BvhSkeleton, forward_kinematics, read_hierarchy, usable_offset
from pipeline.formats.text import LARGEST, is_number, millimetres_in, parse_numbers, read_text
from pipeline.skeleton import MotionCapture
from pipeline.validation import InvalidInput


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
    InvalidInput
        If the file is missing, not a BVH, cut short in a frame, or contradicts itself.
    """
    path = Path(path)
    millimetres = millimetres_in(units, path.name)
    lines = read_text(path).split("\n")
    joints, motion = read_hierarchy(lines, path.name)
    declared, interval, first = _motion_header(lines, motion, path.name)
    labels = [(joint.name, channel) for joint in joints for channel in joint.channels]
    rows = _rows(lines, first, labels, path.name)
    notes = [f"A BVH file declares no unit of length; its numbers were read as {units}."]

    numbers = [*(word for joint in joints for word in joint.offset), interval, *lines[first:]]
    if any("," in words for words in numbers):
        if any("." in words or re.search(r",(?!\d)", words) for words in numbers):
            raise InvalidInput(
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
        offsets_mm=np.array([usable_offset(joint, path.name) for joint in joints]) * millimetres,
        channels=tuple(tuple(joint.channels) for joint in joints),
    )
    values = _values(rows, labels, path.name)
    seconds = float(interval) if is_number(interval) else 0.0
    if not 1e-6 <= seconds <= 1e6:
        raise InvalidInput(
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


def _motion_header(lines: list[str], motion: int, where: str) -> tuple[int, str, int]:
    """Declared number of frames, frame time as written, and the index of the line after them."""
    found: list[str] = []
    for i in range(motion + 1, len(lines)):
        if not lines[i].strip():
            continue
        wanted = ("Frames", "Frame Time")[len(found)]
        match = re.fullmatch(wanted.replace(" ", r"\s+") + r"\s*:\s*(\S+)", lines[i].strip(), re.IGNORECASE)
        if match is None or (not found and not re.fullmatch(r"[0-9]{1,9}", match[1])):
            raise InvalidInput(
                "the motion's header cannot be read",
                where=f"{where}, line {i + 1}",
                expected=f"{wanted}: a number",
                received=repr(lines[i].strip()[:40]),
            )
        found.append(match[1])
        if len(found) == 2:
            return int(found[0]), found[1], i + 1
    raise InvalidInput("the file is cut short in the motion's header", where=where)


def _rows(
    lines: list[str], first: int, labels: list[tuple[str, str]], where: str
) -> list[tuple[int, list[str]]]:
    """Line number and words of each frame, all of the right width."""
    rows = [(i, words) for i, line in enumerate(lines[first:], start=first + 1) if (words := line.split())]
    if not rows or not labels:
        raise InvalidInput("no frames" if labels else "no joint has channels", where=where)
    for number, words in rows:
        if len(words) != len(labels):
            is_cut = number == rows[-1][0] and len(words) < len(labels)
            raise InvalidInput(
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
        values = np.array([parse_numbers(words) for _, words in rows])
        wrong = np.argwhere(np.abs(values) > LARGEST)
    except ValueError:
        wrong = np.array(
            [(t, c) for t, (_, words) in enumerate(rows) for c, w in enumerate(words) if not is_number(w)]
        )
    if wrong.size:
        t, c = wrong[0]
        raise InvalidInput(
            "a value cannot be used",
            where=f"{where}, line {rows[t][0]}, channel {'.'.join(labels[c])}",
            expected=f"a number of at most {LARGEST:g}",
            received=repr(rows[t][1][c][:40]),
        )
    return values


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
