"""Charts in panels with one legend above them: lines with bands, points with intervals, and reference lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from pipeline.chart_limits import abscissa_limits, ordinate_limits
from pipeline.charts import Axis, Chart, Line, Reference, lines_of
from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.notes import Notes
from pipeline.validation import InvalidInput, require_range

_MIN_PANEL_WIDTH = 1.5
"""Smallest width of a panel, inches, in a picture of prescribed width."""


def draw_charts(canvas: look.Canvas) -> None:
    """Draw the charts of a sheet, one row of charts after another.

    Raises
    ------
    InvalidInput
        If the sheet has no charts, a column is missing, or a number cannot be shown on a logarithmic axis.
    """
    sheet, count = canvas.sheet, len(canvas.drawn)
    require_range(f"{canvas.path_stem}, charts", count, at_least=1)
    require_range(f"{canvas.path_stem}, columns", sheet.columns, at_least=1)
    wide = canvas.width_mm / 25.4
    columns = min(sheet.columns, count)
    if wide:
        columns = max(1, min(columns, int(wide / _MIN_PANEL_WIDTH)))
    width, height = sheet.panel_size or look.PANEL_SIZE
    if wide:
        height *= min(1.0, max(look.MIN_SHRUNK, wide / columns / width))
        width = wide / columns
    rows = -(-count // columns)
    with look.applied_style():
        figure = canvas.new_figure(width * columns + look.FRAME * (not wide), height * rows + look.FRAME)
        canvas = replace(canvas, sheet=replace(sheet, columns=columns))
        entries = add_charts(figure, canvas, figure.add_gridspec(rows, columns))
        look.finish(figure, canvas, entries, room=bool(wide))


def add_charts(figure: Figure, canvas: look.Canvas, grid: Any, width: float = 0.0) -> dict[str, Any]:
    """Add charts to a figure, each in a cell of a grid, and return the entries of the charts' legend.

    `width` is the width of a cell in inches, by default an equal share of the figure's.
    """
    sheet, charts, columns = canvas.sheet, canvas.drawn, canvas.sheet.columns
    room = (
        72.0 * (width or figure.get_figwidth() / columns) - 4.0 * look.TITLE_SIZE
    )  # less the numbers of the axis
    drawn: list[tuple[Axes, Chart, list[Line]]] = []
    for number, chart in enumerate(charts):
        lines = _checked(chart, lines_of(chart, canvas.tables))
        first = number - number % columns if sheet.share_y else number
        shared = drawn[first][0] if first < number else None
        axes = figure.add_subplot(grid[number], sharey=shared)
        (_draw_rows if chart.abscissa.words else _draw_lines)(axes, chart, lines)
        letter = f"({chr(ord('a') + number)})" if sheet.letters and len(charts) > 1 else ""
        x_label, y_label = (chart.axes[1], "") if chart.abscissa.words else chart.axes
        named = (
            chart.abscissa.words
            and number % columns
            and charts[number - 1].abscissa.words == chart.abscissa.words
        )
        if shared is not None or named:  # labels appear once, on the left
            axes.tick_params(labelleft=False)
            y_label = ""
        heading = [f"{letter} {chart.title}".strip(), y_label]
        if not chart.title:
            heading = [" ".join(filter(None, heading))]
        spare = 3.0 * look.TITLE_SIZE if chart.abscissa.words else 0.0
        axes.set_title("\n".join(look.wrapped(part, room + spare) for part in heading if part))
        axes.set_xlabel(look.wrapped(x_label, room))
        drawn.append((axes, chart, lines))
    for start in range(0, len(drawn), columns if sheet.share_y else 1):
        row = drawn[start : start + (columns if sheet.share_y else 1)]
        limits = ordinate_limits([(chart, lines) for _, chart, lines in row])
        for axes, chart, _ in row:
            (axes.set_xlim if chart.abscissa.words else axes.set_ylim)(*limits)
    entries: dict[str, Any] = {}
    for axes, chart, lines in drawn:
        canvas.after_layout.append(
            partial(_draw_notes, axes, *(_turned(chart, lines) if chart.abscissa.words else (chart, lines)))
        )
        for line in lines:
            entries.setdefault(line.style.label, _handle(line, rows=bool(chart.abscissa.words)))
        for reference in chart.references:
            if reference.slope is not None or reference.below:
                entries.setdefault(
                    reference.label, look.legend_handle(reference.label, **_look_of(reference))
                )
    entries.pop("", None)
    return entries


def _checked(chart: Chart, lines: list[Line]) -> list[Line]:
    require_range(f"{chart.quantity}, lines", len(lines), at_least=1)
    for line in lines:
        if chart.log_y and line.y.min() <= 0:
            where = f"{chart.quantity}, {line.key}"
            raise InvalidInput("zero or negative numbers on a logarithmic axis", where, code="not_positive")
    return lines


def _draw_lines(axes: Axes, chart: Chart, lines: Sequence[Line]) -> None:
    axes.set_xscale("log" if chart.abscissa.log else "linear")
    axes.set_yscale("log" if chart.log_y else "linear")
    for number, line in enumerate(lines):
        style, colour = line.style, hex_colour(line.style.colour)
        look_of: dict[str, Any] = {"linewidth": style.width * look.LINE_WIDTH, "alpha": style.opacity}
        points = style.line == "points" or line.x.size == 1  # a line of one point would be invisible
        if line.strands is not None:
            at = np.column_stack([line.x, line.y])
            strands = [at[line.strands == strand] for strand in dict.fromkeys(line.strands.tolist())]
            axes.add_collection(
                LineCollection(strands, colors=colour, linestyles=[look.LINE_STYLES[style.line]], **look_of)
            )
            axes.autoscale_view()
            continue
        if points and (ends := line.interval or line.band):
            axes.vlines(line.x, *ends, color=colour, gid=f"interval-{number}", **look_of)
        elif not points:
            for kind, ends, opacity in _bands(line):
                gid = f"{kind}-{number}"
                axes.fill_between(line.x, *ends, color=colour, alpha=opacity, linewidth=0, gid=gid)
        pattern = "none" if points else look.LINE_STYLES[style.line]
        axes.plot(
            line.x, line.y, linestyle=pattern, marker="o" if points else "none", color=colour, **look_of
        )
    axes.set_xlim(*abscissa_limits(chart, lines))
    _tick(axes, chart.abscissa)
    if chart.log_y:
        _tick_log(axes.yaxis)


def _bands(line: Line) -> list[tuple[str, Any, float]]:
    """Return the bands of a line, the lighter band first: kind, ends and opacity of each band."""
    every = (("band", line.band, look.BAND_OPACITY), ("interval", line.interval, look.INTERVAL_OPACITY))
    return [each for each in every if each[1] is not None]


def _draw_rows(axes: Axes, chart: Chart, lines: Sequence[Line]) -> None:
    """Draw a chart with one row for each name, from the top, and the numbers along the abscissa."""
    axes.set_xscale("log" if chart.log_y else "linear")
    for number, line in enumerate(lines):
        look_of: dict[str, Any] = {"color": hex_colour(line.style.colour), "alpha": line.style.opacity}
        if ends := line.interval or line.band:
            width = line.style.width * look.LINE_WIDTH
            axes.hlines(line.x, *ends, linewidth=width, gid=f"interval-{number}", **look_of)
        strands = np.zeros(len(line.x)) if line.strands is None else line.strands
        for strand in dict.fromkeys(strands.tolist()):
            members = strands == strand
            axes.plot(
                line.y[members], line.x[members], linestyle="none" if line.strands is None else "-", marker="o",
                linewidth=line.style.width * look.LINE_WIDTH, **look_of,
            )  # fmt: skip
    _tick(axes, replace(chart.abscissa, log=chart.log_y))
    axes.set_ylim(len(chart.abscissa.words) - 0.5, -0.5)
    axes.set_yticks(range(len(chart.abscissa.words)), list(chart.abscissa.words.values()))
    rows = {at for line in lines for at in np.rint(line.x)}
    for at, name in enumerate(
        axes.get_yticklabels()
    ):  # a name without numbers is the heading of the names below it
        name.set_fontweight("normal" if at in rows else "bold")
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", linewidth=0.3, color=look.NOTE_COLOUR, alpha=0.3)


def _turned(chart: Chart, lines: Sequence[Line]) -> tuple[Chart, list[Line]]:
    """Return a chart of rows with the two axes exchanged; the ends of error bars become points."""
    references = [replace(reference, x=reference.y, y=None) for reference in chart.references]
    points = [
        replace(line, x=values, y=line.x, style=replace(line.style, line="points"))
        for line in lines
        for values in (line.y, *(line.interval or line.band or ()))
    ]
    return replace(chart, references=references), points


def _tick(axes: Axes, abscissa: Axis) -> None:
    if abscissa.log:
        _tick_log(axes.xaxis)
    if isinstance(abscissa.ticks, Sequence | np.ndarray):
        axes.set_xticks(list(abscissa.ticks))
    elif abscissa.ticks is not None:
        low, high = (limit / abscissa.ticks for limit in axes.get_xlim())
        axes.set_xticks(abscissa.ticks * np.arange(np.ceil(low - 1e-9), np.floor(high + 1e-9) + 1))
    elif not abscissa.log:
        axes.xaxis.set_major_locator(MaxNLocator("auto", steps=look.TICK_STEPS))


def _tick_log(axis: Any) -> None:
    """Label a logarithmic axis with plain numbers instead of powers of ten."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 30.0 * low else (1,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _handle(line: Line, *, rows: bool) -> Any:
    """Return the legend entry of a line, drawn like the line itself: line, points, intervals and bands."""
    style, colour = line.style, hex_colour(line.style.colour)
    points = style.line == "points" or line.x.size == 1
    handle = look.legend_handle(
        style.label, colour, line="points" if points or rows else style.line,
        width=max(style.width * look.LINE_WIDTH, look.LEGEND_WIDTH),
    )  # fmt: skip
    if rows and (line.strands is not None or line.interval or line.band):
        handle.set_linestyle("-")
    if points or rows or not _bands(line):
        return handle
    return (*(Patch(color=colour, alpha=opacity, linewidth=0) for _, _, opacity in _bands(line)), handle)


