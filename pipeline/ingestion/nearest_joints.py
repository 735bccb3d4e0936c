"""A mapping proposed from names and from where points are over the clip: next to which joint of an average walker.

The average walker of the synthetic population is laid over a recording: scaled, and in every frame shifted, turned
about the vertical and put into the phase of the step that suits the joints found so far.  Then each joint gets the
point, or the middle of two points, that names and distance over the clip speak for; both steps take turns a few times.
Where names tell nothing, the walker starts from several headings.
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
NEIGHBOURS_MM = 160.0
"""Two points of a side that are no farther apart, on a person with legs of `LEG_MM`, may be the sides of one joint."""

STRANGE_MM = 250.0
"""How much nearer a point must be that bears no name of the joint."""

MOST_NEIGHBOURS = 200
"""Of more points of a side, as of a dense surface, no two are taken for the sides of a joint."""

TINY = 1e-9
"""Scale below which points lie at one place."""

FAR_MM = 0.4 * LEG_MM
"""What lies farther from the walker's joint is not that joint."""

FAR_STRANGE_MM = 0.2 * LEG_MM
"""The same of a point that bears no name of the joint, or a segment's."""

FAR_NAMED_MM = 2 * FAR_MM
"""The same of a point that bears the joint's name."""

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
"""Parts of names by which points of a joint are known."""

SEGMENT = re.compile("thigh|shin|shank")
"""Those of them that name a segment, whose upper end is the joint and whose markers may be anywhere on it."""

NOT_A_PLACE = re.compile(r"angle|force|moment|power|grf|progress", re.IGNORECASE)
"""Names of results of a model that stand among the points of a C3D file and are no points."""

FEWEST = 7
"""Points that tell a body, at least."""

REMARK = "# Of points whose names say as much, those next to an average walker's joints over the clip were taken.\n"
"""First line of a file in which such a mapping is written down."""

HIPS = ("left_hip", "right_hip")
REGRESSIONS = {
    "skin_landmarks": ("L.ASIS", "R.ASIS", "L.PSIS", "R.PSIS", "Sacrum"),
    "trochanters": ("L.GT", "R.GT"),
}
"""Mappings whose hips are a regression, and its points, the better one first."""

PARTS = ("ankle", "knee", "hip", "shoulder", "elbow", "wrist")


Points = tuple[int, ...]
Found = dict[str, Points]
"""The point of each joint, or the two of whose middle it is."""


