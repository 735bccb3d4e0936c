"""Proposal of a mapping for an unknown marker set, from point names and distances to the average walker.

The average walker of the synthetic population is scaled to the recording.  In each frame, it is shifted, rotated about
the vertical, and set to the best phase of the step.  Then each joint gets the point, or the centre of two
points, with the best name and distance.  The two steps alternate a few times.  If names give no sides, the walker
starts from several headings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from pipeline import mappings
from pipeline.clips.missing_joints import LEG_MM, population
from pipeline.core import fourier, walking
from pipeline.ingestion.joints import technical_clusters
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import MappedPoints, bare_names, plain_name
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.validation import InvalidInput, listed

PHASES, FRAMES, ROUNDS, HEADINGS = 8, 24, 4, 12
"""Numbers of walker phases, of frames, of alternations between alignment and assignment, and of initial headings."""

NEIGHBOURS_MM = 160.0
"""Largest distance, mm at leg length `LEG_MM`, between two points on opposite sides of a joint."""

UNNAMED_PENALTY_MM = 250.0
"""Penalty, mm, added to the distance of a point whose name does not contain the joint's name."""

MAX_SIDE_POINTS = 200
"""Largest number of points on one side of the body for which pairs are considered; surface scans have more."""

TINY = 1e-9
"""Smallest scale of the walker; it avoids division by zero if all points coincide."""

FAR_MM = 0.4 * LEG_MM
"""Distance, mm, assumed for a joint without a point, and upper limit of distances in the choice of the phase."""

MAX_UNNAMED_MM = 0.2 * LEG_MM
"""Largest distance, mm, from a joint to a point that is named after a segment, or not named after the joint."""

MAX_NAMED_MM = 2 * FAR_MM
"""Largest distance, mm, from a joint to a point that is named after the joint."""

PART_NAMES = {
    "head": ("head", "hd", "nose", "ear", "skull"),
    "sternum": ("stern", "clav", "chest", "thorax", "neck", "c7", "t1", "jug", "manub"),
    "shoulder": ("sho", "acr", "upperarm", "uparm", "uarm", "larm", "rarm", "humer"),
    "elbow": ("elb", "epic", "forearm", "lowerarm", "farm"),
    "wrist": ("wri", "rad", "uln", "styl", "hand"),
    "pelvis": ("pelv", "sacr", "hips", "root", "waist"),
    "hip": ("hip", "hjc", "troch", "asi", "ias", "upleg", "upperleg", "thigh"),
    "knee": ("kne", "condy", "latcon", "medcon", "lfc", "fle", "shin", "shank", "lowerleg"),
    "ankle": ("ank", "mal", "tal", "foot", "heel", "calc"),
}
"""Words that identify the points of each joint by their names."""

SEGMENT = re.compile("thigh|shin|shank")
"""Pattern of words for segments; a marker with such a name may be far from the segment's upper joint."""

NOT_A_POINT = re.compile(r"angle|force|moment|power|grf|progress", re.IGNORECASE)
"""Pattern of words in the names of model outputs, which C3D files store in the same way as points."""

MIN_POINTS = 7
"""Smallest number of points that can represent a body."""

REMARK = (
    "# Among points with similar names, those nearest to the joints of an average walker were selected.\n"
)
"""First line of a file with a proposed mapping."""

HIPS = ("left_hip", "right_hip")
REGRESSIONS = {
    "skin_landmarks": ("L.ASIS", "R.ASIS", "L.PSIS", "R.PSIS", "Sacrum"),
    "trochanters": ("L.GT", "R.GT"),
}
"""Mappings that compute the hips by a regression, the more accurate first, and the points of each regression."""

PARTS = ("ankle", "knee", "hip", "shoulder", "elbow", "wrist")


Points = tuple[int, ...]
Assignment = dict[str, Points]
"""Assignment of points to joints: one point for a joint, or several points whose centre is the joint."""


