"""Reader of Biovision hierarchies with motion (BVH): joint positions from joint angles.

Conventions
-----------
- A point is the origin of a joint; an ``End Site`` is called ``<parent>_end``.
- The rotations of a joint multiply in the order of its channels: ``Zrotation Xrotation Yrotation`` is Rz·Rx·Ry.
- Position channels replace the ``OFFSET`` of a joint, axis by axis, at the root and elsewhere.  Exporters write the
  position itself to these channels, and adding the offset would count it twice.
- Fewer or more frames than declared are read and noted.  An incomplete frame is rejected, because the file was
  truncated or damaged there.  A decimal comma is read if no number of the file has a decimal point.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import compare_frames, damaged, motion_capture, require_joints
from pipeline.formats.kinematics import turn
from pipeline.formats.text import millimetres_in, number, read_numbers, read_text, read_vector
from pipeline.skeleton.recorded import MotionCapture

_CHANNEL = re.compile(r"([xyz])(position|rotation)", re.IGNORECASE)


@dataclass
class Joint:
    """Joint or end site of the hierarchy; `line` is the line of the file at which it begins.

    Channels are ``tx ty tz rx ry rz`` in the order of the file.
    """

    name: str
    parent: int
    line: int
    is_end: bool
    offset: list[str] = field(default_factory=list)
    channels: list[str] = field(default_factory=list)


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the positions of the joints and end sites from a BVH file, in the file's axes.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Not used: the file states its frame time.
    units : str, optional
        Unit of length, which the format does not store; default ``"cm"``.  Conversions of the CMU recordings need
        ``"in/0.45"``.

    Returns
    -------
    MotionCapture
        A NaN in the file makes the points that depend on it invalid, and is noted.

    Raises
    ------
    InvalidInput
        If the file is missing, not a BVH, truncated inside a frame, or contradicts itself.
    """
    assumed, units = units is None, "cm" if units is None else units
    millimetres = millimetres_in(units, path.name)
    text, text_notes = read_text(path)
    lines = text.split("\n")
    joints, motion = read_hierarchy(lines, path.name)
    declared, interval, first = _motion_header(lines, motion, path.name)
    labels = [f"{joint.name}.{channel}" for joint in joints for channel in joint.channels]
    rows, words = _rows(lines, first, labels, path.name)
    require_points(len(rows), len(joints), path.name)
    notes = [*text_notes]
    numbers = [*(word for joint in joints for word in joint.offset), interval, *lines[first:]]
    if any("," in piece for piece in numbers):
        if any("." in piece or re.search(r",(?!\d)", piece) for piece in numbers):
            raise damaged(
                "the file has commas that may not be decimal commas",
                path.name,
                "commas or decimal points but not both, and a digit after each comma",
                code="ambiguous_commas",
            )
        words = [word.replace(",", ".") for word in words]
        interval = interval.replace(",", ".")
        for joint in joints:
            joint.offset = [word.replace(",", ".") for word in joint.offset]
        notes.append("Decimal commas were read as decimal points.")
    offsets = [
        read_vector(joint.offset, 3, f"{path.name}, OFFSET of {joint.name}, line {joint.line}")
        for joint in joints
    ]
    offsets_mm = np.array(offsets) * millimetres

    def location(n: int) -> str:
        return f"{path.name}, line {rows[n // len(labels)]}, channel {labels[n % len(labels)]}"

    values = read_numbers(words, location).reshape(len(rows), -1)
    seconds = number(interval)
    if not 1e-6 <= seconds <= 1e6:
        where = f"{path.name}, Frame Time"
        if not frame_rate_hz:
            raise damaged(
                "the frame time cannot be used",
                where,
                "seconds > 0, or the option frame_rate_hz",
                interval[:40],
                code="unusable_rate",
                text=interval,
            )
        notes.append(f"The frame time {interval[:40]} cannot be used; the requested frame rate is used.")
        seconds = 1.0 / frame_rate_hz
    compare_frames(declared, len(rows), notes)
    replaced = [
        joint.name
        for joint, offset in zip(joints, offsets_mm, strict=True)
        if np.any(offset) and any(channel[0] == "t" for channel in joint.channels)
    ]
    if replaced:
        count = f" and {len(replaced) - 1} more" if len(replaced) > 1 else ""
        notes.append(f"Position channels replace the OFFSET of {replaced[0]}{count}.")

    scales = np.array([np.pi / 180 if label[-2] == "r" else millimetres for label in labels])
    return motion_capture(
        [joint.name for joint in joints],
        forward_kinematics(joints, offsets_mm, values * scales),
        1.0 / seconds,
        units,
        notes,
        of_angles=True,
        units_assumed=assumed,
    )


