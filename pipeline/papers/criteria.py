"""Readers for measures and bounds of claims in YAML files, and checks of the bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pipeline.papers.claims import Claim
from pipeline.papers.entries import number
from pipeline.papers.intervals import Interval
from pipeline.papers.measure import Measure
from pipeline.validation import InvalidInput


def measure(content: Mapping[str, Any], figure: str, where: str) -> Measure:
    """Return the measure that a YAML mapping ``{name: {argument: value}}`` describes."""
    if len(content) != 1 or not all(isinstance(arguments, Mapping) for arguments in content.values()):
        raise InvalidInput(
            "the entry must be the name of one measure with a mapping of its arguments",
            where,
            received=", ".join(map(str, content)) or "nothing",
            code="not_one_measure",
        )
    ((name, entries),) = content.items()
    arguments = {}
    for argument, value in entries.items():
        if argument == "table" or argument.endswith("_table"):
            if not (isinstance(value, str) and value.rpartition("/")[2].startswith("table")):
                raise InvalidInput(
                    "the argument must be the name of a table",
                    f"{where}, {argument}",
                    received=repr(value),
                    code="not_a_table",
                )
            owner, _, table = value.rpartition("/")
            arguments[argument] = (owner or figure) + ("" if table == "table" else f"/{table}")
        else:
            arguments[argument] = _argument(value, figure, f"{where}, {argument}")
    return Measure(name, arguments)


def _argument(value: Any, figure: str, where: str) -> Any:
    if isinstance(value, Mapping):
        return measure(value, figure, where)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(_argument(item, figure, where) for item in value)
    if not isinstance(value, str | int | float):
        raise InvalidInput(
            "the argument must be a number, a text, a list or a measure",
            where,
            received=repr(value),
            code="wrong_type",
        )
    return value


def interval(content: Mapping[str, Any], published: float | None, where: str) -> Interval:
    """Return the interval that a YAML entry of bounds describes.

    The keys are ``exactly``, ``within`` (a distance from the published number), or the two ends.
    """
    values = {str(key): number(value, f"{where}, {key}") for key, value in content.items()}
    if set(values) == {"exactly"}:
        return Interval(values["exactly"], values["exactly"])
    if set(values) == {"within"} and published is not None:
        return Interval(published - values["within"], published + values["within"])
    doubled = {"at_least", "above"} <= set(values) or {"at_most", "below"} <= set(values)
    if not values or not set(values) <= {"at_least", "above", "at_most", "below"} or doubled:
        raise InvalidInput(
            "the entry must have the key 'exactly', or 'within' (of a published number), or one or two of "
            "the keys 'at_least', 'above', 'at_most' and 'below'",
            where,
            received=", ".join(values) or "nothing",
            code="invalid_bounds",
        )
    interval = Interval(
        values.get("at_least", values.get("above", -math.inf)),
        values.get("at_most", values.get("below", math.inf)),
        low_open="above" in values,
        high_open="below" in values,
    )
    if interval.low >= interval.high:
        raise InvalidInput(
            "the lower bound must be below the upper bound",
            where,
            received=interval,
            code="contradictory_bounds",
        )
    return interval


def check_bounds(claim: Claim, where: str) -> None:
    """Check that bounds contain the published number, and that those of 'close' are wider than those of 'agrees'."""
    inner, outer = claim.bounds.agrees, claim.bounds.close
    if inner is not None and claim.published is not None and claim.published not in inner:
        raise InvalidInput(
            "the published number lies outside the bounds of agreement",
            where,
            code="published_outside_bounds",
        )
    if (
        inner is not None
        and outer is not None
        and (outer == inner or outer.low > inner.low or outer.high < inner.high)
    ):
        raise InvalidInput(
            "the bounds of 'close' must be wider than those of 'agrees'", where, code="close_not_wider"
        )
