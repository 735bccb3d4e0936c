"""Claims, measures and verdicts, and the rule by which a claim is judged.

A claim is one number or one sentence of a paper, with the measure that computes our value from a table, the bounds
within which it counts as reproduced, the wider bounds within which the paper's direction holds, the reason for these
bounds, and its null: what the same measure gives when the method does nothing.  All are written down before the figure
is made.  A verdict rests on the interval of our value, not on the value alone.
"""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class Outcome(StrEnum):
    """Verdict on a claim; the last four are those of conditions and of claims that are not judged."""

    REPRODUCED = "reproduced"
    OF_THE_NULL = "holds, also of the null"
    DIRECTION_ONLY = "direction only"
    UNDECIDED = "undecided"
    DIFFERS = "differs"
    MET = "met"
    NOT_MET = "not met"
    UNTESTED = "cannot be tested on this data"
    NOT_JUDGED = "not judged at smoke scale"


class Kind(StrEnum):
    """Kind of a claim."""

    RESULT = "result"
    """A printed number."""
    SENTENCE = "sentence"
    """A statement; the threshold and the reason for it are ours."""
    CONDITION = "condition"
    """A count or a setting of the experiment: checked, never counted as reproduced."""

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Verdicts that a claim of this kind may have, in the order of tables."""
        if self is Kind.CONDITION:
            return (Outcome.MET, Outcome.NOT_MET, Outcome.UNTESTED)
        judged = (Outcome.REPRODUCED, Outcome.OF_THE_NULL, Outcome.DIRECTION_ONLY, Outcome.UNDECIDED)
        return (*judged, Outcome.DIFFERS, Outcome.UNTESTED)


LEAST_PEOPLE = 10
"""Fewer people decide no claim, unless the claim or its paper asks for another number."""

OVERRIDDEN = "overridden"
"""Data set of results with changed options, for which no explanation of a difference is given."""

ANY_DATA = "any"
"""Key of the explanation for data sets that have none of their own."""

_UNEXPLAINED = {OVERRIDDEN: "not explained: the options differ from the preset's"}


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

    def covers(self, other: Estimate) -> bool:
        """Whether the whole interval of an estimate lies within these bounds."""
        return other.low in self and other.high in self

    def meets(self, other: Estimate) -> bool:
        """Whether the interval of an estimate has a part within these bounds."""
        below = other.high < self.low or (self.low_open and other.high == self.low)
        above = other.low > self.high or (self.high_open and other.low == self.high)
        return not (below or above)

    def side(self, value: float) -> int:
        """On which side of a value the bounds lie: 1 above, -1 below, 0 on both."""
        return int(value <= self.low) - int(value >= self.high)

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
class Estimate:
    """A value and its interval over people or populations.

    Attributes
    ----------
    value : float
    low, high : float
        Ends of the 95 % interval; NaN if it has none.

    Examples
    --------
    >>> print(Estimate(30.0, 22.0, 35.0), "|", Estimate(0.5))
    30 [22, 35] | 0.5
    """

    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def known(self) -> bool:
        """Whether there is an interval."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def __str__(self) -> str:
        return f"{self.value:.4g}" + (f" [{self.low:.4g}, {self.high:.4g}]" if self.known else "")


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
        Value of the same measure when the method does nothing; None if there is none.
    no_null : str
        Why no method that does nothing has a value here; empty if there is a null, or it is not stated.
    least_people : int
        Fewer people cannot decide the claim.
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
    history : str
        What was changed of the claim after it was first written, and when it was; empty if nothing.
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
    no_null: str = ""
    least_people: int = LEAST_PEOPLE
    reproduced: Interval | None = None
    direction: Interval | None = None
    reason: str = ""
    why: Mapping[str, str] = field(default_factory=dict)
    untestable: str = ""
    history: str = ""

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the measure and the null read, each once."""
        measured = [m for m in (self.measure, self.null) if isinstance(m, Measure)]
        return tuple(dict.fromkeys(table for measure in measured for table in measure.tables))


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the tables say on a claim.

    Attributes
    ----------
    value : Estimate
        Our value in the claim's unit; not finite if the tables have none.
    null : Estimate or None
        Of the claim's null; None if it has none.
    gap : Estimate or None
        Value less null, their replicates paired; None if there is no null.
    people : int or None
        How many people the tables rest on; None if it is not known.
    """

    value: Estimate
    null: Estimate | None = None
    gap: Estimate | None = None
    people: int | None = None


