"""A matrix as a heat-map with a path through it, and sequences beside it.

Part of `pipeline.pictures`, the door to matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.lines import Line2D

from pipeline.pictures.sequences import WIDTH, SequencePanel, draw_sequences, legend_entries
from pipeline.pictures.style import COLOURS, finish, house_style, new_figure
from pipeline.validation import InvalidInput

HEIGHT, LEGEND = 3.4, 0.24
"""Inches."""

PATH, OUTLINE = "orange", "grey"


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """A matrix over two axes of whole numbers.

    Attributes
    ----------
    values : (R, C) float
        One row to each ordinate; NaN is left white.
    x, y : (C,) and (R,) int
        Abscissae and ordinates of the cells, increasing by one.
    path : (C,) int
        Ordinate of the path at each abscissa.
    outline : (K, 2) float
        Corners of what is admissible, closed by itself.
    title, xlabel, ylabel, bar : str
        `bar` is beside the scale of colours.
    path_label, outline_label : str
    """

    values: np.ndarray
    x: np.ndarray
    y: np.ndarray
    path: np.ndarray
    outline: np.ndarray
    title: str
    xlabel: str
    ylabel: str
    bar: str
    path_label: str
    outline_label: str


def heat_map(path_stem: Path, matrix: HeatMap, beside: Sequence[SequencePanel], *, caption: str = "") -> None:
    """Draw a heat-map with its path, and panels above one another beside it, into ``path_stem.svg`` and ``.png``.

    Colours go by the square root, so that small misfits are told apart.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    matrix : HeatMap
    beside : sequence of SequencePanel
        From the top.
    caption : str

    Raises
    ------
    InvalidInput
        If shapes do not fit, or there is nothing finite or negative values to draw.
    """
    where = str(path_stem)
    values = np.asarray(matrix.values, dtype=float)
    fits = values.shape == (len(matrix.y), len(matrix.x)) and len(matrix.path) == len(matrix.x)
    if not fits or not beside or not np.isfinite(values).any() or np.nanmin(values) < 0:
        raise InvalidInput(
            "no matrix with a path and panels beside it",
            where=where,
            expected="values of 0 or more (R, C), a path (C,) and one panel or more",
            received=f"{values.shape}, path of {len(matrix.path)}, {len(beside)} panels",
        )
    with house_style():
        figure = new_figure(WIDTH, HEIGHT + LEGEND)
        grid = figure.add_gridspec(len(beside), 2, width_ratios=[1.15, 1.0])
        axes = figure.add_subplot(grid[:, 0])
        handles = _draw_matrix(axes, matrix, np.ma.masked_invalid(values))
        for number, panel in enumerate(beside):
            draw_sequences(figure.add_subplot(grid[number, 1]), panel, where)
        labelled = {bundle.label: bundle for panel in beside for bundle in panel.bundles if bundle.label}
        handles += legend_entries(list(labelled.values()))
        figure.legend(
            handles=handles, loc="upper right", ncols=len(handles), frameon=False, borderaxespad=0.2
        )
        finish(figure, path_stem, caption, header=LEGEND)


def _draw_matrix(axes: Axes, matrix: HeatMap, values: np.ma.MaskedArray) -> list[Line2D]:
    """Draw the matrix, its outline and its path; the lines for the legend."""
    edges = (matrix.x[0] - 0.5, matrix.x[-1] + 0.5, matrix.y[0] - 0.5, matrix.y[-1] + 0.5)
    image = axes.imshow(
        values,
        origin="lower",
        extent=edges,
        aspect="auto",
        interpolation="nearest",
        cmap="viridis",
        norm=PowerNorm(0.5, vmin=0.0, vmax=float(values.max())),
    )
    closed = np.concatenate([matrix.outline, matrix.outline[:1]])
    outline = axes.plot(*closed.T, color=COLOURS[OUTLINE], lw=0.9, label=matrix.outline_label)
    # A white rim keeps the path apart from colours as dark as its own.
    rim = [patheffects.Stroke(linewidth=3.2, foreground="white"), patheffects.Normal()]
    path = axes.plot(
        matrix.x, matrix.path, color=COLOURS[PATH], lw=1.6, label=matrix.path_label, path_effects=rim
    )
    axes.set(xlabel=matrix.xlabel, ylabel=matrix.ylabel, xlim=edges[:2], ylim=edges[2:])
    axes.set_title(matrix.title, loc="left", fontsize=9, pad=4)
    axes.figure.colorbar(image, ax=axes, label=matrix.bar, pad=0.02, aspect=28)
    return [Line2D([], [], label=line.get_label(), color=line.get_color(), lw=1.4) for line in path + outline]
