"""Data of the picture that places the value of each claim relative to the bound of the claim.

The positions of the baseline and of the paper's value are included.

All claims share one abscissa without a unit.  The bound is at 0, and values that agree with the paper are positive.
For a one-sided bound, the position is the distance from the bound, divided by the larger of the baseline's and the
published number's distances.  For two bounds, it is 1 less the distance from their middle over half their distance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import papers
from pipeline.papers import Interval, Kind
from pipeline.report.published import Published, numbered_rows
from pipeline.report.verdicts import answers, beyond_tone, reason, tone
from pipeline.storage import tables
from pipeline.storage.provenance import PROJECT
from pipeline.storage.sealed_folders import visible

CLAIMS, SWITCHES = "claims.csv", "sensitivity.csv"


class Abscissa:
    """Axis of one claim, on which values that agree with the paper have positive positions.

    Parameters
    ----------
    bounds : Interval
        Values that agree with the paper.
    close : Interval, optional
        Wider bounds: values that are close to the paper's.
    others : sequence of float
        Values of the baseline and of the paper, which set the unit of the axis.

    Examples
    --------
    >>> gain = Abscissa(Interval(low=20.0), others=[30.0, 0.0])
    >>> gain.place(20.0), gain.place(30.0), gain.place(0.0)
    (0.0, 0.5, -1.0)
    >>> cover = Abscissa(Interval(93.0, 97.0))
    >>> cover.place(95.0), cover.interval(94.0, 98.0)
    (1.0, (-0.5, 1.0))
    """

    def __init__(
        self, bounds: Interval, close: Interval | None = None, *, others: Sequence[float] = ()
    ) -> None:
        self.low, self.high = bounds.low, bounds.high
        bound = self.low if np.isfinite(self.low) else self.high
        wider = (close.low, close.high) if close else ()
        distances = [abs(end - bound) for end in wider if np.isfinite(end)]
        lengths = (max((abs(value - bound) for value in others), default=0.0), *distances, abs(bound))
        self.unit = next((length for length in lengths if length > 0.0 and np.isfinite(length)), 1.0)

    def place(self, value: float) -> float:
        """Return the position of a value on the axis."""
        if np.isfinite(self.low) and np.isfinite(self.high):
            half = (self.high - self.low) / 2.0
            off = abs(value - (self.low + self.high) / 2.0)
            return 1.0 - off / (half or self.unit)
        return ((value - self.low) if np.isfinite(self.low) else (self.high - value)) / self.unit

    def interval(self, low: float, high: float) -> tuple[float, float]:
        """Return the smallest and the largest position of the values in an interval."""
        ends = sorted((self.place(low), self.place(high)))
        middle = (self.low + self.high) / 2.0
        return ends[0], 1.0 if np.isfinite(middle) and low <= middle <= high else ends[1]


def abscissae(rows: Sequence[Mapping[str, Any]]) -> dict[str, Abscissa]:
    """Return the axis of each claim that has bounds, by claim name.

    The bounds come from the claims of this version.  A row whose claim is absent here, or has other bounds here, gets
    no abscissa.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of ``claims.csv``.
    """
    claims = {claim.name: claim for paper in papers.all_papers().values() for claim in paper.claims}
    axes = {}
    for row in rows:
        claim = claims.get(row["claim"])
        if claim and claim.bounds.agrees and str(claim.bounds.agrees) == row.get("bounds"):
            others = (row.get("baseline_value"), row.get("published"))
            axes[claim.name] = Abscissa(
                claim.bounds.agrees,
                claim.bounds.close,
                others=[v for v in others if isinstance(v, int | float)],
            )
    return axes


def ledger_picture(results: Published, *, listed: Path | None = None) -> dict[str, Any]:
    """Return the data of the claims picture for the page's script, or an empty dict if there are no claims.

    Parameters
    ----------
    results : Published
    listed : Path, optional
        Table of switches; by default the project's ``sensitivity.csv``.
    """
    if not results.claims:
        return {}
    axes = abscissae(results.claims)
    order = {kind: number for number, kind in enumerate(Kind)}
    rows = sorted(results.claims, key=lambda row: order.get(row.get("kind") or Kind.RESULT, 0))
    figures = list(results.figures)
    rows.sort(key=lambda row: figures.index(row["figure"]))
    sets = {results.data: results.claims, **other_sets(results)}
    return {
        "papers": [
            [key, name_of(paper)]
            for key, paper in papers.all_papers().items()
            if results.claims_of(paper=key)
        ],
        "claims": [_words(row) for row in rows],
        "sets": {
            data: {row["claim"]: entry for row in claims if (entry := _claim_numbers(row, axes))}
            for data, claims in sets.items()
        },
        "switches": _switches(results, axes, PROJECT / "results" / SWITCHES if listed is None else listed),
    }


def name_of(paper: papers.Paper) -> str:
    """Return the first author's surname and the year of a paper, or ``ours`` and the key of our own work."""
    first = paper.authors.replace(" and ", ", ").split(",")[0]
    return f"{first.split()[-1]} {paper.year}" if paper.figures else f"ours: {paper.key}"


