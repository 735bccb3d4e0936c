"""Charts in panels: lines with their bands, points with their intervals, references, one legend above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullFormatter

from pipeline.charts import Axis, Chart, Line, Reference, lines_of
from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.validation import InvalidInput, require_range

_MAX_OVER_LINES = 2.0
"""Largest ratio of an ordinate from zero to the highest line; wider bands leave the axes."""


def draw_charts(canvas: look.Canvas) -> None:
    """Draw the charts of a sheet, row by row.

    Raises
    ------
    InvalidInput
        If the sheet has no charts, a column is missing, or a number cannot be shown on a logarithmic axis.
    """
    sheet, count = canvas.sheet, len(canvas.drawn)
    require_range(f"{canvas.path_stem}, charts", count, at_least=1)
    require_range(f"{canvas.path_stem}, columns", sheet.columns, at_least=1)
    rows, columns = -(-count // sheet.columns), sheet.columns
    with look.applied_style():
        width, height = sheet.panel_size or look.PANEL_SIZE
        figure = look.new_figure(width * columns + look.FRAME, height * rows + look.FRAME)
        look.finish(figure, canvas, add_charts(figure, canvas, figure.add_gridspec(rows, columns)))


def add_charts(figure: Figure, canvas: look.Canvas, grid: Any) -> list[Line2D]:
    """Add charts to a figure, each in a cell of a grid; return the entries of their legend."""
    sheet, charts, columns = canvas.sheet, canvas.drawn, canvas.sheet.columns
    drawn: list[tuple[Axes, Chart, list[Line]]] = []
    for number, chart in enumerate(charts):
        lines = _checked(chart, lines_of(chart, canvas.tables))
        first = number - number % columns if sheet.share_y else number
        shared = drawn[first][0] if first < number else None
        axes = figure.add_subplot(grid[number], sharey=shared)
        (_draw_rows if chart.abscissa.words else _draw_lines)(axes, chart, lines)
        letter = f"({chr(ord('a') + number)})" if sheet.letters and len(charts) > 1 else ""
        x_label, y_label = (chart.axes[1], chart.abscissa.label) if chart.abscissa.words else chart.axes
        axes.set(title=f"{letter} {chart.title}".strip(), xlabel=x_label, ylabel=y_label)
        named = (
            chart.abscissa.words
            and number % columns
            and charts[number - 1].abscissa.words == chart.abscissa.words
        )
        if shared is not None or named:  # labels appear once, on the left
            axes.tick_params(labelleft=False)
            axes.set_ylabel("")
        drawn.append((axes, chart, lines))
    for start in range(0, len(drawn), columns if sheet.share_y else 1):
        if not charts[start].abscissa.words:
            _limit_ordinate(drawn[start : start + (columns if sheet.share_y else 1)])
    handles: dict[str, Line2D] = {}
    for axes, chart, lines in drawn:
        _draw_notes(axes, *(_turned(chart, lines) if chart.abscissa.words else (chart, lines)))
        if chart.named:
            _name_at_ends(axes, lines)
        for line in lines if not chart.named else ():
            handles.setdefault(line.style.label, _handle(line, points=bool(chart.abscissa.words)))
        for reference in chart.references:
            if reference.slope is not None or reference.below:
                handles.setdefault(
                    reference.label, look.legend_handle(reference.label, **_look_of(reference))
                )
    handles.pop("", None)
    return list(handles.values())


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
    for line in lines:
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
            axes.vlines(line.x, *ends, color=colour, **look_of)
        elif not points:
            for ends, opacity in ((line.band, look.BAND_OPACITY), (line.interval, look.INTERVAL_OPACITY)):
                if ends is not None:
                    axes.fill_between(line.x, *ends, color=colour, alpha=opacity, linewidth=0)
        pattern = "none" if points else look.LINE_STYLES[style.line]
        axes.plot(
            line.x, line.y, linestyle=pattern, marker="o" if points else "none", color=colour, **look_of
        )
    scattered = any(line.style.line == "points" or line.x.size == 1 for line in lines)
    axes.margins(x=0.03 if scattered else 0.0, y=0.06)
    _limit_abscissa(axes, chart.abscissa)


def _draw_rows(axes: Axes, chart: Chart, lines: Sequence[Line]) -> None:
    """Draw a row for each name, from the top, with numbers along the abscissa."""
    axes.set_xscale("log" if chart.log_y else "linear")
    for line in lines:
        look_of: dict[str, Any] = {"color": hex_colour(line.style.colour), "alpha": line.style.opacity}
        if ends := line.interval or line.band:
            axes.hlines(line.x, *ends, linewidth=line.style.width * look.LINE_WIDTH, **look_of)
        strands = np.zeros(len(line.x)) if line.strands is None else line.strands
        for strand in dict.fromkeys(strands.tolist()):
            members = strands == strand
            axes.plot(
                line.y[members], line.x[members], linestyle="none" if line.strands is None else "-", marker="o",
                linewidth=line.style.width * look.LINE_WIDTH, **look_of,
            )  # fmt: skip
    axes.margins(x=0.06)
    if chart.zero and not chart.limits:
        axes.set_xlim(left=0.0)
    _limit_abscissa(axes, replace(chart.abscissa, log=chart.log_y, limits=chart.limits))
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
    """Return a chart of rows and its lines with abscissa and ordinate exchanged, as they are drawn."""
    references = [replace(reference, x=reference.y, y=None) for reference in chart.references]
    return replace(chart, references=references), [replace(line, x=line.y, y=line.x) for line in lines]


def _limit_abscissa(axes: Axes, abscissa: Axis) -> None:
    if abscissa.limits:
        axes.set_xlim(*abscissa.limits)
    if isinstance(abscissa.ticks, Sequence | np.ndarray):
        axes.set_xticks(list(abscissa.ticks))
        if abscissa.log:  # plain numbers, at the requested ticks only
            axes.set_xticklabels([f"{tick:g}" for tick in abscissa.ticks])
            axes.xaxis.set_minor_formatter(NullFormatter())
    elif abscissa.ticks is not None:
        low, high = (limit / abscissa.ticks for limit in axes.get_xlim())
        axes.set_xticks(abscissa.ticks * np.arange(np.ceil(low - 1e-9), np.floor(high + 1e-9) + 1))
    elif not abscissa.log:
        axes.xaxis.set_major_locator(MaxNLocator("auto", steps=look.TICK_STEPS))


def _limit_ordinate(drawn: Sequence[tuple[Axes, Chart, list[Line]]]) -> None:
    """Set the limits of the ordinate that some axes share."""
    axes = drawn[0][0]
    if limits := next((chart.limits for _, chart, _ in drawn if chart.limits), None):
        axes.set_ylim(*limits)
    elif any(chart.zero for _, chart, _ in drawn):
        # A band much higher than the lines would flatten them onto the abscissa.
        tops = [
            min(np.nanmax([line.y, *(ends[1] for ends in (line.band, line.interval) if ends)]),
                _MAX_OVER_LINES * line.y.max())
            for _, _, lines in drawn
            for line in lines
        ]  # fmt: skip
        marks = [r.y for _, chart, _ in drawn for r in chart.references if r.published and r.y is not None]
        axes.set_ylim(0.0, 1.05 * max(*tops, *map(float, marks), np.finfo(float).tiny))


def _name_at_ends(axes: Axes, lines: Sequence[Line]) -> None:
    """Write the names of lines at their right ends, one above the other where the ends are close."""
    below = -np.inf
    for line in sorted(lines, key=lambda line: line.y[-1]):
        below = max(_fraction(axes, line.y[-1], 1), below + 0.08)
        axes.text(
            1.02, below, line.style.label, transform=axes.transAxes, va="center", fontsize=look.NOTE_SIZE,
            color=hex_colour(line.style.colour),
        )  # fmt: skip


def _handle(line: Line, *, points: bool) -> Line2D:
    style = line.style
    return look.legend_handle(
        style.label,
        hex_colour(style.colour),
        line="points" if points or line.x.size == 1 else style.line,
        width=max(style.width * look.LINE_WIDTH, look.LEGEND_WIDTH),
    )


def _in_axes(axes: Axes, lines: Sequence[Line]) -> np.ndarray:
    """Return points (N, 2) along all lines as fractions of the axes, interpolated between the data."""
    points = []
    for line in lines:
        data = axes.transData.transform(np.column_stack([line.x, line.y]))
        places = axes.transAxes.inverted().transform(data)
        fine, numbers = np.linspace(0, len(places) - 1, max(len(places), 200)), np.arange(len(places))
        points.append(np.stack([np.interp(fine, numbers, places[:, k]) for k in (0, 1)], axis=-1))
    return np.concatenate(points)


def _draw_notes(axes: Axes, chart: Chart, lines: Sequence[Line]) -> None:
    """Draw the references, each with its label at the end that is farther from the data."""
    data = _in_axes(axes, lines)
    across = [r for r in chart.references if r.y is not None and r.x is None]
    heights = [_fraction(axes, float(r.y), 1) for r in across if r.y is not None and r.label]
    upright = [_fraction(axes, float(r.x), 0) for r in chart.references if r.x is not None and r.y is None]
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
            linestyle="none",
                      markersize=1.3 * look.POINT_SIZE, zorder=5, clip_on=False)  # fmt: skip
            at = (_fraction(axes, x, 0), _fraction(axes, y, 1))
            right, high = at[0] > 0.6, at[1] > 0.5
            _write(axes, (at[0] + (-0.025 if right else 0.025), at[1]), reference.label, right, high)
        elif x is not None:
            axes.axvline(x, zorder=0.5, **line_look)
            at_x = _fraction(axes, x, 0)
            far = _farther(data, 0, at_x, (0.05, 0.95))
            # The label is to the right of the line, or to the left if there is no space.
            inward = at_x < 0.7 and not any(0 < other - at_x < 0.25 for other in upright)
            _write(
                axes,
                (at_x + (0.012 if inward else -0.012), 0.96 if far else 0.04),
                reference.label,
                not inward,
                far,
            )
        elif y is not None:
            axes.axhline(y, zorder=0.5, **line_look)
            at_y = _fraction(axes, y, 1)
            far = _farther(data, 1, at_y, (0.14, 0.86))
            # The label is above the line, or below it if an edge or another line leaves no space.
            above = at_y < 0.9 and not any(0 < other - at_y < 0.17 for other in heights)
            corner = (0.985 if far else 0.015, at_y + (0.015 if above else -0.015))
            _write(axes, corner, reference.label, far, not above)


def _look_of(reference: Reference) -> dict[str, Any]:
    """Return the colour, pattern and width of a reference's line."""
    published = reference.published
    dashes = look.PUBLISHED_DASHES if published else look.REFERENCE_DASHES
    colour = hex_colour("published" if published else "reference")
    return {"colour": colour, "line": dashes, "width": look.REFERENCE_WIDTH}


def _write(axes: Axes, corner: tuple[float, float], words: str, right: bool, top: bool) -> None:
    """Write words at a corner of their box, in fractions of the axes; `right` and `top` say which corner."""
    align: dict[str, Any] = {"ha": "right" if right else "left", "va": "top" if top else "bottom"}
    axes.text(
        *corner, words, transform=axes.transAxes, fontsize=look.NOTE_SIZE, color=look.NOTE_COLOUR, **align
    )


def _farther(data: np.ndarray, along: int, at: float, ends: tuple[float, float]) -> bool:
    """Return True if the upper or right end of a line across the axes is farther from the data than the other end."""
    near = data[np.abs(data[:, along] - at) < 0.12][:, 1 - along]
    gaps = [np.abs(near - end).min() if near.size else 1.0 for end in ends]
    return gaps[1] >= gaps[0]


def _fraction(axes: Axes, value: float, along: int) -> float:
    """Return the position of a value of the abscissa (0) or the ordinate (1), as a fraction of the axes."""
    corner = np.array([axes.get_xlim()[0], axes.get_ylim()[0]])
    corner[along] = value
    return float(axes.transAxes.inverted().transform(axes.transData.transform(corner))[along])
