"""Anatomical check of a mapping by the names of its points, without their coordinates."""

from __future__ import annotations

import re

from pipeline.mappings.table import shipped
from pipeline.skeleton import WALKER15
from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.mapped_joints import MappedPoints, bare_names, plain_name
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping

_Weights = dict[int, float]
"""Weights of the points whose weighted sum is a joint, by point index."""

MAX_RULE_CHARACTERS = 90
"""Largest number of characters of a rule that a message quotes."""

_CENTRE = re.compile("origin|pelvi|sacr|root|midhip|hips")
"""Pattern of words in the names of points at the centre of the pelvis."""

_HALF = 0.5 - 1e-9
"""Smallest weight in a rule at which a point counts as the joint itself."""


def check(motion: MotionCapture, mapping: SourceMapping) -> list[Complaint]:
    """Return the anatomical faults of a mapping for a recording; the list is empty for a correct mapping.

    Left and right joints need the same rule.  A hip must not be the centre of the pelvis, nor a marker at its front if
    the hip regression is possible.  No point may be a joint on both sides.

    Parameters
    ----------
    motion : MotionCapture
        Recording; only its point names, and which points were ever measured, are used.
    mapping : SourceMapping
    """
    plain = [plain_name(name) for name in bare_names(motion.names)]
    first = {name: k for k, name in reversed(list(enumerate(plain)))}
    twins = {}
    for name, k in first.items():
        other = first.get({"l": "r", "r": "l"}.get(name[:1], "?") + name[1:])
        if other is not None:
            twins[k] = other
    points = MappedPoints(motion, mapping)
    rules = {joint: weights for joint in WALKER15.joints if (weights := points.weights(joint))}

    def describe(joint: str) -> str:
        text = " + ".join(f"{weight:g} {motion.names[k]}" for k, weight in rules[joint].items())
        return text if len(text) <= MAX_RULE_CHARACTERS else text[: MAX_RULE_CHARACTERS - 1] + "…"

    complaints = []
    pairs = [(joint, joint.replace("left", "right")) for joint in WALKER15.joints if joint.startswith("left")]
    for left, right in pairs:
        if left in rules and right in rules and not _alike(rules[left], rules[right], twins):
            rules_of_both = f"{left} ({describe(left)}) and {right} ({describe(right)})"
            sentence = f"{rules_of_both} follow different rules: map both alike"
            complaints.append(Complaint("side_rules", sentence, (left, right)))
    asis = _regressed(motion)
    for hip in ("left_hip", "right_hip"):
        weights = rules.get(hip, {})
        if weights and weights.keys() <= asis:
            marker = f"{hip} ({describe(hip)}) is a marker on the pelvis"
            sentence = f"{marker}: use the regression (skeleton=skin_landmarks)"
            complaints.append(Complaint("asis_hip", sentence, (hip,)))
        mirrored = {twins.get(k, k): weight for k, weight in weights.items()}
        sided = weights.keys() & twins.keys()
        centre = mirrored == weights if sided else any(_CENTRE.search(plain[k]) for k in weights)
        if weights and (centre or weights == rules.get("pelvis")):
            sentence = f"{hip} ({describe(hip)}) is the centre of the pelvis: map the centre of the hip joint"
            complaints.append(Complaint("centre_hip", sentence, (hip,)))
    for left, _ in pairs:
        for _, right in pairs:
            shared = _shared(rules.get(left, {}), rules.get(right, {}))
            if shared:
                sentence = (
                    f"{motion.names[shared[0]]} is used for {left} and {right}: use a point on each side"
                )
                complaints.append(Complaint("shared_point", sentence, (left, right)))
    return complaints


def _alike(left: _Weights, right: _Weights, twins: dict[int, int]) -> bool:
    """Return True if the rule of a right joint mirrors the rule of the left joint.

    If the names of the points state no side, only the weights of the two rules are compared.
    """
    if not twins.keys() & {*left, *right}:
        return sorted(left.values()) == sorted(right.values())
    return {twins.get(k, k): weight for k, weight in left.items()} == right


def _shared(left: _Weights, right: _Weights) -> list[int]:
    """Return the points that have at least half the weight in the rules of two joints."""
    if min((*left.values(), *right.values()), default=0.0) < 0:
        return []
    return [k for k in left if min(left[k], right.get(k, 0.0)) >= _HALF]


def _regressed(motion: MotionCapture) -> set[int]:
    """Return the two markers at the front of the pelvis, if the file has all markers of the hip regression."""
    points = MappedPoints(motion, shipped()["skin_landmarks"])
    front, back, sacrum = (
        [points.find(name) for name in names]
        for names in (("L.ASIS", "R.ASIS"), ("L.PSIS", "R.PSIS"), ("Sacrum",))
    )
    if None in front or (None in back and None in sacrum):
        return set()
    return {k for k in front if k is not None}
