"""A mapping proposed from names and from where points are over the clip: next to which joint of an average walker.

The average walker of the synthetic population is laid over a recording: scaled, and in every frame shifted, turned
about the vertical and put into the phase of the step that suits the joints found so far.  Then each joint gets the
point, or the middle of two points, that names and distance over the clip speak for; both steps take turns a few times.
Where names tell nothing, the walker starts from several headings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from pipeline.clips.missing_joints import LEG_MM, population
from pipeline.core import fourier, walking
from pipeline.ingestion.static_trial import technical_clusters
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.skeleton.source_points import plain_name
from pipeline.validation import InvalidInput

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
"""The same of a point that bears no name of the joint."""

FAR_NAMED_MM = 2 * FAR_MM
"""The same of a point that bears the joint's name."""

PART_NAMES = {
    "head": ("head", "hd", "nose", "ear", "skull", "kopf", "tete"),
    "sternum": ("stern", "clav", "chest", "thorax", "neck", "c7", "t1", "jug", "manub"),
    "shoulder": ("sho", "acr", "upperarm", "uparm", "uarm", "schulter", "epaule", "larm", "rarm", "humer"),
    "elbow": ("elb", "epic", "forearm", "lowerarm", "farm", "coude", "ellbogen"),
    "wrist": ("wri", "rad", "uln", "styl", "hand", "poignet"),
    "pelvis": ("pelv", "sacr", "hips", "root", "waist"),
    "hip": ("hip", "hjc", "troch", "asi", "ias", "upleg", "upperleg", "thigh", "hanche"),
    "knee": ("kne", "condy", "lfc", "fle", "shin", "shank", "lowerleg", "genou", "knie"),
    "ankle": ("ank", "mal", "tal", "foot", "cheville", "heel", "calc"),
}
"""Parts of names by which points of a joint are known."""

NOT_A_PLACE = re.compile(r"angle|force|moment|power|grf|progress", re.IGNORECASE)
"""Names of results of a model that stand among the points of a C3D file and are no points."""

FEWEST = 7
"""Points that tell a body, at least."""

REMARK = "# Of points whose names say as much, those next to an average walker's joints over the clip were taken.\n"
"""First line of a file in which such a mapping is written down."""

PARTS = ("ankle", "knee", "hip", "shoulder", "elbow", "wrist")


@dataclass(frozen=True)
class _Points:
    """Points of a recording.

    Attributes
    ----------
    names : list of str
    positions : (F, P, 3)
        Some frames, z up, in the unit of the file, NaN where nothing was measured.
    """

    names: list[str]
    positions: np.ndarray

    @property
    def plain(self) -> list[str]:
        """Names without prefix and separators, the side in front."""
        return [plain_name(name) for name in self.names]

    def of(self, candidate: tuple[int, ...]) -> np.ndarray:
        """Positions (F, 3) of a point or of the middle of two."""
        return np.asarray(self.positions[:, list(candidate)].mean(axis=1))


def propose(motion: MotionCapture, name: str) -> SourceMapping:
    """Propose a mapping from names, sides and distance to an average walker, every joint of it guessed.

    Points of technical clusters, which mark no joint, take no part.

    Parameters
    ----------
    motion : MotionCapture
    name : str

    Raises
    ------
    InvalidInput
        If the recording has too few points to tell a body.
    """
    points, up = _points(motion, name)
    cycle = fourier.synthesise(population().mean.reshape(5, 15, 3), 1.0, np.arange(PHASES) / PHASES)
    starts = [*_by_names(points), *_starts(points, cycle)]
    found = min((_matched(points, start, cycle) for start in starts), key=lambda fit: fit[0])[1]
    joints = {
        joint: {points.names[k]: 1.0 / len(found[joint]) for k in found[joint]}
        for joint in WALKER15.joints
        if joint in found
    }
    return SourceMapping(name=name, up=up, joints=joints, guessed=list(joints))


def _points(motion: MotionCapture, name: str) -> tuple[_Points, UpAxis]:
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
    return _Points([motion.names[k] for k in kept], np.roll(positions, 2 - up, axis=-1)), UpAxis("xyz"[up])


def _anchors(points: _Points, found: dict[str, tuple[int, ...]]) -> np.ndarray:
    """Positions (F, 15, 3) of the joints found so far."""
    anchors = np.full((len(points.positions), 15, 3), np.nan)
    for joint, candidate in found.items():
        anchors[:, WALKER15.index(joint)] = points.of(candidate)
    return anchors


