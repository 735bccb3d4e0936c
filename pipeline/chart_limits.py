"""Limits of the axes of charts, in pictures and on the page; they include every value and every end of an interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.charts import Chart, Line, Sheet, lines_of

_MARGIN, _POINT_MARGIN = 0.05, 0.03
"""Margins of an ordinate, and of an abscissa with points, as fractions of the range of the data."""


def ordinate_limits(panels: Sequence[tuple[Chart, Sequence[Line]]]) -> tuple[float, float]:
    """Return the common limits of the ordinate of several charts.

    Values, intervals and references are inside.  Bands of the spread can be much wider: they extend the axis at most by
    the range of these, and not at all if a chart has limits.
    """
    charts, lines = [chart for chart, _ in panels], [line for _, drawn in panels for line in drawn]
    log, zero = any(chart.log_y for chart in charts), any(chart.zero for chart in charts)
    levels = [float(r.y) for chart in charts for r in chart.references if r.y is not None]
    requested = [_scaled(chart.limits, log) for chart in charts if chart.limits]
    inside = [line.y for line in lines] + [end for line in lines for end in line.interval or ()]
    low, high = _ends([_scaled(part, log) for part in (*inside, levels)])
    if zero and not log:
        low, high = min(low, 0.0), max(high, 0.0)
    bands = [_scaled(end, log) for line in lines for end in line.band or ()]
    if requested:
        outer = _ends(requested)
        fixed = (outer[0] <= low, outer[1] >= high)
        low, high = min(low, outer[0]), max(high, outer[1])
    else:
        reach, (lowest, highest) = high - low, _ends([*bands, np.array([low, high])])
        fixed = (zero and not log and low == 0.0, False)
        low = low if fixed[0] else max(lowest, low - reach)
        high = min(highest, high + reach)
    pad = _MARGIN * (high - low) or (0.1 if log else 1.0)
    low, high = (low if fixed[0] else low - pad), (high if fixed[1] else high + pad)
    return (10.0**low, 10.0**high) if log else (low, high)


def abscissa_limits(chart: Chart, lines: Sequence[Line]) -> tuple[float, float]:
    """Return the limits of a chart's abscissa: the limits of its `Axis`, or the range of data and references."""
    if chart.abscissa.limits:
        return chart.abscissa.limits
    log = chart.abscissa.log
    marks = [float(r.x) for r in chart.references if r.x is not None]
    low, high = _ends([_scaled(part, log) for part in (*(line.x for line in lines), marks)])
    points = any(line.style.line == "points" or line.x.size == 1 for line in lines)
    pad = (_POINT_MARGIN if points else 0.0) * (high - low) or (0.0 if high > low else 0.5)
    return (10.0 ** (low - pad), 10.0 ** (high + pad)) if log else (low - pad, high + pad)


def with_shared_limits(sheet: Sheet, tables: Mapping[str, Any]) -> Sheet:
    """Return a sheet in which charts of the same row have the same ordinate limits, if the sheet requests this."""
    if not sheet.share_y:
        return sheet
    pictured = [n for n, chart in enumerate(sheet.charts) if chart.picture]
    charts = list(sheet.charts)
    for start in range(0, len(pictured), sheet.columns):
        row = pictured[start : start + sheet.columns]
        limits = ordinate_limits([(charts[n], lines_of(charts[n], tables)) for n in row])
        for n in row:
            charts[n] = replace(charts[n], limits=limits)
    return replace(sheet, charts=charts)


def _scaled(values: Any, log: bool) -> np.ndarray:
    values = np.asarray(values, float)
    return np.log10(values[values > 0]) if log else values


def _ends(parts: Sequence[np.ndarray]) -> tuple[float, float]:
    every = np.concatenate([part[np.isfinite(part)] for part in parts])
    return float(every.min()), float(every.max())
