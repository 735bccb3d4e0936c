"""Skeleton as a tree of joints with mirror pairs, and the rigid limbs between the joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.validation import require_choice


@dataclass(frozen=True)
class Skeleton:
    """Tree of joints, with the joint on the other side of the body for each joint.

    Attributes
    ----------
    joints : tuple of str
        Names in array order.
    parents : tuple of int
        Index of each joint's parent; -1 for the root.
    mirror : tuple of int
        Index of the corresponding joint on the other side; the joint itself on the midline.
    """

    joints: tuple[str, ...]
    parents: tuple[int, ...]
    mirror: tuple[int, ...]

    def index(self, joint: str) -> int:
        """Return the index of a joint.  Raises InvalidInput if the joint does not exist.

        Examples
        --------
        >>> WALKER15.index("left_knee")
        10
        """
        return self.joints.index(require_choice("a joint of WALKER15", joint, self.joints))

    @property
    def bones(self) -> tuple[tuple[int, int], ...]:
        """Bones of the skeleton as pairs (parent, child) of joint indices."""
        return tuple((p, j) for j, p in enumerate(self.parents) if p >= 0)


WALKER15 = Skeleton(
    joints=(
        "head",
        "sternum",
        "left_shoulder",
        "left_elbow",
        "left_wrist",
        "right_shoulder",
        "right_elbow",
        "right_wrist",
        "pelvis",
        "left_hip",
        "left_knee",
        "left_ankle",
        "right_hip",
        "right_knee",
        "right_ankle",
    ),
    parents=(1, 8, 1, 2, 3, 1, 5, 6, -1, 8, 9, 10, 8, 12, 13),
    mirror=(0, 1, 5, 6, 7, 2, 3, 4, 8, 12, 13, 14, 9, 10, 11),
)
"""Skeleton of the fifteen virtual markers of [zhang2007 figure 1]; every array of joints has this order."""

PELVIS = WALKER15.index("pelvis")
LEFT_LEG, RIGHT_LEG = (
    [WALKER15.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")
)
"""Indices of hip, knee and ankle of the left and the right leg."""
ANKLES = [LEFT_LEG[2], RIGHT_LEG[2]]
"""Indices of the left and the right ankle."""

LEG_LENGTH_MM = (300.0, 1300.0)
"""Range of human leg lengths from hip to knee to ankle, mm; other lengths indicate a wrong unit."""


def leg_length(positions: np.ndarray) -> float:
    """Leg length from hip to knee to ankle, mm: the mean of both sides, each averaged over its measured frames.

    NaN if one side has no measured frame.
    """
    lengths = np.stack(
        [
            np.linalg.norm(np.diff(positions[:, side], axis=1), axis=-1).sum(axis=1)
            for side in (LEFT_LEG, RIGHT_LEG)
        ]
    )
    finite = np.isfinite(lengths)
    if not finite.any(axis=1).all():
        return np.nan
    return float(np.mean([side[frames].mean() for side, frames in zip(lengths, finite, strict=True)]))


@dataclass(frozen=True)
class Limbs:
    """Rigid limbs between joints of WALKER15, ordered from the root of the skeleton outwards.

    Attributes
    ----------
    limbs : tuple of str
        Names in array order.
    ends : tuple of (int, int)
        Indices of the joints at the two ends of each limb.
    """

    limbs: tuple[str, ...]
    ends: tuple[tuple[int, int], ...]


POSTURE12 = Limbs(
    limbs=(
        "hip",
        "torso",
        "shoulder",
        "neck",
        "left_thigh",
        "right_thigh",
        "left_leg",
        "right_leg",
        "left_arm",
        "right_arm",
        "left_forearm",
        "right_forearm",
    ),
    ends=(
        (9, 12),
        (8, 1),
        (2, 5),
        (1, 0),
        (9, 10),
        (12, 13),
        (10, 11),
        (13, 14),
        (2, 3),
        (5, 6),
        (3, 4),
        (6, 7),
    ),
)
"""Twelve rigid limbs of a posture, with the hip as root [mozerov2006 1].

The limbs between the hips and between the shoulders point from left to right.
"""