def _by_names(points: _Points) -> list[np.ndarray]:
    """Positions (F, 15, 3) of the joints by names alone: the middle of points that bear the joint's; none of few."""
    plain = points.plain
    anchors = np.full((len(points.positions), 15, 3), np.nan)
    for j, joint in enumerate(WALKER15.joints):
        side, _, part = joint.rpartition("_")
        bearing = [k for k, point in enumerate(plain) if point.startswith(side[:1]) and _bears(point, part)]
        if bearing:
            anchors[:, j] = points.positions[:, bearing].mean(axis=1)
    return [anchors] if np.isfinite(anchors).all(axis=-1).any(axis=0).sum() >= 5 else []


def _bears(point: str, part: str) -> bool:
    """Whether the name of a point holds a word of a joint."""
    return any(word in point for word in PART_NAMES[part])


def _starts(points: _Points, cycle: np.ndarray) -> Iterator[np.ndarray]:
    """The walker in its mean posture, as tall as the points reach or up to its hips, and facing where sides tell.

    Without sides: with several headings, the same in all frames.
    """
    mean = cycle.mean(axis=0)
    every = np.tile(mean, (len(points.positions), 1, 1))
    z = points.positions[..., 2]
    low, high = np.nanmin(z), np.nanmax(z)
    middle = np.nanmean(points.positions, axis=1, keepdims=True) * [1, 1, 0]
    plain = points.plain
    lefts = [(left, right) for left, right in _twins(plain).items() if plain[left][0] == "l"]
    if lefts:
        left, right = (list(each) for each in zip(*lefts, strict=True))
        across = np.nansum(points.positions[:, right] - points.positions[:, left], axis=1)
        turns = [np.arctan2(across[:, 1], across[:, 0])]
    else:
        turns = [np.full(len(middle), 2 * np.pi * k / HEADINGS) for k in range(HEADINGS)]
    for joints in (range(15), range(8, 15)):
        chosen = mean[list(joints)]
        scale = max(float((high - low) / np.ptp(chosen[:, 2])), TINY)
        up = np.array([0, 0, low - scale * chosen[:, 2].min()])
        for turn in turns:
            start = middle + up + scale * walking.turn_about_vertical(every, turn[:, None])
            start[:, [j for j in range(15) if j not in joints]] = np.nan
            yield start


def _matched(
    points: _Points, anchors: np.ndarray, cycle: np.ndarray
) -> tuple[float, dict[str, tuple[int, ...]]]:
    """Mean distance of the joints, mm on a person with legs of `LEG_MM`, and the points of each joint."""
    cost, found = np.inf, dict[str, tuple[int, ...]]()
    for _ in range(ROUNDS):
        walker, scale = _laid(anchors, cycle)
        distances, found = _chosen(points, walker, scale)
        if len(found) < 4:
            return np.inf, {}
        cost = float(np.mean([*distances.values()] + [FAR_MM] * (15 - len(found))))
        anchors = _anchors(points, found)
    return cost, found


def _laid(anchors: np.ndarray, cycle: np.ndarray) -> tuple[np.ndarray, float]:
    """The walker (F, 15, 3) laid over some joints, in their unit, and that unit's length of a millimetre of it."""
    apart = np.linalg.norm(anchors[:, :, None] - anchors[:, None], axis=-1)
    known = np.isfinite(apart).any(axis=0) & np.triu(np.ones((15, 15), dtype=bool), 1)
    own = np.linalg.norm(cycle[:, :, None] - cycle[:, None], axis=-1).mean(axis=0)
    ratios = np.nanmean(apart[:, known], axis=0) / own[known]
    scale = max(float(np.median(ratios)), TINY) if len(ratios) else 1.0
    seen = np.isfinite(anchors).all(axis=-1)[:, None]
    given = np.where(seen[..., None], anchors[:, None] / scale, 0.0)
    weight = np.broadcast_to(seen, (len(anchors), PHASES, 15)) + 1e-9
    for _ in range(4):
        share = weight / weight.sum(axis=-1, keepdims=True)
        there = (share[..., None] * given).sum(axis=-2, keepdims=True)
        theirs = cycle - (share[..., None] * cycle).sum(axis=-2, keepdims=True)
        ours = given - there
        cross = theirs[..., 0] * ours[..., 1] - theirs[..., 1] * ours[..., 0]
        along = (theirs[..., :2] * ours[..., :2]).sum(axis=-1)
        turn = np.arctan2((share * cross).sum(axis=-1), (share * along).sum(axis=-1))
        laid = walking.turn_about_vertical(theirs, turn[..., None])
        off = np.linalg.norm(laid - ours, axis=-1)
        weight = seen / (1 + (off / 100.0) ** 2) + 1e-9
    best = np.where(seen, np.minimum(off, FAR_MM), 0.0).sum(axis=-1).argmin(axis=1)
    every = np.arange(len(anchors))
    return scale * (laid + there)[every, best], scale


