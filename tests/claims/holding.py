"""What a test named after a sentence asks the ledger."""

from __future__ import annotations

from pipeline import papers
from pipeline.studies.ledger import Tables, judge


def assert_holds(tables: Tables, *names: str, paper: str) -> None:
    """The named claims are reproduced, or at least their direction is."""
    for verdict in judge([papers.claim(f"{paper}_{name}") for name in names], tables, "synthetic"):
        assert verdict.verdict in ("reproduced", "direction only"), f"{verdict.claim.name}: {verdict.why}"
