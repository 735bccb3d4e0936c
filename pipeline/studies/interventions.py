"""Effects of changing one option: changed values of claims and changed verdicts.

Explanations quote some of these numbers, and a table lists the claims that each change affects.

Both are kept in the repository, with the scale of the run that measured them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline import papers
from pipeline.papers.explanations import of_run
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest, visible
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Switch:
    """Named change of options, called a switch, with the figures that are recomputed under this change.

    Attributes
    ----------
    name : str
    common, overrides, figures : tuple of str
        Overrides as on the command line: those of the figures without the switch, too (a smaller grid, fewer trials),
        and those of the switch.
    """

    name: str
    common: tuple[str, ...]
    overrides: tuple[str, ...]
    figures: tuple[str, ...]


@dataclass(frozen=True)
class Numbers(Switch):
    """Values of our claims and quantities, before and after a change of options.

    Attributes
    ----------
    scale : str
        Of the figures made with it.
    without, with_it : dict of str to Estimate
        By the name of the claim or quantity.
    """

    scale: str
    without: Mapping[str, papers.Estimate]
    with_it: Mapping[str, papers.Estimate]


def names_quoted(data_name: str, group: str, switch: str) -> list[str]:
    """Return the names of the claims and quantities whose changed values the explanations quote, sorted."""
    names = set()
    for paper in papers.all_papers().values():
        for claim in paper.claims:
            for _, explanation in claim.explanations:
                run = explanation.run
                if run and (run.data, run.group, run.switch) == (data_name, group, switch):
                    quoted = filter(None, map(of_run, papers.placeholders(explanation.text)))
                    names |= {other or claim.name for _, other in quoted}
    return sorted(names)


def figures_of(names: Iterable[str]) -> set[str]:
    """Return the names of the figures from whose tables the given claims and quantities are computed."""
    return {table.split("/")[0] for name in names for table in _tables(papers.quantity(name))}


def _tables(item: papers.Claim | papers.Quantity) -> tuple[str, ...]:
    if isinstance(item, papers.Claim):
        return item.tables
    return item.measure.tables


def made_by(folder: Path) -> tuple[str, bool]:
    """Return the scales of all figures in a folder, and True if all were made without uncommitted changes."""
    manifests = [
        read_manifest(path.parent, ("scale", "provenance")) for path in visible(folder, "*/manifest.json")
    ]
    scales = sorted({str(m["scale"]) for m in manifests})
    return " ".join(scales), not any(m["provenance"].get("dirty") for m in manifests)


def require_clean(folder: Path) -> None:
    """Raise InvalidInput if a figure in the folder was made from source code with uncommitted changes."""
    for below in (path for path in visible(folder, "*") if path.is_dir()):
        if not made_by(below)[1]:
            raise InvalidInput(
                "the figures were made from source code with uncommitted changes",
                below.name,
                "a checkout without changes",
                code="uncommitted_changes",
            )


def keep_numbers(path: Path, numbers: Sequence[Numbers], data_name: str, group: str) -> None:
    """Replace, in the table of quoted values, all rows of the option changes that were recomputed."""
    rows = [
        {
            "switch": run.name,
            "overrides": " ".join(run.overrides),
            "scale": run.scale,
            "name": name,
            **{
                f"{side}{end}": part
                for side, estimate in (("without", value), ("with", run.with_it[name]))
                for end, part in (("", estimate.value), ("_low", estimate.low), ("_high", estimate.high))
            },
        }
        for run in numbers
        for name, value in run.without.items()
    ]
    _replace(path, rows, numbers, data_name, group, sort_by=["name"])


def keep_table(
    path: Path, rows: Sequence[Mapping[str, Any]], numbers: Sequence[Numbers], data_name: str, group: str
) -> None:
    """Replace, in the table of affected claims, all rows of the option changes that were recomputed."""
    by_name = {run.name: run for run in numbers}
    moved = [
        {
            "scale": by_name[row["switch"]].scale,
            **row,
            "common": " ".join(by_name[row["switch"]].common),
        }
        for row in rows
        if row["answer_moves"] or row["outside_the_interval"]
    ]
    _replace(path, moved, numbers, data_name, group, sort_by=["claim"])


def keep_runs(
    path: Path, rows: Sequence[Mapping[str, Any]], numbers: Sequence[Numbers], data_name: str, group: str
) -> None:
    """Replace, in the table of runs, all rows of the option changes that were recomputed.

    A row has the options, the figures, the number of claims and the number of changed claims.
    """
    of_switch = {run.name: [row for row in rows if row["switch"] == run.name] for run in numbers}
    runs = [
        {
            "switch": run.name,
            "overrides": " ".join(run.overrides),
            "common": " ".join(run.common),
            "figures": " ".join(run.figures),
            "scale": run.scale,
            "claims": len(of_switch[run.name]),
            "outside_the_interval": sum(row["outside_the_interval"] for row in of_switch[run.name]),
            "answers_moved": sum(row["answer_moves"] for row in of_switch[run.name]),
        }
        for run in numbers
    ]
    _replace(path, runs, numbers, data_name, group, sort_by=[])


def _replace(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    numbers: Sequence[Numbers],
    data_name: str,
    group: str,
    *,
    sort_by: list[str],
) -> None:
    """Replace the rows of the recomputed option changes in a table; delete a table that becomes empty."""
    rows = [{"data": data_name, "group": group, **row} for row in rows]
    renewed, by = {(data_name, group, run.name) for run in numbers}, ["data", "group", "switch"]

    def stale(row: Mapping[str, str]) -> bool:
        return tuple(row[name] for name in by) in renewed

    stored = tables.read_rows(path) if path.is_file() else []
    if rows or not all(map(stale, stored)):
        columns = [*(rows or stored)[0]]
        tables.renew(path, rows, stale, columns=columns, sort_by=[*by, *sort_by])
    else:
        path.unlink(missing_ok=True)
