"""Joints of WALKER15 as a character that other programs retarget: their names, a T-pose at rest, one root, feet.

Joints that WALKER15 has not lie between those that it has: spine along the line from pelvis to sternum, collars between
sternum and shoulders.  Feet are carried at a right angle to the shank, as long as Winter [2009] has them for such legs:
they were not observed; what stands on the ground of its ankles is lifted onto its soles.  Positions are in the axes of
the file: x to the left, y up, z forwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.validation import require_shape


class Names(StrEnum):
    """Whose names the joints have."""

    ours = "ours"
    mixamo = "mixamo"
    rokoko = "rokoko"


_LEG, _FOOT_FORWARD, _FOOT_DOWN, _TOES = 0.491, 0.075, 0.032, 0.04
"""Of the stature: hip to ankle; ankle to ball of the foot, forwards and down; ball to the tip of the toes."""
_UP, _FORWARD, _LEFT = np.array([0.0, 1, 0]), np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
_DIRECTIONS = {"up": _UP, "down": -_UP, "left": _LEFT, "right": -_LEFT, "mean": np.full(3, np.nan)}

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
"""Names by ours, Mixamo and Rokoko; our name of the parent; between which joints it is, at what share; at rest.

The head of ours is where the joint is; theirs is at the base of the skull, of which the centre is in the middle."""


@dataclass(frozen=True)
class Character:
    """Points that make a character.

    Attributes
    ----------
    names : tuple of str
        Points without children end limbs.
    parents : tuple of int
    positions : (T, P, 3)
        mm.
    rest : (P, 3)
        Directions from the parents at rest; NaN where it is the mean direction.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: np.ndarray
    rest: np.ndarray


def character(positions: np.ndarray, names: Names) -> Character:
    """Return the character of joints (T, 15, 3) of somebody who walks along z, y up, with these names."""
    require_shape("positions", positions, (len(positions), len(WALKER15.joints), 3))
    at = {joint: positions[:, j] for j, joint in enumerate(WALKER15.joints)}
    whose = list(Names).index(names)
    right = _LIMBS.replace("left", "right").replace("Left", "Right")
    rows = [line.split() for line in f"{_TRUNK}{_LIMBS}{right}".split("\n") if line]
    ours = [row[0] for row in rows]
    called = [row[whose] for row in rows]
    parents = [ours.index(row[3]) if row[3] in ours else -1 for row in rows]
    shares = [1.0 if row[0] == "head" and names is Names.ours else float(row[6]) for row in rows]
    points = [at[row[4]] + share * (at[row[5]] - at[row[4]]) for row, share in zip(rows, shares, strict=True)]
    rest = [_DIRECTIONS[row[7]] for row in rows]
    lift = 0.0
    for side in ("left", "right"):
        hip, knee, ankle = (at[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        stature = float(np.linalg.norm([knee - hip, ankle - knee], axis=-1).mean(axis=1).sum()) / _LEG
        down = _unit(ankle - knee)
        forwards = _unit(np.cross(at["right_hip"] - at["left_hip"], down))
        ball = ankle + stature * (_FOOT_FORWARD * forwards + _FOOT_DOWN * down)
        toes = (f"{side}_toes", f"{side.capitalize()}ToeBase", f"{side.capitalize()}Toe")[whose]
        called += [toes, f"{toes}_end"]
        parents += [ours.index(f"{side}_ankle"), len(points)]
        points += [ball, ball + stature * _TOES * forwards]
        rest += [_unit(_FOOT_FORWARD * _FORWARD - _FOOT_DOWN * _UP), _FORWARD]
        lift = max(lift, stature * _FOOT_DOWN)
    return Character(tuple(called), tuple(parents), np.stack(points, axis=1) + lift * _UP, np.stack(rest))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
