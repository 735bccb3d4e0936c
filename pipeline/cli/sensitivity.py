"""Command `sensitivity`: effect of each switch, which resolves an ambiguity of the papers, on the verdicts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from pipeline import papers, plugins
from pipeline.cli.compose import compose
from pipeline.cli.figures import make_figure
from pipeline.cli.status import CURRENT, status
from pipeline.cli.summary import open_console
from pipeline.papers import Kind, Verdict
from pipeline.storage import tables
from pipeline.storage.provenance import PROJECT
from pipeline.storage.sealed_folders import FIGURE, read_manifest
from pipeline.storage.store import Store
from pipeline.studies import interventions
from pipeline.studies.interventions import Switch
from pipeline.studies.ledger import SMOKE, judge, numbers_of, read_folder
from pipeline.studies.registry import all_measures
from pipeline.validation import InvalidInput, require_choice

PLAIN = "as it is"
"""Name of the baseline run, in which no switch is set."""

KEEP, QUOTED = "keep", "quoted"
"""Arguments: `keep` writes results into the repository; `quoted` selects the switches that the page quotes."""

QUIET = ("figure.picture=false", "figure.recording=false")


def groups() -> dict[str, tuple[Path, Mapping[str, Any]]]:
    """Return the groups of switches by name, each with the folder of options that defines it."""
    files = {folder: folder / "sensitivity.yaml" for folder in plugins.conf_folders()}
    return {
        name: (folder, group)
        for folder, path in files.items()
        if path.is_file()
        for name, group in papers.read_mapping(path).items()
    }


def switches(group: Mapping[str, Any], data_name: str) -> Iterator[Switch]:
    """Yield the baseline of a group of switches, then each switch of the group that applies to a data set."""
    common, every = tuple(group["common"]), tuple(group["figures"])
    yield Switch(PLAIN, common, (), every)
    for name, switch in group["switches"].items():
        if data_name in switch.get("data", [data_name]):
            yield Switch(name, common, tuple(switch["overrides"]), tuple(switch.get("figures", every)))


def compare(plain: Sequence[Verdict], switched: Sequence[Verdict], name: str) -> list[dict[str, Any]]:
    """Return values and verdicts without and with a switch, in one row for each claim that has a value in both runs."""
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
                "agreement": str(verdict.agreement),
                "beyond_baseline": str(verdict.beyond),
                "value_as_it_is": old.value,
                "agreement_as_it_is": str(was.agreement),
                "beyond_baseline_as_it_is": str(was.beyond),
                "outside_the_interval": bool(old.known and not old.low <= value.value <= old.high),
                "answer_moves": (verdict.agreement, verdict.beyond) != (was.agreement, was.beyond),
            }
        )
    return rows


def sensitivity(arguments: Sequence[str]) -> int:
    """Tabulate value and verdict of each claim with each switch: sensitivity [GROUP] [SWITCH ...] [OVERRIDE ...].

    Results go to ``results/sensitivity/<data>/<group>/table.csv``.  Groups are those of ``conf/sensitivity.yaml``, by
    default all.  Names of switches (``start_free``) run only these and their baseline figures.  ``quoted`` runs only
    the switches that explanations quote.  ``keep`` also updates the files of the repository: the numbers in
    explanations and, for whole groups, the moved verdicts (``results/sensitivity.csv``) and the runs
    (``results/sensitivity_runs.csv``).  Current figures are not made again: an interrupted run can be continued.
    """
    groups_by_name = groups()
    options = [item for item in arguments if "=" in item]
    words = [item for item in arguments if "=" not in item and item not in (KEEP, QUOTED)]
    having = {
        name: set(words) & {_word(switch) for switch in group["switches"]}
        for name, (_, group) in groups_by_name.items()
    }
    named = set().union(*having.values())
    chosen = [word for word in words if word not in named] or [
        name for name in groups_by_name if having[name] or not named
    ]
    out = open_console()
    for name in chosen:
        conf, group = groups_by_name[require_choice("the group of switches", name, groups_by_name)]
        first = compose([f"experiment={group['figures'][0]}", *options])
        folder = Path(first.results) / "sensitivity" / first.data.name / name
        every = list(switches(group, first.data.name))
        if named:
            every = list(_selected(every, named))
        if QUOTED in arguments:
            every = list(_quoted(every, first.data.name, name))
        rows, numbers = _measured(every, name, options, folder)
        columns = {column: [row[column] for row in rows] for column in rows[0]}
        tables.write(folder / "table.csv", columns, sort_by=["claim", "switch"])
        out.print(moved_table(rows))
        out.print(f"{len(rows)} values in {folder / 'table.csv'}")
        if KEEP in arguments:
            interventions.require_clean(folder)
            if named:  # the baseline figures were made in part: the rows of the whole group stay
                rows = [row for row in rows if row["switch"] != PLAIN]
                numbers = [run for run in numbers if run.name != PLAIN]
            quoted = conf / "paper" / papers.INTERVENTIONS
            interventions.keep_numbers(quoted, numbers, first.data.name, name)
            if QUOTED not in arguments:
                table, runs = (PROJECT / "results" / f"sensitivity{end}.csv" for end in ("", "_runs"))
                interventions.keep_table(table, rows, numbers, first.data.name, name)
                interventions.keep_runs(runs, rows, numbers, first.data.name, name)
    return 0


def _measured(
    every: Sequence[Switch], name: str, options: Sequence[str], below: Path
) -> tuple[list[dict[str, Any]], list[interventions.Numbers]]:
    """Make the figures of a group with each switch; return the table's rows and the numbers that the page quotes."""
    rows: list[dict[str, Any]] = []
    numbers: list[interventions.Numbers] = []
    plain_tables: dict[str, Any] = {}
    plain: list[Verdict] = []
    data_name = below.parent.name
    for switch in every:
        names = interventions.names_quoted(data_name, name, switch.name)
        folder = below / _word(switch.name)
        for figure_name in switch.figures:
            overrides = [f"experiment={figure_name}", *options, *switch.common, *switch.overrides, *QUIET]
            experiment, figure = compose(overrides), folder / figure_name
            if status(experiment, figure).state == CURRENT:
                continue
            try:
                make_figure(experiment, figure, store=Store(Path(experiment.results)))
            except InvalidInput as error:
                raise InvalidInput(
                    str(error), f"{switch.name}, {figure_name}", code=error.code, **error.values
                ) from None
        smoke = any(read_manifest(folder / figure, FIGURE)["scale"] == SMOKE for figure in switch.figures)
        all_tables = {**plain_tables, **read_folder(folder, switch.figures)}
        claims = [
            claim
            for paper in papers.all_papers().values()
            for claim in paper.claims
            if claim.kind is not Kind.CONDITION
            and {t.split("/")[0] for t in claim.tables} & set(switch.figures)
        ]
        measures = all_measures()
        verdicts = judge(claims, all_tables, data_name, measures=measures, smoke=smoke, overridden=True)
        if switch.name == PLAIN:
            plain_tables, plain = all_tables, verdicts
        rows += compare(plain, verdicts, switch.name)
        scale, _ = interventions.made_by(folder)
        without, with_it = (
            numbers_of(names, figure_tables, measures) for figure_tables in (plain_tables, all_tables)
        )
        numbers.append(interventions.Numbers(**vars(switch), scale=scale, without=without, with_it=with_it))
    if not rows:
        raise InvalidInput(
            "no claim of a paper uses the figures of this group of switches", name, code="no_claim"
        )
    return rows, numbers


