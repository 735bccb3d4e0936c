"""One panel: a pair of axes with lines and bands, references, a note, and the entries of its legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullFormatter

from pipeline.palette import CYCLE, Style, hex_colour
from pipeline.pictures import style as look
from pipeline.tidy import Where
from pipeline.validation import InvalidInput, require_choice, require_finite, require_range, require_shape

Band = np.ndarray | tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Series(Style):
    """One line, or several that are drawn alike, with what `Style` says of label, colour and line.

    Attributes
    ----------
    x, y : (N,) float
    band : (N,) float, or two of them, optional
        Standard deviation or error, or (low, high); drawn as a light area, where low and high are known (not NaN).
    units : (N,), optional
        Which line each point belongs to, e.g. the performance; one line if not given.
    """

    x: np.ndarray
    y: np.ndarray
    band: Band | None = None
    units: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One pair of axes: lines of a table, further series, and what stands around them.

    Attributes
    ----------
    y : str
        Column of the table; empty if all is in `series`.
    band : str, or (str, str)
        Column of the standard deviation or error, or columns of the lower and upper end of the band; empty for none.
    x, by : str, optional
        In place of those of `draw_lines`.
    where : mapping
        Rows of the table that belong here: column → value, or several values.
    units : str
        Column that tells apart lines of one series, e.g. ``"performance"``; empty if each series is one line.
    series : sequence of Series
        Drawn after the lines of the table.
    legend : sequence of str, optional
        Which of the series in `styles` are named in the legend; all if not given.
    title : str
        At the upper left, after the letter of the panel.
    xlabel, ylabel : str
    xlim, ylim : (float, float), optional
    from_zero : bool
        The ordinate runs from 0 to just above the lines, and above their bands up to twice the height of the lines.
    xticks : float or sequence of float, optional
        Places of the ticks, or the step from one to the next.
    xwords : sequence of str
        Words in place of the numbers at `xticks`, which then are places; empty for the numbers.
    xscale, yscale : str
        ``linear`` or ``log``.
    references : sequence of (str, float, str)
        Thin lines: ``"x"`` or ``"y"``, where, and what to write beside it.
    annotation : str
        A note inside the axes, in the corner farthest from the data.
    """

    y: str = ""
    band: str | tuple[str, str] = ""
    x: str | None = None
    by: str | None = None
    where: Where | None = None
    units: str = ""
    series: Sequence[Series] = ()
    legend: Sequence[str] | None = None
    title: str = ""
    xlabel: str | None = None
    ylabel: str = ""
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None
    from_zero: bool = False
    xticks: float | Sequence[float] | None = None
    xwords: Sequence[str] = ()
    xscale: str = "linear"
    yscale: str = "linear"
    references: Sequence[tuple[str, float, str]] = ()
    annotation: str = ""


