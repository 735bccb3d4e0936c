"""Numbers of runs with one option changed: those that explanations quote, and the table of what each switch moves.

Both are kept in the repository, with the commit and the scale of the run that measured them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline import papers
from pipeline.papers.explanations import of_run
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Numbers:
    """Our values without a switch and with it.

    Attributes
    ----------
    switch : str
    overrides : tuple of str
        As on the command line.
    scale, commit : str
        Of the figures made with it.
    without, with_it : dict of str to float
        By the name of the claim or quantity.
    """

    switch: str
    overrides: tuple[str, ...]
    scale: str
    commit: str
    without: Mapping[str, float]
    with_it: Mapping[str, float]


def names_quoted(data_name: str, group: str, switch: str) -> list[str]:
    """Return the claims and quantities that explanations quote from a run, sorted."""
    names = set()
    for paper in papers.PAPERS.values():
        for claim in paper.claims:
            for explanation in claim.why.values():
                run = explanation.run
                if run and (run.data, run.group, run.switch) == (data_name, group, switch):
                    asked = filter(None, map(of_run, papers.placeholders(explanation.text)))
                    names |= {other or claim.name for _, other in asked}
    return sorted(names)


def figures_of(names: Iterable[str]) -> set[str]:
    """Return the figures whose tables these claims and quantities read."""
    return {table.split("/")[0] for name in names for table in _tables(papers.quantity(name))}


def _tables(item: papers.Claim | papers.Quantity) -> tuple[str, ...]:
    if isinstance(item, papers.Claim):
        return item.tables
    return item.measure.tables


def made_by(folder: Path) -> tuple[str, str, bool]:
    """Return scale and commit of the figures of a folder, several joined, and whether the checkout was a clean one."""
    manifests = [read_manifest(path.parent) for path in sorted(folder.glob("*/manifest.json"))]
    scales = sorted({str(m["scale"]) for m in manifests})
    commits = sorted({str(m["provenance"]["commit"])[:12] for m in manifests})
    return " ".join(scales), " ".join(commits), not any(m["provenance"]["dirty"] for m in manifests)


def require_clean(folder: Path) -> None:
    """Raise InvalidInput if figures of switches below a folder were made by a checkout with changes."""
    for below in sorted(path for path in folder.iterdir() if path.is_dir()):
        if not made_by(below)[2]:
            raise InvalidInput(
                "figures were made by a checkout with changes", where=below.name, expected="a clean one"
            )


def keep_numbers(path: Path, numbers: Sequence[Numbers], data_name: str, group: str) -> None:
    """Replace the numbers of these switches in the table that explanations quote."""
    columns = ["data", "group", "switch", "overrides", "scale", "commit", "name", "without", "with"]
    rows = [
        (
            *(data_name, group, run.switch, " ".join(run.overrides), run.scale, run.commit),
            *(name, value, run.with_it[name]),
        )
        for run in numbers
        for name, value in run.without.items()
    ]
    _replace(path, pd.DataFrame(rows, columns=columns), ["data", "group", "switch"], sort_by=["name"])


def keep_table(
    path: Path, rows: Sequence[Mapping[str, Any]], numbers: Sequence[Numbers], data_name: str, group: str
) -> None:
    """Replace the rows of these switches in the table of what switches move; what does not move is left out."""
    made = {run.switch: run for run in numbers}
    moved = [
        {
            "data": data_name,
            "group": group,
            "scale": made[row["switch"]].scale,
            "commit": made[row["switch"]].commit,
            **row,
        }
        for row in rows
        if row["verdict_moves"] or row["outside_the_interval"]
    ]
    _replace(path, pd.DataFrame(moved), ["data", "group", "switch"], sort_by=["claim"])


def _replace(path: Path, rows: pd.DataFrame, by: list[str], *, sort_by: list[str]) -> None:
    """Replace the rows of a table that share these entries with new ones."""
    if rows.empty:
        return
    new = set(rows[by].itertuples(index=False, name=None))
    old = pd.DataFrame(dict(tables.read(path))) if path.is_file() else rows[:0]
    kept = old[[entries not in new for entries in old[by].itertuples(index=False, name=None)]]
    tables.write(path, pd.concat([kept, rows]) if len(kept) else rows, sort_by=[*by, *sort_by])
