"""The ledger of claims: verdicts from published tables, and ``claims.csv``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline import papers
from pipeline.storage import tables
from pipeline.studies import measures
from pipeline.studies.registry import MEASURES

Tables = Mapping[str, Any]
"""Tables, or mappings of columns, by name: ``zhang2007_fig5`` is the figure's ``table.csv``, and
``zhang2007_fig5/table_walkers`` the ``table_walkers.csv`` beside it."""

TIMING = "table_timing"
"""Table of times on the machine that made a figure; no claim uses it."""


def judge(claims: Iterable[papers.Claim], made: Tables, data_name: str) -> list[papers.Verdict]:
    """Return one verdict per claim, in the order of the claims.

    Parameters
    ----------
    claims : iterable of Claim
    made : Tables
        Tables of the figures that are made.
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…: selects the explanation of a difference.

    Raises
    ------
    InvalidInput
        If a table lacks a column that a claim reads.
    """
    frames = {name: _frame(name, table) for name, table in made.items()}
    verdicts = []
    for claim in claims:
        if missing := [name for name in claim.tables if name not in frames]:
            why = f"figure {missing[0]} is not made yet"
            verdicts.append(papers.Verdict(claim, None, papers.UNTESTED, why))
        else:
            ours = _number(claim, frames)
            verdicts.append(
                papers.judge(claim, ours, data_name, lambda name: _number(papers.quantity(name), frames))
            )
    return verdicts


def numbers_of(names: Iterable[str], made: Tables) -> dict[str, float]:
    """Return our values of claims and quantities by name, NaN where the tables have none."""
    frames = {name: _frame(name, table) for name, table in made.items()}
    return {name: _number(papers.quantity(name), frames) for name in names}


def _number(item: papers.Claim | papers.Quantity, frames: Mapping[str, pd.DataFrame]) -> float:
    return measures.evaluate(item.measure, MEASURES, frames) if item.measure else np.nan


def judge_figure(figure: str, made: Mapping[str, Any], data_name: str) -> list[papers.Verdict]:
    """Return the verdicts on the claims that use one figure alone, from its tables by file name without suffix."""
    by_name = {_name(figure, name): table for name, table in made.items()}
    alone = [c for c in _claims([figure]) if all(name.split("/")[0] == figure for name in c.tables)]
    return judge(alone, by_name, data_name)


def judge_folder(folder: Path, data_name: str, figures: Sequence[str]) -> list[papers.Verdict]:
    """Return the verdicts on all claims of these figures, from the tables below ``results/<data>/<scale>``.

    Raises
    ------
    InvalidInput
        If a table differs from what was published.
    """
    return judge(_claims(figures), read_folder(folder, figures), data_name)


def read_folder(folder: Path, figures: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Return the published tables of these figures, by figure and name.

    Raises
    ------
    InvalidInput
        If a table differs from what was published.
    """
    return {
        _name(figure, name): _frame(_name(figure, name), columns)
        for figure in figures
        if (folder / figure).is_dir()
        for name, columns in tables.read_published(folder / figure).items()
    }


def _frame(name: str, table: Any) -> pd.DataFrame:
    frame = pd.DataFrame(table if isinstance(table, pd.DataFrame) else dict(table))
    frame.attrs["name"] = name
    return frame


def _name(figure: str, table: str) -> str:
    return figure if table == "table" else f"{figure}/{table}"


def _claims(figures: Sequence[str]) -> list[papers.Claim]:
    chosen = set(figures)
    return [claim for paper in papers.PAPERS.values() for claim in paper.claims if claim.figure in chosen]


def write_claims(path: Path, verdicts: Sequence[papers.Verdict]) -> None:
    """Write the verdicts as a table, one row per claim: the paper's number, ours, the verdict and why."""
    tables.write(
        path,
        {
            "claim": [v.claim.name for v in verdicts],
            "paper": [v.claim.paper for v in verdicts],
            "section": [v.claim.section for v in verdicts],
            "kind": [str(v.claim.kind) for v in verdicts],
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