def propose(motion: MotionCapture, name: str) -> SourceMapping:
    """Propose a mapping from point names, sides and distances to the average walker; every joint is marked as a guess.

    Points of technical clusters are left out.  If the points of the hips are pelvis markers or trochanters, the hips
    come from their regression.  A joint whose rule fails `pipeline.mappings.check` is not proposed.

    Parameters
    ----------
    motion : MotionCapture
    name : str

    Raises
    ------
    InvalidInput
        If the recording has too few points, or no point resembles a joint.
    """
    names, positions, up = _points(motion, name)
    body = _Body([plain_name(point) for point in bare_names(names)], positions)
    cycle = fourier.synthesise(population().mean.reshape(5, 15, 3), 1.0, np.arange(PHASES) / PHASES)
    starts = [*body.by_names(), *body.starts(cycle)]
    assignment = min((body.matched(start, cycle) for start in starts), key=lambda fit: fit[0])[1]
    if not assignment:
        raise InvalidInput(
            "no point of the recording is near a joint of the average walker",
            name,
            received=f"points {listed(names)}",
            code="no_joint_like",
        )
    joints: dict[str, Rule] = {
        joint: {names[k]: 1.0 / len(assignment[joint]) for k in assignment[joint]}
        for joint in WALKER15.joints
        if joint in assignment
    }
    regressed, lowered = _regressed(motion, {point for hip in HIPS for point in joints.get(hip, {})})
    joints = {joint: rule for joint, rule in joints.items() if joint not in regressed}
    mapping = SourceMapping(name=name, up=up, joints=joints, otherwise=regressed, lowered=lowered)
    failing = {joint for complaint in mappings.check(motion, mapping) for joint in complaint.where}
    for joint in failing:
        joints.pop(joint, None)
        regressed.pop(joint, None)
        lowered.pop(joint, None)
    mapping.guessed = [joint for joint in WALKER15.joints if mapping.rules(joint)]
    return mapping


def _regressed(motion: MotionCapture, hips: set[str]) -> tuple[dict[str, Rule], dict[str, Lowering]]:
    """Return rules and downward shifts for hips and pelvis, from the first regression whose points are in the file.

    The result is empty if `hips`, the points assigned to the hips, are not points of a regression.
    """
    landmarks: set[str] = set()
    rules: dict[str, Rule] = {}
    lowered: dict[str, Lowering] = {}
    for family, marks in REGRESSIONS.items():
        points = MappedPoints(motion, mappings.shipped()[family])
        names = {mark: motion.names[points.index(mark)] for mark in marks if points.find(mark) is not None}
        landmarks |= {*names.values()}
        regression = {joint: points.rule_of(joint) for joint in (*HIPS, "pelvis")}
        for joint, pair in regression.items():
            if not rules.keys() >= regression.keys() and pair and pair[1] and points.sees(pair[0]):
                rules[joint] = {names[mark]: weight for mark, weight in pair[0].items()}
                lowered[joint] = Lowering(by=pair[1].by, between=[names[mark] for mark in pair[1].between])
    usable = len(rules) == len(regression) and (not hips or hips & landmarks)
    return (rules, lowered) if usable else ({}, {})


def _points(motion: MotionCapture, name: str) -> tuple[list[str], np.ndarray, UpAxis]:
    """Return the names and positions of usable points, and the axis that points up.

    The positions are those of evenly spaced frames, chosen among the frames with most points.
    """
    stuck = {k for group in technical_clusters(motion) for k in group}
    usable = [
        k
        for k, point in enumerate(motion.names)
        if k not in stuck and motion.valid[:, k].any() and not NOT_A_POINT.search(point)
    ]
    if len(usable) < MIN_POINTS:
        raise InvalidInput(
            "the recording has too few points for a body",
            name,
            f"{MIN_POINTS} or more",
            f"{len(usable)} points",
            code="too_few_points",
        )
    count = motion.valid[:, usable].sum(axis=1)
    full = np.flatnonzero(2 * count > count.max())
    selection = np.ix_(full[np.unique(np.linspace(0, len(full) - 1, FRAMES).round().astype(int))], usable)
    positions = np.where(motion.valid[selection][..., None], motion.positions_mm[selection], np.nan)
    # A body extends most along the vertical within a frame; over a clip it also extends along its path.
    # Only the inner four fifths count, because a root may stay on the floor.
    low, high = np.nanquantile(positions, [0.1, 0.9], axis=1)
    up = int(np.median(high - low, axis=0).argmax())
    # A cyclic permutation of the axes keeps the handedness.
    return [motion.names[k] for k in usable], np.roll(positions, 2 - up, axis=-1), UpAxis("xyz"[up])


