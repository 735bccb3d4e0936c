"""Claims of the papers: each has a published value, a measure that computes our value, and bounds of agreement.

A claim is one number or one sentence of a paper.  Its measure computes our value from a table.  Its bounds give the
values that agree with the paper, and wider bounds those that are close; the reason for the bounds is recorded.  Each
measure belongs to a class with a baseline: the same measure of a simpler method.  A rule chooses the baseline, not the
claim (``conf/paper/baselines.yaml``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from pipeline.papers.explanations import ANY_DATA, Explanation
from pipeline.papers.intervals import Interval
from pipeline.papers.measure import Measure


class Agreement(StrEnum):
    """Verdict on a claim: whether our value agrees with the paper's; a condition is either met or not met."""

    AGREES = "agrees"
    CLOSE = "close"
    UNDECIDED = "undecided"
    DIFFERS = "differs"
    MET = "met"
    NOT_MET = "not met"
    UNTESTABLE = "untestable"
    NOT_JUDGED = "not judged at smoke scale"


class Beyond(StrEnum):
    """Verdict on a method: whether it is better than its baseline, from the interval of their paired difference."""

    YES = "yes"
    NO = "no"
    WORSE = "worse"
    UNKNOWN = "unknown"
    """The difference between method and baseline has no confidence interval."""
    NOT_APPLICABLE = "not applicable"


class Kind(StrEnum):
    """Kind of a claim: result, sentence, condition or target."""

    RESULT = "result"
    """Claim about a number that a paper publishes."""
    SENTENCE = "sentence"
    """Claim about a statement in words; we define its numerical threshold, and give the reason for it."""
    CONDITION = "condition"
    """Count or setting of the experiment, which is checked but never counted as agreement."""
    TARGET = "target"
    """Goal of this project beyond the papers, tested like a result but counted separately."""

    @property
    def answers(self) -> tuple[Agreement, ...]:
        """Verdicts that are possible for a claim of this kind, in the order of tables."""
        if self is Kind.CONDITION:
            return (Agreement.MET, Agreement.NOT_MET, Agreement.UNTESTABLE)
        judged = (Agreement.AGREES, Agreement.CLOSE, Agreement.UNDECIDED, Agreement.DIFFERS)
        return (*judged, Agreement.UNTESTABLE)


LONGEST_SHORT = 40
"""Largest number of characters in the short name of a claim."""