def _chosen(
    points: _Points, walker: np.ndarray, scale: float
) -> tuple[dict[str, float], dict[str, tuple[int, ...]]]:
    """What each joint costs, mm on a person with legs of `LEG_MM`, and its points: the cheapest of all first."""
    plain = points.plain
    twin = _twins(plain)
    alone = [k for k in range(len(plain)) if k not in twin]
    sided = {k for k in twin if plain[k][0] == "l"}
    near = _neighbours(points, sorted(sided), NEIGHBOURS_MM * scale)
    lefts: list[tuple[int, ...]] = [*((k,) for k in sorted(sided)), *near]
    couples = [(left, tuple(twin[k] for k in left)) for left in lefts]
    middles = [(k,) for k in alone] + [(k, twin[k]) for k in sorted(sided)]
    offers: list[tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]] = []
    if couples:
        offers += [((f"left_{part}", f"right_{part}"), couple) for part in PARTS for couple in couples]
    else:
        offers += [((joint,), (one,)) for joint in WALKER15.joints if "_" in joint for one in middles]
    offers += [((joint,), (one,)) for joint in ("head", "sternum", "pelvis") for one in middles]
    away = {
        one: _away(points.of(one), walker) / scale
        for one in dict.fromkeys(c for _, pair in offers for c in pair)
    }
    ranked = []
    for n, (joints, given) in enumerate(offers):
        off = [float(away[one][WALKER15.index(joint)]) for joint, one in zip(joints, given, strict=True)]
        part = joints[0].rpartition("_")[2]
        strange = not all(_bears(plain[k], part) for one in given for k in one)
        if strange and len(joints) == 1 and len(given[0]) == 2:
            continue  # a left and a right point are a joint in the middle only by their names
        if max(off) <= (FAR_STRANGE_MM if strange else FAR_NAMED_MM):
            ranked.append((float(np.mean(off)) + STRANGE_MM * strange, n, joints, given))
    cost: dict[str, float] = {}
    found: dict[str, tuple[int, ...]] = {}
    used: set[int] = set()
    for price, _, joints, given in sorted(ranked):
        taken = {k for one in given for k in one}
        if joints[0] not in found and not used & taken:
            used |= taken
            found |= dict(zip(joints, given, strict=True))
            cost |= dict.fromkeys(joints, price)
    if {"left_hip", "right_hip"} <= found.keys():
        hips = found["left_hip"] + found["right_hip"]
        middle = float(_away(points.of(hips), walker)[WALKER15.index("pelvis")]) / scale
        if middle < cost.get("pelvis", np.inf):
            found["pelvis"], cost["pelvis"] = hips, middle
    return cost, found


def _away(point: np.ndarray, walker: np.ndarray) -> np.ndarray:
    """Mean distance (15,) of a point (F, 3) from each joint of the walker (F, 15, 3); infinite if it was never seen."""
    seen = np.isfinite(point).all(axis=-1)
    if not seen.any():
        return np.full(15, np.inf)
    return np.asarray(np.linalg.norm(point[seen, None] - walker[seen], axis=-1).mean(axis=0))


def _twins(plain: list[str]) -> dict[int, int]:
    """Points whose names differ by left and right alone, each with the other."""
    place = {point: k for k, point in reversed(list(enumerate(plain)))}
    pairs = [
        (k, place["r" + point[1:]])
        for point, k in place.items()
        if point[:1] == "l" and "r" + point[1:] in place
    ]
    return dict(pairs) | {right: left for left, right in pairs}


def _neighbours(points: _Points, left: list[int], within: float) -> list[tuple[int, ...]]:
    """Pairs of points of a side that stay near each other."""
    pairs: list[tuple[int, ...]] = []
    for one, other in combinations(left if len(left) <= MOST_NEIGHBOURS else [], 2):
        apart = np.linalg.norm(points.positions[:, one] - points.positions[:, other], axis=-1)
        apart = apart[np.isfinite(apart)]
        if len(apart) and apart.max() <= within:
            pairs.append((one, other))
    return pairs
