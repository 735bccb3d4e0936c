"""CSS classes and meanings of the verdicts on the report page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.papers import Agreement, Beyond
from pipeline.report.published import Published

AGREEMENTS = {
    Agreement.AGREES: ("good", "the whole interval of our value is to the right of the line."),
    Agreement.CLOSE: (
        "half",
        "the direction agrees with the paper; the interval is within wider bounds for the size.",
    ),
    Agreement.UNDECIDED: ("open", "the interval crosses an end of the wider bounds."),
    Agreement.DIFFERS: ("bad", "the interval is to the left of the line, outside the wider bounds."),
    Agreement.MET: ("met", "our count or setting equals the paper's."),
    Agreement.NOT_MET: ("unmet", "our count or setting differs from the paper's."),
    Agreement.UNTESTABLE: ("none", "our data cannot test the claim."),
    Agreement.NOT_JUDGED: ("none", "the run was too small to test the claim."),
}
"""CSS class and meaning of each verdict on the agreement with the paper."""

BEYOND = {
    Beyond.YES: ("better", "the method beats its baseline, a simpler method that is fixed by rule."),
    Beyond.NO: ("even", "the method cannot be distinguished from its baseline, which has the same verdict."),
    Beyond.WORSE: ("worse", "the method is worse than its baseline."),
    Beyond.UNKNOWN: ("unsure", "the interval of the gap to the baseline is unknown."),
}
"""CSS class and meaning of each verdict against the baseline, for claims with a baseline."""


def tone(verdict: str) -> str:
    """Return the CSS class of a verdict on the agreement with the paper.

    Examples
    --------
    >>> [tone(v) for v in ("agrees", "close", "undecided", "differs", "untestable", "met", "not met")]
    ['good', 'half', 'open', 'bad', 'none', 'met', 'unmet']
    """
    return AGREEMENTS[Agreement(verdict)][0] if verdict in set(Agreement) else "none"


def beyond_tone(verdict: str) -> str:
    """Return the CSS class of a verdict against the baseline, or an empty string without a baseline."""
    return BEYOND[Beyond(verdict)][0] if verdict in BEYOND else ""


def answers(claim: Mapping[str, Any]) -> tuple[str, str]:
    """Return the two verdicts on a claim: agreement with the paper, and comparison with the baseline."""
    return str(claim["agreement"]), str(claim.get("beyond_baseline") or Beyond.NOT_APPLICABLE)


def reason(claim: Mapping[str, Any]) -> str:
    """Return the reason for a claim's bounds and verdict, without the value and the bounds that precede it.

    Examples
    --------
    >>> reason({"why": "15, bounds exactly 15: a count: equal or not", "bounds": "exactly 15"})
    'a count: equal or not'
    """
    return str(claim.get("why") or "").rpartition(f"bounds {claim.get('bounds')}: ")[2]


def legend(results: Published) -> list[tuple[str, str, str]]:
    """Return the CSS class, name and meaning of each agreement verdict that occurs on the page."""
    present = {answers(claim)[0] for claim in results.claims}
    return [
        (tone, str(agreement), words)
        for agreement, (tone, words) in AGREEMENTS.items()
        if agreement in present
    ]