class _Body:
    """Points of a recording, with methods that assign them to joints by names and distances.

    Parameters
    ----------
    names : list of str
        Names without prefix and separators, with the side in front.
    positions : (F, P, 3)
        Positions in selected frames, z up, in the unit of the file, NaN where not measured.
    """

    def __init__(self, names: list[str], positions: np.ndarray) -> None:
        self._names, self._positions = names, positions
        index = {point: k for k, point in reversed(list(enumerate(names)))}
        twins = {k: index.get("r" + point[1:]) for point, k in index.items() if point[:1] == "l"}
        self._twin = {k: twin for k, twin in sorted(twins.items()) if twin is not None}
        """For each point on the left, the point on the right whose name differs only in the side."""

    def _centre(self, candidate: Points) -> np.ndarray:
        """Return the positions (F, 3) of a point, or of the centre of several points."""
        return self._positions[:, list(candidate)].mean(axis=1)

    def _is_named(self, point: int, part: str) -> bool:
        """Return True if the name of a point contains a word that identifies a joint."""
        return any(word in self._names[point] for word in PART_NAMES[part])

    def _anchors(self, assignment: Assignment) -> np.ndarray:
        """Return the positions (F, 15, 3) of the assigned joints; NaN for joints without points."""
        anchors = np.full((len(self._positions), 15, 3), np.nan)
        for joint, candidate in assignment.items():
            anchors[:, WALKER15.index(joint)] = self._centre(candidate)
        return anchors

    def by_names(self) -> list[np.ndarray]:
        """Return a first estimate of the joints (F, 15, 3) from names alone, as a list with one element.

        Each joint is the centre of the points named after it.  The list is empty if fewer than 5 joints have points.
        """
        assignment = {}
        for joint in WALKER15.joints:
            side, _, part = joint.rpartition("_")
            beginning = [k for k, point in enumerate(self._names) if point.startswith(side[:1])]
            if named := tuple(k for k in beginning if self._is_named(k, part)):
                assignment[joint] = named
        anchors = self._anchors(assignment)
        return [anchors] if np.isfinite(anchors).all(axis=-1).any(axis=0).sum() >= 5 else []

    def starts(self, cycle: np.ndarray) -> Iterator[np.ndarray]:
        """Yield first estimates of the joints: the walker's mean posture, scaled to the height of the points.

        The points reach from the feet to the head, or only to the hips.  The sides of the points give the heading.
        Without sides, several headings are used, the same in all frames.
        """
        mean = cycle.mean(axis=0)
        every = np.tile(mean, (len(self._positions), 1, 1))
        z = self._positions[..., 2]
        low, high = np.nanmin(z), np.nanmax(z)
        middle = np.nanmean(self._positions, axis=1, keepdims=True) * [1, 1, 0]
        turns = [np.full(len(middle), 2 * np.pi * k / HEADINGS) for k in range(HEADINGS)]
        if self._twin:
            left, right = list(self._twin), list(self._twin.values())
            across = np.nansum(self._positions[:, right] - self._positions[:, left], axis=1)
            turns = [np.arctan2(across[:, 1], across[:, 0])]
        for first in (0, WALKER15.index("pelvis")):
            heights = mean[first:, 2]
            scale = max(float((high - low) / np.ptp(heights)), TINY)
            up = np.array([0, 0, low - scale * heights.min()])
            for turn in turns:
                start = middle + up + scale * walking.turn_about_vertical(every, turn[:, None])
                start[:, :first] = np.nan
                yield start

    def matched(self, anchors: np.ndarray, cycle: np.ndarray) -> tuple[float, Assignment]:
        """Fit the walker to estimated joints; return their mean cost, mm at leg length `LEG_MM`, and their points."""
        cost, assignment = np.inf, Assignment()
        for _ in range(ROUNDS):
            walker, scale = _aligned(anchors, cycle)
            distances, assignment = self._assigned(walker, scale)
            if len(assignment) < 4:
                return np.inf, {}
            cost = float(np.mean([*distances.values()] + [FAR_MM] * (15 - len(assignment))))
            anchors = self._anchors(assignment)
        return cost, assignment

    def _assigned(self, walker: np.ndarray, scale: float) -> tuple[dict[str, float], Assignment]:
        """Assign points to joints greedily; return each joint's cost, mm at leg length `LEG_MM`, and its points."""
        twin = self._twin
        sided = {*twin, *twin.values()}
        central: list[Points] = [(k,) for k in range(len(self._names)) if k not in sided]
        central += twin.items()
        lefts = [*((k,) for k in twin), *self._neighbours(NEIGHBOURS_MM * scale)]
        couples = [(left, tuple(twin[k] for k in left)) for left in lefts]
        single = [joint for joint in WALKER15.joints if not couples or "_" not in joint]
        options: list[tuple[tuple[str, ...], tuple[Points, ...]]]
        options = [((f"left_{p}", f"right_{p}"), couple) for p in PARTS for couple in couples]
        options += [((joint,), (points,)) for joint in single for points in central]
        distances = {
            points: self._distances(points, walker) / scale
            for points in {candidate for _, candidates in options for candidate in candidates}
        }
        ranked = []
        for n, (joints, candidates) in enumerate(options):
            errors = [
                float(distances[points][WALKER15.index(joint)])
                for joint, points in zip(joints, candidates, strict=True)
            ]
            part = joints[0].rpartition("_")[2]
            unnamed = not all(self._is_named(k, part) for points in candidates for k in points)
            if unnamed and len(joints) == 1 and len(candidates[0]) == 2:
                continue  # a left and a right point give a central joint only if their names match it
            must_be_near = unnamed or any(
                SEGMENT.search(self._names[k]) for points in candidates for k in points
            )
            if max(errors) <= (MAX_UNNAMED_MM if must_be_near else MAX_NAMED_MM):
                ranked.append((float(np.mean(errors)) + UNNAMED_PENALTY_MM * unnamed, n, joints, candidates))
        cost: dict[str, float] = {}
        assignment = Assignment()
        used: set[int] = set()
        for price, _, joints, candidates in sorted(ranked):
            indices = {k for points in candidates for k in points}
            if joints[0] not in assignment and not used & indices:
                used |= indices
                assignment |= dict(zip(joints, candidates, strict=True))
                cost |= dict.fromkeys(joints, price)
        if {"left_hip", "right_hip"} <= assignment.keys():
            hips = assignment["left_hip"] + assignment["right_hip"]
            hip_centre_cost = float(self._distances(hips, walker)[WALKER15.index("pelvis")]) / scale
            if hip_centre_cost < cost.get("pelvis", np.inf):
                assignment["pelvis"], cost["pelvis"] = hips, hip_centre_cost
        return cost, assignment

    def _distances(self, candidate: Points, walker: np.ndarray) -> np.ndarray:
        """Return a point's mean distance (15,) from the walker's joints (F, 15, 3); infinite for a missing point."""
        point = self._centre(candidate)
        measured = np.isfinite(point).all(axis=-1)
        distances = np.linalg.norm(point[measured, None] - walker[measured], axis=-1)
        return distances.mean(axis=0) if measured.any() else np.full(15, np.inf)

    def _neighbours(self, within: float) -> list[Points]:
        """Return the pairs of points on the left whose distance from each other never exceeds `within`."""
        left = list(self._twin) if len(self._twin) <= MAX_SIDE_POINTS else []
        side = self._positions[:, left]
        distance = np.linalg.norm(side[:, :, None] - side[:, None], axis=-1)
        largest = np.where(np.isfinite(distance), distance, -1.0).max(axis=0)  # -1: never measured together
        near = np.triu((largest >= 0) & (largest <= within), 1)
        return [(left[first], left[second]) for first, second in np.argwhere(near)]


