"""Joints, parents, mirror pairs and the world frame; source points to joints.

Conventions
-----------
World: right-handed, z up, the walk along +y, +x to the walker's right.  Lengths in millimetres.
Axis order of every array of positions: ``(frame, joint, space)``.

A *source mapping* (``conf/skeleton/*.yaml``) gives the weighted source points of each joint, and the axis of the
file that points up.  Names of points match without case, separators and prefixes, with the side at either end:
``LANK``, ``anna:l_ank``, ``Ank.L`` and ``LeftAnk`` are the same point.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
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
    units_assumed : bool
        Whether neither the file nor the caller stated the unit.
    """

    names: tuple[str, ...]
    positions_mm: np.ndarray
    valid: np.ndarray
    frame_rate_hz: float
    units: str
    channels: tuple[str, ...]
    angles_deg: np.ndarray
    notes: tuple[str, ...] = ()
    units_assumed: bool = False


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
    minus_x = "-x"
    minus_y = "-y"
    minus_z = "-z"
    auto = "auto"
    """The axis along which the hips are above the ankles."""


Rule = dict[str, float]
"""Source points of a joint and their weights, which sum to one."""


@dataclass(kw_only=True)
class SourceMapping:
    """Rules that turn the points of a source into joints; one file of ``conf/skeleton/`` each.

    Attributes
    ----------
    name : str
    up : UpAxis
    joints : dict
        joint → {source point: weight}, or a list of such rules; the first whose points the file has is used.
    otherwise : dict
        The same, for a joint of which no rule in `joints` can be used.
    lowered : dict
        joint → `Lowering`, applied only to a joint made by `otherwise`.
    points : dict
        source point → other names that it goes by.
    recognised_by : list of str
        Points without which a file is not taken to be of this family unasked.
    units : str
        Unit of length of files of this family that do not state theirs.
    guessed : list of str
        Joints whose rules were proposed from names and geometry and have not been confirmed by anyone.
    """

    name: str
    up: UpAxis = UpAxis.auto
    joints: Mapping[str, Rule | list[Rule]] = field(default_factory=dict)
    otherwise: Mapping[str, Rule | list[Rule]] = field(default_factory=dict)
    lowered: dict[str, Lowering] = field(default_factory=dict)
    points: dict[str, list[str]] = field(default_factory=dict)
    recognised_by: list[str] = field(default_factory=list)
    units: str = ""
    guessed: list[str] = field(default_factory=list)

    def rules(self, joint: str) -> list[tuple[Rule, Lowering | None]]:
        """Return the rules of a joint in order, each with the lowering that belongs to it."""
        first, last = (_listed(rules.get(joint)) for rules in (self.joints, self.otherwise))
        return [(rule, None) for rule in first] + [(rule, self.lowered.get(joint)) for rule in last]


def _listed(rules: Rule | list[Rule] | None) -> list[Rule]:
    return [] if not rules else rules if isinstance(rules, list) else [rules]


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
    UpAxis.minus_x: np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    UpAxis.minus_y: np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    UpAxis.minus_z: np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
"""Rotations (which keep handedness) that bring the named axis to z."""

LOWER_BODY = ("pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle")
"""Joints without which there is no walk: they are never estimated."""


