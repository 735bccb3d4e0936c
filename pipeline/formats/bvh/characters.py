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

_TRUNK = (
    (0.0, ("pelvis", "Hips", "Hips")),
    (0.1, ("spine", "Spine", "Spine1")),
    (0.4, ("chest", "Spine1", "Spine2")),
    (0.7, ("upper_chest", "Spine2", "Spine3")),
    (1.0, ("sternum", "Neck", "Neck")),
)
"""Place of a joint between pelvis and sternum, each the parent of the next, and its names by `Names`."""
_LIMB_NAMES = {
    "shoulder": ("collar", "Shoulder", "Shoulder"), "arm": ("shoulder", "Arm", "Arm"),
    "forearm": ("elbow", "ForeArm", "ForeArm"), "hand": ("wrist", "Hand", "Hand"), "thigh": ("hip", "UpLeg", "Thigh"),
    "shank": ("knee", "Leg", "Shin"), "foot": ("ankle", "Foot", "Foot"), "toes": ("toes", "ToeBase", "Toe"),
}  # fmt: skip


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
    found: list[tuple[str, int, np.ndarray, np.ndarray | None]] = []

    def add(name: str, parent: int, points: np.ndarray, rest: np.ndarray | None) -> int:
        found.append((name, parent, points, rest))
        return len(found) - 1

    def called(side: str, part: str) -> str:
        name = _LIMB_NAMES[part][whose]
        return f"{side}_{name}" if names is Names.ours else f"{side.capitalize()}{name}"

    for number, (share, of) in enumerate(_TRUNK):
        place = (1.0 - share) * at["pelvis"] + share * at["sternum"]
        add(of[whose], number - 1, place, _UP if number else None)
    # Ours is where the joint is; theirs is at the base of the skull, of which the centre is in the middle of the bone.
    skull = at["head"] - at["sternum"]
    base, name = (1.0, "head") if names is Names.ours else (0.6, "Head")
    head = add(name, len(_TRUNK) - 1, at["sternum"] + base * skull, _UP)
    add("head_end", head, at["sternum"] + 1.4 * skull, _UP)
    for side, outwards in (("left", _LEFT), ("right", -_LEFT)):
        shoulder, elbow, wrist = (at[f"{side}_{joint}"] for joint in ("shoulder", "elbow", "wrist"))
        above = add(called(side, "shoulder"), 3, 0.85 * at["sternum"] + 0.15 * shoulder, None)
        for part, points in (("arm", shoulder), ("forearm", elbow), ("hand", wrist)):
            above = add(called(side, part), above, points, outwards)
        add(f"{side}_hand_end", above, wrist + 0.4 * (wrist - elbow), outwards)
        hip, knee, ankle = (at[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        above = add(called(side, "thigh"), 0, hip, None)
        for part, points in (("shank", knee), ("foot", ankle)):
            above = add(called(side, part), above, points, -_UP)
        stature = (
            float(np.linalg.norm(knee - hip, axis=1).mean() + np.linalg.norm(ankle - knee, axis=1).mean())
            / _LEG
        )
        down = _unit(ankle - knee)
        forwards = _unit(np.cross(at["right_hip"] - at["left_hip"], down))
        ball = (
            stature * np.hypot(_FOOT_FORWARD, _FOOT_DOWN) * _unit(_FOOT_FORWARD * _FORWARD - _FOOT_DOWN * _UP)
        )
        foot = ball[2] * forwards - ball[1] * down
        above = add(called(side, "toes"), above, ankle + foot, _unit(ball))
        add(f"{side}_toes_end", above, ankle + foot + stature * _TOES * forwards, _FORWARD)
    nowhere = np.full(3, np.nan)
    return Character(
        names=tuple(name for name, *_ in found),
        parents=tuple(parent for _, parent, *_ in found),
        positions=np.stack([points for _, _, points, _ in found], axis=1) + stature * _FOOT_DOWN * _UP,
        rest=np.stack([nowhere if rest is None else rest for *_, rest in found]),
    )


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))
