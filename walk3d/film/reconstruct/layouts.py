"""Layouts of keypoints (``conf/keypoints/*.yaml``): the joint that each point marks, and its offset from the joint.

A layout is recognised by the names in the file, or by the number of points.  Layouts with the same number are
distinguished by the positions of their points in the image.
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

PREFIX_POINTS = {23: 17, 75: 33, 133: 17, 136: 26, 308: 70, 501: 33, 543: 33}
"""Number of points in layouts with feet, hands or face, mapped to the number of first points that are used."""
COMPLETED_POINTS = {29: 33, 31: 33}
"""Number of points in MediaPipe files without toes or heels, mapped to the number of points in the full layout."""
MIN_NUMBERED_NAMES = 12
"""Minimum number of numbered names such as kp0, kp1, … for which points are identified by their number."""
MIN_VISIBLE_SHARE = 0.2
"""Share of detections that show a joint, below which the joint is ignored in the check of the vertical order.

Heads, for example, may be outside the image.
"""
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
        Joint of WALKER15 and the points whose mean it is; unseen points are skipped.
    detector : Detector
    measured : bool
        True if offsets and floor were measured; otherwise the bars for any person are shown.
    """

    name: str
    points: tuple[str, ...]
    joints: dict[str, tuple[str, ...]]
    detector: Detector
    measured: bool


def load(path: Path) -> Layout:
    """Load one layout from its file.

    Raises
    ------
    InvalidInput
        If the file is inconsistent.
    """
    content = read_mapping(path)
    points = tuple(content["points"])
    if len(points) != content["count"] or len(set(points)) != len(points):
        raise InvalidInput(
            "must list each point once", f"{path.name}, points", received=len(points), code="not_distinct"
        )
    joints: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in WALKER15.joints if joint in points}
    joints["head"] = tuple(require_choice(f"{path.name}, head", point, points) for point in content["head"])
    for derived in ("sternum", "pelvis"):  # means of other points, except in simulated layouts
        if derived not in content["floor_mm"]:
            joints.pop(derived, None)
    offset, floor = np.zeros((len(WALKER15.joints), 3)), np.full(len(WALKER15.joints), 10.0)
    visible = np.zeros(len(WALKER15.joints), bool)
    for number, joint in enumerate(WALKER15.joints):
        kind = joint.split("_")[-1]
        visible[number] = joint in joints
        floor[number] = content["floor_mm"].get(kind, 10.0)
        right, forwards, up = content["offset_mm"].get(kind, (0.0, 0.0, 0.0))
        # The table gives the left limb; the right one is its mirror image.
        offset[number] = (-right if joint.startswith("right") else right), forwards, up
    detector = Detector(offset_mm=offset, floor_mm=floor, visible=visible)
    return Layout(content["name"], points, joints, detector, content["measured"])


def layouts() -> dict[str, Layout]:
    """Return all layouts by name."""
    return {name: load(path) for name, path in plugins.conf_files("keypoints").items()}


_JOINT_BY_NAME = {
    "head_joint": "nose", "shoulder_1_joint": "shoulder", "forearm_joint": "elbow", "hand_joint": "wrist",
    "up_leg_joint": "hip", "leg_joint": "knee", "foot_joint": "ankle", "sho": "shoulder", "elb": "elbow",
    "wr": "wrist", "wri": "wrist", "ank": "ankle",
}  # fmt: skip
"""Joint for each name of a point in Apple's Vision and in OpenCV.

Vision names the segment below a joint; OpenCV uses short names.
"""


_PARTS = {"eye", "ear", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "heel"}
"""Joints whose name may follow a lower-case l or r without a separator, as in ``rhip``."""


