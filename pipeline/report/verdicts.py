"""Verdicts on the page: their signs, how many of each kind there are, and what they mean."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from pipeline import papers
from pipeline.report.published import Published

TONES = {
    "good": "our number is within bounds of the paper's.",
    "empty": "it is, but it would be without the method too.",
    "half": "the paper's direction holds, not its size.",
    "bad": "it does not; the ledger says why.",
    "none": "our data cannot decide.",
    "met": "a condition of the paper's experiment, a count or a setting, is ours as well.",
    "unmet": "it is not: see the ledger.",
}
"""What a verdict means, by the sign that it has on the page."""


def tone(verdict: str) -> str:
    """Return the class of a verdict for the style: a key of `TONES`.

    Examples
    --------
    >>> [tone(v) for v in ("reproduced", "holds, also of the null", "direction only", "differs", "undecided")]
    ['good', 'empty', 'half', 'bad', 'none']
    >>> tone("met"), tone("not met")
    ('met', 'unmet')
    """
    words = verdict.lower()
    if "null" in words:
        return "empty"
    beginnings = {
        "reproduced": "good", "direction": "half", "differs": "bad", "met": "met", "not met": "unmet"
    }  # fmt: skip
    return next((kind for start, kind in beginnings.items() if words.startswith(start)), "none")


def counts_by_kind(claims: Iterable[Mapping[str, Any]]) -> list[tuple[str, list[tuple[str, int]]]]:
    """Return how many claims of each kind have each verdict.

    Examples
    --------
    >>> counts_by_kind([{"kind": "result", "verdict": "reproduced"}, {"kind": "result", "verdict": "differs"}])
    [('results', [('reproduced', 1), ('differs', 1)])]
    """
    kinds: dict[str, list[str]] = {}
    for claim in claims:
        kinds.setdefault(str(claim.get("kind") or "claim"), []).append(str(claim["verdict"]))
    order = [kind.value for kind in papers.Kind]
    return [
        (f"{kind}s", tally(kinds[kind]))
        for kind in sorted(kinds, key=lambda kind: order.index(kind) if kind in order else len(order))
    ]


def tally(verdicts: Iterable[str]) -> list[tuple[str, int]]:
    """Return verdicts with their numbers, in the order of the rule."""
    known = {outcome.value: place for place, outcome in enumerate(papers.Outcome)}
    return sorted(
        Counter(verdict.removesuffix(" on this data") for verdict in verdicts).items(),
        key=lambda item: (known.get(item[0], len(known)), item[0]),
    )


def legend(results: Published) -> list[tuple[str, str, str]]:
    """Return sign, verdicts and meaning of the verdicts that the page has."""
    there = [verdict for verdict, _ in tally(claim["verdict"] for claim in results.claims)]
    named = {kind: ", ".join(verdict for verdict in there if tone(verdict) == kind) for kind in TONES}
    return [(kind, named[kind], words) for kind, words in TONES.items() if named[kind]]
