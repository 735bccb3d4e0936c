"""A mapping for a recording that no shipped one fits: by names, sides and heights, every guess marked."""

from __future__ import annotations

import re

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping, UpAxis
from pipeline.skeleton.source_points import plain_name
from pipeline.validation import InvalidInput

_HEIGHT = {
    "head": 0.97, "sternum": 0.84, "shoulder": 0.84, "elbow": 0.64, "wrist": 0.51, "pelvis": 0.56, "hip": 0.53,
    "knee": 0.29, "ankle": 0.05,
}  # fmt: skip
"""Height of each joint of somebody upright, relative to the highest point of the body."""

PART_NAMES = {
    "head": ("head", "hd", "nose", "ear", "skull", "kopf", "tete"),
    "sternum": ("stern", "clav", "chest", "thorax", "neck", "c7", "t1", "jug", "manub"),
    "shoulder": ("sho", "acr", "upperarm", "uparm", "uarm", "schulter", "epaule"),
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

_FAR = 0.12
"""A point so far above or below a joint's height, relative to the body, is not taken for it."""


def propose(motion: MotionCapture, name: str) -> SourceMapping:
    """Propose a mapping: one point for each joint, or its pair's middle, all of them guessed.

    Parameters
    ----------
    motion : MotionCapture
    name : str

    Raises
    ------
    InvalidInput
        If the recording has too few points to tell a body.

    Notes
    -----
    The axis along which the points spread most is up.  A point's height is its mean over the clip between the lowest
    and the highest point.  Sides are told by names: points whose names differ by left and right alone are a pair.
    Of the points or pairs whose name holds a word of the joint, the nearest to its height is taken; without such a
    name, the nearest of all pairs that are left.
    """
    seen = [
        k
        for k in range(len(motion.names))
        if motion.valid[:, k].any() and not NOT_A_PLACE.search(motion.names[k])
    ]
    if len(seen) < 7:
        received = f"{len(seen)} points"
        raise InvalidInput(
            "too few points to tell a body", where=name, expected="7 or more", received=received
        )
    mean = np.array([np.nanmean(motion.positions_mm[motion.valid[:, k], k], axis=0) for k in seen])
    spread = np.array([np.ptp(mean[:, axis]) for axis in range(3)])
    # People who walk along an axis spread along it together: only what is left of a frame's own centre counts.
    up = int(spread.argmax())
    height = (mean[:, up] - mean[:, up].min()) / max(float(np.ptp(mean[:, up])), 1e-9)
    names = [motion.names[k] for k in seen]
    plain = [plain_name(point) for point in names]
    place = {point: k for k, point in reversed(list(enumerate(plain)))}
    pairs = [
        (place[point], place["r" + point[1:]])
        for point in place
        if point[0] == "l" and "r" + point[1:] in place
    ]
    joints: dict[str, dict[str, float]] = {}
    used: set[int] = set()
    for part in ("ankle", "knee", "hip", "shoulder", "elbow", "wrist"):
        left_over = [pair for pair in pairs if not used & set(pair)]
        known = [pair for pair in left_over if any(word in plain[pair[0]] for word in PART_NAMES[part])]
        pair = _nearest(known, height, _HEIGHT[part], 2 * _FAR) or _nearest(
            left_over, height, _HEIGHT[part], _FAR
        )
        if pair:
            used |= set(pair)
            joints[f"left_{part}"], joints[f"right_{part}"] = ({names[k]: 1.0} for k in pair)
    alone = [(k, k) for k in range(len(names)) if k not in {i for pair in pairs for i in pair}]
    for part in ("head", "sternum", "pelvis"):
        known = [one for one in (*alone, *pairs) if any(word in plain[one[0]] for word in PART_NAMES[part])]
        if one := _nearest(known, height, _HEIGHT[part], 2 * _FAR):
            joints[part] = {names[k]: 1.0 / len(set(one)) for k in one}
    if "pelvis" not in joints and "left_hip" in joints:
        joints["pelvis"] = {point: 0.5 for side in ("left_hip", "right_hip") for point in joints[side]}
    ordered = {joint: joints[joint] for joint in WALKER15.joints if joint in joints}
    return SourceMapping(name=name, up=UpAxis("xyz"[up]), joints=ordered, guessed=list(ordered))


def _nearest(
    candidates: list[tuple[int, int]], height: np.ndarray, wanted: float, far: float
) -> tuple[int, int] | None:
    """The points whose mean height is nearest to what is wanted, the first of equals; None if all are far."""
    off = [abs(float(height[list(pair)].mean()) - wanted) for pair in candidates]
    return candidates[int(np.argmin(off))] if off and min(off) <= far else None


def written(mapping: SourceMapping, motion: MotionCapture) -> str:
    """Return a mapping as YAML that `pipeline.mappings.load` reads; guesses are marked, unused points listed."""
    lines = [
        "# Proposed from the names, sides and heights of the points of one recording.  Check every line that is",
        "# marked as guessed; weights of a joint sum to one, e.g. {lateral: 0.5, medial: 0.5}.",
        f"name: {_quoted(mapping.name)}",
        f"up: {mapping.up}  # guessed: the axis along which the points spread most",
        "joints:",
    ]
    used = set()
    for joint in WALKER15.joints:
        rules = mapping.rules(joint)
        if not rules:
            lines.append(
                f"  # {joint}: no point was found; without it, it is estimated (not possible for legs)"
            )
            continue
        used |= set(rules[0][0])
        inner = ", ".join(f"{_quoted(point)}: {weight:g}" for point, weight in rules[0][0].items())
        lines.append(f"  {joint}: {{{inner}}}" + ("  # guessed" if joint in mapping.guessed else ""))
    if mapping.guessed:
        lines.append(f"guessed: [{', '.join(mapping.guessed)}]")
    left = [_quoted(name) for name in motion.names if name not in used]
    lines += ["# points not used: " + ", ".join(left[k : k + 8]) for k in range(0, len(left), 8)]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """A word of YAML: in quotes, so that no name is taken for anything else."""
    return (
        '"'
        + "".join(
            c
            if c.isprintable() and c not in '"\\'
            else f"\\u{ord(c):04x}"
            if ord(c) < 65536
            else f"\\U{ord(c):08x}"
            for c in text
        )
        + '"'
    )
