"""The two answers to a claim: does our value agree with the paper's, and is the method beyond its baseline.

Agreement rests on the 95 % interval of where we are, against the bounds of the claim, and on nothing else.  Beyond the
baseline is decided by the interval of the paired gap between method and baseline; it never takes agreement away.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pipeline.papers.claims import Agreement, Beyond, Claim, Kind
from pipeline.papers.intervals import Estimate, Interval

FEWEST_COVERED = 12
"""Over fewer people a 95 % interval of a mean holds the true one less than 93 times in a hundred, if it is exponential
(``make bench ARGS=coverage_of_intervals``): they decide nothing."""

_OVERRIDDEN = "not explained: the options differ from the preset's"


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What the tables say on a claim.

    Attributes
    ----------
    value : Estimate
        Our value in the claim's unit; not finite if the tables have none.
    one_sample : Estimate or None
        The value with the interval of one sample of the paper's size.
    baseline : Estimate or None
        The same measure of the baseline; None if it has none.
    gain : Estimate or None
        By how much the method is better than the baseline, their replicates paired (`gain`).
    people : int or None
        How many people the tables rest on; None if it is not known.
    doubt : str
        Why the tables decide nothing: who is who is not known, or a condition of the experiment is not met; else empty.
    drawn : int
        How many people or clips the interval draws from; 0 if it is over populations.
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
    """The two answers to a claim for one data set.

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
        """Our value in the claim's unit; None if there is none."""
        return self.evidence.value.value if self.evidence else None

    @property
    def row(self) -> dict[str, str]:
        """The columns of ``claims.csv`` that counts rest on."""
        return {
            "paper": self.claim.paper,
            "kind": str(self.claim.kind),
            "agreement": str(self.agreement),
            "beyond_baseline": str(self.beyond),
            "same_as": self.claim.same_as,
        }

    @property
    def paper_in_prediction(self) -> bool | None:
        """Whether one sample of the paper's size would give the paper's number; None if that is not known."""
        found = self.evidence.one_sample if self.evidence else None
        if found is None or not found.known or self.claim.published is None:
            return None
        return found.low <= self.claim.published <= found.high


def gain(claim: Claim, baseline: float) -> Callable[[Any, Any], Any]:
    """Return the function of values and baselines by which the first are better.

    The better side is the open one of the bounds, else what the class says; else that on which they lie of the
    baseline; within two ends, the nearness to the paper's number, or to the middle.
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
    """Return why this data cannot decide, empty if it can."""
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
    """Return the agreement, and the reason where it is not that the interval lies within or outside of the bounds."""
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
