"""The four papers as data: where each numbered equation lives, and what became of each claim."""

from pipeline.papers.register import (
    OVERRIDDEN,
    PAPERS,
    Claim,
    Equation,
    Interval,
    Outcome,
    Paper,
    Tables,
    Tag,
    Verdict,
    claim,
    equation,
    find_tags,
    judge,
    paper,
)

__all__ = [
    "OVERRIDDEN",
    "PAPERS",
    "Claim",
    "Equation",
    "Interval",
    "Outcome",
    "Paper",
    "Tables",
    "Tag",
    "Verdict",
    "claim",
    "equation",
    "find_tags",
    "judge",
    "paper",
]