def map_joints(
    motion: MotionCapture, mapping: SourceMapping, skeleton: Skeleton = WALKER15, *, missing: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from source points, with z up.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
    skeleton : Skeleton
    missing : bool
        Whether joints other than legs and pelvis may be missing: they are NaN and not valid throughout.

    Returns
    -------
    positions : (T, J, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, J) bool

    Raises
    ------
    InvalidInput
        If a joint that may not be missing has no rule or its rules name points that the file lacks, weights do
        not sum to one, or a point stands twice in the file (two people).
    """
    require_choice(f"{mapping.name}.up", mapping.up, UpAxis)
    for joint in (*mapping.joints, *mapping.otherwise, *mapping.lowered):
        require_choice(f"{mapping.name}.joints", joint, skeleton.joints)
    points = SourcePoints(motion, mapping.points)
    found = {joint: points.rule_of(joint, mapping) for joint in skeleton.joints}
    for joint, rule in found.items():
        if rule is None and (joint in LOWER_BODY or not missing):
            raise points.lacking(joint, mapping)
    positions = np.full((len(motion.positions_mm), len(skeleton.joints), 3), np.nan)
    for j, joint in enumerate(skeleton.joints):
        if (rule := found[joint]) is not None:
            weights = np.array(list(rule[0].values()), dtype=float)
            if abs(weights.sum() - 1.0) > 1e-6:
                what, received = f"the weights of {joint!r} do not sum to one", f"{weights.sum():g}"
                raise InvalidInput(what, where=mapping.name, received=received)
            source = motion.positions_mm[:, [points.index(point) for point in rule[0]]]
            positions[:, j] = np.einsum("tpk,p->tk", source, weights)
    up = _up_axis(positions, skeleton) if mapping.up == UpAxis.auto else UpAxis(mapping.up)
    positions = positions @ _TO_Z_UP[up].T
    for j, joint in enumerate(skeleton.joints):
        if (rule := found[joint]) is not None and rule[1] is not None:
            positions[:, j, 2] -= rule[1].by * points.distance(joint, rule[1], mapping)
    return positions, np.all(np.isfinite(positions), axis=-1)


def _up_axis(positions: np.ndarray, skeleton: Skeleton) -> UpAxis:
    """The signed axis along which hips are above ankles, all over the clip."""
    hips, ankles = (
        [k for k, joint in enumerate(skeleton.joints) if joint.endswith(part)] for part in ("hip", "ankle")
    )
    if not hips or not ankles:
        return UpAxis.z
    legs = (positions[:, hips] - positions[:, ankles]).reshape(-1, 3)
    legs = legs[np.isfinite(legs).all(axis=1)]
    if not len(legs):
        return UpAxis.z
    mean = legs.mean(axis=0)
    axis = int(np.abs(mean).argmax())
    return UpAxis(("-" if mean[axis] < 0 else "") + "xyz"[axis])


_SEPARATORS = re.compile(r"[\W_]+")
_SIDE_FIRST = re.compile(r"(left|right|lt|rt|l|r)[\W_]+(?=.)|(left|right)(?=[a-z0-9])", re.IGNORECASE)
_SIDE_LAST = re.compile(r"(?<=.)[\W_]+(left|right|lt|rt|l|r)$|(?<=[A-Za-z0-9])(Left|Right)$", re.IGNORECASE)


def plain_name(name: str) -> str:
    """Return a name without prefix, separators and case, a side written out or at the end as one letter in front.

    Examples
    --------
    >>> [plain_name(n) for n in ("anna:L_Ank", "Ank.L", "LeftAnk", "LANK", "l ank", "Ball")]
    ['lank', 'lank', 'lank', 'lank', 'lank', 'ball']
    """
    name = name.rsplit(":", 1)[-1].strip()
    if match := _SIDE_FIRST.match(name) or _SIDE_LAST.search(name):
        side = (match[1] or match[2])[0]
        name = side + name[: match.start()] + name[match.end() :]
    return _SEPARATORS.sub("", name).lower()


class SourcePoints:
    """The points of a recording by their names, as rules of a mapping ask for them.

    Parameters
    ----------
    motion : MotionCapture
    synonyms : mapping of str to list of str
        Other names that points go by.
    """

    def __init__(self, motion: MotionCapture, synonyms: Mapping[str, Iterable[str]]) -> None:
        self._motion = motion
        self._seen = np.asarray(motion.valid.any(axis=0))
        self._synonyms = synonyms
        names = motion.names
        after = [name.rsplit(":", 1)[-1] for name in names]
        begin = _shared_beginning(after)
        self._ways = (
            (str, _places(names)),
            (str.lower, _places([name.lower() for name in names])),
            (lambda name: name.rsplit(":", 1)[-1].lower(), _places([name.lower() for name in after])),
            (plain_name, _places([plain_name(name) for name in names])),
            (plain_name, _places([plain_name(name[begin:]) for name in after]) if begin else {}),
        )
        self._found: dict[str, int | None] = {}

    def find(self, wanted: str) -> int | None:
        """Return the index of a point by its name or a synonym; None if it is not there."""
        if wanted not in self._found:
            candidates = (self._by_name(name) for name in (wanted, *self._synonyms.get(wanted, ())))
            self._found[wanted] = next((index for index in candidates if index is not None), None)
        return self._found[wanted]

    def index(self, wanted: str) -> int:
        """Return the index of a point that is there."""
        index = self.find(wanted)
        assert index is not None
        return index

    def _by_name(self, wanted: str) -> int | None:
        for normalise, places in self._ways:
            found = places.get(normalise(wanted), [])
            if len(found) > 1:  # a second one that was never seen is no second person
                found = [i for i in found if self._seen[i]] or found[:1]
            if len(found) > 1:
                found = self._one_of(found, wanted)
            if found:
                return found[0]
        return None

    def _one_of(self, found: list[int], wanted: str) -> list[int]:
        """One of several points of a name: they must be spelled alike, and equal wherever both were seen."""
        positions = self._motion.positions_mm[:, found]
        off = np.asarray(np.abs(positions - positions[:, :1]))
        spellings = {self._motion.names[i] for i in found}
        if len(spellings) > 1 or (off[np.isfinite(off)] > 1.0).any() or not np.isfinite(off[:, 1:]).any():
            received = ", ".join(self._motion.names[i] for i in found[:3])
            what = f"{len(found)} points are called {wanted!r}"
            raise InvalidInput(what, expected="one person to a file", received=received)
        return [max(found, key=lambda i: int(self._motion.valid[:, i].sum()))]

    def rule_of(self, joint: str, mapping: SourceMapping) -> tuple[Rule, Lowering | None] | None:
        """Return the first rule of a joint whose points are all in the file, those that were ever seen first."""
        there = [
            (rule, lowering)
            for rule, lowering in mapping.rules(joint)
            if all(self.find(point) is not None for point in rule)
        ]
        seen = [pair for pair in there if self.sees(pair[0])]
        return next(iter(seen or there), None)

    def sees(self, rule: Rule) -> bool:
        """Return whether all points of a rule are in the file and were ever seen."""
        return all((index := self.find(point)) is not None and self._seen[index] for point in rule)

    def lacking(self, joint: str, mapping: SourceMapping) -> InvalidInput:
        """Return the refusal of a file from which a joint cannot be made."""
        rules = mapping.rules(joint)
        if not rules:
            return InvalidInput(f"no rule for the joint {joint!r}", where=mapping.name)
        lacked = next(point for point in rules[-1][0] if self.find(point) is None)
        what = f"the joint {joint!r} needs the point {lacked!r}, which the file does not have"
        names = self._motion.names
        received = "points " + ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
        return InvalidInput(what, where=mapping.name, received=received)

    def distance(self, joint: str, lowering: Lowering, mapping: SourceMapping) -> float:
        """Return the mean distance, mm, of the two points by which a joint is lowered."""
        pair = [index for point in lowering.between if (index := self.find(point)) is not None]
        if len(pair) != 2:
            what = f"the lowering of {joint!r} needs two points of the file"
            raise InvalidInput(what, where=mapping.name, received=str(lowering.between))
        ends = self._motion.positions_mm[:, pair]
        apart = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)
        if not np.isfinite(apart).any():
            what = f"the two points by which {joint!r} is lowered were never seen together"
            raise InvalidInput(what, where=mapping.name, received=str(lowering.between))
        return float(np.nanmean(apart))


def _places(names: Iterable[str]) -> dict[str, list[int]]:
    places: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        places.setdefault(name, []).append(index)
    return places


def _shared_beginning(names: list[str]) -> int:
    """Length of the beginning that all names have in common, such as ``mixamorig``; 0 if it is no prefix."""
    length = 0
    while names and all(len(name) > length + 1 and name[length] == names[0][length] for name in names):
        length += 1
    return length if length >= 3 and len(names) >= 7 else 0