def canonical(name: str) -> str:
    """Return the name of a point in the spelling that the layouts use.

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
    if len(joined) == 2 and joined[0] in _PARTS:  # DeepLabCut numbers the sides of people
        joined[1] = {"1": "right", "2": "left"}.get(joined[1], joined[1])
    side = [sides[word] for word in joined if word in sides]
    rest = "_".join(word for word in joined if word not in sides)
    return "_".join([*side[:1], _JOINT_BY_NAME.get(rest, rest)])


def recognise(source: Detections, layout_name: str = "") -> tuple[Layout, np.ndarray, str]:
    """Recognise the layout of keypoints.

    Parameters
    ----------
    source : Detections
    layout_name : str
        Name of the layout; empty: recognise it.

    Returns
    -------
    layout : Layout
    order : (K,) int
        Index of the file's point for each point of the layout; -1 if the file lacks it.
    why : str
        Reason, one sentence.

    Raises
    ------
    InvalidInput
        If no layout fits.
    """
    layouts_by_name = layouts()
    if layout_name:
        require_choice("input.layout", layout_name, layouts_by_name)
    stems = [name.rstrip("0123456789") for name in source.names]
    groups = [
        {
            int(source.names[k][len(stem) :] or -1): k
            for k, point_stem in enumerate(stems)
            if point_stem == stem
        }
        for stem in dict.fromkeys(stems)
        if stems.count(stem) >= MIN_NUMBERED_NAMES
    ]  # kp0, kp1, … of the body; hands have their own stem
    sizes = {*map(len, (layout.points for layout in layouts_by_name.values())), *PREFIX_POINTS}
    numbered = max(groups, key=lambda group: max(group) + 1 in sizes, default={})
    in_turn = np.array([k for _, k in sorted(numbered.items())] or range(source.points.shape[1]))
    count = max(numbered, default=0) + 1
    left_out = count > len(numbered) + (0 not in numbered)
    if numbered and left_out and (count := COMPLETED_POINTS.get(count, count)) in sizes:
        in_turn = np.array([numbered.get(number, -1) for number in range(count)])
    points = np.where(in_turn[:, None] < 0, np.nan, source.points[:, in_turn])
    K = len(in_turn)
    if source.names and not numbered:
        return _by_names(source, layouts_by_name, layout_name)
    used = PREFIX_POINTS.get(K, K)
    fitting = [layout for layout in layouts_by_name.values() if len(layout.points) == used]
    if layout_name:
        if len(layouts_by_name[layout_name].points) != used:
            what, expected = (
                "the number of points is not that of input.layout",
                len(layouts_by_name[layout_name].points),
            )
            raise InvalidInput(
                what,
                expected=f"{expected} for {layout_name}",
                received=K,
                code="wrong_count",
                needed=expected,
                count=K,
            )
        return layouts_by_name[layout_name], in_turn[:used], f"{layout_name}: as input.layout says"
    if not fitting:
        counts = ", ".join(
            sorted({f"{len(layout.points)} ({layout.name})" for layout in layouts_by_name.values()})
        )
        raise InvalidInput(
            "no layout has this number of points", expected=counts, received=K, code="unknown_layout", count=K
        )
    upright = [_upright(layout, points) for layout in fitting]
    scores = np.nan_to_num(upright)
    best = fitting[np.argmax(scores)]
    why = f"{best.name}: {K} points"
    if used != K:
        why += f"; the first {used} are used"
    if len(fitting) > 1:
        others = ", ".join(layout.name for layout in fitting if layout is not best)
        why += f"; heads are above hips above ankles, unlike in {others}"
    first, second = sorted([0.0, *scores])[:-3:-1]
    if (first < 0.5 or first - second < 0.2) and not (len(fitting) == 1 and np.isnan(upright[0])):
        raise InvalidInput(
            "the layout of keypoints is ambiguous: no or several layouts put heads above hips and hips above ankles",
            expected="points with names, or input.layout=" + " or ".join(layout.name for layout in fitting),
            received=f"{K} points",
            code="unclear_layout",
            layouts=[layout.name for layout in fitting],
        )
    return best, in_turn[:used], why


def _by_names(
    source: Detections, layouts_by_name: Mapping[str, Layout], layout_name: str
) -> tuple[Layout, np.ndarray, str]:
    """Return the layout whose point names match those of the file, in the same form as `recognise`."""
    sided = [name for name in source.names if canonical(name).startswith(("left_", "right_"))]
    differing = (k for k, letters in enumerate(zip(*sided, strict=False)) if len(set(letters)) > 1)
    before = "".join(sided[:1])[: next(differing, 0)]  # anna:, PoseLandmark.
    names = {canonical(name.removeprefix(before)): k for k, name in enumerate(source.names)}
    best, order, rank = None, np.empty(0, int), (0, 0)
    for layout in [layouts_by_name[layout_name]] if layout_name else layouts_by_name.values():
        where = np.array([names.get(canonical(point), -1) for point in layout.points])
        if (
            (layout_rank := ((where >= 0).sum(), -len(where))) > rank
            and all(joint in names for joint in _NEEDED)
            and not (
                layout.measured and -1 in where and not layout_name
            )  # a measured layout must be complete
        ):
            best, order, rank = layout, where, layout_rank  # the smallest layout with the most names
    if best is None:
        raise InvalidInput(
            "hips, knees and ankles of both sides are not among the points",
            expected=", ".join(_NEEDED),
            received=", ".join(source.names[:8]),
            code="no_legs",
        )
    return best, order, f"{best.name}: {rank[0]} of its {len(best.points)} names are in the file"


def _upright(layout: Layout, points: np.ndarray) -> float:
    """Return the share of detections whose joints are in vertical order from head to ankle.

    The share is the smaller one of the left and right side; NaN if neither side can be checked.
    """

    def height(joint: str) -> np.ndarray:
        part = points[:, [layout.points.index(point) for point in layout.joints[joint]], 1]
        visible = np.isfinite(part)
        with np.errstate(invalid="ignore"):  # 0 / 0
            return np.where(visible, part, 0.0).sum(axis=1) / visible.sum(axis=1)

    shares = []
    for side in ("left", "right"):
        joints = ("head", *(f"{side}_{kind}" for kind in ("shoulder", "hip", "knee", "ankle")))
        rows = np.column_stack([height(joint) for joint in joints])
        rows = rows[:, np.isfinite(rows).mean(axis=0) > MIN_VISIBLE_SHARE]
        steps = np.diff(rows[np.isfinite(rows).all(axis=1)], axis=1)
        if rows.shape[1] >= 3 and len(steps):
            shares.append(max((steps > 0).all(axis=1).mean(), (steps < 0).all(axis=1).mean()))
    return float(min(shares, default=np.nan))


def to_joints(layout: Layout, order: np.ndarray, source: Detections) -> tuple[np.ndarray, np.ndarray]:
    """Return the joints (N, 15, 2) of all detections and their confidence (N, 15).

    A missing joint is NaN, with confidence 0.
    """
    pixels = np.full((len(source.points), len(WALKER15.joints), 2), np.nan)
    confidence = np.zeros(pixels.shape[:2])
    for number, joint in enumerate(WALKER15.joints):
        columns = [order[layout.points.index(point)] for point in layout.joints.get(joint, ())]
        columns = [column for column in columns if column >= 0]
        if not columns:
            continue
        part, sure = source.points[:, columns], source.confidence[:, columns]
        visible = np.isfinite(part).all(axis=-1) & (sure > 0)
        count = visible.sum(axis=1)
        some = count > 0
        pixels[some, number] = np.where(visible[..., None], part, 0.0).sum(axis=1)[some] / count[some, None]
        confidence[some, number] = (sure * visible).sum(axis=1)[some] / count[some]
    return pixels, confidence
