"""Every claim of every paper has its table, and whatever is not reproduced is explained."""

from __future__ import annotations

import pytest

from pipeline import papers
from pipeline.studies.ledger import Tables, judge

FEW_ENOUGH = {
    "zhang2004_twenty_eight_components",
    "zhang2007_thirty_components",
    "park2011_low_reconstructibility_impostor",
}
"""Claims about components and trials so rare that a small run may have none."""


@pytest.mark.parametrize("paper", papers.PAPERS)
def test_no_claim_about_the_papers_figures_lacks_its_table(paper: str, synthetic_tables: Tables) -> None:
    claims = [c for c in papers.PAPERS[paper].claims if not c.untestable and c.name not in FEW_ENOUGH]
    verdicts = judge(claims, synthetic_tables, "synthetic")
    assert [f"{v.claim.name}: {v.why}" for v in verdicts if v.value is None] == []


@pytest.mark.parametrize("paper", papers.PAPERS)
def test_whatever_is_not_reproduced_is_explained(paper: str, synthetic_tables: Tables) -> None:
    verdicts = judge(papers.PAPERS[paper].claims, synthetic_tables, "synthetic")
    assert [v.claim.name for v in verdicts if "not explained" in v.why] == []
