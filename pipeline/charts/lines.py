"""Lines of a chart, with their values from the tables of its figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline import tidy
from pipeline.charts.values import Chart, Lines
from pipeline.palette import CYCLE, Style, style_keys, style_of
from pipeline.validation import InvalidInput

Ends = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Line:
    """Line of a chart, with its values.

    Attributes
    ----------
    key : str
        Name of the series.
    style : Style
        Style, always with a colour.
    x, y : (N,) float
    band, interval : ((N,), (N,)) float, optional
        Lower and upper ends; NaN where unknown.
    strands : (N,), optional
        Line to which each point belongs.
    """

    key: str
    style: Style
    x: np.ndarray
    y: np.ndarray
    band: Ends | None = None
    interval: Ends | None = None
    strands: np.ndarray | None = None


def lines_of(chart: Chart, tables: Mapping[str, Any]) -> list[Line]:
    """Return the lines of a chart from the tables of its figure.

    Rows without a finite value are left out.  Over an abscissa of names, the series are drawn next to each other.

    Raises
    ------
    InvalidInput
        If a table or column is missing, or no row matches.
    """
    drawn: list[Line] = []
    for lines in (chart, *chart.also):
        table = tables.get(lines.table) if isinstance(lines.table, str) else lines.table
        if table is None:
            raise InvalidInput(
                "the figure has no such table", lines.table, ", ".join(tables), code="no_table"
            )
        drawn += _lines(chart, lines, table, len(drawn))
    if (
        chart.abscissa.words
        and len(drawn) > 1
        and len(np.unique(places := np.concatenate([line.x for line in drawn]))) < len(places)
        and not any(lines.strands for lines in (chart, *chart.also))
    ):
        step = 0.5 / (len(drawn) - 1)
        drawn = [replace(line, x=line.x - 0.25 + step * n) for n, line in enumerate(drawn)]
    return drawn


def _lines(chart: Chart, lines: Lines, table: Any, number: int) -> list[Line]:
    x, y = lines.x or chart.x, lines.y
    around = [lines.band] if isinstance(lines.band, str) else list(lines.band)
    ends = [name for name in (f"{y}_low", f"{y}_high") if name in table]
    columns = [x, y, *filter(None, [*around, lines.strands, lines.less]), *ends]
    keys = style_keys(lines.styles)
    drawn: list[Line] = []
    for key, rows in tidy.groups(table, columns, by=lines.by, where=lines.where, keys=keys).items():
        key = key or (keys[0] if len(keys) == 1 else y)
        style = style_of(lines.styles, key)
        less = rows[lines.less] if lines.less else 0.0

        def scaled(column: str, rows: Mapping[str, np.ndarray] = rows, less: Any = less) -> np.ndarray:
            values = lines.times * (np.asarray(rows[column], float) - less)
            return np.maximum(values, chart.least) if chart.log_y else values

        values, band, interval = scaled(y), None, None
        if around[0] and style.banded:
            half = rows[around[0]]
            band = (
                (scaled(around[0]), scaled(around[1]))
                if len(around) == 2
                else (values - lines.times * half, values + lines.times * half)
            )
        if len(ends) == 2 and style.interval:
            interval = (scaled(ends[0]), scaled(ends[1]))
        places = list(chart.abscissa.words)
        at = np.array([places.index(str(v)) for v in rows[x]] if places else rows[x], float)
        rows_drawn = np.flatnonzero(np.isfinite(values) & np.isfinite(at))
        if chart.abscissa.log:
            rows_drawn = rows_drawn[at[rows_drawn] > 0]
        rows_drawn = rows_drawn[np.argsort(at[rows_drawn], kind="stable")]
        if rows_drawn.size:
            colour = style.colour or CYCLE[(number + len(drawn)) % len(CYCLE)]
            drawn.append(
                Line(
                    key,
                    replace(style, colour=colour),
                    at[rows_drawn],
                    values[rows_drawn],
                    _known(band, rows_drawn),
                    _known(interval, rows_drawn),
                    rows[lines.strands][rows_drawn] if lines.strands else None,
                )
            )
    return drawn


def _known(ends: Ends | None, rows: np.ndarray) -> Ends | None:
    """Return the ends of these rows, with NaN for both ends where one is unknown; None if all are unknown."""
    if ends is None:
        return None
    low, high = (end[rows] for end in ends)
    if (low > high).any():
        raise InvalidInput("the ends of an interval are swapped", expected="low ≤ high", code="swapped_ends")
    finite = np.isfinite(low) & np.isfinite(high)
    return (np.where(finite, low, np.nan), np.where(finite, high, np.nan)) if finite.any() else None


def on_timeline(timeline: str, values: np.ndarray) -> np.ndarray:
    """Return the positions (N,) of abscissa values on a timeline, as whole numbers except for ``time``.

    Examples
    --------
    >>> on_timeline("log10_eta_per_mille", np.array([1.0, 2.0])), on_timeline("view_angle_deg", np.array([30.0]))
    (array([  0., 301.]), array([30.]))
    """
    values = np.log10(values) if timeline.startswith("log10_") else values
    values = 1000.0 * values if timeline.endswith("_per_mille") else values
    return values if timeline == "time" else np.rint(values)
