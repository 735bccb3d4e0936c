"""Source mappings: rules that compute joints from the points of a data source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


@dataclass(kw_only=True)
class Lowering:
    """Shift of a joint downwards, by a fraction of the mean distance between two points of the source."""

    by: float
    between: list[str]


class UpAxis(StrEnum):
    """Axis of a file that points upwards."""

    x = "x"
    y = "y"
    z = "z"
    # Options refer to members by name, and "-x" is not a valid identifier for an assignment.
    vars()["-x"] = "-x"
    vars()["-y"] = "-y"
    vars()["-z"] = "-z"
    auto = "auto"
    """The axis along which the body stands is inferred from the joints."""


Rule = dict[str, float]
"""Weights of the points that define a joint, by point name; they sum to one."""


@dataclass(kw_only=True)
class SourceMapping:
    """Mapping from the points of a data source to joints; each file in ``conf/skeleton/`` contains one mapping.

    Attributes
    ----------
    name : str
    up : UpAxis
        Axis that points up, used if the joints do not determine it.
    joints : dict
        joint → {source point: weight}, or a list of such rules.  The first rule whose points are in the file is used.
    otherwise : dict
        Rules in the same form, for a joint without a usable rule in `joints`.
    lowered : dict
        joint → `Lowering`, applied only to joints from `otherwise`.
    points : dict
        source point → alternative names.
    recognised_by : list of str
        Points that a file must have, so that this mapping is suggested for it.
    units : str
        Usual unit of length of such files, for files that do not state it.
    guessed : list of str
        Joints with rules that were proposed from names and geometry, and not yet confirmed.
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
        """Return the rules for a joint in order of priority, each with its downward shift or None."""
        first, last = (_listed(rules.get(joint)) for rules in (self.joints, self.otherwise))
        return [(rule, None) for rule in first] + [(rule, self.lowered.get(joint)) for rule in last]


def _listed(rules: Rule | list[Rule] | None) -> list[Rule]:
    return [] if not rules else rules if isinstance(rules, list) else [rules]
