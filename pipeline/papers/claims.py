"""Claims, measures and verdicts, and the rule by which a claim is judged.

A claim is one number or one sentence of a paper, with the measure that computes our value from a table, the bounds
within which it counts as reproduced, the wider bounds within which the paper's direction holds, and the reason for
these bounds.  All are written down before the figure is made.
"""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal

Outcome = Literal["reproduced", "direction only", "differs", "cannot be tested on this data"]

REPRODUCED: Outcome = "reproduced"
DIRECTION_ONLY: Outcome = "direction only"
DIFFERS: Outcome = "differs"
UNTESTED: Outcome = "cannot be tested on this data"
OUTCOMES = (REPRODUCED, DIRECTION_ONLY, DIFFERS, UNTESTED)

OVERRIDDEN = "overridden"
"""Data set of results with changed options, for which no explanation of a difference is given."""

ANY_DATA = "any"
"""Key of the explanation for data sets that have none of their own."""

_UNEXPLAINED = {OVERRIDDEN: "not explained: the options differ from the preset's"}


class Kind(StrEnum):
    """Kind of a claim."""

    RESULT = "result"
    """A printed number."""
    SENTENCE = "sentence"
    """A statement; the threshold and the reason for it are ours."""
    CONDITION = "condition"
    """A count or a setting of the experiment."""


