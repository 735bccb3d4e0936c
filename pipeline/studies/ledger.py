"""The ledger of claims at work: published tables in, verdicts and ``claims.csv`` out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import papers
from pipeline.storage import tables

TIMING = "table_timing"
"""Seconds of the machine that made a figure: published, judged by nothing."""


def judge_figure(figure: str, made_tables: Mapping[str, Any], data_name: str) -> list[papers.Verdict]:
    """Verdicts on the claims that one figure backs alone."""
    by_name = {
        _name(figure, name): {column: np.asarray(values) for column, values in table.items()}
        for name, table in made_tables.items()
        if name != TIMING
    }
    alone = [
        claim for claim in _claims([figure]) if all(name.split("/")[0] == figure for name in claim.tables)
    ]
    return papers.judge(alone, by_name, data_name)


def judge_folder(folder: Path, data_name: str, figures: Sequence[str]) -> list[papers.Verdict]:
    """Verdicts on all claims of these figures, from the tables published below ``results/<data>/<scale>``.

    Raises
    ------
    InvalidInput
        If a table of a figure that is there is not what was published.
    """
    by_name = {
        _name(figure, table): columns
        for figure in figures
        if (folder / figure).is_dir()
        for table, columns in tables.read_published(folder / figure).items()
        if table != TIMING
    }
    return papers.judge(_claims(figures), by_name, data_name)


def _name(figure: str, table: str) -> str:
    return figure if table == "table" else f"{figure}/{table}"


def _claims(figures: Sequence[str]) -> list[papers.Claim]:
    chosen = set(figures)
    return [claim for paper in papers.PAPERS.values() for claim in paper.claims if claim.figure in chosen]


def write_claims(path: Path, verdicts: Sequence[papers.Verdict]) -> None:
    """The ledger as a table, one claim to a row: the paper's figure, ours, the verdict and why."""
    tables.write(
        path,
        {
            "claim": [v.claim.name for v in verdicts],
            "paper": [v.claim.paper for v in verdicts],
            "section": [v.claim.section for v in verdicts],
            "figure": [v.claim.figure for v in verdicts],
            "quote": [v.claim.quote for v in verdicts],
            "published": [np.nan if v.claim.published is None else v.claim.published for v in verdicts],
            "ours": [np.nan if v.ours is None else v.ours for v in verdicts],
            "unit": [v.claim.unit for v in verdicts],
            "verdict": [v.verdict for v in verdicts],
            "why": [v.why for v in verdicts],
        },
        sort_by=["claim"],
    )
