"""Tests that every claim of the papers has its table, and that every disagreement has an explanation.

Targets of our own are judged where their figures are made: `tests/stages`, `make sweeps`.
"""

from __future__ import annotations

import pytest

from pipeline import papers
from pipeline.studies.ledger import Tables, judge
from pipeline.studies.registry import all_measures

MEASURES = all_measures()

pytestmark = pytest.mark.thorough

FEW_ENOUGH = {
    "zhang2004_twenty_eight_components",
    "zhang2007_thirty_components",
    "park2011_low_reconstructibility_impostor",
}
"""Claims about events so rare that a small run may contain none of them."""


PAPERS = {key: paper for key, paper in papers.all_papers().items() if paper.figures}


def claims_of(paper: str) -> list[papers.Claim]:
    """Return the claims of a paper, without targets of our own work."""
    return [claim for claim in PAPERS[paper].claims if claim.kind is not papers.Kind.TARGET]


@pytest.mark.parametrize("paper", PAPERS)
def test_no_claim_about_the_papers_figures_lacks_its_table(paper: str, synthetic_tables: Tables) -> None:
    claims = [c for c in claims_of(paper) if not c.scope.untestable and c.name not in FEW_ENOUGH]
    verdicts = judge(claims, synthetic_tables, "synthetic", measures=MEASURES)
    assert [f"{v.claim.name}: {v.why}" for v in verdicts if v.value is None] == []


@pytest.mark.parametrize("paper", PAPERS)
def test_whatever_does_not_agree_is_explained(paper: str, synthetic_tables: Tables) -> None:
    verdicts = judge(claims_of(paper), synthetic_tables, "synthetic", measures=MEASURES)
    assert [v.claim.name for v in verdicts if "not explained" in v.why] == []
