"""Counts of the verdicts on claims, for README, report, article, documentation and terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.papers.claims import Agreement, Beyond, Kind

OF_PAPERS = (Kind.RESULT, Kind.SENTENCE)
"""Kinds of claims that count as statements of a paper; conditions and our own targets do not count."""

JUDGED = (Agreement.AGREES, Agreement.CLOSE, Agreement.UNDECIDED, Agreement.DIFFERS)
"""Verdicts that data decide; claims that are untestable, or computed in a small test run, have other verdicts."""


@dataclass(frozen=True)
class Tally:
    """Numbers of claims by agreement with the paper and by comparison with the baseline.

    Attributes
    ----------
    answers : mapping of (Agreement, Beyond) to int
        Number of claims with each pair of answers.

    Examples
    --------
    >>> tally = count([{"kind": "result", "agreement": "agrees", "beyond_baseline": "yes"}])
    >>> tally.number(Agreement.AGREES), tally.judged, tally.rows
    (1, 1, [('agrees', 1, [('yes', 1)])])
    """

    answers: Mapping[tuple[Agreement, Beyond], int]

    def number(self, *agreements: Agreement, beyond: Beyond | None = None) -> int:
        """Return the number of claims with one of the given agreements and, optionally, a given comparison with the
        baseline.
        """
        return sum(
            times
            for (agreement, answer), times in self.answers.items()
            if agreement in agreements and beyond in (None, answer)
        )

    @property
    def judged(self) -> int:
        """Number of claims that the data decide, whether or not they agree."""
        return self.number(*JUDGED)

    @property
    def rows(self) -> list[tuple[str, int, list[tuple[str, int]]]]:
        """Rows of a table: each agreement with its number of claims, and this number split by comparison with the
        baseline.

        Counts of zero are left out.
        """
        return [
            (
                str(agreement),
                number,
                [
                    (str(beyond), times)
                    for beyond in Beyond
                    if beyond is not Beyond.NOT_APPLICABLE
                    and (times := self.answers.get((agreement, beyond), 0))
                ],
            )
            for agreement in Agreement
            if (number := self.number(agreement))
        ]


def count(claims: Iterable[Mapping[str, Any]], kinds: Sequence[Kind] = tuple(Kind)) -> Tally:
    """Count the verdicts on claims of given kinds; claims with the same number (``same_as``) count once.

    Parameters
    ----------
    claims : iterable of mapping
        Rows of ``claims.csv``, or `Verdict.row`: ``kind``, ``agreement``, ``beyond_baseline``, ``same_as``.  A row with
        an agreement of an earlier version is left out.
    kinds : sequence of Kind
        By default all.
    """
    answers = Counter(
        (Agreement(str(row["agreement"])), Beyond(str(row.get("beyond_baseline") or Beyond.NOT_APPLICABLE)))
        for row in claims
        if (row.get("kind") or Kind.RESULT) in kinds
        and not row.get("same_as")
        and row["agreement"] in set(Agreement)
    )
    return Tally(answers)


def count_by_kind(claims: Iterable[Mapping[str, Any]]) -> dict[Kind, Tally]:
    """Count the verdicts separately for each kind of claim that occurs."""
    rows = list(claims)
    return {kind: tally for kind in Kind if (tally := count(rows, [kind])).answers}