def _band(series: Series) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper end of the band, each (N,); the line itself where there is none."""
    if isinstance(series.band, tuple):
        return series.band
    half = 0.0 if series.band is None else np.asarray(series.band)
    return series.y - half, series.y + half


def checked_lines(panel: Panel, lines: Sequence[Series], where: str) -> list[Series]:
    """Return the lines of a panel, each with a colour and as float arrays that can be drawn."""
    require_range(f"{where}, series", len(lines), at_least=1)
    for scale in (panel.xscale, panel.yscale):
        require_choice(f"{where}, scale", scale, ("linear", "log"))
    found = []
    for number, one in enumerate(lines):
        one = replace(one, colour=one.colour or CYCLE[number % len(CYCLE)])
        found.append(_checked(one, panel, f"{where}, {one.label or f'series {number + 1}'}"))
    return found


def _checked(series: Series, panel: Panel, where: str) -> Series:
    look.colour(where, series.colour)
    require_choice(f"{where}, line", series.line, look.LINE_STYLES)
    x = require_finite(f"{where}, x", require_shape(f"{where}, x", series.x, ("N",))).astype(float)
    require_range(f"{where}, points", x.size, at_least=1)
    y = require_finite(f"{where}, y", require_shape(f"{where}, y", series.y, (x.size,))).astype(float)
    if (panel.xscale == "log" and x.min() <= 0) or (panel.yscale == "log" and y.min() <= 0):
        raise InvalidInput("numbers without a logarithm on a logarithmic axis", where=where)
    checked = replace(series, x=x, y=y)
    if series.band is not None:
        ends = series.band if isinstance(series.band, tuple) else (series.band,)
        shaped = [require_shape(f"{where}, band", end, (x.size,)).astype(float) for end in ends]
        known = ~np.isnan(shaped).any(axis=0) if len(shaped) == 2 else np.ones(x.size, dtype=bool)
        for end in shaped:
            require_finite(f"{where}, band", np.where(known, end, 0.0))
        low, high = _band(checked)
        if (np.asarray(low) > high).any():
            raise InvalidInput("a band that is negative", where=where)
        band = (np.where(known, low, np.nan), np.where(known, high, np.nan))
        checked = replace(checked, band=band if known.any() else None)
    if series.units is not None:
        require_shape(f"{where}, units", series.units, (x.size,))
    return checked


def draw_panel(axes: Axes, panel: Panel, where: str) -> list[Line2D]:
    """Draw a panel that has all its lines in `series`; return the entries of its legend."""
    lines = checked_lines(panel, panel.series, where)
    draw_data(axes, panel, lines)
    axes.set(title=panel.title, xlabel=panel.xlabel or "", ylabel=panel.ylabel)
    limit_ordinates([axes], [panel], [lines], "none", 1)
    return legend_handles(lines)


def draw_data(axes: Axes, panel: Panel, lines: Sequence[Series]) -> None:
    """Draw the lines and bands of a panel, and limit the abscissa."""
    axes.set_xscale(panel.xscale)
    axes.set_yscale(panel.yscale)
    for one in lines:
        colour = hex_colour(one.colour)
        if one.band is not None:
            axes.fill_between(one.x, *_band(one), color=colour, alpha=look.BAND_OPACITY, linewidth=0)
        pattern: dict[str, Any] = {"linewidth": one.width * look.LINE_WIDTH, "alpha": one.opacity}
        points = one.line == "points" or one.x.size == 1  # a line of one point would not be seen
        if one.units is None:
            marker = "o" if points else "none"
            style = look.LINE_STYLES[one.line]
            axes.plot(one.x, one.y, linestyle=style, marker=marker, color=colour, **pattern)
        else:
            at = np.stack([one.x, one.y], axis=-1)
            strands = [at[one.units == unit] for unit in dict.fromkeys(np.asarray(one.units).tolist())]
            style = look.LINE_STYLES[one.line]
            axes.add_collection(LineCollection(strands, colors=colour, linestyles=[style], **pattern))
            axes.autoscale_view()
    axes.margins(x=0.03 if any(one.line == "points" for one in lines) else 0.0, y=0.06)
    if panel.xlim:
        axes.set_xlim(*panel.xlim)
    if panel.xticks is None and panel.xscale == "linear":
        axes.xaxis.set_major_locator(MaxNLocator("auto", steps=look.TICK_STEPS))
    elif isinstance(panel.xticks, Sequence | np.ndarray):
        axes.set_xticks(list(panel.xticks))
        if panel.xwords:
            axes.set_xticklabels(list(panel.xwords), rotation=35, ha="right", rotation_mode="anchor")
        elif panel.xscale == "log":  # plain numbers, and none beside the ticks that were asked for
            axes.set_xticklabels([f"{place:g}" for place in panel.xticks])
            axes.xaxis.set_minor_formatter(NullFormatter())
    elif panel.xticks is not None:
        low, high = (limit / panel.xticks for limit in axes.get_xlim())
        axes.set_xticks(panel.xticks * np.arange(np.ceil(low - 1e-9), np.floor(high + 1e-9) + 1))


def limit_ordinates(
    drawn: Sequence[Axes], panels: Sequence[Panel], lines: Sequence[list[Series]], share_y: str, columns: int
) -> None:
    """Limit each ordinate, or those that are shared together."""
    step = {"none": 1, "row": columns, "all": len(panels)}[share_y]
    for start in range(0, len(panels), step):
        group = range(start, min(start + step, len(panels)))
        if limits := next((panels[i].ylim for i in group if panels[i].ylim), None):
            drawn[start].set_ylim(*limits)
        elif any(panels[i].from_zero for i in group):
            # A band that is much wider than its line is high would press the lines onto the abscissa.
            tops = [
                min(np.fmax(_band(one)[1], one.y).max(), 2.0 * one.y.max()) for i in group for one in lines[i]
            ]
            drawn[start].set_ylim(0.0, 1.05 * float(max(tops)))


def legend_handles(lines: Sequence[Series]) -> list[Line2D]:
    """Entries of the legend."""
    return [
        look.legend_handle(
            one.label,
            hex_colour(one.colour),
            line="points" if one.x.size == 1 else one.line,
            width=max(one.width * look.LINE_WIDTH, look.LEGEND_WIDTH),
        )
        for one in lines
        if one.label
    ]


def _in_axes(axes: Axes, lines: Sequence[Series]) -> np.ndarray:
    """Points of all lines as fractions of the axes, (N, 2), filled in between the points given."""
    found = []
    for one in lines:
        data = axes.transData.transform(np.stack([one.x, one.y], axis=-1))
        places = axes.transAxes.inverted().transform(data)
        fine, own = np.linspace(0, len(places) - 1, max(len(places), 200)), np.arange(len(places))
        found.append(np.stack([np.interp(fine, own, places[:, k]) for k in (0, 1)], axis=-1))
    return np.concatenate(found)


def _annotate(axes: Axes, words: str, data: np.ndarray) -> None:
    """Write in the corner that is farthest from the data."""
    corners = [(0.97, 0.06), (0.97, 0.94), (0.03, 0.06), (0.03, 0.94)]
    middles = [np.array([0.8 if right > 0.5 else 0.2, up]) for right, up in corners]
    free = [float(np.abs(data - middle).max(axis=1).min()) for middle in middles]
    right, up = corners[int(np.argmax(free))]
    align: dict[str, Any] = {"ha": "right" if right > 0.5 else "left", "va": "top" if up > 0.5 else "bottom"}
    axes.text(right, up, words, transform=axes.transAxes, fontsize=look.NOTE_SIZE, **align)


def draw_notes(axes: Axes, panel: Panel, lines: Sequence[Series], where: str) -> None:
    """Draw the references, each with its words at the end that lies farther from the data, and the annotation."""
    data = _in_axes(axes, lines)
    if panel.annotation:
        _annotate(axes, panel.annotation, data)
    note: dict[str, Any] = {
        "transform": axes.transAxes,
        "fontsize": look.NOTE_SIZE,
        "color": look.NOTE_COLOUR,
    }
    line: dict[str, Any] = {"color": hex_colour("reference"), "lw": look.REFERENCE_WIDTH, "zorder": 0.5}
    heights = [_fraction(axes, value, 1) for axis, value, words in panel.references if axis == "y" and words]
    for axis, value, words in panel.references:
        require_choice(f"{where}, axis of a reference", axis, ("x", "y"))
        along = 0 if axis == "x" else 1  # which coordinate of the axes the value is
        (axes.axvline if axis == "x" else axes.axhline)(value, linestyle=look.REFERENCE_DASHES, **line)
        at = _fraction(axes, value, along)
        near = data[np.abs(data[:, along] - at) < 0.12][:, 1 - along]
        ends = (0.05, 0.95) if axis == "x" else (0.14, 0.86)
        gaps = [float(np.abs(near - end).min()) if near.size else 1.0 for end in ends]
        far = gaps[1] >= gaps[0]  # the upper, or the right end
        if axis == "x":
            inward = at < 0.7  # words after the line, or before it where there is no space after it
            place = (at + (0.012 if inward else -0.012), 0.96 if far else 0.04)
            align = {"ha": "left" if inward else "right", "va": "top" if far else "bottom"}
        else:
            # Words above the line, or below it where there is no space above: the edge, or the next line.
            above = at < 0.9 and not any(0 < other - at < 0.08 for other in heights)
            place = (0.985 if far else 0.015, at + (0.015 if above else -0.015))
            align = {"ha": "right" if far else "left", "va": "bottom" if above else "top"}
        axes.text(*place, words, **{**note, **align})


def _fraction(axes: Axes, value: float, along: int) -> float:
    """Where a value of the abscissa (0) or the ordinate (1) lies, as a fraction of the axes."""
    corner = np.array([axes.get_xlim()[0], axes.get_ylim()[0]])
    corner[along] = value
    return float(axes.transAxes.inverted().transform(axes.transData.transform(corner))[along])
