"""Panels of many sequences: every performance of an action as a thin line, and what they have in common.

Part of `pipeline.pictures`, the door to matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pipeline.pictures.style import COLOURS, finish, house_style, new_figure
from pipeline.validation import InvalidInput

LINES: dict[str, Literal["-", "--"]] = {"solid": "-", "dashed": "--"}

WIDTH, LEGEND, HEADING = 7.4, 0.24, 0.2
"""Inches: of the whole figure, at its top for the legend, and of a row of titles."""


@dataclass(frozen=True, kw_only=True)
class Bundle:
    """Sequences that are drawn alike.

    Attributes
    ----------
    sequences : sequence of ((N,), (N,))
        Abscissae and values of each.
    label : str
        For the legend; empty for none.
    colour : str
        One of `COLOURS`.
    style : str
        ``solid`` or ``dashed``.
    width : float
        Of the lines, in points.
    opacity : float
    """

    sequences: Sequence[tuple[np.ndarray, np.ndarray]]
    label: str = ""
    colour: str = "blue"
    style: str = "solid"
    width: float = 0.5
    opacity: float = 1.0


@dataclass(frozen=True, kw_only=True)
class SequencePanel:
    """One pair of axes.

    Attributes
    ----------
    bundles : sequence of Bundle
        The later over the earlier.
    title, xlabel, ylabel : str
    ylim : (float, float), optional
    """

    bundles: Sequence[Bundle]
    title: str = ""
    xlabel: str = ""
    ylabel: str = ""
    ylim: tuple[float, float] | None = None


def sequence_panels(
    path_stem: Path, rows: Sequence[Sequence[SequencePanel]], *, row_height: float = 1.5, caption: str = ""
) -> None:
    """Draw rows of panels into ``path_stem.svg`` and ``path_stem.png``; the panels of a row share their ordinate.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    rows : sequence of sequence of SequencePanel
        From the top; as many panels in each.
    row_height : float
        Inches.
    caption : str

    Raises
    ------
    InvalidInput
        If there is nothing to draw, lengths differ, or numbers are not finite.
    """
    where = str(path_stem)
    if not rows or not rows[0] or any(len(row) != len(rows[0]) for row in rows):
        raise InvalidInput(
            "nothing to draw", where=where, expected="rows of as many panels each, one or more"
        )
    with house_style():
        figure = new_figure(WIDTH, row_height * len(rows) + HEADING + LEGEND)
        for i, row in enumerate(rows):
            first: Axes | None = None
            for j, panel in enumerate(row):
                axes = figure.add_subplot(len(rows), len(row), i * len(row) + j + 1, sharey=first)
                draw_sequences(axes, panel, where)
                if first is not None:
                    axes.tick_params(labelleft=False)
                first = first or axes
        labelled = {b.label: b for row in rows for panel in row for b in panel.bundles if b.label}
        figure.legend(
            handles=legend_entries(list(labelled.values())),
            loc="upper right",
            ncols=max(len(labelled), 1),
            frameon=False,
            borderaxespad=0.2,
            handlelength=2.4,
            columnspacing=1.2,
        )
        finish(figure, path_stem, caption, header=LEGEND)


def legend_entries(bundles: Sequence[Bundle]) -> list[Line2D]:
    """One line for each, wide enough to be told apart."""
    return [
        Line2D(
            [],
            [],
            label=bundle.label,
            color=COLOURS[bundle.colour],
            linestyle=LINES[bundle.style],
            linewidth=max(bundle.width, 0.9),
        )
        for bundle in bundles
    ]


def draw_sequences(axes: Axes, panel: SequencePanel, where: str) -> None:
    """Draw a panel on axes; a InvalidInput, with `where` in it, if it cannot be drawn."""
    for bundle in panel.bundles:
        here = f"{where}, {panel.title or panel.ylabel}, {bundle.label or bundle.colour}"
        if bundle.colour not in COLOURS or bundle.style not in LINES:
            known = ", ".join([*LINES, *COLOURS])
            received = f"{bundle.style}, {bundle.colour}"
            raise InvalidInput("an unknown style or colour", where=here, expected=known, received=received)
        lines = [_checked(x, y, here) for x, y in bundle.sequences]
        if not lines:
            raise InvalidInput("nothing to draw", where=here, expected="one sequence or more")
        axes.add_collection(
            LineCollection(
                lines,
                colors=COLOURS[bundle.colour],
                linestyles=[LINES[bundle.style]],
                linewidths=bundle.width,
                alpha=bundle.opacity,
            )
        )
    axes.autoscale_view()
    axes.margins(x=0.0, y=0.06)
    axes.set(xlabel=panel.xlabel, ylabel=panel.ylabel)
    if panel.ylim:
        axes.set_ylim(*panel.ylim)
    axes.set_title(panel.title, loc="left", fontsize=9, pad=4)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def _checked(x: np.ndarray, y: np.ndarray, where: str) -> np.ndarray:
    """Points (N, 2) of one sequence."""
    points = [np.asarray(values, dtype=float) for values in (x, y)]
    if points[0].ndim != 1 or points[0].shape != points[1].shape or not points[0].size:
        shapes = f"{points[0].shape}, {points[1].shape}"
        raise InvalidInput(
            "a sequence of the wrong shape", where=where, expected="(N,), (N,)", received=shapes
        )
    if not np.isfinite(points).all():
        raise InvalidInput("a sequence with numbers that are not finite", where=where)
    return np.stack(points, axis=-1)
