"""Claims, and the measures that give our numbers beside theirs.

A claim is one number or one sentence of a paper, with the measure that computes our value from a table, the bounds
within which it counts as reproduced, the wider bounds within which the paper's direction holds, the reason for these
bounds, and its null: what the same measure gives when the method does nothing.  All are written down before the figure
is made.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from pipeline.papers.explanations import ANY_DATA, Explanation
from pipeline.papers.intervals import Interval


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
    TARGET = "target"
    """What we set out to reach beyond the papers, judged as a result is and counted apart from theirs."""

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Verdicts that a claim of this kind may have, in the order of tables."""
        if self is Kind.CONDITION:
            return (Outcome.MET, Outcome.NOT_MET, Outcome.UNTESTED)
        judged = (Outcome.REPRODUCED, Outcome.OF_THE_NULL, Outcome.DIRECTION_ONLY, Outcome.UNDECIDED)
        return (*judged, Outcome.DIFFERS, Outcome.UNTESTED)


LEAST_PEOPLE = 10
"""Fewer people decide no claim, unless the claim or its paper asks for another number."""


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
    """A number of ours that an explanation or the documentation quotes, without a claim about it.

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
    assumed : mapping of str to str
        Data sets of which the statement is an assumption, each with what is assumed: they cannot test it.
    only : tuple of str
        Data sets that the claim is about; empty if it is about all.
    least_people : int
        Fewer people cannot decide the claim.
    reproduced : Interval or None
        Our values that count as reproduced; None only if `untestable`.
    direction : Interval or None
        Our values for which at least the paper's direction holds; None if there are no such bounds.
    reason : str
        Why these bounds, in one line, written before the figure was made.
    why : mapping of str to Explanation
        Why our value differs, by data set; `ANY_DATA` for all that have none of their own.
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
    assumed: Mapping[str, str] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    least_people: int = LEAST_PEOPLE
    reproduced: Interval | None = None
    direction: Interval | None = None
    reason: str = ""
    why: Mapping[str, Explanation] = field(default_factory=dict)
    untestable: str = ""
    history: str = ""

    def explanation(self, data_name: str) -> Explanation | None:
        """Return why our value differs on a data set; None if nothing is said."""
        return self.why.get(data_name) or self.why.get(ANY_DATA)

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the measure and the null read, each once."""
        measured = [m for m in (self.measure, self.null) if isinstance(m, Measure)]
        return tuple(dict.fromkeys(table for measure in measured for table in measure.tables))