def _word(name: str) -> str:
    """Return the name of a switch with underscores for spaces, for use in arguments and folder names."""
    return name.replace(" ", "_")


def _selected(every: Sequence[Switch], named: Collection[str]) -> Iterator[Switch]:
    """Yield the baseline, restricted to the figures that the named switches change, and then these switches."""
    plain, *others = every
    selected = [switch for switch in others if _word(switch.name) in named]
    changed = {figure for switch in selected for figure in switch.figures}
    yield replace(plain, figures=tuple(figure for figure in plain.figures if figure in changed))
    yield from selected


def _quoted(every: Sequence[Switch], data_name: str, group: str) -> Iterator[Switch]:
    """Yield the baseline and the switches that the page's explanations quote, restricted to the quoted figures."""
    figures = {
        switch.name: interventions.figures_of(interventions.names_quoted(data_name, group, switch.name))
        for switch in every
    }
    figures[PLAIN] = set().union(*figures.values())
    for switch in every:
        if selected := tuple(figure for figure in switch.figures if figure in figures[switch.name]):
            yield replace(switch, figures=selected)


def moved_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Return a printable table of the claims whose verdict changes with a switch."""
    table = Table(
        title="Claims whose verdict changes with a switch", title_justify="left", box=None, pad_edge=False
    )
    for heading in ("claim", "as it is", "", "switch", "with it", " "):
        table.add_column(heading)
    for row in rows:
        if row["answer_moves"]:
            table.add_row(
                row["claim"],
                f"{row['value_as_it_is']:.4g}",
                Text(_answers(row, "_as_it_is")),
                row["switch"],
                f"{row['value']:.4g}",
                Text(_answers(row)),
            )
    return table


def _answers(row: Mapping[str, Any], when: str = "") -> str:
    beyond = row[f"beyond_baseline{when}"]
    return str(row[f"agreement{when}"]) + (f", beyond its baseline: {beyond}" if beyond else "")
