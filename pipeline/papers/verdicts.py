"""Verdicts on claims: agreement of our value with the paper, and comparison of the method with its baseline.

Agreement depends only on the 95 % interval of our value and the bounds of the claim.  The comparison depends on the
interval of the paired difference between method and baseline; it does not change the agreement.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pipeline.papers.claims import Agreement, Beyond, Claim, Kind
from pipeline.papers.intervals import Estimate, Interval

FEWEST_COVERED = 12
"""Smallest number of people for a confidence interval that can decide a claim.

With fewer people, a 95 % interval of a mean covers the true mean of exponential data in less than 93 % of trials
(``make bench ARGS=coverage_of_intervals``).
"""

_OVERRIDDEN = "not explained: the options differ from the preset's"


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Evidence for a verdict on a claim: our value, the baseline's value and the number of people, from the tables.

    Attributes
    ----------
    value : Estimate
        Our value in the claim's unit; not finite if the tables have none.
    one_sample : Estimate or None
        Our value with the prediction interval for one sample of the paper's size.
    baseline : Estimate or None
        The measure of the baseline, if any.
    gain : Estimate or None
        Advantage of the method over the baseline, with paired replicates (`gain`).
    people : int or None
        Number of people in the tables, if known.
    doubt : str
        Reason why the tables cannot decide: unknown people, or a condition that is not met; else empty.
    drawn : int
        Number of people or clips that the interval resamples; 0 for an interval over populations.
    """

    value: Estimate
    one_sample: Estimate | None = None
    baseline: Estimate | None = None
    gain: Estimate | None = None
    people: int | None = None
    doubt: str = ""
    drawn: int = 0


@dataclass(frozen=True)
class Verdict:
    """Verdict on a claim for one data set, with the reason and the evidence.

    Attributes
    ----------
    claim : Claim
    agreement : Agreement
    beyond : Beyond
    why : str
        Reason, one line.
    evidence : Evidence or None
        None if the claim has no value on this data.
    """

    claim: Claim
    agreement: Agreement
    why: str
    evidence: Evidence | None = None
    beyond: Beyond = Beyond.NOT_APPLICABLE

    @property
    def value(self) -> float | None:
        """Our value in the unit of the claim, or None if the claim has no value on these data."""
        return self.evidence.value.value if self.evidence else None

    @property
    def row(self) -> dict[str, str]:
        """Row of the verdict as in ``claims.csv``, but with only the columns that counts need."""
        return {
            "paper": self.claim.paper,
            "kind": str(self.claim.kind),
            "agreement": str(self.agreement),
            "beyond_baseline": str(self.beyond),
            "same_as": self.claim.same_as,
        }

    @property
    def paper_in_prediction(self) -> bool | None:
        """True if the paper's value lies in our prediction interval for a sample of the paper's size.

        None without a published value or without a prediction interval.
        """
        prediction = self.evidence.one_sample if self.evidence else None
        if prediction is None or not prediction.known or self.claim.published is None:
            return None
        return prediction.low <= self.claim.published <= prediction.high


def gain(claim: Claim, baseline: float) -> Callable[[Any, Any], Any]:
    """Return a function of our value and the baseline's value that gives the advantage of our value.

    Bounds with one end define the better side.  With two ends, the class of the measure defines it, or else the side
    of the baseline on which the bounds lie.  If the baseline lies within the bounds, nearness to the paper's number,
    or to the middle of the bounds, is better.
    """
    bounds = claim.bounds.agrees or Interval()
    side = int(math.isinf(bounds.high)) - int(math.isinf(bounds.low))
    side = side or (claim.baseline.better if claim.baseline else 0) or bounds.side(baseline)
    if side:
        return lambda ours, theirs: side * (ours - theirs)
    middle = claim.published if claim.published is not None else 0.5 * (bounds.low + bounds.high)
    return lambda ours, theirs: abs(theirs - middle) - abs(ours - middle)