def _draw_notes(axes: Axes, chart: Chart, lines: Sequence[Line]) -> None:
    """Draw the reference lines and points of a chart with their labels."""
    for reference in chart.references:
        look_of = _look_of(reference)
        line_look = {"color": look_of["colour"], "linestyle": look_of["line"], "linewidth": look_of["width"]}
        x, y = (None if v is None else float(v) for v in (reference.x, reference.y))
        if reference.slope is not None or reference.below:
            line = next((line for line in lines if line.key == reference.below), lines[0])
            share = 1.0 - float(reference.percent) / 100.0
            ends = np.array(axes.get_xlim())
            points = (line.x, share * line.y) if reference.below else (ends, (reference.slope or 0.0) * ends)
            axes.plot(*points, zorder=1.5, scalex=False, scaley=False, **line_look)
        elif x is not None and y is not None:
            axes.plot([x], [y], marker="D", markerfacecolor="white", markeredgecolor=line_look["color"],
                      linestyle="none", markersize=1.3 * look.POINT_SIZE, zorder=5, clip_on=False)  # fmt: skip
        elif x is not None:
            axes.axvline(x, zorder=0.5, **line_look)
        elif y is not None:
            axes.axhline(y, zorder=0.5, **line_look)
    notes = Notes(axes, lines, chart.references)
    for reference in chart.references:
        if reference.x is not None or reference.y is not None:
            notes.write(reference)


def _look_of(reference: Reference) -> dict[str, Any]:
    """Return colour, dash pattern and width of a reference line."""
    published = reference.published
    dashes = look.PUBLISHED_DASHES if published else look.REFERENCE_DASHES
    colour = hex_colour("published" if published else "reference")
    return {"colour": colour, "line": dashes, "width": look.REFERENCE_WIDTH}