def _words(row: Mapping[str, Any]) -> dict[str, Any]:
    names = (
        "paper",
        "figure",
        "quote",
        "section",
        "unit",
        "bounds",
        "close_bounds",
        "baseline",
        "baseline_knows",
        "help",
        "same_as",
    )
    filled_cells = {name: row[name] for name in names if row.get(name)}
    return {
        "name": row["claim"],
        "short": row.get("short") or row["claim"],
        "kind": row.get("kind") or "",
        "published": row.get("published"),
        **filled_cells,
        "why": reason(row),
    }


def _claim_numbers(row: Mapping[str, Any], axes: Mapping[str, Abscissa]) -> dict[str, Any]:
    """Return our value of a claim, its position and its verdicts, from the claim's row in ``claims.csv``.

    The result is empty if the row has no value, and has no positions if the claim has no axis.
    """
    value, axis = row.get("value"), axes.get(row["claim"])
    if not isinstance(value, int | float):
        return {}
    agreement, beyond = answers(row)
    entry = _numbers(axis, value, row.get("value_low"), row.get("value_high"), agreement)
    if beyond_tone(beyond):
        entry |= {"beyond": beyond}
    if isinstance(simple := row.get("baseline_value"), int | float):
        entry |= {"simple": _short(simple)} | ({"ring": _at(axis.place(simple))} if axis else {})
    for name in ("gain", "one_sample"):
        cells = [row.get(f"{name}_{side}") for side in ("low", "high")]
        ends = [_short(cell) for cell in cells if isinstance(cell, int | float)]
        if len(ends) == len(cells):
            entry[name] = ends
    if row.get("paper_in_prediction"):
        entry["possible"] = row["paper_in_prediction"]
    return entry


def _numbers(axis: Abscissa | None, value: float, low: Any, high: Any, agreement: str) -> dict[str, Any]:
    """Return the picture data of one value: number, verdict, position on the axis, and interval if there is one."""
    entry = {"value": _short(value), "verdict": agreement, "tone": tone(agreement)}
    if axis:
        entry["at"] = _at(axis.place(value))
    if isinstance(low, int | float) and isinstance(high, int | float):
        entry["ends"] = [_short(low), _short(high)]
        if axis:
            entry["reach"] = list(map(_at, axis.interval(low, high)))
    return entry


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _at(position: float) -> float:
    """Return a horizontal position in per cent of the width. The bound is at 45, and large distances are compressed."""
    compressed = position / (1.0 + abs(position))
    return round(45.0 + (53.0 if compressed > 0 else 43.0) * compressed, 1)


def other_sets(results: Published) -> dict[str, Sequence[Mapping[str, Any]]]:
    """Return the claims of all data sets except the page's own, from neighbouring results or from light archives."""
    claims_of: dict[str, Sequence[Mapping[str, Any]]] = {}
    light = visible(PROJECT / "results" / "archive" / "light", f"*/{CLAIMS}")
    near = visible(results.folder.parent.parent, f"*/{results.scale}/{CLAIMS}")
    for path in [*near, *(light if results.scale == "full" else ())]:
        data = path.parent.parent.name if path in near else path.parent.name
        if data not in (results.data, *claims_of):
            claims_of[data] = numbered_rows(path)
    return claims_of


def _switches(results: Published, axes: Mapping[str, Abscissa], path: Path) -> list[dict[str, Any]]:
    """Return the switches of the sensitivity analysis and the claims that each changes, most changed verdicts first."""
    rows = tables.read_rows(path) if path.is_file() else []
    rows_of: dict[tuple[str, str], list[Mapping[str, str]]] = {}
    for row in rows:
        if (row["data"], row["scale"]) == (results.data, results.scale) and row["claim"] in axes:
            rows_of.setdefault((row["group"], row["switch"]), []).append(row)
    groups = papers.read_mapping(PROJECT / "conf" / "sensitivity.yaml") if rows_of else {}
    switches = [
        {
            "name": name,
            "options": " ".join(groups.get(group, {}).get("switches", {}).get(name, {}).get("overrides", [])),
            "verdicts": sum(row["answer_moves"] == "True" for row in switch_rows),
            "moved": {row["claim"]: _switched_numbers(row, axes[row["claim"]]) for row in switch_rows},
        }
        for (group, name), switch_rows in rows_of.items()
    ]
    return sorted(switches, key=lambda entry: (-entry["verdicts"], -len(entry["moved"]), entry["name"]))


def _switched_numbers(row: Mapping[str, str], axis: Abscissa) -> dict[str, Any]:
    low, high = (float(row[name]) if row[name] else None for name in ("value_low", "value_high"))
    entry = _numbers(axis, float(row["value"]), low, high, row["agreement"])
    return {**entry, "jumps": row["answer_moves"] == "True"}
