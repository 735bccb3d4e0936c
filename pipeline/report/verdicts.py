"""Verdicts on the page: their signs, how many of each kind there are, and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.papers import Agreement, Beyond
from pipeline.report.published import Published

AGREEMENTS = {
    Agreement.AGREES: ("good", "the whole interval of our value lies right of the line."),
    Agreement.CLOSE: ("half", "the paper's direction, its size not for certain: within wider bounds."),
    Agreement.UNDECIDED: ("open", "it reaches over an end of the wider bounds."),
    Agreement.DIFFERS: ("bad", "it lies left of it, outside of the wider bounds."),
    Agreement.MET: ("met", "a count or a setting of the paper's is ours as well."),
    Agreement.NOT_MET: ("unmet", "it is not."),
    Agreement.UNTESTABLE: ("none", "our data cannot decide."),
    Agreement.NOT_JUDGED: ("none", "a small run decides nothing."),
}
"""The sign of each agreement, and what it means."""

BEYOND = {
    Beyond.YES: ("better", "the method is better than its baseline, a simpler method that is fixed by rule."),
    Beyond.NO: ("even", "it is not told apart from its baseline, which agrees or differs as it does."),
    Beyond.WORSE: ("worse", "it is worse than its baseline."),
    Beyond.UNKNOWN: ("unsure", "no interval of its gap to the baseline is known."),
}
"""The same of what is said about the baseline; not where there is none."""


def tone(verdict: str) -> str:
    """Return the class of an agreement for the style.

    Examples
    --------
    >>> [tone(v) for v in ("agrees", "close", "undecided", "differs", "untestable", "met", "not met")]
    ['good', 'half', 'open', 'bad', 'none', 'met', 'unmet']
    """
    return AGREEMENTS[Agreement(verdict)][0] if verdict in set(Agreement) else "none"


def beyond_tone(verdict: str) -> str:
    """Return the class of an answer about the baseline for the style, empty where there is no baseline."""
    return BEYOND[Beyond(verdict)][0] if verdict in BEYOND else ""


def answers(claim: Mapping[str, Any]) -> tuple[str, str]:
    """Return both answers to a row of the claims."""
    return str(claim["agreement"]), str(claim.get("beyond_baseline") or Beyond.NOT_APPLICABLE)


def reason(claim: Mapping[str, Any]) -> str:
    """Return why a claim has its bounds and its answer, without the numbers that stand before it.

    Examples
    --------
    >>> reason({"why": "15, bounds exactly 15: a count: equal or not", "bounds": "exactly 15"})
    'a count: equal or not'
    """
    return str(claim.get("why") or "").rpartition(f"bounds {claim.get('bounds')}: ")[2]


def legend(results: Published) -> list[tuple[str, str, str]]:
    """Return sign, words and meaning of the agreements that the page has."""
    there = {answers(claim)[0] for claim in results.claims}
    return [(tone, str(one), words) for one, (tone, words) in AGREEMENTS.items() if one in there]
