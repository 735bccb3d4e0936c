"""Rows of skeletons, each about one posture: that posture first, then others drawn over its shadow.

Part of `pipeline.pictures`, the door to matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from pipeline.pictures.style import COLOURS, finish, house_style, new_figure
from pipeline.validation import InvalidInput

WIDTH = 7.2
"""Inches of a figure."""

TALLEST = 1.3
"""Inches of a skeleton at most."""

LEGEND = 0.24
"""Inches at the top of the figure."""


@dataclass(frozen=True, kw_only=True)
class SkeletonRow:
    """One posture (J, 2) and others (n, J, 2) beside it, mm, the second axis up.

    Attributes
    ----------
    label : str
        Above the row.
    centre : (J, 2) float
    others : (n, J, 2) float
    """

    label: str
    centre: np.ndarray
    others: np.ndarray


def skeletons(
    path_stem: Path,
    rows: Sequence[SkeletonRow],
    bones: Sequence[tuple[int, int]],
    *,
    legend: tuple[str, str],
    caption: str = "",
) -> None:
    """Draw rows of skeletons into ``path_stem.svg`` and ``path_stem.png``, all at one scale, on a line for the floor.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    rows : sequence of SkeletonRow
        From the top; all with as many postures.
    bones : sequence of (int, int)
        Pairs of joints.
    legend : (str, str)
        What the first posture of a row is, and what the others are.
    caption : str

    Raises
    ------
    InvalidInput
        If there is nothing to draw, shapes differ, or numbers are not finite.
    """
    bodies = _checked(str(path_stem), rows, bones)
    low, tops = float(min(0.0, bodies[..., 1].min())), bodies[..., 1].max(axis=(1, 2))
    left, right = float(bodies[..., 0].min()), float(bodies[..., 0].max())
    count = bodies.shape[1]
    step = 1.04 * (right - left)
    # Inches per millimetre, one scale for all.
    inches = min((WIDTH - 0.2) / (count * step), TALLEST / float(tops.max() - low))
    head, foot = 0.24 / inches, 0.03 / inches
    heights = inches * (tops + head - low + foot)
    with house_style():
        figure = new_figure(
            max(inches * count * step + 0.2, 3.6), float(heights.sum()) + 0.1 * len(rows) + LEGEND
        )
        grid = figure.add_gridspec(len(rows), 1, height_ratios=heights)
        for number, (row, body, high) in enumerate(zip(rows, bodies, tops, strict=True)):
            axes = figure.add_subplot(grid[number])
            axes.set_axis_off()
            axes.set_aspect("equal")
            axes.set_xlim(left, left + count * step)
            axes.set_ylim(low - foot, high + head)
            axes.text(left, high + head, row.label, va="top", fontsize=9)
            axes.axhline(0.0, color=COLOURS["grey"], linewidth=0.4)
            for place in range(count):
                if place:
                    _draw(axes, body[0], bones, place * step, "grey", 0.7)
                _draw(axes, body[place], bones, place * step, "blue" if place else "black", 1.2)
        proxies = [
            Line2D([], [], color=COLOURS[colour], linewidth=width, label=name)
            for colour, width, name in (
                ("black", 1.2, legend[0]),
                ("blue", 1.2, legend[1]),
                ("grey", 0.7, f"{legend[0]}, to compare"),
            )
        ]
        figure.legend(handles=proxies, loc="upper right", ncols=3, frameon=False, borderaxespad=0.2)
        finish(figure, path_stem, caption, header=LEGEND)


def _draw(
    axes: Axes, body: np.ndarray, bones: Sequence[tuple[int, int]], shift: float, colour: str, width: float
) -> None:
    strips = body[np.asarray(bones)] + [shift, 0.0]
    lines = LineCollection(list(strips), colors=COLOURS[colour], linewidths=width, capstyle="round")
    axes.add_collection(lines, autolim=False)


def _checked(where: str, rows: Sequence[SkeletonRow], bones: Sequence[tuple[int, int]]) -> np.ndarray:
    """(rows, 1 + n, J, 2), once all rows fit one another and the bones."""
    if not rows:
        raise InvalidInput("nothing to draw", where=where, expected="at least one row")
    joints = len(np.asarray(rows[0].centre))
    shape = (len(rows[0].others), joints, 2)
    for row in rows:
        given = np.shape(row.centre), np.shape(row.others)
        if given != (shape[1:], shape):
            raise InvalidInput(
                "postures of the wrong shape",
                where=f"{where}, {row.label}",
                expected=f"{shape[1:]} and {shape}",
                received=f"{given[0]} and {given[1]}",
            )
    pairs = np.asarray(bones)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.min() < 0 or pairs.max() >= joints:
        raise InvalidInput("bones that are not pairs of joints", where=where, expected=f"0…{joints - 1}")
    bodies = np.stack([np.concatenate([[r.centre], r.others]) for r in rows]).astype(float)
    if not np.isfinite(bodies).all():
        raise InvalidInput("positions that are not finite", where=where)
    return bodies
