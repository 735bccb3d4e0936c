"""Source mappings: rules by which the points of a source become joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


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
    # Options name a choice by its member's name, which no assignment can write.
    vars()["-x"] = "-x"
    vars()["-y"] = "-y"
    vars()["-z"] = "-z"
    auto = "auto"
    """The axis along which the body stands."""


Rule = dict[str, float]
"""Source points of a joint and their weights, which sum to one."""


@dataclass(kw_only=True)
class SourceMapping:
    """Rules that turn the points of a source into joints; one file of ``conf/skeleton/`` each.

    Attributes
    ----------
    name : str
    up : UpAxis
        Axis that decides where the joints stand along no axis, or as well along another.
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
