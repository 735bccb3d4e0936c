"""Published numbers: ``results/published.csv``, and the tables of documentation and page, which are made from it.

The file has a row for each of our values of claims and quantities and for each count of verdicts, by data set, with the
commit.  `measured` returns the rows of a folder of published figures, `filled` and `rendered` the tables.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline import papers
from pipeline.papers import Agreement, Beyond, Kind, placeholders
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest
from pipeline.studies.evaluation import Registry
from pipeline.studies.ledger import judge, numbers_of, read_folder
from pipeline.validation import InvalidInput, require_choice

COLUMNS = ("data", "scale", "commit", "figure", "name", "value", "unit")


def names_quoted(layout: Mapping[str, Any]) -> list[str]:
    """Return the names of the claims and quantities that the tables quote, sorted."""
    templates = [
        template
        for table in layout.values()
        for template in (*table["columns"].values(), *(t for row in table["rows"] for t in _templates(row)))
    ]
    return sorted({name for template in templates for name in placeholders(template)})


def measured(
    folder: Path, figures: Sequence[str], layout: Mapping[str, Any], measures: Registry
) -> pd.DataFrame:
    """Return the rows of the file for the figures published below ``results/<data>/<scale>``.

    Raises
    ------
    InvalidInput
        If nothing is published there, figures are small, or were made by different commits or by a changed checkout.
    """
    needed = ("data", "scale", "provenance")
    manifests = [read_manifest(folder / figure, needed) for figure in figures if (folder / figure).is_dir()]
    made = {(m["data"], m["scale"], m["provenance"].get("commit", "unknown")) for m in manifests}
    if len(made) != 1:
        raise InvalidInput(
            "the figures are not of one commit, data set and scale" if made else "nothing is published",
            str(folder),
            received="; ".join(" ".join(map(str, item)) for item in sorted(made)),
            code="mixed_figures" if made else "nothing_published",
        )
    data_name, scale, commit = made.pop()
    require_choice("scale", scale, ["full"])
    if any(manifest["provenance"].get("dirty") for manifest in manifests):
        raise InvalidInput(
            "figures were made by a checkout with changes",
            str(folder),
            "a clean one (experiment=NAME,NAME,… makes figures again that are current)",
            code="uncommitted_changes",
        )
    by_name = read_folder(folder, figures)
    values = numbers_of(names_quoted(layout), by_name, measures)
    items = [papers.quantity(name) for name in values]
    rows = [
        (item.figure, item.name, values[item.name].value, item.unit)
        for item in items
        if math.isfinite(values[item.name].value)
    ]
    rows += verdict_counts(by_name, data_name, layout, measures)
    return pd.DataFrame([(data_name, scale, str(commit)[:12], *row) for row in rows], columns=list(COLUMNS))


def verdict_counts(
    by_name: Mapping[str, Any], data_name: str, layout: Mapping[str, Any], measures: Registry
) -> list[tuple[str, str, float, str]]:
    """Return figure, name, value and unit of the rows that count verdicts by kind, for papers with figures here."""
    counted = []
    for keys in _judged_together(layout):
        claims = [c for key in keys for c in papers.paper(key).claims if not c.scope.untestable]
        verdicts = judge(claims, by_name, data_name, measures=measures)
        if {verdict.agreement for verdict in verdicts} != {Agreement.UNTESTABLE}:
            # A number that is printed twice counts once.
            found = Counter((v.claim.kind, v.agreement, v.beyond) for v in verdicts if not v.claim.same_as)
            counted += [
                ("", _count_name(keys, kind, agreement, *beyond), float(times), "claims")
                for kind in Kind
                for agreement in kind.answers
                for beyond, times in _counts(found, kind, agreement).items()
            ]
    return counted


def _counts(
    found: Counter[tuple[Kind, Agreement, Beyond]], kind: Kind, agreement: Agreement
) -> dict[tuple[Beyond, ...], int]:
    """Return how many claims have an agreement, and how many of these have each answer about their baseline."""
    of_it: dict[tuple[Beyond, ...], int] = {(beyond,): found[kind, agreement, beyond] for beyond in Beyond}
    judged = agreement not in (Agreement.MET, Agreement.NOT_MET, Agreement.UNTESTABLE)
    return {(): sum(of_it.values())} | (of_it if judged else {})


def renew(path: Path, rows: pd.DataFrame) -> None:
    """Replace the rows of the same data sets in the file."""
    anew = set(rows["data"])
    cells = rows.to_dict("records")
    tables.renew(path, cells, lambda row: row["data"] in anew, columns=COLUMNS, sort_by=["data", "name"])


Cells = tuple[list[str], list[list[str]]]
"""The heads of a table's columns, and its rows."""


