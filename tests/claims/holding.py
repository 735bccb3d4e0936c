"""What a test named after a sentence asks the ledger."""

from __future__ import annotations

from pipeline import papers
from pipeline.studies.ledger import Tables, judge


def assert_holds(tables: Tables, *names: str, paper: str) -> None:
    """Our values of the named claims are within the bounds, or at least within those of the direction.

    Whether that counts as reproduced, beside the null and with its interval, is a finding of the ledger, not a test.
    """
    for verdict in judge([papers.claim(f"{paper}_{name}") for name in names], tables, "synthetic"):
        claim, value = verdict.claim, verdict.value
        bounds = [b for b in (claim.reproduced, claim.direction) if b is not None]
        assert value is not None, f"{claim.name}: {verdict.why}"
        assert any(value in b for b in bounds), f"{claim.name}: {verdict.why}"
