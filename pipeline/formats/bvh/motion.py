"""Biovision hierarchies with motion (BVH): channels in, positions of joints out.

Conventions
-----------
- What a joint's offset and channels do is stated in `pipeline.formats.bvh.hierarchy`.
- Fewer or more frames than declared are read and noted; a frame that is not whole is refused, because the
  file was cut or damaged there.  A decimal comma is read if no number of the file has a decimal point.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.bvh.hierarchy import BvhSkeleton, forward_kinematics, read_hierarchy
from pipeline.formats.contract import damaged, motion_capture
from pipeline.formats.text import millimetres_in, number, read_numbers, read_text, read_vector
from pipeline.skeleton.recorded import MotionCapture


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read positions of the joints and end sites from a BVH file, in the file's axes.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Not used: the file states its frame time.
    units : str, optional
        Unit of length, which the format does not state (noted): ``"cm"`` if not given; ``"in/0.45"`` for
        conversions of the CMU recordings.

    Returns
    -------
    MotionCapture
        A NaN in the file makes the points that depend on it invalid, and is noted.

    Raises
    ------
    InvalidInput
        If the file is missing, not a BVH, cut short in a frame, or contradicts itself.
    """
    path, assumed, units = Path(path), units is None, "cm" if units is None else units
    millimetres = millimetres_in(units, path.name)
    text, odd = read_text(path)
    lines = text.split("\n")
    joints, motion = read_hierarchy(lines, path.name)
    declared, interval, first = _motion_header(lines, motion, path.name)
    labels = [f"{joint.name}.{channel}" for joint in joints for channel in joint.channels]
    rows, words = _rows(lines, first, labels, path.name)
    require_points(len(rows), len(joints), path.name)
    notes = [*odd]

    numbers = [*(word for joint in joints for word in joint.offset), interval, *lines[first:]]
    if any("," in piece for piece in numbers):
        if any("." in piece or re.search(r",(?!\d)", piece) for piece in numbers):
            expected = "no decimal points beside commas, and a digit after each comma"
            raise damaged("commas that may not be decimal commas", path.name, expected)
        words = [word.replace(",", ".") for word in words]
        interval = interval.replace(",", ".")
        for joint in joints:
            joint.offset = [word.replace(",", ".") for word in joint.offset]
        notes.append("Decimal commas were read as decimal points.")
    offsets = [
        read_vector(joint.offset, 3, f"{path.name}, OFFSET of {joint.name}, line {joint.line}")
        for joint in joints
    ]
    skeleton = BvhSkeleton(
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        offsets_mm=np.array(offsets) * millimetres,
        channels=tuple(tuple(joint.channels) for joint in joints),
    )

    def place(n: int) -> str:
        return f"{path.name}, line {rows[n // len(labels)]}, channel {labels[n % len(labels)]}"

    values = read_numbers(words, place).reshape(len(rows), -1)
    seconds = number(interval)
    if not 1e-6 <= seconds <= 1e6:
        where = f"{path.name}, Frame Time"
        if not frame_rate_hz:
            expected = "seconds > 0, or the option frame_rate_hz"
            raise damaged("the frame time cannot be used", where, expected, interval[:40])
        notes.append(f"The frame time {interval[:40]} cannot be used; the frame rate asked for is.")
        seconds = 1.0 / frame_rate_hz
    if declared != len(rows):
        notes.append(f"The file declares {declared} frames and has {len(rows)}; all {len(rows)} were read.")
    notes.extend(_notes_on_positions(skeleton))

    scales = np.array([np.pi / 180 if label[-2] == "r" else millimetres for label in labels])
    return motion_capture(
        skeleton.names,
        forward_kinematics(skeleton, values * scales),
        1.0 / seconds,
        units,
        notes,
        of_angles=True,
        units_assumed=assumed,
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
            place, received = f"{where}, line {i + 1}", f"{lines[i].strip()!r:.40}"
            raise damaged("the motion's header cannot be read", place, f"{wanted}: a number", received)
        found.append(match[1])
        if len(found) == 2:
            return int(found[0]), found[1], i + 1
    raise damaged("the file is cut short in the motion's header", where)


def _rows(lines: list[str], first: int, labels: list[str], where: str) -> tuple[list[int], list[str]]:
    """Line number of each frame, and the words of all frames, each of the right width."""
    rows = [k for k in range(first, len(lines)) if lines[k].strip()]
    if not rows or not labels:
        raise damaged("no frames" if labels else "no joint has channels", where)
    found: list[str] = []
    for k in rows:
        words = lines[k].split()
        if len(words) != len(labels):
            is_cut = k == rows[-1] and len(words) < len(labels)
            what = "the file is cut short: a" if is_cut else "a"
            place = f"{where}, line {k + 1}"
            raise damaged(f"{what} frame has a wrong number of values", place, len(labels), len(words))
        found += words
    return [k + 1 for k in rows], found


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
