"""The charts of published figures on the page: from a figure's manifest to what the page's script draws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from pipeline.charts import Chart, Lines, from_json, style_keys
from pipeline.palette import CYCLE, Style, colour_name
from pipeline.report.published import PublishedFigure


def declared(figure: PublishedFigure) -> list[Chart]:
    """Return the charts that a figure was published with."""
    return [from_json(plain, figure.name) for plain in figure.manifest.get("charts", [])]


def charts_of(figure: PublishedFigure) -> list[dict[str, Any]]:
    """Return the charts of a figure whose tables are there, as the page's script draws them."""
    found = []
    for chart in declared(figure):
        lines = [_line(chart, one) for one, table in _drawn(figure, chart) if table is not None]
        if lines:
            x_label, y_label = chart.axes
            found.append(
                {
                    "title": chart.title,
                    "x_label": x_label,
                    "y_label": ": ".join(filter(None, [chart.title, y_label])),
                    "log_x": chart.log_x,
                    "log_y": chart.log_y,
                    "zero": chart.zero,
                    "least": chart.least or None,
                    "limits": chart.limits,
                    "words": chart.words or None,
                    "references": [asdict(reference) for reference in chart.references],
                    "lines": lines,
                }
            )
    return found


def columns_of(figure: PublishedFigure) -> dict[str, set[str]]:
    """Return the columns that the charts of a figure read, by the file names of tables."""
    needed: dict[str, set[str]] = {}
    for chart in declared(figure):
        for lines, header in _drawn(figure, chart):
            if isinstance(lines.table, str) and header is not None:
                ends = {f"{lines.y}_low", f"{lines.y}_high"} & set(header)
                needed.setdefault(f"{lines.table}.csv", set()).update(_columns(chart, lines) | ends)
    return needed


def drawn_rows(figure: PublishedFigure, name: str, rows: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return which rows of a table (n,) bool its charts draw."""
    size = len(next(iter(rows.values())))
    drawn = np.zeros(size, dtype=bool)
    for chart in declared(figure):
        for lines, header in _drawn(figure, chart):
            if header is None or lines.table != name:
                continue
            chosen = np.ones(size, dtype=bool)
            for column, value in lines.where.items():
                chosen &= np.isin(rows[column], value)
            if lines.by and (keys := style_keys(lines.styles)):
                chosen &= np.isin(np.asarray(rows[lines.by]).astype(str), keys)
            drawn |= chosen
    return drawn


def _columns(chart: Chart, lines: Lines) -> set[str]:
    band = [lines.band] if isinstance(lines.band, str) else lines.band
    named = (lines.x or chart.x, lines.y, lines.by, lines.less, *band, *lines.where)
    return {name for name in named if name}


def _drawn(figure: PublishedFigure, chart: Chart) -> Iterator[tuple[Lines, list[str] | None]]:
    """Lines of a chart with the columns of their table; None if that is not there, or not with their columns."""
    for lines in (chart, *chart.also):
        header = (
            figure.headers.get(f"{lines.table}.csv") if isinstance(lines.table, str) else list(lines.table)
        )
        yield lines, header if header is not None and _columns(chart, lines) <= set(header) else None


def _line(chart: Chart, lines: Lines) -> dict[str, Any]:
    names = ("y", "table", "by", "where", "band", "less", "times")
    style = lines.styles if isinstance(lines.styles, Style) else None
    styles = lines.styles if isinstance(lines.styles, Mapping) else {}
    return {
        **{name: getattr(lines, name) for name in names},
        "x": lines.x or chart.x,
        "style": _style(style, 0) if style else None,
        "styles": {key: _style(of, number) for number, (key, of) in enumerate(styles.items())},
    }


def _style(style: Style, number: int) -> dict[str, Any]:
    colour = colour_name(style.colour or CYCLE[number % len(CYCLE)])
    return {**asdict(style), "colour": colour}