def propose(motion: MotionCapture, name: str) -> SourceMapping:
    """Propose a mapping from names, sides and distance to an average walker, every joint of it guessed.

    Points of technical clusters, which mark no joint, are left out.  Hips come by the regression of the pelvis's
    markers, or of the trochanters, where these are in the file and would be taken for hips.  A joint whose rule fails
    `pipeline.mappings.check` is not proposed.

    Parameters
    ----------
    motion : MotionCapture
    name : str

    Raises
    ------
    InvalidInput
        If the recording has too few points to tell a body, or none that is like a joint.
    """
    names, positions, up = _points(motion, name)
    body = _Body([plain_name(point) for point in bare_names(names)], positions)
    cycle = fourier.synthesise(population().mean.reshape(5, 15, 3), 1.0, np.arange(PHASES) / PHASES)
    starts = [*body.by_names(), *body.starts(cycle)]
    found = min((body.matched(start, cycle) for start in starts), key=lambda fit: fit[0])[1]
    if not found:
        raise InvalidInput(
            "no point is like a joint of a walker",
            name,
            received=f"points {listed(names)}",
            code="no_joint_like",
        )
    joints: dict[str, Rule] = {
        joint: {names[k]: 1.0 / len(found[joint]) for k in found[joint]}
        for joint in WALKER15.joints
        if joint in found
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
    """Rules of hips and pelvis by the first regression that ships whose points the file has, and their lowering.

    Nothing where `hips`, the points that were taken for hips, are some that no regression uses.
    """
    landmarks: set[str] = set()
    rules: dict[str, Rule] = {}
    lowered: dict[str, Lowering] = {}
    for family, marks in REGRESSIONS.items():
        points = MappedPoints(motion, mappings.shipped()[family])
        names = {mark: motion.names[points.index(mark)] for mark in marks if points.find(mark) is not None}
        landmarks |= {*names.values()}
        found = {joint: points.rule_of(joint) for joint in (*HIPS, "pelvis")}
        for joint, pair in found.items():
            if not rules.keys() >= found.keys() and pair and pair[1] and points.sees(pair[0]):
                rules[joint] = {names[mark]: weight for mark, weight in pair[0].items()}
                lowered[joint] = Lowering(by=pair[1].by, between=[names[mark] for mark in pair[1].between])
    usable = len(rules) == len(found) and (not hips or hips & landmarks)
    return (rules, lowered) if usable else ({}, {})


def _points(motion: MotionCapture, name: str) -> tuple[list[str], np.ndarray, UpAxis]:
    """Points that were ever seen and have a place, in frames evenly over those that show most of them; and up."""
    stuck = {k for group in technical_clusters(motion) for k in group}
    kept = [
        k
        for k, point in enumerate(motion.names)
        if k not in stuck and motion.valid[:, k].any() and not NOT_A_PLACE.search(point)
    ]
    if len(kept) < FEWEST:
        raise InvalidInput(
            "too few points to tell a body",
            name,
            f"{FEWEST} or more",
            f"{len(kept)} points",
            code="too_few_points",
        )
    shown = motion.valid[:, kept].sum(axis=1)
    full = np.flatnonzero(2 * shown > shown.max())
    some = np.ix_(full[np.unique(np.linspace(0, len(full) - 1, FRAMES).round().astype(int))], kept)
    positions = np.where(motion.valid[some][..., None], motion.positions_mm[some], np.nan)
    # Up is where a body spreads most within a frame: over the clip, with gaps, people spread along their way, too.
    # The inner four fifths, as a root may stay behind on the floor.
    low, high = np.nanquantile(positions, [0.1, 0.9], axis=1)
    up = int(np.median(high - low, axis=0).argmax())
    # Axes in turn, which keeps handedness.
    return [motion.names[k] for k in kept], np.roll(positions, 2 - up, axis=-1), UpAxis("xyz"[up])


class _Body:
    """Points of a recording.

    Parameters
    ----------
    names : list of str
        Without prefix and separators, the side in front.
    positions : (F, P, 3)
        Some frames, z up, in the unit of the file, NaN where nothing was measured.
    """

    def __init__(self, names: list[str], positions: np.ndarray) -> None:
        self._names, self._positions = names, positions
        place = {point: k for k, point in reversed(list(enumerate(names)))}
        twins = {k: place.get("r" + point[1:]) for point, k in place.items() if point[:1] == "l"}
        self._twin = {k: twin for k, twin in sorted(twins.items()) if twin is not None}
        """Points of the left, each with that of the right whose name differs by the side alone."""

    def _of(self, candidate: Points) -> np.ndarray:
        """Positions (F, 3) of a point or of the middle of several."""
        return self._positions[:, list(candidate)].mean(axis=1)

    def _bears(self, point: int, part: str) -> bool:
        """Whether the name of a point holds a word of a joint."""
        return any(word in self._names[point] for word in PART_NAMES[part])

    def _anchors(self, found: Found) -> np.ndarray:
        """Positions (F, 15, 3) of the joints found so far."""
        anchors = np.full((len(self._positions), 15, 3), np.nan)
        for joint, candidate in found.items():
            anchors[:, WALKER15.index(joint)] = self._of(candidate)
        return anchors

    def by_names(self) -> list[np.ndarray]:
        """Positions (F, 15, 3) of joints by names alone: the middle of points that bear the joint's; none of few."""
        found = {}
        for joint in WALKER15.joints:
            side, _, part = joint.rpartition("_")
            beginning = [k for k, point in enumerate(self._names) if point.startswith(side[:1])]
            if bearing := tuple(k for k in beginning if self._bears(k, part)):
                found[joint] = bearing
        anchors = self._anchors(found)
        return [anchors] if np.isfinite(anchors).all(axis=-1).any(axis=0).sum() >= 5 else []

    def starts(self, cycle: np.ndarray) -> Iterator[np.ndarray]:
        """The walker in its mean posture, as tall as the points reach or up to its hips, and facing where sides tell.

        Without sides: with several headings, the same in all frames.
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

    def matched(self, anchors: np.ndarray, cycle: np.ndarray) -> tuple[float, Found]:
        """Mean distance of the joints, mm on a person with legs of `LEG_MM`, and the points of each joint."""
        cost, found = np.inf, Found()
        for _ in range(ROUNDS):
            walker, scale = _laid(anchors, cycle)
            distances, found = self._chosen(walker, scale)
            if len(found) < 4:
                return np.inf, {}
            cost = float(np.mean([*distances.values()] + [FAR_MM] * (15 - len(found))))
            anchors = self._anchors(found)
        return cost, found

    def _chosen(self, walker: np.ndarray, scale: float) -> tuple[dict[str, float], Found]:
        """What each joint costs, mm on a person with legs of `LEG_MM`, and its points: the cheapest of all first."""
        twin = self._twin
        sided = {*twin, *twin.values()}
        middles: list[Points] = [(k,) for k in range(len(self._names)) if k not in sided]
        middles += twin.items()
        lefts = [*((k,) for k in twin), *self._neighbours(NEIGHBOURS_MM * scale)]
        couples = [(left, tuple(twin[k] for k in left)) for left in lefts]
        alone = [joint for joint in WALKER15.joints if not couples or "_" not in joint]
        offers: list[tuple[tuple[str, ...], tuple[Points, ...]]]
        offers = [((f"left_{p}", f"right_{p}"), couple) for p in PARTS for couple in couples]
        offers += [((joint,), (one,)) for joint in alone for one in middles]
        away = {one: self._away(one, walker) / scale for one in {c for _, pair in offers for c in pair}}
        ranked = []
        for n, (joints, given) in enumerate(offers):
            off = [float(away[one][WALKER15.index(joint)]) for joint, one in zip(joints, given, strict=True)]
            part = joints[0].rpartition("_")[2]
            strange = not all(self._bears(k, part) for one in given for k in one)
            if strange and len(joints) == 1 and len(given[0]) == 2:
                continue  # a left and a right point are a joint in the middle only by their names
            near = strange or any(SEGMENT.search(self._names[k]) for one in given for k in one)
            if max(off) <= (FAR_STRANGE_MM if near else FAR_NAMED_MM):
                ranked.append((float(np.mean(off)) + STRANGE_MM * strange, n, joints, given))
        cost: dict[str, float] = {}
        found = Found()
        used: set[int] = set()
        for price, _, joints, given in sorted(ranked):
            taken = {k for one in given for k in one}
            if joints[0] not in found and not used & taken:
                used |= taken
                found |= dict(zip(joints, given, strict=True))
                cost |= dict.fromkeys(joints, price)
        if {"left_hip", "right_hip"} <= found.keys():
            hips = found["left_hip"] + found["right_hip"]
            middle = float(self._away(hips, walker)[WALKER15.index("pelvis")]) / scale
            if middle < cost.get("pelvis", np.inf):
                found["pelvis"], cost["pelvis"] = hips, middle
        return cost, found

    def _away(self, candidate: Points, walker: np.ndarray) -> np.ndarray:
        """Mean distance (15,) of a point from each joint of the walker (F, 15, 3); infinite if it was never seen."""
        point = self._of(candidate)
        seen = np.isfinite(point).all(axis=-1)
        distances = np.linalg.norm(point[seen, None] - walker[seen], axis=-1)
        return distances.mean(axis=0) if seen.any() else np.full(15, np.inf)

    def _neighbours(self, within: float) -> list[Points]:
        """Pairs of points of the left that stay near each other."""
        left = list(self._twin) if len(self._twin) <= MOST_NEIGHBOURS else []
        side = self._positions[:, left]
        apart = np.linalg.norm(side[:, :, None] - side[:, None], axis=-1)
        widest = np.where(np.isfinite(apart), apart, -1.0).max(axis=0)  # -1: never seen together
        near = np.triu((widest >= 0) & (widest <= within), 1)
        return [(left[one], left[other]) for one, other in np.argwhere(near)]


def _laid(anchors: np.ndarray, cycle: np.ndarray) -> tuple[np.ndarray, float]:
    """The walker (F, 15, 3) laid over some joints, in their unit, and that unit's length of a millimetre of it."""
    apart = np.linalg.norm(anchors[:, :, None] - anchors[:, None], axis=-1)
    known = np.isfinite(apart).any(axis=0) & np.triu(np.ones((15, 15), bool), 1)
    own = np.linalg.norm(cycle[:, :, None] - cycle[:, None], axis=-1).mean(axis=0)
    ratios = np.nanmean(apart[:, known], axis=0) / own[known]
    scale = max(np.median(ratios), TINY) if len(ratios) else 1.0
    seen = np.isfinite(anchors).all(axis=-1)[:, None]
    given = np.where(seen[..., None], anchors[:, None] / scale, 0.0)
    weight = np.broadcast_to(seen, (len(anchors), PHASES, 15)) + 1e-9
    for _ in range(4):
        share = (weight / weight.sum(axis=-1, keepdims=True))[..., None]
        there = (share * given).sum(axis=-2, keepdims=True)
        theirs = cycle - (share * cycle).sum(axis=-2, keepdims=True)
        ours = given - there
        cross = theirs[..., 0] * ours[..., 1] - theirs[..., 1] * ours[..., 0]
        along = (theirs[..., :2] * ours[..., :2]).sum(axis=-1)
        turn = np.arctan2((share[..., 0] * cross).sum(axis=-1), (share[..., 0] * along).sum(axis=-1))
        laid = walking.turn_about_vertical(theirs, turn[..., None])
        off = np.linalg.norm(laid - ours, axis=-1)
        weight = seen / (1 + (off / 100.0) ** 2) + 1e-9
    best = np.where(seen, np.minimum(off, FAR_MM), 0.0).sum(axis=-1).argmin(axis=1)
    every = np.arange(len(anchors))
    return scale * (laid + there)[every, best], scale
