"""Hierarchies of BVH files: joints, and positions of joints from the values of their channels.

Conventions
-----------
- A point is the origin of a joint; an ``End Site`` is called ``<parent>_end``.
- A joint's rotations multiply in the order of its channels: ``Zrotation Xrotation Yrotation`` is Rz·Rx·Ry.
- Position channels take the place of the joint's ``OFFSET``, axis by axis, at the root and elsewhere:
  exporters write there where the joint is, so adding the two would count the offset twice.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from pipeline.formats.contract import damaged, require_joints
from pipeline.formats.kinematics import turn

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


def forward_kinematics(skeleton: BvhSkeleton, values: np.ndarray) -> np.ndarray:
    """Compute positions of joints and end sites.

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
        rotations[p] = np.eye(3) if parent < 0 else rotations[parent]
        for channel in channels:
            if channel.startswith("t"):
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


@dataclass
class Joint:
    """A joint or end site as the file describes it; `line` is where it begins."""

    name: str
    parent: int
    line: int
    offset: list[str] = field(default_factory=list)
    channels: list[str] = field(default_factory=list)
    is_end: bool = False


def read_hierarchy(lines: list[str], where: str) -> tuple[list[Joint], int]:
    """Read the joints in the order of the file, and the index of the line ``MOTION``.

    Raises
    ------
    InvalidInput
        If the hierarchy has no end, its braces do not match, or a line cannot be read.
    """
    joints: list[Joint] = []
    names: set[str] = set()  # of one root: people in one file may have the same
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
                    raise damaged("this is not a BVH file", place, "HIERARCHY", f"{part!r:.40}")
                started = True
            elif awaits_brace != (key == "{"):
                expected = "{" if awaits_brace else "no {"
                raise damaged("braces do not match", place, expected, f"{part!r:.40}")
            elif key == "{":
                awaits_brace = False
            elif key == "}":
                if not open_joints:
                    raise damaged("a } too many", place)
                open_joints.pop()
            elif key == "MOTION":
                if open_joints:
                    lost = joints[open_joints[-1]]
                    raise damaged(f"the brace of {lost.name!r} (line {lost.line}) is not closed", place, "}")
                _name_apart(joints)
                return joints, number - 1
            elif key in ("ROOT", "JOINT", "END"):
                if key == "ROOT" and not open_joints:
                    names = set()
                joint = _new_joint(joints, open_joints, names, key, " ".join(words), place, number)
                open_joints.append(len(joints))
                joints.append(joint)
                require_joints(len(joints), place)
                awaits_brace = True
            elif key in ("OFFSET", "CHANNELS") and open_joints:
                _describe(joints[open_joints[-1]], key, words, place)
            else:
                expected = "ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION"
                raise damaged("a line of the hierarchy cannot be read", place, expected, f"{part!r:.40}")
    raise damaged("the file is cut short: no MOTION", where)


def _name_apart(joints: list[Joint]) -> None:
    """Put the number of its root and a colon before each name, where several roots have joints of one name."""
    if len({joint.name for joint in joints}) == len(joints):
        return
    root = 0
    for joint in joints:
        root += joint.parent < 0
        joint.name = f"{root}:{joint.name}"


def _new_joint(
    joints: list[Joint],
    open_joints: list[int],
    names: set[str],
    key: str,
    name: str,
    place: str,
    number: int,
) -> Joint:
    """A joint or end site under the joint whose brace is open."""
    if (key == "ROOT") == bool(open_joints):
        side = "inside" if open_joints else "outside"
        raise damaged(f"{key} stands {side} a joint", place, "ROOT around JOINT and End Site")
    parent = open_joints[-1] if open_joints else -1
    if key == "END":
        # More than one end of the same joint is legal: the second is `<parent>_end2`.
        base = f"{joints[parent].name}_end"
        count = sum(joint.is_end and joint.parent == parent for joint in joints)
        name = base if count == 0 else f"{base}{count + 1}"
    if parent >= 0 and joints[parent].is_end:
        raise damaged("a joint stands inside an End Site", place, received=f"{name!r:.40}")
    if not name or name in names:
        raise damaged("a joint has no name of its own", place, "a new name", f"{name!r:.40}")
    names.add(name)
    return Joint(name=name, parent=parent, line=number, is_end=key == "END")


def _describe(joint: Joint, key: str, words: list[str], place: str) -> None:
    """Store the offset or the channels of a joint."""
    received = " ".join(words)[:80]
    if key == "OFFSET":
        if joint.offset or len(words) != 3:
            what = f"the offset of {joint.name!r} cannot be read"
            raise damaged(what, place, "three numbers, once", received)
        joint.offset = words
        return
    found = [_CHANNEL.fullmatch(word) for word in words[1:]]
    channels = [("r" if m[2].lower() == "rotation" else "t") + m[1].lower() for m in found if m]
    is_counted = bool(words) and words[0] == str(len(words) - 1)
    if joint.is_end or joint.channels or not is_counted or len(set(channels)) != len(words) - 1:
        expected = "their count, then each of Xposition … Zrotation at most once"
        raise damaged(f"the channels of {joint.name!r} cannot be read", place, expected, received)
    joint.channels = channels
