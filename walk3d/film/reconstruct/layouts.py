"""Layouts of keypoints: which point is which joint, and how far from it (``conf/keypoints/*.yaml``).

A layout is recognised by the names in the file, or by the number of points; two layouts of one number are told apart by
where the points lie in the image.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline import plugins
from pipeline.papers.entries import read_mapping
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import in_english
from pipeline.validation import InvalidInput, require_choice
from walk3d.film.keypoints import Detections
from walk3d.film.walk import Detector

LONGER = {23: 17, 75: 33, 133: 17, 136: 26, 308: 70, 501: 33, 543: 33}
"""Layouts with feet, or of whole bodies, that begin with a smaller one: number of points and of those that are used."""
SHORTER = {29: 33, 31: 33}
"""MediaPipe's without toes, or heels: one more than the last number of a point, and the points of the layout."""
FEWEST = 12
"""Names that differ in their number alone, from which on points are told by it: kp0, kp1, …"""
LEAST_SEEN = 0.2
"""Joints that fewer detections have say nothing of the order: a head may be out of the picture."""
_NEEDED = [f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "ankle")]


@dataclass(frozen=True)
class Layout:
    """One layout of keypoints.

    Attributes
    ----------
    name : str
    points : tuple of str
        Names in order.
    joints : dict of str to tuple of str
        Joint of WALKER15 and the points whose middle it is, as far as seen.
    detector : Detector
    measured : bool
        Whether offsets and floor were measured; if not, bars are those for anybody.
    """

    name: str
    points: tuple[str, ...]
    joints: dict[str, tuple[str, ...]]
    detector: Detector
    measured: bool


def load(path: Path) -> Layout:
    """Load one layout.

    Raises
    ------
    InvalidInput
        If the file contradicts itself.
    """
    content = read_mapping(path)
    points = tuple(content["points"])
    if len(points) != content["count"] or len(set(points)) != len(points):
        raise InvalidInput(
            "must list each point once", f"{path.name}, points", received=len(points), code="not_distinct"
        )
    joints: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in WALKER15.joints if joint in points}
    joints["head"] = tuple(require_choice(f"{path.name}, head", point, points) for point in content["head"])
    for derived in ("sternum", "pelvis"):  # middles of others, unless simulated
        if derived not in content["floor_mm"]:
            joints.pop(derived, None)
    offset, floor = np.zeros((len(WALKER15.joints), 3)), np.full(len(WALKER15.joints), 10.0)
    seen = np.zeros(len(WALKER15.joints), bool)
    for number, joint in enumerate(WALKER15.joints):
        kind = joint.split("_")[-1]
        seen[number] = joint in joints
        floor[number] = content["floor_mm"].get(kind, 10.0)
        right, forwards, up = content["offset_mm"].get(kind, (0.0, 0.0, 0.0))
        # Of limbs the table has the left side; the right one is its mirror image.
        offset[number] = (-right if joint.startswith("right") else right), forwards, up
    detector = Detector(offset_mm=offset, floor_mm=floor, seen=seen)
    return Layout(content["name"], points, joints, detector, content["measured"])


def layouts() -> dict[str, Layout]:
    """All layouts by name."""
    return {name: load(path) for name, path in plugins.conf_files("keypoints").items()}


_OF_APPLE = {
    "head_joint": "nose", "shoulder_1_joint": "shoulder", "forearm_joint": "elbow", "hand_joint": "wrist",
    "up_leg_joint": "hip", "leg_joint": "knee", "foot_joint": "ankle", "sho": "shoulder", "elb": "elbow",
    "wr": "wrist", "wri": "wrist", "ank": "ankle",
}  # fmt: skip
"""Names of Apple's Vision, which are those of the segments below the joints; OpenCV's short ones."""