def _motion_header(lines: list[str], motion: int, where: str) -> tuple[int, str, int]:
    """Return the declared number of frames, the frame time as text, and the index of the first line of numbers."""
    values: list[str] = []
    for i in range(motion + 1, len(lines)):
        if not lines[i].strip():
            continue
        key = ("Frames", "Frame Time")[len(values)]
        match = re.fullmatch(key.replace(" ", r"\s+") + r"\s*:\s*(\S+)", lines[i].strip(), re.IGNORECASE)
        if match is None or (not values and not re.fullmatch(r"[0-9]{1,9}", match[1])):
            raise damaged(
                "the header of the motion cannot be read",
                f"{where}, line {i + 1}",
                f"{key}: a number",
                f"{lines[i].strip()!r:.40}",
                code="unreadable_header",
                key=key,
            )
        values.append(match[1])
        if len(values) == 2:
            return int(values[0]), values[1], i + 1
    raise damaged("the file is truncated in the header of the motion", where, code="truncated", part="header")


def _rows(lines: list[str], first: int, labels: list[str], where: str) -> tuple[list[int], list[str]]:
    """Return the line number of each frame of motion, and the numbers of all frames as words.

    Raises InvalidInput if a frame has the wrong number of words.
    """
    rows = [k for k in range(first, len(lines)) if lines[k].strip()]
    if not rows or not labels:
        raise damaged(
            "the file has no frames" if labels else "no joint has channels",
            where,
            code="no_frames" if labels else "no_channels",
        )
    cells: list[str] = []
    for k in rows:
        words = lines[k].split()
        if len(words) != len(labels):
            is_cut = k == rows[-1] and len(words) < len(labels)
            what = "the file is truncated: a" if is_cut else "a"
            raise damaged(
                f"{what} frame has a wrong number of values",
                f"{where}, line {k + 1}",
                len(labels),
                len(words),
                code="truncated" if is_cut else "wrong_count",
                needed=len(labels),
                count=len(words),
            )
        cells += words
    return [k + 1 for k in rows], cells


