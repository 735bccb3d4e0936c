"""Data of the four papers: numbered equations, the functions that compute them, and the claims to reproduce."""

from pipeline.papers.claims import (
    LEAST_PEOPLE,
    Agreement,
    Baseline,
    Beyond,
    Bounds,
    Claim,
    ClaimText,
    Kind,
    Quantity,
    Scope,
)
from pipeline.papers.counts import JUDGED, OF_PAPERS, Tally, count, count_by_kind
from pipeline.papers.entries import read_mapping
from pipeline.papers.explanations import (
    Explanation,
    Support,
    placeholders,
    read_runs,
)
from pipeline.papers.intervals import Estimate, Interval
from pipeline.papers.loading import BASELINES, INTERVENTIONS, Equation, Paper, load
from pipeline.papers.measure import Measure
from pipeline.papers.register import (
    all_papers,
    claim,
    locate,
    paper,
    published,
    quantity,
)
from pipeline.papers.verdicts import Evidence, Verdict, gain, judge

__all__ = [
    "BASELINES",
    "INTERVENTIONS",
    "JUDGED",
    "LEAST_PEOPLE",
    "OF_PAPERS",
    "Agreement",
    "Baseline",
    "Beyond",
    "Bounds",
    "Claim",
    "ClaimText",
    "Equation",
    "Estimate",
    "Evidence",
    "Explanation",
    "Interval",
    "Kind",
    "Measure",
    "Paper",
    "Quantity",
    "Scope",
    "Support",
    "Tally",
    "Verdict",
    "all_papers",
    "claim",
    "count",
    "count_by_kind",
    "gain",
    "judge",
    "load",
    "locate",
    "paper",
    "placeholders",
    "published",
    "quantity",
    "read_mapping",
    "read_runs",
]