@dataclass(frozen=True)
class Interval:
    """An interval of numbers; an end belongs to it unless it is open.

    Examples
    --------
    >>> 94.0 in Interval(88.9, 94.9), 95.0 in Interval(88.9, 94.9), 1.0 in Interval(1.0, math.inf, low_open=True)
    (True, False, False)
    >>> print(Interval(88.9, 94.9), "|", Interval(high=2.0), "|", Interval(80.0, 80.0))
    88.9 to 94.9 | at most 2 | exactly 80
    """

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: float) -> bool:
        over = value > self.low if self.low_open else value >= self.low
        under = value < self.high if self.high_open else value <= self.high
        return over and under

    def __str__(self) -> str:
        if self.low == self.high:
            return f"exactly {self.low:g}"
        if math.isfinite(self.low) and math.isfinite(self.high) and not (self.low_open or self.high_open):
            return f"{self.low:g} to {self.high:g}"
        ends = []
        if math.isfinite(self.low):
            ends.append(f"{'over' if self.low_open else 'at least'} {self.low:g}")
        if math.isfinite(self.high):
            ends.append(f"{'under' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(ends)


@dataclass(frozen=True)
class Measure:
    """A named function of tables with its arguments.

    Attributes
    ----------
    name : str
        Of a function in the `measures` modules of the studies.
    arguments : mapping of str to Any
        Numbers, texts, measures and lists of them.  The argument ``table``, and any whose name ends in
        ``_table``, names a table: ``zhang2007_fig5`` is the figure's ``table.csv``, and
        ``zhang2007_fig5/table_walkers`` the ``table_walkers.csv`` beside it.

    Examples
    --------
    >>> of = Measure("mean", {"table": "zhang2007_fig5", "column": "rms_error_mm"})
    >>> both = Measure("ratio", {"of": of, "to": 2})
    >>> print(both, both.tables)
    ratio(of=mean(table=zhang2007_fig5, column=rms_error_mm), to=2) ('zhang2007_fig5',)
    """

    name: str
    arguments: Mapping[str, Any]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(f'{name}={_told(value)}' for name, value in self.arguments.items())})"

    @property
    def parts(self) -> Iterator[Measure]:
        """This measure and all measures among its arguments, recursively."""
        yield self
        for value in self.arguments.values():
            for item in value if isinstance(value, tuple) else (value,):
                if isinstance(item, Measure):
                    yield from item.parts

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the measure reads, each once."""
        named = (
            value
            for part in self.parts
            for name, value in part.arguments.items()
            if name == "table" or name.endswith("_table")
        )
        return tuple(dict.fromkeys(named))


def _told(value: Any) -> str:
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number of ours that an explanation or the README quotes, without a claim about it.

    Attributes
    ----------
    name : str
        Unique among claims and quantities; begins with the paper's key.
    paper, figure : str
        Key of the paper; preset whose tables the measure reads.
    how : str
        The measure in words, one line.
    measure : Measure
    unit : str
    """

    name: str
    paper: str
    figure: str
    how: str
    measure: Measure
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number or a sentence of a paper, and the criterion by which it counts as reproduced.

    Attributes
    ----------
    name : str
        Unique, snake case, begins with the paper's key.
    paper, section : str
    kind : Kind
    quote : str
        The paper's own words, short, with the published number.
    published : float or None
        The paper's number; None for a sentence without one.
    unit : str
        Unit of the published number and of ours; empty for a count or a ratio.
    figure : str
        Preset whose tables back the claim; empty only if `untestable`.
    how : str
        The measure in words, one line.
    measure : Measure or None
        None only if `untestable`.
    null : Measure or float or None
        Value of the same measure when the method does nothing; None if it is not stated.
    reproduced : Interval or None
        Our values that count as reproduced; None only if `untestable`.
    direction : Interval or None
        Our values for which at least the paper's direction holds; None if there are no such bounds.
    reason : str
        Why these bounds, in one line, written before the figure was made.
    why : mapping of str to str
        Why our value differs, by data set; `ANY_DATA` for all that have none of their own.  Our numbers stand
        as placeholders, ``{value:.1f}`` for the claim's own and ``{zhang2007_walkers:.0f}`` for another's.
    untestable : str
        Why none of our data can decide; empty if some can.
    """

    name: str
    paper: str
    section: str
    kind: Kind
    quote: str
    published: float | None = None
    unit: str = ""
    figure: str = ""
    how: str = ""
    measure: Measure | None = None
    null: Measure | float | None = None
    reproduced: Interval | None = None
    direction: Interval | None = None
    reason: str = ""
    why: Mapping[str, str] = field(default_factory=dict)
    untestable: str = ""

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the measure reads."""
        return self.measure.tables if self.measure else ()


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim for one data set.

    Attributes
    ----------
    claim : Claim
    ours : float or None
        Our value in the claim's unit; None if there is none.
    verdict : str
        ``reproduced``, ``direction only``, ``differs`` or ``cannot be tested on this data``.
    why : str
        Reason, one line.
    """

    claim: Claim
    ours: float | None
    verdict: Outcome
    why: str


def judge(claim: Claim, ours: float, data_name: str, number: Callable[[str], float] | None = None) -> Verdict:
    """Return the verdict on a claim, given our value.

    Parameters
    ----------
    claim : Claim
    ours : float
        Our value; not finite if the tables have none.
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…: selects the explanation of a difference.
    number : callable, optional
        Our value of another claim or quantity, by name, for explanations that quote it.
    """
    if claim.untestable or claim.reproduced is None:
        return Verdict(claim, None, UNTESTED, claim.untestable)
    if not math.isfinite(ours):
        table = claim.tables[0] if claim.tables else claim.figure
        return Verdict(claim, None, UNTESTED, f"table {table} holds no finite value for: {claim.how}")
    judged = f"{ours:.4g} {claim.unit}".rstrip() + f", bounds {claim.reproduced}"
    if ours in claim.reproduced:
        return Verdict(claim, ours, REPRODUCED, f"{judged}: {claim.reason}")
    text = (
        claim.why.get(data_name)
        or claim.why.get(ANY_DATA)
        or _UNEXPLAINED.get(data_name, "not explained yet")
    )
    why = _filled(text, {"value": ours}, number)
    if claim.direction is not None and ours in claim.direction:
        return Verdict(claim, ours, DIRECTION_ONLY, f"{judged}, direction {claim.direction}: {why}")
    return Verdict(claim, ours, DIFFERS, f"{judged}: {why}")


def placeholders(text: str) -> list[str]:
    """Return the names of the numbers that a text quotes, in order.

    Examples
    --------
    >>> placeholders("{value:.1f} of {zhang2007_walkers:.0f} walkers")
    ['value', 'zhang2007_walkers']
    """
    return [name for _, name, _, _ in string.Formatter().parse(text) if name is not None]


def _filled(text: str, known: Mapping[str, float], number: Callable[[str], float] | None) -> str:
    numbers = {name: known[name] if name in known else number(name) if number else math.nan
               for name in placeholders(text)}  # fmt: skip
    return text.format_map({name: _Number(value) for name, value in numbers.items()})


class _Number(float):
    """A number that is formatted as ``(no number)`` if it is not finite."""

    def __format__(self, specification: str) -> str:
        return super().__format__(specification) if math.isfinite(self) else "(no number)"
