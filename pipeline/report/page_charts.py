"""Charts of published figures as plain values, from which the page's script draws the charts."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from pipeline.chart_limits import abscissa_limits, ordinate_limits
from pipeline.charts import Chart, Line, lines_of
from pipeline.palette import colour_name
from pipeline.report.published import PublishedFigure
from pipeline.validation import InvalidInput

_RANGE = "range of all populations"


def charts_of(figure: PublishedFigure) -> list[dict[str, Any]]:
    """Return the charts of a figure with their lines; charts without their table or columns are left out."""
    plain_charts: list[dict[str, Any]] = []
    for chart in figure.charts:
        with suppress(InvalidInput):  # a table that an earlier version published without these columns
            tables = figure.tables_of(chart)
            note = _band_words(chart, tables, figure.manifest.get("caption", ""))
            plain_charts.append({**_plain(chart, tables), "note": note})
    return plain_charts


def _plain(chart: Chart, tables: Mapping[str, Any]) -> dict[str, Any]:
    drawn = lines_of(chart, tables)
    x_label, y_label = chart.axes
    names = list(chart.abscissa.words.values())
    return {
        "title": chart.title,
        "x": chart.x,
        "x_label": x_label,
        "y_label": ": ".join(filter(None, [chart.title, y_label])),
        "log_x": chart.abscissa.log,
        "log_y": chart.log_y,
        "zero": chart.zero,
        "least": chart.least or None,
        "limits": _short(np.array(ordinate_limits([(chart, drawn)]))),
        "x_limits": None if names else _short(np.array(abscissa_limits(chart, drawn))),
        "ticks": chart.abscissa.ticks,
        "names": names or None,
        "references": [asdict(reference) for reference in chart.references],
        "series": [_series(chart, line) for line in lines_of(replace(chart, least=0.0), tables)],
    }


def _series(chart: Chart, line: Line) -> dict[str, Any]:
    style = line.style
    ends = {
        name: _short(end)
        for names, pair in ((("lo", "hi"), line.interval), (("low", "high"), line.band))
        for name, end in zip(names, pair or (), strict=bool(pair))
    }
    return {
        "key": line.key,
        "name": "" if style.label == chart.y else style.label,
        "colour": colour_name(style.colour),
        "line": style.line,
        "width": style.width,
        "x": _short(np.rint(line.x) if chart.abscissa.words else line.x),
        "y": _short(line.y),
        **ends,
    }


def _short(values: np.ndarray) -> list[float | int | None]:
    """Return numbers rounded to six significant digits, with None for numbers that are not finite."""
    return [
        None if not np.isfinite(v) else int(v) if v == int(v) else float(f"{v:.6g}") for v in values.tolist()
    ]


def _band_words(chart: Chart, tables: Mapping[str, Any], caption: str) -> str:
    """Return a text that explains what the bands of a chart show.

    For synthetic people, it may be the range that the caption names.
    """
    interval = isinstance(chart.table, str) and f"{chart.y}_low" in tables[chart.table]
    spread = "" if not chart.band else "±1 standard deviation" if isinstance(chart.band, str) else "quartiles"
    words = [spread and ("light " if interval else "") + f"bands: {spread}"]
    if interval:
        words.append(f"bands: {_RANGE if _RANGE in caption else '95 % interval'}")
    return "; ".join(filter(None, words))
