"""``sensitivity``: every switch of the papers' ambiguities, one at a time: which moves which verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from pipeline import papers
from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.cli.presets import CONF
from pipeline.cli.summary import open_console
from pipeline.papers import OVERRIDDEN, Kind, Verdict
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.studies.ledger import SMOKE, judge, read_folder
from pipeline.validation import InvalidInput, require_choice

PLAIN = "as it is"
"""Name of the figures without a switch."""

QUIET = ("figure.picture=false", "figure.recording=false")


@dataclass(frozen=True)
class Switch:
    """Figures made with some options changed.

    Attributes
    ----------
    name : str
        `PLAIN`, or of the switch.
    overrides, figures : tuple of str
        As on the command line.
    """

    name: str
    overrides: tuple[str, ...]
    figures: tuple[str, ...]


def switches(group: Mapping[str, Any], data_name: str) -> Iterator[Switch]:
    """Yield the plain figures of a group of `conf/sensitivity.yaml`, then each switch for this data set."""
    common, every = tuple(group["common"]), tuple(group["figures"])
    yield Switch(PLAIN, common, every)
    for name, switch in group["switches"].items():
        if data_name in switch.get("data", [data_name]):
            yield Switch(name, (*common, *switch["overrides"]), tuple(switch.get("figures", every)))


def compare(plain: Sequence[Verdict], switched: Sequence[Verdict], name: str) -> list[dict[str, Any]]:
    """Return a row for each claim that both judge: value and verdict as it is and with the switch."""
    before = {verdict.claim.name: verdict for verdict in plain}
    rows = []
    for verdict in switched:
        was = before.get(verdict.claim.name)
        if was is None or was.evidence is None or verdict.evidence is None:
            continue
        value, old = verdict.evidence.value, was.evidence.value
        rows.append(
            {
                "claim": verdict.claim.name,
                "switch": name,
                "value": value.value,
                "value_low": value.low,
                "value_high": value.high,
                "verdict": str(verdict.outcome),
                "value_as_it_is": old.value,
                "verdict_as_it_is": str(was.outcome),
                "outside_the_interval": bool(old.known and not old.low <= value.value <= old.high),
                "verdict_moves": verdict.outcome != was.outcome,
            }
        )
    return rows


def sensitivity(arguments: Sequence[str]) -> int:
    """Tabulate claim × switch → value and verdict, in ``results/sensitivity/<data>/<group>/table.csv``.

    Arguments are overrides as on the command line, and names of groups of ``conf/sensitivity.yaml``; by default all.
    """
    groups = papers.read_mapping(CONF / "sensitivity.yaml")
    options = [item for item in arguments if "=" in item]
    chosen = [item for item in arguments if "=" not in item] or list(groups)
    out = open_console()
    for name in chosen:
        group = groups[require_choice("the group of switches", name, groups)]
        rows = _measured(group, name, options)
        data_name = compose([f"experiment={group['figures'][0]}", *options]).data.name
        results = Path(compose([f"experiment={group['figures'][0]}", *options]).results)
        folder = results / "sensitivity" / data_name / name
        folder.mkdir(parents=True, exist_ok=True)
        columns = {column: np.array([row[column] for row in rows]) for column in rows[0]}
        tables.write(folder / "table.csv", columns, sort_by=["claim", "switch"])
        out.print(moved_table(rows))
        out.print(f"{len(rows)} values in {folder / 'table.csv'}")
    return 0


def _measured(group: Mapping[str, Any], name: str, options: Sequence[str]) -> list[dict[str, Any]]:
    """Make the figures of a group with each switch, and return the rows of its table."""
    rows: list[dict[str, Any]] = []
    plain_tables: dict[str, Any] = {}
    plain: list[Verdict] = []
    for switch in switches(group, compose([f"experiment={group['figures'][0]}", *options]).data.name):
        made: dict[str, Any] = {}
        for figure in switch.figures:
            experiment = compose([f"experiment={figure}", *options, *switch.overrides, *QUIET])
            below = Path(experiment.results) / "sensitivity" / experiment.data.name / name
            folder = below / switch.name.replace(" ", "_") / figure
            make_figure(experiment, folder, store=Store(Path(experiment.results)))
            made |= read_folder(folder.parent, [figure])
            smoke = experiment.scale.name == SMOKE
        claims = [
            claim
            for paper in papers.PAPERS.values()
            for claim in paper.claims
            if claim.kind is not Kind.CONDITION
            and {t.split("/")[0] for t in claim.tables} & set(switch.figures)
        ]
        verdicts = judge(claims, {**plain_tables, **made}, OVERRIDDEN, smoke=smoke)
        if switch.name == PLAIN:
            plain_tables, plain = made, verdicts
        rows += compare(plain, verdicts, switch.name)
    if not rows:
        raise InvalidInput("no claim rests on the figures of this group", where=name)
    return rows


def moved_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return the values with which a verdict moves, as a table to be read."""
    table = Table(title="Verdicts that a switch moves", title_justify="left", box=None, pad_edge=False)
    for heading in ("claim", "as it is", "", "switch", "with it", " "):
        table.add_column(heading)
    for row in rows:
        if row["verdict_moves"]:
            table.add_row(
                row["claim"],
                f"{row['value_as_it_is']:.4g}",
                Text(row["verdict_as_it_is"]),
                row["switch"],
                f"{row['value']:.4g}",
                Text(row["verdict"]),
            )
    return table