def forward_kinematics(joints: Sequence[Joint], offsets_mm: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the positions of joints and end sites, computed from joint angles.

    Parameters
    ----------
    joints : sequence of Joint
        Parents before children.
    offsets_mm : (P, 3) float64
        Offsets from the parent, in the parent's axes; position channels replace them.
    values : (T, C) float64
        Values of all channels in the order of the file: millimetres and radians.

    Returns
    -------
    (T, P, 3) float64
        Millimetres, in the order of the joints.
    """
    frames = len(values)
    positions = np.empty((frames, len(joints), 3))
    rotations = np.empty((len(joints), frames, 3, 3))
    column = 0
    for p, joint in enumerate(joints):
        parent = joint.parent
        shift = np.repeat(offsets_mm[p][None], frames, axis=0)
        rotations[p] = np.eye(3) if parent < 0 else rotations[parent]
        for channel in joint.channels:
            if channel[0] == "t":
                shift[:, "xyz".index(channel[1])] = values[:, column]
            else:
                turn(rotations[p], channel[1], values[:, column])
            column += 1
        if parent < 0:
            positions[:, p] = shift
        else:
            moved = rotations[parent] @ shift[:, :, None]
            positions[:, p] = positions[:, parent] + moved[:, :, 0]
    return positions


def read_hierarchy(lines: list[str], where: str) -> tuple[list[Joint], int]:
    """Return the joints of a BVH file, in the order of the file, and the index of the line ``MOTION``.

    Raises
    ------
    InvalidInput
        If the hierarchy has no end, its braces do not match, or a line cannot be read.
    """
    joints: list[Joint] = []
    names: set[str] = set()  # per root: several people in a file may use the same names
    current = -1  # the joint whose brace is open
    awaits_brace = False
    started = False
    for at, line in enumerate(lines, start=1):
        location = f"{where}, line {at}"
        for part in filter(None, map(str.strip, re.split(r"([{}])", line))):
            key, *words = part.split()
            key = key.upper()
            if not started:
                if key != "HIERARCHY" or words:
                    raise damaged(
                        "this is not a BVH file", location, "HIERARCHY", f"{part!r:.40}", code="wrong_format"
                    )
                started = True
            elif awaits_brace != (key == "{"):
                raise damaged(
                    "braces do not match",
                    location,
                    "{" if awaits_brace else "no {",
                    f"{part!r:.40}",
                    code="unbalanced",
                )
            elif key == "{":
                awaits_brace = False
            elif key == "}":
                if current < 0:
                    raise damaged("a } has no {", location, code="unopened")
                current = joints[current].parent
            elif key == "MOTION":
                if current >= 0:
                    unclosed = joints[current]
                    raise damaged(
                        f"the brace of {unclosed.name!r} (line {unclosed.line}) is not closed",
                        location,
                        "}",
                        code="unclosed",
                        joint=unclosed.name,
                        line=unclosed.line,
                    )
                _prefix_names(joints)
                return joints, at - 1
            elif key in ("ROOT", "JOINT", "END"):
                if key == "ROOT" and current < 0:
                    names = set()
                joints.append(_new_joint(joints, current, names, key, " ".join(words), location, at))
                current = len(joints) - 1
                require_joints(len(joints), location)
                awaits_brace = True
            elif key in ("OFFSET", "CHANNELS") and current >= 0:
                _describe(joints[current], key, words, location)
            else:
                raise damaged(
                    "a line of the hierarchy cannot be read",
                    location,
                    "ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION",
                    f"{part!r:.40}",
                    code="unreadable_line",
                    text=part,
                )
    raise damaged("the file is truncated: it has no MOTION", where, code="truncated", part="hierarchy")


def _prefix_names(joints: list[Joint]) -> None:
    """Prefix each name with the number of its root and a colon, if several roots have joints with the same name."""
    if len({joint.name for joint in joints}) == len(joints):
        return
    root = 0
    for joint in joints:
        root += joint.parent < 0
        joint.name = f"{root}:{joint.name}"


def _new_joint(
    joints: list[Joint],
    parent: int,
    names: set[str],
    key: str,
    name: str,
    location: str,
    number: int,
) -> Joint:
    """Return a new joint or end site, as a child of the joint whose brace is still open."""
    if (key == "ROOT") == (parent >= 0):
        side = "inside" if parent >= 0 else "outside"
        raise damaged(
            f"{key} is {side} a joint",
            location,
            "ROOT around JOINT and End Site",
            code="joint_misplaced",
            key=key,
        )
    if key == "END":
        # A joint may have several ends: the second is called `<parent>_end2`.
        base = f"{joints[parent].name}_end"
        count = sum(joint.is_end and joint.parent == parent for joint in joints)
        name = base if count == 0 else f"{base}{count + 1}"
    if parent >= 0 and joints[parent].is_end:
        raise damaged(
            "a joint is inside an End Site", location, received=f"{name!r:.40}", code="joint_in_end_site"
        )
    if not name or name in names:
        raise damaged(
            "the name of a joint is missing or repeated",
            location,
            "a name that no other joint has",
            f"{name!r:.40}",
            code="no_own_name",
            name=name,
        )
    names.add(name)
    return Joint(name=name, parent=parent, line=number, is_end=key == "END")


def _describe(joint: Joint, key: str, words: list[str], location: str) -> None:
    """Store in a joint the offset or the channels that a line of a BVH file states."""
    received = " ".join(words)[:80]
    if key == "OFFSET":
        if joint.offset or len(words) != 3:
            raise damaged(
                f"the offset of {joint.name!r} cannot be read",
                location,
                "three numbers, once",
                received,
                code="unreadable_offset",
                joint=joint.name,
                text=received,
            )
        joint.offset = words
        return
    matches = [_CHANNEL.fullmatch(word) for word in words[1:]]
    channels = [("r" if m[2].lower() == "rotation" else "t") + m[1].lower() for m in matches if m]
    is_counted = bool(words) and words[0] == str(len(words) - 1)
    if joint.is_end or joint.channels or not is_counted or len(set(channels)) != len(words) - 1:
        raise damaged(
            f"the channels of {joint.name!r} cannot be read",
            location,
            "their count, then each of Xposition … Zrotation at most once",
            received,
            code="wrong_channels",
            joint=joint.name,
        )
    joint.channels = channels
