"""Numbers of runs with one option changed: those that explanations quote, and the table of what each switch moves.

Both are kept in the repository, with the commit and the scale of the run that measured them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    without, with_it : dict of str to float
        By the name of the claim or quantity.
    """

    switch: str
    overrides: tuple[str, ...]
    without: Mapping[str, float]
    with_it: Mapping[str, float]


@dataclass(frozen=True)
class Made:
    """Scale and commit of a run."""

    scale: str
    commit: str


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


def made_by(folder: Path) -> Made:
    """Return scale and commit of the figures below a folder of switches.

    Raises
    ------
    InvalidInput
        If they are of several commits or scales, or of a changed checkout.
    """
    manifests = [read_manifest(path.parent) for path in sorted(folder.glob("*/*/manifest.json"))]
    found = {(m["scale"], str(m["provenance"]["commit"])[:12], m["provenance"]["dirty"]) for m in manifests}
    if len(found) != 1 or any(dirty for *_, dirty in found):
        raise InvalidInput(
            "the figures are not of one commit and scale, or of a checkout with changes",
            where=folder.name,
            received="; ".join(" ".join(map(str, item)) for item in sorted(found)),
        )
    ((scale, commit, _),) = found
    return Made(scale, commit)


def keep_numbers(path: Path, numbers: Sequence[Numbers], data_name: str, group: str, made: Made) -> None:
    """Replace the numbers of a group and data set in the table that explanations quote."""
    rows = [
        (data_name, group, run.switch, " ".join(run.overrides), made.scale, made.commit, name, value,
         run.with_it[name])
        for run in numbers
        for name, value in run.without.items()
    ]  # fmt: skip
    columns = ["data", "group", "switch", "overrides", "scale", "commit", "name", "without", "with"]
    _replace(path, pd.DataFrame(rows, columns=columns), data_name, group, ["data", "group", "switch", "name"])


def keep_table(path: Path, rows: Sequence[Mapping[str, Any]], data_name: str, group: str, made: Made) -> None:
    """Replace the rows of a group and data set in the table of what switches move; the rest is left out."""
    moved = [row for row in rows if row["verdict_moves"] or row["outside_the_interval"]]
    frame = pd.DataFrame(moved, columns=list(rows[0]))
    for place, (name, value) in enumerate(
        {"data": data_name, "group": group, "scale": made.scale, "commit": made.commit}.items()
    ):
        frame.insert(place, name, value)
    _replace(path, frame, data_name, group, ["data", "group", "switch", "claim"])


def _replace(path: Path, rows: pd.DataFrame, data_name: str, group: str, sort_by: list[str]) -> None:
    old = pd.DataFrame(dict(tables.read(path))) if path.is_file() else rows[:0]
    kept = old[(old["data"] != data_name) | (old["group"] != group)]
    together = pd.concat([kept, rows]) if len(kept) else rows
    if len(together):
        tables.write(path, together, sort_by=sort_by)