def judge(
    claim: Claim,
    found: Evidence,
    data_name: str,
    number: Callable[[str], float] | None = None,
    *,
    smoke: bool = False,
    overridden: bool = False,
) -> Verdict:
    """Return the verdict on a claim for one data set.

    Parameters
    ----------
    claim : Claim
    found : Evidence
    data_name : str
        Option of the data group, such as ``"synthetic"`` or ``"optical"``.  It selects assumptions, scope and
        explanation of the claim.
    number : callable, optional
        Function from the name of another claim or quantity to our value, which explanations quote.
    smoke : bool
        True for tables of a small run, which decides only conditions.
    overridden : bool
        True if options differ from the preset's: differences are not explained.
    """
    bounds = claim.bounds_on(data_name)
    if claim.bounds.registered is not None and (smoke or overridden):
        why = "registered values are those of the presets at full scale"
        return Verdict(claim, Agreement.UNTESTABLE, why, found)
    if claim.bounds.registered is not None and bounds is None:
        return Verdict(claim, Agreement.UNTESTABLE, f"no value is registered for {data_name}", found)
    if claim.scope.untestable or bounds is None:
        return Verdict(claim, Agreement.UNTESTABLE, claim.scope.untestable)
    if not math.isfinite(found.value.value):
        table = claim.tables[0] if claim.tables else claim.figure
        why = f"table {table} holds no finite value for: {claim.text.how}"
        return Verdict(claim, Agreement.UNTESTABLE, why)
    if claim.kind is Kind.CONDITION:
        met = found.value.value in bounds
        agreement, because, beyond = Agreement.MET if met else Agreement.NOT_MET, "", Beyond.NOT_APPLICABLE
        numbers = f"{found.value.value:.4g} {claim.unit}".rstrip()
    elif smoke:
        return Verdict(claim, Agreement.NOT_JUDGED, "a small run decides nothing", found)
    elif because := _untestable(claim, found, data_name):
        return Verdict(claim, Agreement.UNTESTABLE, because, found)
    else:
        agreement, because = _agreement(claim, found.value)
        beyond = _beyond(found)
        numbers = f"{found.value} {claim.unit}".rstrip()
        numbers += f", baseline {found.baseline}" if found.baseline else ""
    numbers += f", bounds {bounds}"
    runs = () if overridden else claim.sensitivity.get(data_name, ())
    other = [run.in_words(claim.name, found.value.value, number) for run in runs]
    if agreement in (Agreement.AGREES, Agreement.MET):
        why = "; ".join([claim.bounds.reason, *other])
        return Verdict(claim, agreement, f"{numbers}: {why}", found, beyond)
    explanation = claim.explanation(data_name)
    if overridden:
        text = _OVERRIDDEN
    elif explanation is None:
        text = "" if because else "not explained yet"
    else:
        text = explanation.in_words(claim.name, found.value.value, number)
    why = "; ".join(filter(None, [because, text, *other]))
    return Verdict(claim, agreement, f"{numbers}: {why}", found, beyond)


def _untestable(claim: Claim, found: Evidence, data_name: str) -> str:
    """Return the reason why these data cannot test a claim, or an empty string if they can."""
    if data_name in claim.scope.assumed:
        return (
            f"{found.value} {claim.unit}".rstrip()
            + f": assumed of this data: {claim.scope.assumed[data_name]}"
        )
    if claim.scope.only and data_name not in claim.scope.only:
        return f"about {' and '.join(claim.scope.only)} alone"
    if found.people is not None and found.people < claim.scope.people:
        return f"too few people: {found.people}, and fewer than {claim.scope.people} decide nothing"
    if 0 < found.drawn < FEWEST_COVERED:
        too_few = f"too few people: an interval over fewer than {FEWEST_COVERED} does not hold its level"
        return f"{found.value} {claim.unit}".rstrip() + f": {too_few} (found {found.drawn})"
    return found.doubt


def _agreement(claim: Claim, value: Estimate) -> tuple[Agreement, str]:
    """Return the agreement of our value with the paper, and a reason if our interval is unknown or crosses a bound."""
    assert claim.bounds.agrees is not None
    if not value.known:
        return Agreement.UNDECIDED, "no interval is known"
    if claim.bounds.agrees.covers(value):
        return Agreement.AGREES, ""
    wider = claim.bounds.close or claim.bounds.agrees
    if wider.covers(value):
        crosses = claim.bounds.agrees.meets(value)
        return (
            Agreement.CLOSE,
            f"the interval reaches over an end of {claim.bounds.agrees}" if crosses else "",
        )
    if wider.meets(value):
        return Agreement.UNDECIDED, f"the interval reaches over an end of {wider}"
    return Agreement.DIFFERS, ""


def _beyond(found: Evidence) -> Beyond:
    if found.baseline is None or found.gain is None:
        return Beyond.NOT_APPLICABLE
    if not found.gain.known:
        return Beyond.UNKNOWN
    if found.gain.low > 0:
        return Beyond.YES
    return Beyond.WORSE if found.gain.high < 0 else Beyond.NO
