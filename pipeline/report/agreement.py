"""Sentences on the report page about claims that our results confirm, with numbers of the data set that decides."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from pipeline import papers
from pipeline.papers import Agreement, Claim
from pipeline.report.published import Published
from pipeline.report.verdicts import tone
from pipeline.studies.captions import BASELINE, PUBLISHED, filled_caption
from pipeline.studies.ledger import read_folder, value_of
from pipeline.studies.registry import all_measures
from pipeline.validation import InvalidInput

GENERATED = "synthetic"
"""Data set of synthetic people, whose statistics are not evidence about real people."""


@dataclass(frozen=True)
class Numbers:
    """Our values of claims and quantities on one data set.

    Attributes
    ----------
    data : str
    rows : mapping of str to mapping
        Rows of ``claims.csv`` by claim.
    quantity : callable
        Value of a quantity by its name; NaN if it is unknown.
    """

    data: str
    rows: Mapping[str, Mapping[str, Any]]
    quantity: Callable[[str], float]

    def __call__(self, name: str) -> float:
        """Return our value of a claim or quantity, or the value of a claim's baseline; NaN if there is no value."""
        column = "baseline_value" if name.startswith(BASELINE) else "value"
        claim = name.removeprefix(BASELINE)
        if claim not in self.rows:
            return self.quantity(name)
        value = self.rows[claim].get(column)
        return value if isinstance(value, int | float) else math.nan


def numbers_of(results: Published) -> Numbers:
    """Return our values of claims and quantities on the page's data set; quantities are computed from the tables."""

    def quantity(name: str) -> float:
        item = papers.quantity(name.removeprefix(BASELINE))
        if isinstance(item, Claim) or item.measure is None:
            return math.nan
        figures = {path.partition("/")[0] for path in item.measure.tables} & results.figures.keys()
        frames = read_folder(results.folder, sorted(figures))
        with suppress(InvalidInput):  # a table that an earlier version published without these columns
            return value_of(item, frames, all_measures())
        return math.nan

    return Numbers(results.data, {row["claim"]: row for row in results.claims}, quantity)


def numbers_of_others(
    others: Mapping[str, Sequence[Mapping[str, Any]]], listed: Sequence[Mapping[str, str]]
) -> list[Numbers]:
    """Return our values on all data sets except the page's own, one `Numbers` for each data set.

    Parameters
    ----------
    others : mapping of str to sequence of mapping
        Rows of ``claims.csv`` by data set.
    listed : sequence of mapping
        Rows of ``published.csv``, which has the quantities.
    """
    quantities: dict[str, dict[str, float]] = {data: {} for data in others}
    for row in listed:
        quantities.setdefault(row["data"], {})[row["name"]] = float(row["value"])

    def quantity_of(data: str) -> Callable[[str], float]:
        return lambda name: quantities[data].get(name, math.nan)

    return [
        Numbers(data, {row["claim"]: row for row in rows}, quantity_of(data)) for data, rows in others.items()
    ]


def sentences(paper: papers.Paper, own: Numbers, others: Sequence[Numbers]) -> list[dict[str, Any]]:
    """Return the sentences of a paper that our results confirm, each with the verdict on its claim.

    The verdict is from the first data set that decides the claim of the sentence.

    Recorded people come first, then the page's own data set.  A sentence without a decided claim has the page's own
    numbers; a sentence without all of its numbers is left out.
    """
    ordered = sorted([own, *others], key=lambda numbers: numbers.data == GENERATED)
    entries = []
    for name, template in paper.page.agrees.items():
        candidates = [
            numbers
            for numbers in [*(n for n in ordered if _agreement(n, name) in papers.JUDGED), own]
            if name in numbers.rows and all(map(_finite(numbers), papers.placeholders(template)))
        ]
        if candidates:
            verdict = _agreement(candidates[0], name)
            text = filled_caption(template, candidates[0])
            entries.append(
                {
                    "text": text,
                    "claim": name,
                    "data": candidates[0].data,
                    "agreement": verdict,
                    "tone": tone(verdict),
                }
            )
    return entries


def _agreement(numbers: Numbers, claim: str) -> str:
    return str(numbers.rows.get(claim, {}).get("agreement", Agreement.UNTESTABLE))


def _finite(numbers: Numbers) -> Callable[[str], bool]:
    return lambda name: name.startswith(PUBLISHED) or math.isfinite(numbers(name))
