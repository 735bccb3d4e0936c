"""Which mapping fits a recording: how many joints each gives, and of what."""

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
HUMAN_LEG_MM = (350.0, 1300.0)
"""Hip to knee to ankle of a child of three and of a very tall adult."""

_UNITS = {**MILLIMETRES, "in/0.45": 25.4 / 0.45}
"""Units that files without one are found to be in; the last is that of the CMU skeletons."""


@dataclass(frozen=True)
class Fit:
    """How a mapping fits a recording.

    Attributes
    ----------
    mapping : SourceMapping
    missing : tuple of str
        Joints that it does not give.
    lacking : tuple of str
        Of those that mark the family, and of the rule of each joint of legs and pelvis that lacks least, the first,
        the points that the recording lacks.
    points : int
        Points of the recording that are used.
    usable : bool
        Whether the points that mark the family, legs and pelvis are there.
    rank : tuple of int
        What makes one fit better than another, the weightiest first: fewer points lacking; joints; fewer of them put
        below their points, which a mapping of joints by name need not do; points; joints given by the first of their
        rules.
    """

    mapping: SourceMapping
    missing: tuple[str, ...]
    lacking: tuple[str, ...]
    points: int
    usable: bool
    rank: tuple[int, ...]


def fitted(motion: MotionCapture, mapping: SourceMapping) -> Fit:
    """Return how a mapping fits a recording."""
    points = MappedPoints(motion, mapping)

    def absent(names: Iterable[str]) -> list[str]:
        return [point for point in names if points.find(point) is None]

    lacking = absent(mapping.recognised_by)
    missing, first, lowered, used = [], 0, 0, set()
    for joint in WALKER15.joints:
        rules = mapping.rules(joint)
        try:
            rule = points.rule_of(joint)
        except InvalidInput:  # two points of one name
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
    """Return the best fit of several mappings, of equal ones the first.

    Raises
    ------
    InvalidInput
        If none can be used, and to one of them two points go by one name.
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
    """Return by what to multiply the positions of a file that states no unit, and a sentence that says so.

    Parameters
    ----------
    motion : MotionCapture
    mapping : SourceMapping
        The unit of the family, if it has one, is taken where it makes human legs.
    leg_mm : float
        Length of the legs as the file was read, mm.

    Returns
    -------
    factor : float
        1 if the unit that was assumed will do: it stays where legs are human.
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
        # Children are many, giants few.
        unit = min(human, key=lambda name: max(4.0 * longer[name], -longer[name]))
    factor = _UNITS.get(unit, assumed) / assumed
    legs = leg_mm * factor
    why = (
        f"as {mapping.name} has it"
        if unit == mapping.units
        else f"which makes legs of {legs:.{0 if legs >= 100 else 2}f} mm"
    )
    return factor, f"The file states no unit; its numbers are taken as {unit}, {why}."
