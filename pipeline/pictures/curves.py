"""Figures for print: curves and postures, each as an SVG and a PNG, in one house style.

The only matplotlib in the house.  Every figure is a `Figure` of its own, without global state; the same
input gives the same bytes.  Solid and dashed lines tell series apart in grey, Okabe and Ito's colours tell
them apart for everyone.  Legends stand above the axes, never over data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.pictures.postures import PostureRow, postures
from pipeline.pictures.style import COLOURS, finish, house_style, new_figure
from pipeline.validation import InvalidInput

__all__ = ["COLOURS", "Panel", "PostureRow", "Series", "curves", "postures"]

LINES = {"solid": "-", "dashed": "--", "dotted": ":", "points": "none"}


@dataclass(frozen=True, kw_only=True)
class Series:
    """One curve.

    Attributes
    ----------
    x, y : (N,) float
    label : str
        For the legend; empty for none.
    style : str
        ``solid``, ``dashed``, ``dotted`` or ``points``.
    spread : (N,) float, or two of them, optional
        Standard deviation or error, or (low, high); drawn as a light band.
    colour : str
        One of `COLOURS`; empty for the next in order.
    """

    x: np.ndarray
    y: np.ndarray
    label: str = ""
    style: str = "solid"
    spread: np.ndarray | tuple[np.ndarray, np.ndarray] | None = None
    colour: str = ""


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One pair of axes.

    Attributes
    ----------
    series : sequence of Series
    title : str
        E.g. ``"(a)"``, at the upper left.
    xlabel, ylabel : str
    xlim, ylim : (float, float), optional
    xticks : sequence of float, optional
    xscale, yscale : str
        ``linear`` or ``log``.
    references : sequence of (str, float, str)
        Thin lines: ``"x"`` or ``"y"``, where, and what to write beside it.
    annotation : str
        A note inside the axes, in the corner farthest from the data.
    """

    series: Sequence[Series]
    title: str = ""
    xlabel: str = ""
    ylabel: str = ""
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None
    xticks: Sequence[float] | None = None
    xscale: str = "linear"
    yscale: str = "linear"
    references: Sequence[tuple[str, float, str]] = ()
    annotation: str = ""