def _aligned(anchors: np.ndarray, cycle: np.ndarray) -> tuple[np.ndarray, float]:
    """Align the walker's best phase with the estimated joints; return its joints (F, 15, 3) and the scale.

    The joints are in the unit of the estimated joints.  The scale is that unit per millimetre of the walker.
    """
    distance = np.linalg.norm(anchors[:, :, None] - anchors[:, None], axis=-1)
    measured = np.isfinite(distance).any(axis=0) & np.triu(np.ones((15, 15), bool), 1)
    reference = np.linalg.norm(cycle[:, :, None] - cycle[:, None], axis=-1).mean(axis=0)
    ratios = np.nanmean(distance[:, measured], axis=0) / reference[measured]
    scale = max(np.median(ratios), TINY) if len(ratios) else 1.0
    finite = np.isfinite(anchors).all(axis=-1)[:, None]
    target = np.where(finite[..., None], anchors[:, None] / scale, 0.0)
    weight = np.broadcast_to(finite, (len(anchors), PHASES, 15)) + 1e-9
    for _ in range(4):
        share = (weight / weight.sum(axis=-1, keepdims=True))[..., None]
        centre = (share * target).sum(axis=-2, keepdims=True)
        walker = cycle - (share * cycle).sum(axis=-2, keepdims=True)
        centred = target - centre
        cross = walker[..., 0] * centred[..., 1] - walker[..., 1] * centred[..., 0]
        along = (walker[..., :2] * centred[..., :2]).sum(axis=-1)
        turn = np.arctan2((share[..., 0] * cross).sum(axis=-1), (share[..., 0] * along).sum(axis=-1))
        aligned = walking.turn_about_vertical(walker, turn[..., None])
        error = np.linalg.norm(aligned - centred, axis=-1)
        weight = finite / (1 + (error / 100.0) ** 2) + 1e-9
    best = np.where(finite, np.minimum(error, FAR_MM), 0.0).sum(axis=-1).argmin(axis=1)
    frames = np.arange(len(anchors))
    return scale * (aligned + centre)[frames, best], scale