_PARTS = {"eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "heel"}
"""What follows an l or r that is written small and without a separator: ``rhip``."""


def canonical(name: str) -> str:
    """A name of a point as layouts write it.

    Examples
    --------
    >>> canonical("LKnee"), canonical("RBigToe"), canonical("knee_l"), canonical("left_leg_joint"), canonical("rhip")
    ('left_knee', 'right_big_toe', 'left_knee', 'left_knee', 'right_hip')
    >>> canonical("R-Sho"), canonical("ankle1")
    ('right_shoulder', 'right_ankle')
    """
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", in_english(name).replace("_", " "))
    joined = [word.lower() for word in words]
    sides = {"l": "left", "r": "right", "left": "left", "right": "right"}
    if (
        joined
        and joined[0] not in sides
        and joined[0][0] in "lr"
        and (words[0][:2].isupper() or joined[0][1:] in _PARTS)
    ):
        joined = [joined[0][0], joined[0][1:], *joined[1:]]
    if len(joined) == 2 and joined[0] in _PARTS:  # DeepLabCut's people
        joined[1] = {"1": "right", "2": "left"}.get(joined[1], joined[1])
    side = [sides[word] for word in joined if word in sides]
    rest = "_".join(word for word in joined if word not in sides)
    return "_".join([*side[:1], _OF_APPLE.get(rest, rest)])


def recognise(found: Detections, wanted: str = "") -> tuple[Layout, np.ndarray, str]:
    """Recognise the layout of keypoints.

    Parameters
    ----------
    found : Detections
    wanted : str
        Name of the layout, if the user knows it.

    Returns
    -------
    layout : Layout
    order : (K,) int
        Point of the file for each point of the layout; -1 where the file has none.
    why : str
        One sentence.

    Raises
    ------
    InvalidInput
        If no layout fits.
    """
    known = layouts()
    if wanted:
        require_choice("input.layout", wanted, known)
    stems = [name.rstrip("0123456789") for name in found.names]
    groups = [
        {int(found.names[k][len(stem) :] or -1): k for k, own in enumerate(stems) if own == stem}
        for stem in dict.fromkeys(stems)
        if stems.count(stem) >= FEWEST
    ]  # kp0, kp1, … beside others; a body's, not hands'
    sizes = {*map(len, (layout.points for layout in known.values())), *LONGER}
    numbered = max(groups, key=lambda group: max(group) + 1 in sizes, default={})
    in_turn = np.array([k for _, k in sorted(numbered.items())] or range(found.points.shape[1]))
    count = max(numbered, default=0) + 1
    left_out = count > len(numbered) + (0 not in numbered)
    if numbered and left_out and (count := SHORTER.get(count, count)) in sizes:
        in_turn = np.array([numbered.get(number, -1) for number in range(count)])
    points = np.where(in_turn[:, None] < 0, np.nan, found.points[:, in_turn])
    K = len(in_turn)
    if found.names and not numbered:
        return _by_names(found, known, wanted)
    used = LONGER.get(K, K)
    fitting = [layout for layout in known.values() if len(layout.points) == used]
    if wanted:
        if len(known[wanted].points) != used:
            what, expected = "the number of points is not that of input.layout", len(known[wanted].points)
            raise InvalidInput(
                what,
                expected=f"{expected} for {wanted}",
                received=K,
                code="wrong_count",
                needed=expected,
                count=K,
            )
        return known[wanted], in_turn[:used], f"{wanted}: as input.layout says"
    if not fitting:
        counts = ", ".join(sorted({f"{len(layout.points)} ({layout.name})" for layout in known.values()}))
        raise InvalidInput(
            "no layout has this number of points", expected=counts, received=K, code="unknown_layout", count=K
        )
    upright = [_upright(layout, points) for layout in fitting]
    scores = np.nan_to_num(upright)
    best = fitting[np.argmax(scores)]
    why = f"{best.name}: {K} points"
    if used != K:
        why += f", of which the first {used} are used"
    if len(fitting) > 1:
        others = ", ".join(layout.name for layout in fitting if layout is not best)
        why += f", and heads above hips above ankles as in no other order ({others})"
    first, second = sorted([0.0, *scores])[:-3:-1]
    if (first < 0.5 or first - second < 0.2) and not (len(fitting) == 1 and np.isnan(upright[0])):
        raise InvalidInput(
            "the order of the points is not clear: heads must be above hips above ankles in one layout alone",
            expected="points with names, or input.layout=" + " or ".join(layout.name for layout in fitting),
            received=f"{K} points",
            code="unclear_layout",
            layouts=[layout.name for layout in fitting],
        )
    return best, in_turn[:used], why


def _by_names(found: Detections, known: Mapping[str, Layout], wanted: str) -> tuple[Layout, np.ndarray, str]:
    """Return the layout whose points have the names in the file, as `recognise` does."""
    sided = [name for name in found.names if canonical(name).startswith(("left_", "right_"))]
    apart = (k for k, letters in enumerate(zip(*sided, strict=False)) if len(set(letters)) > 1)
    before = "".join(sided[:1])[: next(apart, 0)]  # anna:, PoseLandmark.
    names = {canonical(name.removeprefix(before)): k for k, name in enumerate(found.names)}
    best, order, rank = None, np.empty(0, int), (0, 0)
    for layout in [known[wanted]] if wanted else known.values():
        where = np.array([names.get(canonical(point), -1) for point in layout.points])
        if (
            (own := ((where >= 0).sum(), -len(where))) > rank
            and all(joint in names for joint in _NEEDED)
            and not (layout.measured and -1 in where and not wanted)  # a part may be anybody's
        ):
            best, order, rank = layout, where, own  # the smallest that has as many of the names
    if best is None:
        raise InvalidInput(
            "hips, knees and ankles of both sides are not among the points",
            expected=", ".join(_NEEDED),
            received=", ".join(found.names[:8]),
            code="no_legs",
        )
    return best, order, f"{best.name}: {rank[0]} of its {len(best.points)} names are in the file"


def _upright(layout: Layout, points: np.ndarray) -> float:
    """Share of detections with head, shoulder, hip, knee, ankle in vertical order, on the worse side; or NaN."""

    def height(joint: str) -> np.ndarray:
        part = points[:, [layout.points.index(point) for point in layout.joints[joint]], 1]
        known = np.isfinite(part)
        with np.errstate(invalid="ignore"):  # nothing over nothing
            return np.where(known, part, 0.0).sum(axis=1) / known.sum(axis=1)

    shares = []
    for side in ("left", "right"):
        joints = ("head", *(f"{side}_{kind}" for kind in ("shoulder", "hip", "knee", "ankle")))
        rows = np.column_stack([height(joint) for joint in joints])
        rows = rows[:, np.isfinite(rows).mean(axis=0) > LEAST_SEEN]
        steps = np.diff(rows[np.isfinite(rows).all(axis=1)], axis=1)
        if rows.shape[1] >= 3 and len(steps):
            shares.append(max((steps > 0).all(axis=1).mean(), (steps < 0).all(axis=1).mean()))
    return float(min(shares, default=np.nan))


def to_joints(layout: Layout, order: np.ndarray, found: Detections) -> tuple[np.ndarray, np.ndarray]:
    """Joints (N, 15, 2) of detections and their confidence (N, 15), 0 where missing."""
    pixels = np.full((len(found.points), len(WALKER15.joints), 2), np.nan)
    confidence = np.zeros(pixels.shape[:2])
    for number, joint in enumerate(WALKER15.joints):
        columns = [order[layout.points.index(point)] for point in layout.joints.get(joint, ())]
        columns = [column for column in columns if column >= 0]
        if not columns:
            continue
        part, sure = found.points[:, columns], found.confidence[:, columns]
        seen = np.isfinite(part).all(axis=-1) & (sure > 0)
        count = seen.sum(axis=1)
        some = count > 0
        pixels[some, number] = np.where(seen[..., None], part, 0.0).sum(axis=1)[some] / count[some, None]
        confidence[some, number] = (sure * seen).sum(axis=1)[some] / count[some]
    return pixels, confidence
