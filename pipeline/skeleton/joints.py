"""Joints with their parents and mirror pairs, and rigid parts between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.validation import require_choice


@dataclass(frozen=True)
class Skeleton:
    """A tree of joints.

    Attributes
    ----------
    joints : tuple of str
        Names in array order.
    parents : tuple of int
        Index of each joint's parent; -1 for the root.
    mirror : tuple of int
        Index of the joint that takes this one's place when left and right change sides.
    """

    joints: tuple[str, ...]
    parents: tuple[int, ...]
    mirror: tuple[int, ...]

    def index(self, joint: str) -> int:
        """Index of a joint.  Raises InvalidInput if the skeleton has no such joint.

        Examples
        --------
        >>> WALKER15.index("left_knee")
        10
        """
        return self.joints.index(require_choice("a joint of WALKER15", joint, self.joints))

    @property
    def bones(self) -> tuple[tuple[int, int], ...]:
        """Pairs (parent, child)."""
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
"""The fifteen virtual markers of [zhang2007 figure 1], in the order of every array."""

PELVIS = WALKER15.index("pelvis")
LEFT_LEG, RIGHT_LEG = (
    [WALKER15.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")
)
"""Hip, knee and ankle."""
ANKLES = [LEFT_LEG[2], RIGHT_LEG[2]]

LEG_LENGTH_MM = (300.0, 1300.0)
"""Hip to knee to ankle of a small child and of a very tall adult: outside of it the unit is wrong."""


def leg_length(positions: np.ndarray) -> float:
    """Hip to knee to ankle in mm, mean over sides and the frames that show them; NaN where none does."""
    lengths = np.stack(
        [
            np.linalg.norm(np.diff(positions[:, side], axis=1), axis=-1).sum(axis=1)
            for side in (LEFT_LEG, RIGHT_LEG)
        ]
    )
    seen = np.isfinite(lengths)
    if not seen.any(axis=1).all():
        return np.nan
    return float(np.mean([side[known].mean() for side, known in zip(lengths, seen, strict=True)]))


@dataclass(frozen=True)
class Limbs:
    """Rigid parts of a body between joints of WALKER15, each limb after the one that carries it.

    Attributes
    ----------
    limbs : tuple of str
        Names in array order.
    ends : tuple of (int, int)
        Joints at which each limb begins and ends.
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
"""The twelve rigid parts of [mozerov2006 1], rooted at the hip; hip and shoulder are axes from left to right."""
