"""Published numbers in ``results/published.csv``, and tables of them for the documentation and the report page.

The file has a row for each of our values of claims and quantities and for each count of verdicts, by data set, with the
commit.  `measured` returns the rows of a folder of published figures, `filled` and `rendered` the tables.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline import papers
from pipeline.papers import Agreement, Beyond, Kind, placeholders
from pipeline.reading import as_written
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest
from pipeline.studies.evaluation import Registry
from pipeline.studies.ledger import judge_folder, numbers_of, read_folder
from pipeline.validation import InvalidInput, require_choice

COUNTED = ((Kind.RESULT,), (Kind.SENTENCE,), papers.OF_PAPERS, (Kind.CONDITION,))
"""Groups of kinds of claims whose verdicts are counted together; our own targets are not counted."""

JUDGED = "judged"
"""Name of the table row that counts those claims of a paper that the data can decide."""

SEPARATOR = ", "
"""Separator within the names of rows in ``published.csv``, for instance between a claim and an option change."""

COLUMNS = ("data", "scale", "commit", "figure", "name", "value", "unit")


def names_quoted(layout: Mapping[str, Any]) -> list[str]:
    """Return the names of the claims and quantities whose values a layout of tables shows, sorted."""
    templates = [
        template
        for table in layout.values()
        for template in (*table["columns"].values(), *(t for row in table["rows"] for t in _templates(row)))
    ]
    names = {name for template in templates for name in placeholders(template)}
    return sorted(name for name in names if SEPARATOR not in name)


def measured(
    folder: Path, figures: Sequence[str], layout: Mapping[str, Any], measures: Registry
) -> pd.DataFrame:
    """Return the rows of ``published.csv`` for the figures in a folder ``results/<data>/<scale>``.

    Raises
    ------
    InvalidInput
        If nothing is published there, or figures are of the small scale, of several commits or of a changed checkout.
    """
    needed = ("data", "scale", "provenance")
    manifests = [read_manifest(folder / figure, needed) for figure in figures if (folder / figure).is_dir()]
    origins = {(m["data"], m["scale"], m["provenance"].get("commit", "unknown")) for m in manifests}
    if len(origins) != 1:
        raise InvalidInput(
            "the figures come from several commits, data sets or scales"
            if origins
            else "no figure is published in this folder",
            str(folder),
            received="; ".join(" ".join(map(str, item)) for item in sorted(origins)),
            code="mixed_figures" if origins else "nothing_published",
        )
    data_name, scale, commit = origins.pop()
    require_choice("scale", scale, ["full"])
    if any(manifest["provenance"].get("dirty") for manifest in manifests):
        raise InvalidInput(
            "some figures were made from source code with uncommitted changes",
            str(folder),
            "a clean checkout (experiment=NAME,NAME,… recomputes current figures)",
            code="uncommitted_changes",
        )
    by_name = read_folder(folder, figures)
    with as_written(folder):
        values = numbers_of(names_quoted(layout), by_name, measures)
    items = [papers.quantity(name) for name in values]
    rows = [
        (item.figure, item.name, values[item.name].value, item.unit)
        for item in items
        if math.isfinite(values[item.name].value)
    ]
    rows += sensitivities(data_name)
    verdicts = judge_folder(folder, data_name, figures, measures=measures)
    rows += verdict_counts(verdicts, layout)
    return pd.DataFrame([(data_name, scale, str(commit)[:12], *row) for row in rows], columns=list(COLUMNS))


def sensitivities(data_name: str) -> list[tuple[str, str, float, str]]:
    """Return our values of claims when one option is changed, as tuples of figure, name, value and unit."""
    return [
        (claim.figure, f"{claim.name}{SEPARATOR}{run.switch}", run.with_it[claim.name].value, claim.unit)
        for paper in papers.all_papers().values()
        for claim in paper.claims
        for explanation in claim.sensitivity.get(data_name, ())
        if (run := explanation.run) and claim.name in run.with_it
    ]


def verdict_counts(
    verdicts: Sequence[papers.Verdict], layout: Mapping[str, Any]
) -> list[tuple[str, str, float, str]]:
    """Return the numbers of verdicts of each kind, as tuples of figure, name, value and unit.

    Papers without testable claims have no row.
    """
    counted = []
    for keys in _judged_together(layout):
        rows = [verdict.row for verdict in verdicts if verdict.claim.paper in keys]
        if papers.count(rows).answers.keys() <= {(Agreement.UNTESTABLE, Beyond.NOT_APPLICABLE)}:
            continue
        for kinds in COUNTED:
            tally = papers.count(rows, kinds)
            numbers = {JUDGED: tally.judged} if kinds == papers.OF_PAPERS else {}
            for agreement in kinds[0].answers:
                numbers[str(agreement)] = tally.number(agreement)
                if agreement in papers.JUDGED:
                    numbers |= {
                        _answers(agreement, beyond): tally.number(agreement, beyond=beyond)
                        for beyond in Beyond
                    }
            counted += [
                ("", _count_name(keys, kinds, name), float(number), "claims")
                for name, number in numbers.items()
            ]
    return counted


def renew(path: Path, rows: pd.DataFrame) -> None:
    """Replace, in ``published.csv``, all rows of the data sets that the new rows are from."""
    data_sets = set(rows["data"])
    cells = rows.to_dict("records")
    tables.renew(
        path, cells, lambda row: row.get("data") in data_sets, columns=COLUMNS, sort_by=["data", "name"]
    )


Cells = tuple[list[str], list[list[str]]]
"""Column headings and body rows of a table, as text."""


def filled(layout: Mapping[str, Any], published: Mapping[str, Any]) -> dict[str, Cells]:
    """Return each table of a layout with the published numbers filled in; rows without numbers are omitted."""
    values: dict[str, dict[str, float]] = {}
    if lacking := [name for name in ("data", "name", "value") if name not in published]:
        raise InvalidInput(
            f"the table has no column {lacking[0]!r}",
            "results/published.csv",
            code="no_column",
            column=lacking[0],
        )
    if np.asarray(published["value"]).dtype.kind not in "if":
        raise InvalidInput("a value is not a number", "results/published.csv", code="not_a_number")
    for data_name, name, value in zip(
        published["data"], published["name"], map(float, published["value"]), strict=True
    ):
        values.setdefault(str(data_name), {})[str(name)] = value
    return {name: _table(table, values) for name, table in layout.items()}


def _table(table: Mapping[str, Any], values: Mapping[str, Mapping[str, float]]) -> Cells:
    by_data_name = {data_name: values.get(data_name, {}) for data_name in table["columns"]}
    paper = "paper" in table
    heads = [_filled([title], by_data_name[data_name]) for data_name, title in table["columns"].items()]
    rows = []
    for row in table["rows"]:
        if "verdicts" in row:
            kinds = (Kind(row["kind"]),) if "kind" in row else papers.OF_PAPERS
            templates = [_counts(row["verdicts"], kinds)]
        else:
            templates = _templates(row)
        cells = [
            re.sub(" +", " ", _filled(templates, by_data_name[data_name])) for data_name in table["columns"]
        ]
        cells = ["none can be judged" if cell.startswith("0 of 0 ") else cell for cell in cells]
        if any(cells):
            rows.append([row["label"], *([row.get("paper", "")] if paper else []), *cells])
    return [table["corner"], *([table["paper"]] if paper else []), *heads], rows


def rendered(layout: Mapping[str, Any], published: Mapping[str, Any]) -> dict[str, str]:
    """Return each table of a layout in Markdown, with the published numbers filled in.

    A layout without rows is only a sentence, its last column heading.
    """
    cells = filled(layout, published)
    return {
        name: _markdown(heads, rows) if layout[name]["rows"] else heads[-1]
        for name, (heads, rows) in cells.items()
    }


def _markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    if not rows:
        return "Not published yet: `make claims` prints them after `make sweeps`."
    lines = [f"| {' | '.join(cells)} |" for cells in (heads, *rows)]
    ruled = [lines[0], f"|{'---|' * len(heads)}", *lines[1:]]
    return "\n".join(re.sub(" +", " ", line) for line in ruled)


def _templates(row: Mapping[str, Any]) -> list[str]:
    cell = row.get("cell", [])
    return [cell] if isinstance(cell, str) else list(cell)


def _filled(templates: Sequence[str], values: Mapping[str, float]) -> str:
    """Return the first of several text templates whose numbers are all known, filled in; empty without one."""
    for template in templates if values else ():
        if set(placeholders(template)) <= set(values):
            return template.format_map({name: _Printed(value) for name, value in values.items()})
    return ""


class _Printed(float):
    """Number that is printed with a minus sign instead of a hyphen, and with spaces between thousands."""

    def __format__(self, specification: str) -> str:
        return super().__format__(specification).replace("-", "−").replace(",", " ")


def _judged_together(layout: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
    rows = (row for table in layout.values() for row in table["rows"])
    return dict.fromkeys(tuple(row["verdicts"]) for row in rows if "verdicts" in row)


def _counts(keys: Sequence[str], kinds: Sequence[Kind]) -> str:
    """Return a text template for the numbers of verdicts that agree with the paper.

    The number of claims that agree is followed by the number of those that also exceed their baseline.

    Several kinds together give the agreeing claims of the judged ones; a single kind gives a count for each agreement.
    """

    def number(name: str) -> str:
        return f"{{{_count_name(keys, kinds, name)}:.0f}}"

    agrees = number(Agreement.AGREES)
    beyond = f" ({number(_answers(Agreement.AGREES, Beyond.YES))})"
    if len(kinds) > 1:
        return f"{agrees} of {number(JUDGED)}{beyond}"
    return ", ".join(number(a) + beyond * (a is Agreement.AGREES) for a in kinds[0].answers)


def _answers(agreement: Agreement, beyond: Beyond) -> str:
    return f"{agreement}, beyond the baseline {beyond}"


def _count_name(keys: Iterable[str], kinds: Iterable[Kind], name: str) -> str:
    return SEPARATOR.join([" and ".join(keys), " and ".join(f"{kind}s" for kind in kinds), name])


def insert(text: str, rendered_tables: Mapping[str, str]) -> str:
    """Return a text in which new tables replace the tables between pairs of markers.

    The markers ``<!-- results:begin walks -->`` and ``<!-- results:end -->`` enclose a table.

    Raises
    ------
    InvalidInput
        If the markers do not match the tables.

    Examples
    --------
    >>> insert("<!-- results:begin a -->\\nold\\n<!-- results:end -->", {"a": "new"})
    '<!-- results:begin a -->\\nnew\\n<!-- results:end -->'
    """
    names = re.findall(r"<!-- results:begin (\w+) -->", text)
    if sorted(names) != sorted(rendered_tables):
        raise InvalidInput(
            "the names between the table markers in the text are not the names of the tables",
            expected=", ".join(sorted(rendered_tables)),
            received=", ".join(sorted(names)),
            code="markers_differ",
        )
    return re.sub(
        r"(<!-- results:begin (\w+) -->\n).*?(<!-- results:end -->)",
        lambda match: f"{match[1]}{rendered_tables[match[2]]}\n{match[3]}",
        text,
        flags=re.DOTALL,
    )
