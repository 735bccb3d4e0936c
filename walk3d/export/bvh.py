"""BVH files: points with a position channel at every joint, or a character that only has rotations.

Programs that read only the rotations show limbs of constant length, their mean.  Programs that read the position
channels as well, like this package, get back the exact points.

A character has the joints of WALKER15, renamed for retargeting, with a T-pose at rest, one root, and feet.  Joints that
WALKER15 lacks are interpolated: the spine between pelvis and sternum, the collars between sternum and shoulders.  Feet
were not observed: they are at a right angle to the shank, with the length of Winter [2009] for such legs.  The
character is lifted so that its soles, not its ankles, are at ground level.  Positions are in the axes of the file: x to
the left, y up, z forwards.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import positions_to_write
from pipeline.skeleton import WALKER15
from pipeline.validation import require_shape


def write(
    path: Path,
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    parents: Sequence[int] | None = None,
    rest: np.ndarray | None = None,
) -> None:
    """Write joint positions to a BVH file, in centimetres.

    Each joint has a position and a rotation (Z, X, Y) relative to its parent.

    A joint with one child turns by the smallest rotation that moves the child to its position.  A joint with several
    children turns by the rotation that fits them best, and one without children like its parent.  At rest, limbs have
    their mean direction and length.  With `rest` they have its directions, and only roots have position channels.

    Parameters
    ----------
    path : Path
    names : sequence of str
        P names; blanks in them become underscores.
    positions_mm : (T, P, 3) array
        Millimetres; the format does not allow missing samples.
    frame_rate_hz : float
    parents : sequence of int, optional
        Index of each point's parent, -1 for a root; by default every point is a root.
    rest : (P, 3) array, optional
        Directions of a character at rest, NaN for the mean direction; points without children become end sites.

    Raises
    ------
    InvalidInput
        If the shapes do not fit, a sample is missing, or a name or a coordinate cannot be written.
    """
    where = path.name
    names = [re.sub(r"\s+", "_", name) for name in names]
    positions = positions_to_write(names, positions_mm, frame_rate_hz, where, distinct=True) / 10.0
    if np.isnan(positions).any():
        frame, point = np.argwhere(np.isnan(positions))[0][:2]
        raise damaged(
            "BVH cannot store missing samples: choose another format",
            where,
            received=f"{names[point]} missing in frame {frame}",
            code="missing_sample",
            joint=names[point],
            frame=int(frame),
        )
    above = [-1] * len(names) if parents is None else list(parents)
    children = {p: [k for k, parent in enumerate(above) if parent == p] for p in range(-1, len(names))}
    vectors = np.stack(
        [positions[:, k] - (positions[:, p] if p >= 0 else 0.0) for k, p in enumerate(above)], axis=1
    )
    offsets = _at_rest(vectors)
    if rest is not None:
        stated = np.isfinite(rest).all(axis=1)
        offsets[stated] = np.linalg.norm(vectors[:, stated], axis=-1).mean(axis=0)[:, None] * rest[stated]
        offsets[np.array(above) < 0] = 0.0
    turns = _turns(vectors, offsets, above, children)
    has_position = [rest is None or parent < 0 for parent in above]
    lines, order = ["HIERARCHY"], []

    def joint(k: int, depth: int) -> None:
        blank = "\t" * depth
        offset = f"{blank}\tOFFSET " + " ".join(f"{value:.6f}" for value in offsets[k])
        if rest is not None and not children[k]:
            lines.extend([f"{blank}End Site", blank + "{", offset, blank + "}"])
            return
        order.append(k)
        moved = "Xposition Yposition Zposition " if has_position[k] else ""
        lines.append(f"{blank}{'ROOT' if above[k] < 0 else 'JOINT'} {names[k]}")
        lines.append(blank + "{")
        lines.append(offset)
        lines.append(f"{blank}\tCHANNELS {6 if has_position[k] else 3} {moved}Zrotation Xrotation Yrotation")
        for child in children[k]:
            joint(child, depth + 1)
        if not children[k]:
            lines.extend([f"{blank}\tEnd Site", blank + "\t{", f"{blank}\t\tOFFSET 0 0 0", blank + "\t}"])
        lines.append(blank + "}")

    for root in children[-1]:
        joint(root, 0)
    lines += ["MOTION", f"Frames: {len(positions)}", f"Frame Time: {1.0 / float(frame_rate_hz)!r}"]
    columns = []
    for k in order:
        of_parent = turns[above[k]] if above[k] >= 0 else np.broadcast_to(np.eye(3), turns[k].shape)
        if has_position[k]:
            columns.append(np.einsum("tji,tj->ti", of_parent, vectors[:, k]))
        columns.append(_angles_deg(np.swapaxes(of_parent, 1, 2) @ turns[k]))
    lines += [" ".join(map(repr, row)) for row in np.hstack(columns).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _at_rest(vectors: np.ndarray) -> np.ndarray:
    """Return one offset vector per point (P, 3), with the mean direction and mean length of vectors (T, P, 3)."""
    mean, length = vectors.mean(axis=0), np.linalg.norm(vectors, axis=-1).mean(axis=0)
    size = np.linalg.norm(mean, axis=-1)
    directed = size > 1e-6 * length
    scaled: np.ndarray = np.where(directed, length / np.where(directed, size, 1.0), 0.0)[:, None] * mean
    return scaled


def _turns(
    vectors: np.ndarray, offsets: np.ndarray, above: Sequence[int], children: dict[int, list[int]]
) -> np.ndarray:
    """Return the rotations (P, T, 3, 3) of all joints, in the axes of the file.

    The rotation of a joint moves the offsets of its children onto their recorded directions.
    """
    turns = np.tile(np.eye(3), (len(above), len(vectors), 1, 1))
    waiting = list(children[-1])
    while waiting:
        k = waiting.pop()
        if above[k] >= 0:
            turns[k] = turns[above[k]]
        if len(children[k]) == 1:
            (child,) = children[k]
            turns[k] = _least_turn(turns[k] @ offsets[child], vectors[:, child]) @ turns[k]
        elif children[k]:
            # Least-squares rotation [Kabsch 1976] of unit directions, so that long limbs do not outweigh short ones.
            recorded, rest = (_directions(v) for v in (vectors[:, children[k]], offsets[children[k]]))
            left, _, right = np.linalg.svd(np.einsum("tci,cj->tij", recorded, rest))
            left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
            turns[k] = left @ right
        waiting += children[k]
    return turns


def _directions(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def _least_turn(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the smallest rotations (T, 3, 3) that turn one direction (T, 3) to another.

    The rotation is the identity where a direction has length zero.
    """
    a, b = _directions(before), _directions(after)
    axis = np.cross(a, b)
    plus = 0.5 * ((a + b) ** 2).sum(axis=1)  # 1 + the cosine, accurate for small values
    cross = np.zeros((len(a), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = axis
    cross[:, [1, 2, 0], [2, 0, 1]] = -axis
    turnable = (
        (plus > 1e-8) & a.any(axis=1) & b.any(axis=1)
    )  # opposite directions have no unique smallest rotation
    share = np.where(turnable, 1.0 / np.where(turnable, plus, 1.0), 0.0)
    turn: np.ndarray = np.eye(3) + turnable[:, None, None] * cross + share[:, None, None] * (cross @ cross)
    return turn


def _angles_deg(turns: np.ndarray) -> np.ndarray:
    """Return the angles (T, 3), degrees, about z, x and y of rotations (T, 3, 3) = Rz Rx Ry.

    The angles are continuous in time.
    """
    sine, cosine = turns[:, 2, 1], np.hypot(turns[:, 0, 1], turns[:, 1, 1])
    straight = cosine > 1e-9  # otherwise z and y turn about the same axis, and y is set to zero
    about_z = np.where(
        straight, np.arctan2(-turns[:, 0, 1], turns[:, 1, 1]), np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    )
    about_y = np.where(straight, np.arctan2(-turns[:, 2, 0], turns[:, 2, 2]), 0.0)
    angles = np.column_stack([about_z, np.arctan2(sine, cosine), about_y])
    return np.degrees(np.unwrap(angles, axis=0))


class Names(StrEnum):
    """Naming scheme of the joints."""

    ours = "ours"
    mixamo = "mixamo"
    rokoko = "rokoko"


_LEG, _FOOT_FORWARD, _FOOT_DOWN, _TOES = 0.491, 0.075, 0.032, 0.04
"""Lengths relative to the stature: leg, ankle to ball of the foot (forward and down), and ball to tip of the toes."""
_UP, _FORWARD, _LEFT = np.array([0.0, 1, 0]), np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
_DIRECTIONS = {"up": _UP, "down": -_UP, "left": _LEFT, "right": -_LEFT, "mean": np.full(3, np.nan)}

_COLUMNS = (*Names, "parent", "start", "end", "share", "direction")
"""Columns of the table of a character's joints: names of the joint, parent, start, end, share, and direction at rest.

The joint is at this share of the distance from start to end.
"""
_TRUNK = """
pelvis      Hips    Hips    none        pelvis  pelvis 0   mean
spine       Spine   Spine1  pelvis      pelvis  sternum .1 up
chest       Spine1  Spine2  spine       pelvis  sternum .4 up
upper_chest Spine2  Spine3  chest       pelvis  sternum .7 up
sternum     Neck    Neck    upper_chest pelvis  sternum 1  up
head        Head    Head    sternum     sternum head    .6 up
head_end    HeadEnd HeadEnd head        sternum head   1.4 up
"""
_LIMBS = """
left_collar   LeftShoulder LeftShoulder upper_chest   sternum       left_shoulder .15 mean
left_shoulder LeftArm      LeftArm      left_collar   left_shoulder left_elbow    0  left
left_elbow    LeftForeArm  LeftForeArm  left_shoulder left_shoulder left_elbow    1  left
left_wrist    LeftHand     LeftHand     left_elbow    left_elbow    left_wrist    1  left
left_hand_end LeftHandEnd  LeftHandEnd  left_wrist    left_elbow    left_wrist   1.4 left
left_hip      LeftUpLeg    LeftThigh    pelvis        left_hip      left_knee     0  mean
left_knee     LeftLeg      LeftShin     left_hip      left_hip      left_knee     1  down
left_ankle    LeftFoot     LeftFoot     left_knee     left_knee     left_ankle    1  down
"""
"""Table of the joints of a character, one joint per row, with the columns `_COLUMNS`.

The names are ours, Mixamo's and Rokoko's.

Our head joint is at the centre of the head; that of the other schemes is at the base of the skull.
"""


@dataclass(frozen=True)
class Character:
    """Joints of an animation character, with parents, positions and directions at rest.

    Attributes
    ----------
    names : tuple of str
        Names of the points; points without children end limbs.
    parents : tuple of int
    positions : (T, P, 3)
        Positions, mm.
    rest : (P, 3)
        Directions from the parents at rest; NaN for the mean direction.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: np.ndarray
    rest: np.ndarray


def character(positions: np.ndarray, names: Names) -> Character:
    """Return a character with a naming scheme that moves like a walker, from joint positions (T, 15, 3), mm.

    The walker moves along z, with y up.
    """
    require_shape("positions", positions, (len(positions), len(WALKER15.joints), 3))
    at = {joint: positions[:, j] for j, joint in enumerate(WALKER15.joints)}
    right = _LIMBS.replace("left", "right").replace("Left", "Right")
    lines = [line.split() for line in f"{_TRUNK}{_LIMBS}{right}".split("\n") if line]
    rows = [dict(zip(_COLUMNS, line, strict=True)) for line in lines]
    ours = [row[Names.ours] for row in rows]
    joint_names = [row[names] for row in rows]
    parents = [ours.index(row["parent"]) if row["parent"] in ours else -1 for row in rows]
    shares = [
        1.0 if row[Names.ours] == "head" and names is Names.ours else float(row["share"]) for row in rows
    ]
    points = [
        at[row["start"]] + share * (at[row["end"]] - at[row["start"]])
        for row, share in zip(rows, shares, strict=True)
    ]
    rest = [_DIRECTIONS[row["direction"]] for row in rows]
    lift = 0.0
    for side in ("left", "right"):
        hip, knee, ankle = (at[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        stature = np.linalg.norm([knee - hip, ankle - knee], axis=-1).mean(axis=1).sum() / _LEG
        down = _directions(ankle - knee)
        forwards = _directions(np.cross(at["right_hip"] - at["left_hip"], down))
        ball = ankle + stature * (_FOOT_FORWARD * forwards + _FOOT_DOWN * down)
        toes = {
            Names.ours: f"{side}_toes",
            Names.mixamo: f"{side.capitalize()}ToeBase",
            Names.rokoko: f"{side.capitalize()}Toe",
        }[names]
        joint_names += [toes, f"{toes}_end"]
        parents += [ours.index(f"{side}_ankle"), len(points)]
        points += [ball, ball + stature * _TOES * forwards]
        rest += [_directions(_FOOT_FORWARD * _FORWARD - _FOOT_DOWN * _UP), _FORWARD]
        lift = max(lift, stature * _FOOT_DOWN)
    return Character(
        tuple(joint_names), tuple(parents), np.stack(points, axis=1) + lift * _UP, np.stack(rest)
    )
