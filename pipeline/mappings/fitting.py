"""Ranking of mappings by how well their points match the points of a recording."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import LOWER_BODY, MappedPoints
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping
from pipeline.validation import InvalidInput

ADULT_LEG_MM = 850.0
"""Typical leg length of an adult, mm."""
HUMAN_LEG_MM = (350.0, 1300.0)
"""Range of human leg lengths from hip to knee to ankle, mm, from small children to very tall adults."""

_UNITS = {**MILLIMETRES, "in/0.45": 25.4 / 0.45}
"""Size in mm of each unit that is tried for a file without a unit; the last one is the unit of CMU skeletons."""


@dataclass(frozen=True)
class Fit:
    """Result of the comparison of a mapping's points with the points of a recording.

    Attributes
    ----------
    mapping : SourceMapping
    missing : tuple of str
        Joints without a usable rule.
    lacking : tuple of str
        Missing points of the recording: all missing points that identify the family, and for each missing joint of
        legs and pelvis the first missing point of its most complete rule.
    points : int
        Number of points of the recording that the mapping uses.
    usable : bool
        True if the recording has the points that identify the family, and the joints of legs and pelvis.
    rank : tuple of int
        Sort key, larger is better: fewer missing points; fewer missing joints; fewer joints that are lowered below
        their points; more used points; more joints given by their first rule.
    """

    mapping: SourceMapping
    missing: tuple[str, ...]
    lacking: tuple[str, ...]
    points: int
    usable: bool
    rank: tuple[int, ...]


def fitted(motion: MotionCapture, mapping: SourceMapping) -> Fit:
    """Return how well the points of a recording match a mapping."""
    points = MappedPoints(motion, mapping)

    def absent(names: Iterable[str]) -> list[str]:
        return [point for point in names if points.find(point) is None]

    lacking = absent(mapping.recognised_by)
    missing, first, lowered, used = [], 0, 0, set()
    for joint in WALKER15.joints:
        rules = mapping.rules(joint)
        try:
            rule = points.rule_of(joint)
        except InvalidInput:  # two points have the same name
            rule = None
        if rule is None or not points.sees(rule[0]):
            missing.append(joint)
            if joint in LOWER_BODY:
                nearest = max(
                    (rule for rule, _ in rules), key=lambda rule: len(rule) - len(absent(rule)), default={}
                )
                lacking += [*absent(nearest), joint][:1]
        else:
            first += rule[0] is rules[0][0]
            lowered += rule[1] is not None
            used |= {points.index(point) for point in rule[0]}
    lacking = list(dict.fromkeys(lacking))
    rank = (-len(lacking), -len(missing), -lowered, len(used), first)
    return Fit(mapping, tuple(missing), tuple(lacking), len(used), not lacking, rank)


def suggest(motion: MotionCapture, mappings: Iterable[SourceMapping]) -> Fit:
    """Return the mapping that matches the points of a recording best, with its score; the first one on ties.

    Raises
    ------
    InvalidInput
        If no mapping can be used, and a mapping failed because two points have the same name.
    """
    fits, refusals = [], []
    for mapping in mappings:
        try:
            fits.append(fitted(motion, mapping))
        except InvalidInput as error:
            refusals.append(error)
    best = max(fits, key=lambda fit: fit.rank, default=None)
    if best is None or (refusals and not best.usable):
        raise refusals[0]
    return best


def rescaled(motion: MotionCapture, mapping: SourceMapping, leg_mm: float) -> tuple[float, str]:
    """Return the scale factor for positions in a file that states no unit, and a note on the assumed unit.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping
        Mapping of the recording; its usual unit is used if the legs then have a human length.
    leg_mm : float
        Length of the legs in the assumed unit, mm.

    Returns
    -------
    factor : float
        Scale factor; 1 if the assumed unit gives legs of human length.
    sentence : str
    """
    if not motion.units_assumed:
        return 1.0, ""
    assumed = _UNITS.get(motion.units, 1.0)
    legs_mm = {name: leg_mm / assumed * unit for name, unit in _UNITS.items()}
    human = [name for name, legs in legs_mm.items() if HUMAN_LEG_MM[0] <= legs <= HUMAN_LEG_MM[1]]
    unit = next((name for name in (mapping.units, motion.units) if name in _UNITS), motion.units)
    if human and unit not in human:
        longer = {name: np.log(legs_mm[name] / ADULT_LEG_MM) for name in human}
        # Legs shorter than an adult's are more likely than longer ones.
        unit = min(human, key=lambda name: max(4.0 * longer[name], -longer[name]))
    factor = _UNITS.get(unit, assumed) / assumed
    legs = leg_mm * factor
    reason = (
        f"the usual unit of {mapping.name}"
        if unit == mapping.units
        else f"which makes legs of {legs:.{0 if legs >= 100 else 2}f} mm"
    )
    return factor, f"The file states no unit; its numbers are taken as {unit}, {reason}."