LEAST_PEOPLE = {"walks": 10, "clips": 10, "performances": 3}
"""Smallest number of people that can decide a claim, by the kind of recordings that the paper uses."""


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """Simpler method with which a method of a paper is compared, for one class of measures.

    Attributes
    ----------
    measures : str
        Name of the class.
    name, knows : str
        The method in words, and its input: nothing, the image, linear time, one eigenwalker.  Both are empty for a
        class without a baseline, where no method is involved.
    reason : str
        Reason for this baseline, or for the lack of one.
    replace : mapping of str to str
        Words of a measure and their replacements in the measure of the baseline.
    value : float or None
        Constant value of the baseline, instead of a measure.
    better : int
        1 if more is better, -1 if less is better, 0 if the bounds of each claim decide.
    assumed : mapping of str to str
        Data sets that assume the measured property, each with the assumption; they test no claim of the class.
    """

    measures: str
    reason: str
    name: str = ""
    knows: str = ""
    replace: Mapping[str, str] = field(default_factory=dict)
    value: float | None = None
    better: int = 0
    assumed: Mapping[str, str] = field(default_factory=dict)

    def of(self, measure: Measure) -> Measure | float | None:
        """Return the measure, or the constant value, that stands for the baseline of a given measure.

        Return None if there is no baseline, or if no word of the measure is replaced.
        """
        if self.value is not None or not self.replace:
            return self.value
        changed = measure.replaced(self.replace)
        return None if str(changed) == str(measure) else changed


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One of our results that explanations or the documentation quote, but that is not a claim.

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
class ClaimText:
    """Texts that describe a claim: short name, place in the paper, quotation and method of measurement.

    Attributes
    ----------
    short : str
        Subject of the claim, at most `LONGEST_SHORT` characters, unique.
    section : str
        Section of the paper.
    quote : str
        The paper's own words, short, with the published number; the target in words if it is ours.
    how : str
        The measure in words, one line.
    help : str
        Help that our method has here and the paper's had not; empty without such help.
    """

    short: str
    section: str
    quote: str
    how: str = ""
    help: str = ""


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Bounds within which our value agrees with a claim, and the reason for these bounds.

    Attributes
    ----------
    agrees : Interval or None
        Our values that agree with the paper; None only if the claim is untestable or has registered values.
    close : Interval or None
        Wider bounds, if any.
    reason : str
        Reason for these bounds, in one line.
    written : str
        Date of bounds and class: before the figure was made, or the changes after it.
    registered : mapping of str to Interval, or None
        Bounds by data set, for a condition on a registered value.
    """

    agrees: Interval | None = None
    close: Interval | None = None
    reason: str = ""
    written: str = ""
    registered: Mapping[str, Interval] | None = None


@dataclass(frozen=True, kw_only=True)
class Scope:
    """Data sets that can decide a claim, with the required number of people.

    Attributes
    ----------
    assumed : mapping of str to str
        Data sets that assume the statement, each with the assumption; they cannot test it.
    only : tuple of str
        Data sets that the claim is about; empty for all data sets.
    rests_on : tuple of str
        Conditions of the experiment; unless all are met, the claim cannot be tested.
    people, sample : int
        Least number of people that decides; number of people in the paper.
    untestable : str
        Reason why none of our data can decide; empty if some can.
    """

    assumed: Mapping[str, str] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    rests_on: tuple[str, ...] = ()
    people: int = LEAST_PEOPLE["walks"]
    sample: int = 0
    untestable: str = ""


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number or a sentence of a paper, with the measure that computes our value and the bounds of agreement.

    Attributes
    ----------
    name : str
        Unique, snake case, begins with the paper's key.
    paper : str
    kind : Kind
    figure : str
        Preset whose tables back the claim; empty only if it is untestable.
    published : float or None
        The paper's number; None for a sentence without one.
    unit : str
        Unit of the published number and of ours; empty for a count or a ratio.
    measure : Measure or None
        None only if the claim is untestable.
    baseline : Baseline or None
        Baseline of the class of its measure; None for a condition and for an untestable claim.
    same_as : str
        Claim that has the same number, which counts once.
    text : ClaimText
    bounds : Bounds
    scope : Scope
    why : mapping of str to Explanation
        Reason why our value differs, by data set; `ANY_DATA` for all other data sets.
    sensitivity : mapping of str to tuple of Explanation
        Our value under other assumptions, by data set; reported together with the value.
    """

    name: str
    paper: str
    kind: Kind
    figure: str = ""
    published: float | None = None
    unit: str = ""
    measure: Measure | None = None
    baseline: Baseline | None = None
    same_as: str = ""
    text: ClaimText
    bounds: Bounds = Bounds()
    scope: Scope = Scope()
    why: Mapping[str, Explanation] = field(default_factory=dict)
    sensitivity: Mapping[str, tuple[Explanation, ...]] = field(default_factory=dict)

    @property
    def explanations(self) -> Iterator[tuple[str, Explanation]]:
        """Pairs of a data set's name and an explanation, including the explanations of sensitivity runs."""
        yield from self.why.items()
        for data_name, runs in self.sensitivity.items():
            yield from ((data_name, run) for run in runs)

    def bounds_on(self, data_name: str) -> Interval | None:
        """Return the bounds of agreement of this claim on a data set, or None if they are not defined."""
        registered = self.bounds.registered
        return self.bounds.agrees if registered is None else registered.get(data_name)

    def explanation(self, data_name: str) -> Explanation | None:
        """Return the reason why our value differs from the paper's value on a data set, or None."""
        return self.why.get(data_name) or self.why.get(ANY_DATA)

    @property
    def of_baseline(self) -> Measure | float | None:
        """Measure of the claim's baseline: the claim's measure for a simpler method, a constant, or None."""
        return self.baseline.of(self.measure) if self.baseline and self.measure else None

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the claim's measure and its baseline read, without duplicates."""
        measured = [m for m in (self.measure, self.of_baseline) if isinstance(m, Measure)]
        return tuple(dict.fromkeys(table for measure in measured for table in measure.tables))
