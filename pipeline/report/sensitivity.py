"""Which ambiguity of the papers moves which conclusion: the page's section on ``results/sensitivity.csv``.

Each switch is an option that a paper leaves open, or a property of the data; with it the figures of its group were made
again.  The file has a row for each claim whose verdict is another then, or whose value leaves its interval.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline import papers
from pipeline.report.published import Published
from pipeline.storage import provenance, tables

TABLE = "sensitivity.csv"
"""File name of the table, in ``results`` and as it is downloaded from the page."""

Row = Mapping[str, Any]


def moved_by_switches(results: Published, listed: Path | None = None) -> dict[str, Any] | None:
    """Return what the page shows of the switches of this data set; None if none is known at this scale.

    Parameters
    ----------
    results : Published
    listed : Path, optional
        The table; that of the project by default.
    """
    path = provenance.PROJECT / "results" / TABLE if listed is None else listed
    rows = [
        row
        for row in (tables.read_rows(path) if path.is_file() else ())
        if row["data"] == results.data and row["scale"] == results.scale
    ]
    if not rows:
        return None
    known = papers.read_mapping(provenance.PROJECT / "conf" / "sensitivity.yaml")
    pairs = list(dict.fromkeys((row["group"], row["switch"]) for row in rows))
    switches = [_switch(group, name, rows, known) for group, name in pairs]
    header = [name for name in rows[0] if name not in ("data", "scale", "commit")]
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(
        [header, *([row[name] for name in header] for row in rows)]
    )
    return {
        "commits": sorted({row["commit"] for row in rows}),
        "switches": sorted(switches, key=lambda one: (-one["verdicts"], -one["values"], one["name"])),
        # Options of the figures with a switch and without, such as fewer views.
        "common": sorted({(row["group"], row["common"]) for row in rows if row.get("common")}),
        "claims": _moved_claims(rows),
        # Rows of before the two answers have the words of their time.
        "earlier": any(row["verdict"] not in set(papers.Agreement) for row in rows),
        "rows": len(rows),
        "columns": len(header),
        "text": text.getvalue(),
    }


def _switch(group: str, name: str, rows: Sequence[Row], known: Mapping[str, Any]) -> dict[str, Any]:
    """Return a switch with the options that it sets, and how many claims it moves."""
    own = [row for row in rows if (row["group"], row["switch"]) == (group, name)]
    options = known.get(group, {}).get("switches", {}).get(name, {}).get("overrides", [])
    return {
        "group": group,
        "name": name,
        "options": " ".join(options),
        "verdicts": sum(_true(row["verdict_moves"]) for row in own),
        "values": sum(_true(row["outside_the_interval"]) for row in own),
    }


def _moved_claims(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return each claim whose verdict some switch moves: as it is, and with each of these switches."""
    moved: dict[str, list[Row]] = {}
    for row in rows:
        if _true(row["verdict_moves"]):
            moved.setdefault(row["claim"], []).append(row)
    return [
        {
            **_words(name),
            "value": float(of[0]["value_as_it_is"]),
            "verdict": of[0]["verdict_as_it_is"],
            "with": [(row["switch"], float(row["value"]), row["verdict"]) for row in of],
        }
        for name, of in sorted(moved.items(), key=lambda item: (-len(item[1]), item[0]))
    ]


def _words(name: str) -> dict[str, str]:
    """Return the quote and the figure of a claim; of one that the papers' files no longer have, its name."""
    for paper in papers.PAPERS.values():
        for claim in paper.claims:
            if claim.name == name:
                return {"quote": claim.quote, "figure": claim.figure}
    return {"quote": name, "figure": ""}


def _true(text: str) -> bool:
    return text == "True"
