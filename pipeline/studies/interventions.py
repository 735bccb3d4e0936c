"""Numbers of runs with one option changed: those that explanations quote, and the table of what each switch moves.

Both are kept in the repository, with the scale of the run that measured them.
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
    scale : str
        Of the figures made with it.
    without, with_it : dict of str to Estimate
        By the name of the claim or quantity.
    common : tuple of str
        Overrides of the figures with the switch and without: a smaller grid, fewer trials.
    figures : tuple of str
    """

    switch: str
    overrides: tuple[str, ...]
    scale: str
    without: Mapping[str, papers.Estimate]
    with_it: Mapping[str, papers.Estimate]
    common: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()


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


def made_by(folder: Path) -> tuple[str, bool]:
    """Return the scale of the figures of a folder, several joined, and whether the checkout was a clean one."""
    manifests = [read_manifest(path.parent) for path in sorted(folder.glob("*/manifest.json"))]
    scales = sorted({str(m["scale"]) for m in manifests})
    return " ".join(scales), not any(m["provenance"]["dirty"] for m in manifests)


def require_clean(folder: Path) -> None:
    """Raise InvalidInput if figures of switches below a folder were made by a checkout with changes."""
    for below in sorted(path for path in folder.iterdir() if path.is_dir()):
        if not made_by(below)[1]:
            raise InvalidInput(
                "figures were made by a checkout with changes", where=below.name, expected="a clean one"
            )


def keep_numbers(path: Path, numbers: Sequence[Numbers], data_name: str, group: str) -> None:
    """Replace the numbers of these switches in the table that explanations quote."""
    sides = [f"{side}{end}" for side in ("without", "with") for end in ("", "_low", "_high")]
    columns = ["data", "group", "switch", "overrides", "scale", "name", *sides]
    rows = [
        (
            *(data_name, group, run.switch, " ".join(run.overrides), run.scale, name),
            *(part for side in (value, run.with_it[name]) for part in (side.value, side.low, side.high)),
        )
        for run in numbers
        for name, value in run.without.items()
    ]
    made = {(data_name, group, run.switch) for run in numbers}
    _replace(path, pd.DataFrame(rows, columns=columns), made, sort_by=["name"])


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
            **row,
            "common": " ".join(made[row["switch"]].common),
        }
        for row in rows
        if row["answer_moves"] or row["outside_the_interval"]
    ]
    switches = {(data_name, group, run.switch) for run in numbers}
    _replace(path, pd.DataFrame(moved), switches, sort_by=["claim"])


def keep_runs(
    path: Path, rows: Sequence[Mapping[str, Any]], numbers: Sequence[Numbers], data_name: str, group: str
) -> None:
    """Replace these switches in the table of what was run: options, figures, how many claims were judged and moved."""
    of_switch = {run.switch: [row for row in rows if row["switch"] == run.switch] for run in numbers}
    runs = [
        {
            "data": data_name,
            "group": group,
            "switch": run.switch,
            "overrides": " ".join(run.overrides),
            "common": " ".join(run.common),
            "figures": " ".join(run.figures),
            "scale": run.scale,
            "claims": len(of_switch[run.switch]),
            "outside_the_interval": sum(row["outside_the_interval"] for row in of_switch[run.switch]),
            "answers_moved": sum(row["answer_moves"] for row in of_switch[run.switch]),
        }
        for run in numbers
    ]
    switches = {(data_name, group, run.switch) for run in numbers}
    _replace(path, pd.DataFrame(runs), switches, sort_by=[])


def _replace(
    path: Path, rows: pd.DataFrame, switches: set[tuple[str, str, str]], *, sort_by: list[str]
) -> None:
    """Replace the rows of switches, each with its data set and group, in a table."""
    by = ["data", "group", "switch"]
    parts = [rows] if len(rows) else []
    if path.is_file():
        old = pd.DataFrame(dict(tables.read(path)))
        kept = old[[entries not in switches for entries in old[by].itertuples(index=False, name=None)]]
        # A column of texts that are all empty is read as numbers that are missing.
        texts = [name for name in rows.columns if len(rows) and not pd.api.types.is_numeric_dtype(rows[name])]
        kept = kept.reindex(columns=rows.columns) if len(rows) else kept
        parts = [kept.assign(**{name: kept[name].astype(object).fillna("") for name in texts}), *parts]
    if parts := [part for part in parts if len(part)]:
        tables.write(path, pd.concat(parts), sort_by=[*by, *sort_by], replace=True)  # read above
    else:
        path.unlink(missing_ok=True)