def filled(layout: Mapping[str, Any], published: Mapping[str, Any]) -> dict[str, Cells]:
    """Return each table with its numbers, from the columns of the file; rows of which nothing is known are left out."""
    values: dict[str, dict[str, float]] = {}
    if np.asarray(published["value"]).dtype.kind not in "if":
        raise InvalidInput("a value is no number", "results/published.csv", code="not_a_number")
    for data_name, name, value in zip(
        published["data"], published["name"], map(float, published["value"]), strict=True
    ):
        values.setdefault(str(data_name), {})[str(name)] = value
    return {name: _table(table, values) for name, table in layout.items()}


def _table(table: Mapping[str, Any], values: Mapping[str, Mapping[str, float]]) -> Cells:
    of = {data_name: values.get(data_name, {}) for data_name in table["columns"]}
    paper = "paper" in table
    heads = [_filled([title], of[data_name]) for data_name, title in table["columns"].items()]
    rows = []
    for row in table["rows"]:
        counts = _counted(row["verdicts"], Kind(row["kind"])) if "verdicts" in row else ()
        templates = [", ".join(counts)] if counts else _templates(row)
        cells = [re.sub(" +", " ", _filled(templates, of[data_name])) for data_name in table["columns"]]
        if any(cells):
            rows.append([row["label"], *([row.get("paper", "")] if paper else []), *cells])
    return [table["corner"], *([table["paper"]] if paper else []), *heads], rows


def rendered(layout: Mapping[str, Any], published: Mapping[str, Any]) -> dict[str, str]:
    """Return each table as Markdown, from the columns of the file."""
    made = filled(layout, published)
    return {name: _markdown(heads, rows) for name, (heads, rows) in made.items()}


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
    """Return the first template with all its numbers known, filled in; empty if there is none."""
    for template in templates if values else ():
        if set(placeholders(template)) <= set(values):
            return template.format_map({name: _Printed(value) for name, value in values.items()})
    return ""


class _Printed(float):
    """A number formatted with a minus sign, and spaces between thousands."""

    def __format__(self, specification: str) -> str:
        return super().__format__(specification).replace("-", "−").replace(",", " ")


def _judged_together(layout: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
    rows = (row for table in layout.values() for row in table["rows"])
    return dict.fromkeys(tuple(row["verdicts"]) for row in rows if "verdicts" in row)


def _counted(keys: Sequence[str], kind: Kind) -> list[str]:
    """Return the templates of the counts of a kind; of those that agree, how many are beyond their baseline as well."""
    templates = []
    for agreement in kind.answers:
        beyond = f" ({{{_count_name(keys, kind, agreement, Beyond.YES)}:.0f}})"
        templates.append(
            f"{{{_count_name(keys, kind, agreement)}:.0f}}" + beyond * (agreement is Agreement.AGREES)
        )
    return templates


def _count_name(keys: Iterable[str], kind: Kind, agreement: Agreement, *beyond: Beyond) -> str:
    answers = "".join(f", beyond the baseline {answer}" for answer in beyond)
    return f"{' and '.join(keys)}, {kind}s, {agreement}{answers}"


def insert(text: str, made: Mapping[str, str]) -> str:
    """Return a text with each table between its markers, ``<!-- results:begin walks -->`` and ``<!-- results:end -->``.

    Raises
    ------
    InvalidInput
        If the markers are not those of the tables.

    Examples
    --------
    >>> insert("<!-- results:begin a -->\\nold\\n<!-- results:end -->", {"a": "new"})
    '<!-- results:begin a -->\\nnew\\n<!-- results:end -->'
    """
    places = re.findall(r"<!-- results:begin (\w+) -->", text)
    if sorted(places) != sorted(made):
        raise InvalidInput(
            "the markers in the text are not those of the tables",
            expected=", ".join(sorted(made)),
            received=", ".join(sorted(places)),
            code="markers_differ",
        )
    return re.sub(
        r"(<!-- results:begin (\w+) -->\n).*?(<!-- results:end -->)",
        lambda match: f"{match[1]}{made[match[2]]}\n{match[3]}",
        text,
        flags=re.DOTALL,
    )
