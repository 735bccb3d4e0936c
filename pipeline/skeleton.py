"""Joints, parents, mirror pairs and the world frame; source points to joints.

Conventions
-----------
World: right-handed, z up, the walk along +y, +x to the walker's right.  Lengths in millimetres.
Axis order of every array of positions: ``(frame, joint, space)``.

A *source mapping* (``conf/skeleton/*.yaml``) gives the weighted source points of each joint, and the axis of the
file that points up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pipeline.validation import InvalidInput, require_choice

MILLIMETRES = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Millimetres in one unit of length, by the unit's short name."""


@dataclass(frozen=True)
class Skeleton:
    """A tree of joints.

    Attributes
    ----------
    name : str
    joints : tuple of str
        Names in array order.
    parents : tuple of int
        Index of each joint's parent; -1 for the root.
    mirror : tuple of int
        Index of the joint that takes this one's place when left and right change sides.
    """

    name: str
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
        return self.joints.index(require_choice(f"a joint of {self.name}", joint, self.joints))

    @property
    def bones(self) -> tuple[tuple[int, int], ...]:
        """Pairs (parent, child)."""
        return tuple((p, j) for j, p in enumerate(self.parents) if p >= 0)


WALKER15 = Skeleton(
    name="WALKER15",
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


@dataclass(frozen=True)
class MotionCapture:
    """A recording as every reader of `pipeline.formats` returns it.

    Attributes
    ----------
    names : tuple of str
        P point names: markers, segment origins or bone ends.
    positions_mm : (T, P, 3) float64
        Positions in millimetres, in the file's own axes; NaN where not valid.
    valid : (T, P) bool
        False where the point was not measured.
    frame_rate_hz : float
    units : str
        The unit of length that the file declares or that the caller gave (``"mm"``, ``"m"``, ``"in/0.45"``…).
    channels : tuple of str
        Names of the C angle channels, e.g. ``"lfemur.rx"``; empty for files of points.
    angles_deg : (T, C) float64
        The channels as written in the file, before forward kinematics; ``(T, 0)`` for files of points.
    notes : tuple of str
        What is odd in the file but readable, one sentence each (a frame count that disagrees, …).
    """

    names: tuple[str, ...]
    positions_mm: np.ndarray
    valid: np.ndarray
    frame_rate_hz: float
    units: str
    channels: tuple[str, ...]
    angles_deg: np.ndarray
    notes: tuple[str, ...] = ()


@dataclass(kw_only=True)
class Lowering:
    """Vertical drop of a joint: a fraction `by` of the mean distance `between` two source points."""

    by: float
    between: list[str]


class UpAxis(StrEnum):
    """Axis of a file that points up."""

    x = "x"
    y = "y"
    z = "z"


@dataclass(kw_only=True)
class SourceMapping:
    """Rules that turn the points of a source into joints; one file of ``conf/skeleton/`` each.

    Attributes
    ----------
    name : str
    up : UpAxis
    joints : dict
        joint → {source point: weight}; weights sum to one.
    otherwise : dict
        The same, for a joint whose source points in `joints` are not all in the file.
    lowered : dict
        joint → `Lowering`, applied only to a joint made by `otherwise`.
    """

    name: str
    up: UpAxis = UpAxis.z
    joints: dict[str, dict[str, float]] = field(default_factory=dict)
    otherwise: dict[str, dict[str, float]] = field(default_factory=dict)
    lowered: dict[str, Lowering] = field(default_factory=dict)


@dataclass(frozen=True)
class LimbTree:
    """Rigid parts of a body between joints of a skeleton, each limb after its parent.

    Attributes
    ----------
    name : str
    limbs : tuple of str
        Names in array order.
    ends : tuple of (int, int)
        Joints of `skeleton` at which each limb begins and ends.
    parents : tuple of int
        Index of each limb's parent; -1 for the root.
    mirror : tuple of int
        Index of the limb that takes this one's place when left and right change sides.
    skeleton : Skeleton
    """

    name: str
    limbs: tuple[str, ...]
    ends: tuple[tuple[int, int], ...]
    parents: tuple[int, ...]
    mirror: tuple[int, ...]
    skeleton: Skeleton


POSTURE12 = LimbTree(
    name="POSTURE12",
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
    parents=(-1, 0, 1, 1, 0, 0, 4, 5, 2, 2, 8, 9),
    mirror=(0, 1, 2, 3, 5, 4, 7, 6, 9, 8, 11, 10),
    skeleton=WALKER15,
)
"""The twelve rigid parts of [mozerov2006 1], rooted at the hip; hip and shoulder are axes from left to right."""


_TO_Z_UP = {
    UpAxis.x: np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    UpAxis.y: np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    UpAxis.z: np.eye(3),
}
"""Rotations (cyclic permutations, so handedness is kept) that bring the named axis to z."""


def map_joints(
    motion: MotionCapture, mapping: SourceMapping, skeleton: Skeleton = WALKER15
) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from source points, with z up.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
    skeleton : Skeleton

    Returns
    -------
    positions : (T, J, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, J) bool

    Raises
    ------
    InvalidInput
        If a joint has no rule, a rule names points that the file lacks, weights do not sum to one, or a
        point stands twice in the file (two people).
    """
    rotation = _TO_Z_UP[require_choice(f"{mapping.name}.up", mapping.up, _TO_Z_UP)]
    for joint in (*mapping.joints, *mapping.otherwise, *mapping.lowered):
        require_choice(f"{mapping.name}.joints", joint, skeleton.joints)
    positions = np.empty((len(motion.positions_mm), len(skeleton.joints), 3))
    for j, joint in enumerate(skeleton.joints):
        rule, points = _rule_of(joint, motion.names, mapping)
        weights = np.array(list(rule.values()), dtype=float)
        if abs(weights.sum() - 1.0) > 1e-6:
            what, received = f"the weights of {joint!r} do not sum to one", f"{weights.sum():g}"
            raise InvalidInput(what, where=mapping.name, received=received)
        source = motion.positions_mm[:, points]
        positions[:, j] = np.einsum("tpk,p->tk", source, weights) @ rotation.T
        if joint in mapping.lowered and rule is mapping.otherwise.get(joint):
            lowering = mapping.lowered[joint]
            pair = [i for point in lowering.between if (i := _find(motion.names, point)) is not None]
            if len(pair) != 2:
                what, received = (
                    f"the lowering of {joint!r} needs two points of the file",
                    str(lowering.between),
                )
                raise InvalidInput(what, where=mapping.name, received=received)
            ends = motion.positions_mm[:, pair]
            distance = np.nanmean(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1))
            positions[:, j, 2] -= lowering.by * distance
    return positions, np.all(np.isfinite(positions), axis=-1)


def _rule_of(
    joint: str, names: tuple[str, ...], mapping: SourceMapping
) -> tuple[dict[str, float], list[int]]:
    """The first rule of a joint whose source points are all in the file, and the indices of these points."""
    rules = [rules[joint] for rules in (mapping.joints, mapping.otherwise) if rules.get(joint)]
    if not rules:
        raise InvalidInput(f"no rule for the joint {joint!r}", where=mapping.name)
    for rule in rules:
        found = {point: _find(names, point) for point in rule}
        indices = [i for i in found.values() if i is not None]
        if len(indices) == len(rule):
            return rule, indices
    missing = next(point for point, i in found.items() if i is None)
    what = f"the joint {joint!r} needs the point {missing!r}, which the file does not have"
    received = "points " + ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
    raise InvalidInput(what, where=mapping.name, received=received)


def _find(names: tuple[str, ...], wanted: str) -> int | None:
    """Index of a source point: exact name, else case-insensitive, else after a ``Subject:`` prefix."""
    for normalise in (lambda s: s, str.lower, lambda s: s.rsplit(":", 1)[-1].lower()):
        target = normalise(wanted)
        found = [i for i, name in enumerate(names) if normalise(name) == target]
        if len(found) > 1:
            received = ", ".join(names[i] for i in found[:3])
            what = f"{len(found)} points are called {wanted!r}"
            raise InvalidInput(what, expected="one person to a file", received=received)
        if found:
            return found[0]
    return None