@dataclass(frozen=True)
class Verdict:
    """The verdict on a claim for one data set.

    Attributes
    ----------
    claim : Claim
    outcome : Outcome
    why : str
        Reason, one line.
    evidence : Evidence or None
        None if the claim has no value on this data.
    """

    claim: Claim
    outcome: Outcome
    why: str
    evidence: Evidence | None = None

    @property
    def value(self) -> float | None:
        """Our value in the claim's unit; None if there is none."""
        return self.evidence.value.value if self.evidence else None


def judge(
    claim: Claim,
    found: Evidence,
    data_name: str,
    number: Callable[[str], float] | None = None,
    *,
    smoke: bool = False,
) -> Verdict:
    """Return the verdict on a claim.

    Parameters
    ----------
    claim : Claim
    found : Evidence
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…: selects the explanation of a difference.
    number : callable, optional
        Our value of another claim or quantity, by name, for explanations that quote it.
    smoke : bool
        Whether the tables are of a small run, which decides nothing but conditions.
    """
    if claim.untestable or claim.reproduced is None:
        return Verdict(claim, Outcome.UNTESTED, claim.untestable)
    if not math.isfinite(found.value.value):
        table = claim.tables[0] if claim.tables else claim.figure
        return Verdict(claim, Outcome.UNTESTED, f"table {table} holds no finite value for: {claim.how}")
    outcome, because = _decide(claim, claim.reproduced, found, smoke)
    if claim.kind is Kind.CONDITION:
        told = f"{found.value.value:.4g} {claim.unit}".rstrip()
    else:
        told = f"{found.value} {claim.unit}".rstrip()
        told += f", null {found.null}" if found.null else ""
    told += f", bounds {claim.reproduced}"
    if outcome in (Outcome.REPRODUCED, Outcome.MET, Outcome.UNTESTED, Outcome.NOT_JUDGED):
        return Verdict(claim, outcome, f"{told}: {because or claim.reason}", found)
    text = (
        claim.why.get(data_name)
        or claim.why.get(ANY_DATA)
        or _UNEXPLAINED.get(data_name, "" if because else "not explained yet")
    )
    # What the interval or the null decides needs no explanation of ours; one may follow.
    why = "; ".join(filter(None, [because, _filled(text, {"value": found.value.value}, number)]))
    return Verdict(claim, outcome, f"{told}: {why}", found)


def _decide(claim: Claim, bounds: Interval, found: Evidence, smoke: bool) -> tuple[Outcome, str]:
    """Return the outcome, and the reason where it is not that the value lies within or outside of the bounds."""
    value, null, gap = found.value, found.null, found.gap
    if claim.kind is Kind.CONDITION:
        return (Outcome.MET if value.value in bounds else Outcome.NOT_MET), ""
    if smoke:
        return Outcome.NOT_JUDGED, "a small run decides nothing"
    if found.people is not None and found.people < claim.least_people:
        return Outcome.UNTESTED, f"{found.people} people, and fewer than {claim.least_people} decide nothing"
    if null is None and not claim.no_null:
        return Outcome.UNDECIDED, "no null is stated"
    if not value.known:
        return Outcome.UNDECIDED, "no interval is known"
    if bounds.covers(value):
        if null is None:
            return Outcome.REPRODUCED, ""
        if null.value in bounds:
            return Outcome.OF_THE_NULL, "a method that does nothing is within the bounds, too"
        if null.known and bounds.meets(null):
            return Outcome.UNDECIDED, "the null's interval reaches into the bounds"
        return Outcome.REPRODUCED, ""
    if bounds.meets(value):
        return Outcome.UNDECIDED, "the interval reaches over an end of the bounds"
    directed = claim.direction is None or claim.direction.covers(value)
    if null is None:
        return (Outcome.DIRECTION_ONLY if directed and claim.direction else Outcome.DIFFERS), ""
    if not (gap and gap.known and (gap.low > 0.0 or gap.high < 0.0)):
        return Outcome.DIFFERS, "and not told apart from a method that does nothing"
    towards = bounds.side(null.value) * gap.value > 0.0
    return (Outcome.DIRECTION_ONLY if directed and towards else Outcome.DIFFERS), ""


def count(verdicts: Iterable[Verdict]) -> dict[Kind, dict[Outcome, int]]:
    """Return how many claims of each kind have each outcome, the kinds apart; outcomes of none are left out."""
    counts: dict[Kind, dict[Outcome, int]] = {}
    for verdict in verdicts:
        of_kind = counts.setdefault(verdict.claim.kind, {})
        of_kind[verdict.outcome] = of_kind.get(verdict.outcome, 0) + 1
    return {
        kind: {outcome: counts[kind][outcome] for outcome in Outcome if outcome in counts[kind]}
        for kind in Kind
        if kind in counts
    }


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
