"""The four papers as data: which functions compute each numbered equation, and how each claim is judged."""

from pipeline.papers.claims import LEAST_PEOPLE, Claim, Kind, Measure, Outcome, Quantity
from pipeline.papers.entries import read_mapping
from pipeline.papers.explanations import (
    ANY_DATA,
    Explanation,
    Run,
    Support,
    placeholders,
    read_runs,
)
from pipeline.papers.intervals import Estimate, Interval
from pipeline.papers.loading import INTERVENTIONS, Equation, Paper, load
from pipeline.papers.register import (
    PAPERS,
    Tag,
    claim,
    equation,
    find_tags,
    locate,
    paper,
    quantity,
)
from pipeline.papers.verdicts import Evidence, Verdict, count, judge

__all__ = [
    "ANY_DATA",
    "INTERVENTIONS",
    "LEAST_PEOPLE",
    "PAPERS",
    "Claim",
    "Equation",
    "Estimate",
    "Evidence",
    "Explanation",
    "Interval",
    "Kind",
    "Measure",
    "Outcome",
    "Paper",
    "Quantity",
    "Run",
    "Support",
    "Tag",
    "Verdict",
    "claim",
    "count",
    "equation",
    "find_tags",
    "judge",
    "load",
    "locate",
    "paper",
    "placeholders",
    "quantity",
    "read_mapping",
    "read_runs",
]
