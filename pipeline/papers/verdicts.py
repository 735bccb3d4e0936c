"""The rule of verdicts: from the interval of our value, that of the null and the bounds of the claim."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pipeline.papers.claims import Claim, Kind, Outcome
from pipeline.papers.intervals import Estimate, Interval

_OVERRIDDEN = "not explained: the options differ from the preset's"


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
    doubt : str
        Why it is not known how many people they are; empty if it is.
    """

    value: Estimate
    null: Estimate | None = None
    gap: Estimate | None = None
    people: int | None = None
    doubt: str = ""


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
    overridden: bool = False,
) -> Verdict:
    """Return the verdict on a claim.

    Parameters
    ----------
    claim : Claim
    found : Evidence
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…: what is assumed of it, whether the claim is about
        it, the explanation of a difference.
    number : callable, optional
        Our value of another claim or quantity, by name, for explanations that quote it.
    smoke : bool
        Whether the tables are of a small run, which decides nothing but conditions.
    overridden : bool
        Whether options differ from the preset's: no explanation of a difference is given.
    """
    if claim.untestable or claim.reproduced is None:
        return Verdict(claim, Outcome.UNTESTED, claim.untestable)
    if not math.isfinite(found.value.value):
        table = claim.tables[0] if claim.tables else claim.figure
        return Verdict(claim, Outcome.UNTESTED, f"table {table} holds no finite value for: {claim.how}")
    if claim.kind is not Kind.CONDITION and data_name in claim.assumed and not smoke:
        why = f"{found.value} {claim.unit}".rstrip() + f": assumed of this data: {claim.assumed[data_name]}"
        return Verdict(claim, Outcome.UNTESTED, why, found)
    if claim.only and data_name not in claim.only:
        return Verdict(claim, Outcome.UNTESTED, f"about {' and '.join(claim.only)} alone", found)
    outcome, because = _decide(claim, claim.reproduced, found, smoke)
    if claim.kind is Kind.CONDITION:
        told = f"{found.value.value:.4g} {claim.unit}".rstrip()
    else:
        told = f"{found.value} {claim.unit}".rstrip()
        told += f", null {found.null}" if found.null else ""
    told += f", bounds {claim.reproduced}"
    if outcome in (Outcome.REPRODUCED, Outcome.MET, Outcome.UNTESTED, Outcome.NOT_JUDGED):
        return Verdict(claim, outcome, f"{told}: {because or claim.reason}", found)
    explanation = claim.explanation(data_name)
    if overridden:
        text = _OVERRIDDEN
    elif explanation is None:
        text = "" if because else "not explained yet"
    else:
        text = explanation.told(claim.name, found.value.value, number)
    # What the interval or the null decides needs no explanation of ours; one may follow.
    why = "; ".join(filter(None, [because, text]))
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
    if found.doubt:
        return Outcome.UNTESTED, f"who is who is not known: {found.doubt}"
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