def curves(path_stem: Path, panels: Sequence[Panel], *, columns: int = 1, caption: str = "") -> None:
    """Draw panels of curves, row by row, into ``path_stem.svg`` and ``path_stem.png``.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    panels : sequence of Panel
    columns : int
    caption : str
        Set small under the figure: data set, number of walkers, components.

    Raises
    ------
    InvalidInput
        If there is nothing to draw, lengths differ, or numbers are not finite.
    """
    if not panels or columns < 1:
        raise InvalidInput(
            "nothing to draw", where=str(path_stem), expected="at least one panel and one column"
        )
    rows = -(-len(panels) // columns)
    with house_style():
        figure = new_figure(3.7 * columns + 0.1, 2.35 * rows + 0.1)
        previous: list[str] = []
        for number, panel in enumerate(panels):
            axes = figure.add_subplot(rows, columns, number + 1)
            _draw(axes, panel, f"{path_stem.name} {panel.title or f'panel {number + 1}'}")
            labels = [s.label for s in panel.series if s.label]
            if labels and labels != previous:  # a legend that says the same again says nothing
                _legend(axes, len(labels))
            previous = labels
        finish(figure, path_stem, caption)


def _vector(where: str, values: np.ndarray, length: int | None = None) -> np.ndarray:
    v = np.asarray(values, dtype=float)
    if v.ndim != 1 or not v.size or (length is not None and len(v) != length):
        expected = "(N,)" if length is None else f"({length},)"
        raise InvalidInput(
            "a series of the wrong shape", where=where, expected=expected, received=str(v.shape)
        )
    if not np.isfinite(v).all():
        raise InvalidInput("a series with numbers that are not finite", where=where)
    return v


def _draw(axes: Axes, panel: Panel, where: str) -> None:
    if not panel.series:
        raise InvalidInput("nothing to draw", where=where, expected="at least one series")
    for scale in (panel.xscale, panel.yscale):
        if scale not in ("linear", "log"):
            raise InvalidInput("an unknown scale", where=where, expected="linear or log", received=scale)
    axes.set_xscale(panel.xscale)
    axes.set_yscale(panel.yscale)
    palette = list(COLOURS.values())
    drawn = []
    for number, series in enumerate(panel.series):
        here = f"{where}, {series.label or f'series {number + 1}'}"
        if series.style not in LINES or (series.colour and series.colour not in COLOURS):
            known = ", ".join([*LINES, *COLOURS])
            raise InvalidInput(
                "an unknown style or colour", where=here, expected=known, received=series.style
            )
        x = _vector(here, series.x)
        y = _vector(here, series.y, len(x))
        if (panel.xscale == "log" and x.min() <= 0) or (panel.yscale == "log" and y.min() <= 0):
            raise InvalidInput("numbers without a logarithm on a logarithmic axis", where=here)
        colour = COLOURS[series.colour] if series.colour else palette[number % len(palette)]
        if series.spread is not None:
            low, high = _band(here, y, series.spread)
            axes.fill_between(x, low, high, color=colour, alpha=0.16, linewidth=0)
        marker = "o" if series.style == "points" else "none"
        axes.plot(
            x,
            y,
            linestyle=LINES[series.style],
            marker=marker,
            ms=3.2,
            color=colour,
            label=series.label or None,
        )
        drawn.append((x, y))
    axes.margins(x=0.03 if any(s.style == "points" for s in panel.series) else 0.0, y=0.06)
    axes.set(xlabel=panel.xlabel, ylabel=panel.ylabel)
    axes.set_title(panel.title, loc="left", fontsize=9, pad=4)
    if panel.xlim:
        axes.set_xlim(*panel.xlim)
    if panel.ylim:
        axes.set_ylim(*panel.ylim)
    if panel.xticks is not None:
        axes.set_xticks(list(panel.xticks))
    for axis, value, label in panel.references:
        _reference(axes, axis, value, label, drawn, where)
    if panel.annotation:
        _annotate(axes, panel.annotation, drawn)


def _band(
    where: str, y: np.ndarray, spread: np.ndarray | tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(spread, tuple):
        low, high = (_vector(f"{where}, spread", side, len(y)) for side in spread)
    else:
        half = _vector(f"{where}, spread", spread, len(y))
        low, high = y - half, y + half
    if (low > high).any():
        raise InvalidInput("a spread that is negative", where=where)
    return low, high


def _in_axes(axes: Axes, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Data as fractions of the axes, (N, 2); lines are filled in between their points."""
    data = axes.transData.transform(np.stack([x, y], axis=-1))
    places = axes.transAxes.inverted().transform(data)
    fine = np.linspace(0, len(places) - 1, max(len(places), 200))
    return np.stack([np.interp(fine, np.arange(len(places)), places[:, k]) for k in (0, 1)], axis=-1)


def _annotate(axes: Axes, words: str, drawn: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """Words in the corner that is farthest from the data."""
    data = np.concatenate([_in_axes(axes, x, y) for x, y in drawn])
    corners = [(0.97, 0.06), (0.97, 0.94), (0.03, 0.06), (0.03, 0.94)]
    middles = [np.array([0.8 if right > 0.5 else 0.2, up]) for right, up in corners]
    free = [float(np.abs(data - middle).max(axis=1).min()) for middle in middles]
    right, up = corners[int(np.argmax(free))]
    axes.text(
        right,
        up,
        words,
        transform=axes.transAxes,
        ha="right" if right > 0.5 else "left",
        va="top" if up > 0.5 else "bottom",
        fontsize=8,
    )


def _reference(
    axes: Axes, axis: str, value: float, label: str, drawn: list[tuple[np.ndarray, np.ndarray]], where: str
) -> None:
    """A thin line, with its words at the end that lies farther from the data."""
    if axis not in ("x", "y"):
        raise InvalidInput("a reference on an unknown axis", where=where, expected="x or y", received=axis)
    line: dict[str, Any] = {"color": COLOURS["grey"], "lw": 0.7, "linestyle": (0, (1, 1.6)), "zorder": 0.5}
    along = 0 if axis == "x" else 1  # which coordinate of the axes the value is
    (axes.axvline if axis == "x" else axes.axhline)(value, **line)
    corner = np.array([axes.get_xlim()[0], axes.get_ylim()[0]])
    corner[along] = value
    at = float(_in_axes(axes, corner[:1], corner[1:])[0, along])
    data = np.concatenate([_in_axes(axes, x, y) for x, y in drawn])
    near = data[np.abs(data[:, along] - at) < 0.12][:, 1 - along]
    ends = (0.05, 0.95) if axis == "x" else (0.14, 0.86)
    gaps = [float(np.abs(near - end).min()) if near.size else 1.0 for end in ends]
    far = gaps[1] >= gaps[0]  # the upper, or the right end
    inward = at < 0.7  # words after the line, or before it where room runs out
    style: dict[str, Any] = {"transform": axes.transAxes, "fontsize": 8, "color": "#404040"}
    if axis == "x":
        place = (at + (0.012 if inward else -0.012), 0.96 if far else 0.04)
        axes.text(*place, label, ha="left" if inward else "right", va="top" if far else "bottom", **style)
    else:
        place = (0.985 if far else 0.015, at + (0.015 if at < 0.9 else -0.015))
        axes.text(*place, label, ha="right" if far else "left", va="bottom" if at < 0.9 else "top", **style)


def _legend(axes: Axes, entries: int) -> None:
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=min(entries, 4),
        frameon=False,
        borderaxespad=0.1,
        borderpad=0.2,
        handlelength=2.4,
        columnspacing=1.2,
    )
