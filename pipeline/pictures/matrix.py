"""Picture of a matrix as a heat map, with a path over it and charts to the right of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.lines import Line2D

from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.charts import add_charts
from pipeline.scenes import HeatMap

_HEIGHT = 3.4
"""Height of the picture without the legend, inches."""


def draw_heat_map(canvas: look.Canvas, matrix: HeatMap) -> None:
    """Draw a heat map with its path, and a column of charts to the right of it.

    Colours follow the square root, so that small misfits can be distinguished.
    """
    count = len(canvas.drawn)
    with look.applied_style():
        figure = canvas.new_figure(look.PAGE_WIDTH + look.FRAME, _HEIGHT + look.LEGEND_LINE)
        grid = figure.add_gridspec(count, 2, width_ratios=[1.15, 1.0])
        axes = figure.add_subplot(grid[:, 0])
        entries = _draw_matrix(axes, matrix)
        places = [grid[number, 1] for number in range(count)]
        entries |= add_charts(figure, canvas, places, 0.4 * figure.get_figwidth())
        look.finish(figure, canvas, entries)


def _draw_matrix(axes: Axes, matrix: HeatMap) -> dict[str, Line2D]:
    """Draw the matrix, its outline and its path; return the entries of the legend."""
    values = np.ma.masked_invalid(matrix.values)
    edges = (matrix.x[0] - 0.5, matrix.x[-1] + 0.5, matrix.y[0] - 0.5, matrix.y[-1] + 0.5)
    image = axes.imshow(
        values,
        origin="lower",
        extent=edges,
        aspect="auto",
        interpolation="nearest",
        cmap=look.MATRIX_COLOURS,
        norm=PowerNorm(0.5, vmin=0.0, vmax=values.max()),
    )
    closed = np.concatenate([matrix.outline, matrix.outline[:1]])
    lines: list[tuple[str, Any, str, float]] = [
        (matrix.outline_label, closed.T, "reference", look.OUTLINE_WIDTH),
        (matrix.path_label, (matrix.x, matrix.path), "optimal_path", look.PATH_OVER_MATRIX_WIDTH),
    ]
    drawn = [axes.plot(*points, color=hex_colour(colour), lw=width)[0] for _, points, colour, width in lines]
    # A white rim separates the path from matrix colours that are as dark.
    rim = patheffects.Stroke(linewidth=2 * look.PATH_OVER_MATRIX_WIDTH, foreground="white")
    drawn[-1].set_path_effects([rim, patheffects.Normal()])
    axes.set(xlabel=matrix.xlabel, ylabel=matrix.ylabel, xlim=edges[:2], ylim=edges[2:], title=matrix.title)
    axes.figure.colorbar(image, ax=axes, label=matrix.bar, pad=0.02, aspect=28)
    return {
        label: look.legend_handle(label, hex_colour(colour), width=width)
        for label, _, colour, width in reversed(lines)
    }
