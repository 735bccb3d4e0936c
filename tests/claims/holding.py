"""Assertion that our values agree with claims, for tests that are named after sentences of a paper."""

from __future__ import annotations

from pipeline import papers
from pipeline.studies.ledger import Tables, judge
from pipeline.studies.registry import all_measures

MEASURES = all_measures()


def assert_holds(tables: Tables, *names: str, paper: str) -> None:
    """Assert that our values of the named claims are within the claims' bounds, or at least within their wider bounds.

    Whether they agree with their interval, and are beyond a baseline, is a finding of the ledger, not a test.
    """
    for verdict in judge(
        [papers.claim(f"{paper}_{name}") for name in names], tables, "synthetic", measures=MEASURES
    ):
        claim, value = verdict.claim, verdict.value
        bounds = [b for b in (claim.bounds.agrees, claim.bounds.close) if b is not None]
        assert value is not None, f"{claim.name}: {verdict.why}"
        assert any(value in b for b in bounds), f"{claim.name}: {verdict.why}"
