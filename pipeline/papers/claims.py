"""Claims, and the measures that give our numbers beside theirs.

A claim is one number or one sentence of a paper, with the measure that computes our value from a table, the bounds
within which it agrees with the paper, the wider bounds within which it is close, the reason for these bounds, and the
class of its measure.  The class has the baseline: what the same measure gives of a simpler method, chosen by rule and
not by the claim (``conf/paper/baselines.yaml``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from pipeline.papers.explanations import ANY_DATA, Explanation
from pipeline.papers.intervals import Interval
from pipeline.papers.measure import Measure


class Agreement(StrEnum):
    """Whether our value agrees with the paper; of conditions the two before the last two."""

    AGREES = "agrees"
    CLOSE = "close"
    UNDECIDED = "undecided"
    DIFFERS = "differs"
    MET = "met"
    NOT_MET = "not met"
    UNTESTABLE = "untestable"
    NOT_JUDGED = "not judged at smoke scale"


class Beyond(StrEnum):
    """Whether the method is better than its baseline, by more than the interval of their paired gap."""

    YES = "yes"
    NO = "no"
    WORSE = "worse"
    UNKNOWN = "unknown"
    """No interval of the gap is known."""
    NOT_APPLICABLE = "not applicable"


class Kind(StrEnum):
    """Kind of a claim."""

    RESULT = "result"
    """A printed number."""
    SENTENCE = "sentence"
    """A statement; the threshold and the reason for it are ours."""
    CONDITION = "condition"
    """A count or a setting of the experiment: checked, never counted as agreement."""
    TARGET = "target"
    """What we set out to reach beyond the papers, judged as a result is and counted apart from theirs."""

    @property
    def answers(self) -> tuple[Agreement, ...]:
        """Agreements that a claim of this kind may have, in the order of tables."""
        if self is Kind.CONDITION:
            return (Agreement.MET, Agreement.NOT_MET, Agreement.UNTESTABLE)
        judged = (Agreement.AGREES, Agreement.CLOSE, Agreement.UNDECIDED, Agreement.DIFFERS)
        return (*judged, Agreement.UNTESTABLE)


LONGEST_SHORT = 40
"""Characters of a claim's short name."""

LEAST_PEOPLE = {"walks": 10, "clips": 10, "performances": 3}
"""Fewer people decide no claim, by the clips that a paper's figures rest on."""


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """The simpler method with which a class of measures is compared.

    Attributes
    ----------
    measures : str
        Name of the class.
    name, knows : str
        The method in words, and what it knows: nothing, the image, linear time, one eigenwalker; empty if the class
        has none, because no method has a part in it.
    reason : str
        Why this one, or why none.
    replace : mapping of str to str
        Words of a measure for which others stand in that of the baseline.
    value : float or None
        A number in place of a measure.
    better : int
        1 if more is better, -1 if less, 0 if the bounds of a claim say; only bounds with two ends leave it open.
    assumed : mapping of str to str
        Data sets that assume what the class measures, each with the assumption: they test no claim of the class.
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
        """Return the same measure of the baseline; None if the class has none, or the measure names nothing of it."""
        if self.value is not None or not self.replace:
            return self.value
        changed = measure.replaced(self.replace)
        return None if str(changed) == str(measure) else changed


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
class ClaimText:
    """Words of a claim.

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
        Help that our method has here and the paper's did not; empty if none.
    """

    short: str
    section: str
    quote: str
    how: str = ""
    help: str = ""


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Values with which a claim agrees.

    Attributes
    ----------
    agrees : Interval or None
        Our values that agree with the paper; None only if the claim is untestable or has registered values.
    close : Interval or None
        Wider bounds; None if there are none.
    reason : str
        Reason for these bounds, in one line.
    written : str
        Date of bounds and class: before the figure was made, or what was changed after it.
    registered : mapping of str to Interval, or None
        Of a condition on a registered value: its bounds by data set.
    """

    agrees: Interval | None = None
    close: Interval | None = None
    reason: str = ""
    written: str = ""
    registered: Mapping[str, Interval] | None = None


@dataclass(frozen=True, kw_only=True)
class Scope:
    """Data that can decide a claim.

    Attributes
    ----------
    assumed : mapping of str to str
        Data sets that assume the statement, each with the assumption: they cannot test it.
    only : tuple of str
        Data sets that the claim is about; empty if it is about all.
    rests_on : tuple of str
        Conditions of the experiment: where one is not met, the claim cannot be tested.
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
    """A number or a sentence of a paper, and the criterion by which ours agrees with it.

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
        Reason why our value differs, by data set; `ANY_DATA` for all that have none of their own.
    sensitivity : mapping of str to tuple of Explanation
        Our value under other assumptions, by data set: it stands wherever the value does.
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
        """Each explanation with its data set, those of the sensitivity included."""
        yield from self.why.items()
        for data_name, runs in self.sensitivity.items():
            yield from ((data_name, run) for run in runs)

    def bounds_on(self, data_name: str) -> Interval | None:
        """Return the values that agree on a data set; None if there are none, or no value is registered for it."""
        registered = self.bounds.registered
        return self.bounds.agrees if registered is None else registered.get(data_name)

    def explanation(self, data_name: str) -> Explanation | None:
        """Return why our value differs on a data set; None if nothing is said."""
        return self.why.get(data_name) or self.why.get(ANY_DATA)

    @property
    def of_baseline(self) -> Measure | float | None:
        """The same measure of the baseline; None if it has none."""
        return self.baseline.of(self.measure) if self.baseline and self.measure else None

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the measure and its baseline read, each once."""
        measured = [m for m in (self.measure, self.of_baseline) if isinstance(m, Measure)]
        return tuple(dict.fromkeys(table for measure in measured for table in measure.tables))
