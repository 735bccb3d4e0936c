"""Rows of stick figures: original postures dashed, reconstructed postures solid.

Part of `pipeline.pictures`, the door to matplotlib.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from pipeline.pictures.style import finish, house_style, new_figure
from pipeline.validation import InvalidInput

POSTURE_LINES: tuple[dict[str, Any], ...] = (
    {"color": "#000000", "linestyle": (0, (3.2, 1.4)), "linewidth": 0.8},
    {"color": "#0072B2", "linestyle": "-", "linewidth": 1.1},
)
"""How the original and the reconstruction are drawn."""

LEGEND = 0.22
"""Inches at the top of the figure."""


@dataclass(frozen=True, kw_only=True)
class PostureRow:
    """Postures side by side, `original` and `reconstructed`, each (n, J, 2) in mm, the second axis up."""

    label: str
    original: np.ndarray
    reconstructed: np.ndarray


def postures(
    path_stem: Path,
    groups: Sequence[tuple[str, Sequence[PostureRow]]],
    bones: Sequence[tuple[int, int]],
    *,
    column_titles: Sequence[str] = (),
    legend: tuple[str, str] = ("original", "reconstructed"),
    caption: str = "",
) -> None:
    """Draw rows of stick figures, groups side by side, into ``path_stem.svg`` and ``path_stem.png``.

    All figures have one scale; the original and the reconstruction of a posture share one origin, so that
    a displacement is seen as one.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    groups : sequence of (str, sequence of PostureRow)
        Title of a group, e.g. ``"(a) Approach I"``, and its rows from the top.
    bones : sequence of (int, int)
        Pairs of joints.
    column_titles : sequence of str
        One for each posture of a row; empty for none.
    legend : (str, str)
        What the dashed and the solid lines are.
    caption : str

    Raises
    ------
    InvalidInput
        If there is nothing to draw, shapes differ, or numbers are not finite.
    """
    where = str(path_stem)
    count = _check_postures(where, groups, bones)
    if column_titles and len(column_titles) != count:
        raise InvalidInput("not one title for each posture", where=where, expected=str(count))
    every = [row for _, rows in groups for row in rows]
    figures = [_centred(row) for row in every]
    reach = max(float(np.abs(f[..., 0]).max()) for f in figures)
    low, high = (float(pick([pick(f[..., 1]) for f in figures])) for pick in (np.min, np.max))
    # Neighbours may overlap a little; half a step is then less than the reach, so the ends get the reach itself.
    step, drop = max(1.8 * reach, 0.45 * (high - low)), 1.12 * (high - low)
    end = max(0.5 * step, 1.02 * reach)
    names = 0.12 + 0.065 * max(len(row.label) for row in every)  # inches that the labels take on the left
    inches = min(
        (3.5 - names) / ((count - 1) * step + 2 * end), 1.35 / drop
    )  # per millimetre, one scale for all
    deepest, margin = max(len(rows) for _, rows in groups), names / inches
    with house_style():
        width, height = names + inches * ((count - 1) * step + 2 * end), inches * deepest * drop
        heading = 0.2 + (0.18 if column_titles else 0.0)
        figure = new_figure((width + 0.1) * len(groups), height + heading + LEGEND)
        for number, (title, rows) in enumerate(groups):
            axes = figure.add_subplot(1, len(groups), number + 1)
            axes.set_axis_off()
            axes.set_aspect("equal")
            axes.set_xlim(-end - margin, (count - 1) * step + end)
            axes.set_ylim(low + 0.94 * (high - low) + 0.08 * drop - deepest * drop, high + 0.02 * drop)
            axes.set_title(title, loc="left", fontsize=9, pad=15 if column_titles else 5)
            for k, name in enumerate(column_titles):
                place = axes.get_xaxis_transform()
                axes.text(k * step, 1.0, name, transform=place, ha="center", va="bottom", fontsize=8)
            for i, row in enumerate(rows):
                axes.text(-end - margin, 0.5 * (low + high) - i * drop, row.label, va="center")
                _stick_figures(axes, _centred(row), np.asarray(bones), step, -i * drop)
        proxies = [
            Line2D([], [], label=name, **line) for name, line in zip(legend, POSTURE_LINES, strict=True)
        ]
        figure.legend(handles=proxies, loc="upper right", ncols=2, frameon=False, borderaxespad=0.2)
        finish(figure, path_stem, caption, header=LEGEND)


def _centred(row: PostureRow) -> np.ndarray:
    """(2, n, J, 2): original and reconstruction, each posture about its original's horizontal mean."""
    pair = np.stack([row.original, row.reconstructed]).astype(float)
    pair[..., 0] -= pair[0, :, :, 0].mean(axis=-1)[:, None]
    return pair


def _stick_figures(axes: Axes, pair: np.ndarray, bones: np.ndarray, step: float, rise: float) -> None:
    """Draw a row of postures, the original over the reconstruction."""
    shift = np.stack([step * np.arange(pair.shape[1]), np.full(pair.shape[1], rise)], axis=-1)
    moved = pair + shift[None, :, None]
    for which in (1, 0):
        strips = moved[which][:, bones].reshape(-1, 2, 2)
        style = {name + "s": value for name, value in POSTURE_LINES[which].items()}
        axes.add_collection(LineCollection(strips, capstyle="round", **style), autolim=False)


def _check_postures(
    where: str, groups: Sequence[tuple[str, Sequence[PostureRow]]], bones: Sequence[tuple[int, int]]
) -> int:
    """The number of postures in every row, once all rows fit one another and the bones."""
    if not groups or not all(rows for _, rows in groups):
        raise InvalidInput("nothing to draw", where=where, expected="at least one row in every group")
    shape = np.shape(groups[0][1][0].original)
    for title, rows in groups:
        for row in rows:
            for which, array in (("original", row.original), ("reconstructed", row.reconstructed)):
                here = f"{where}, {title} {row.label}, {which}"
                a = np.asarray(array, dtype=float)
                if a.ndim != 3 or a.shape[2] != 2 or 0 in a.shape or a.shape != shape:
                    raise InvalidInput(
                        "postures of the wrong shape",
                        where=here,
                        expected=f"(n, J, 2), in every row the same, the first {shape}",
                        received=str(a.shape),
                    )
                if not np.isfinite(a).all():
                    raise InvalidInput("positions that are not finite", where=here)
    pairs = np.asarray(bones)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.min() < 0 or pairs.max() >= shape[1]:
        raise InvalidInput("bones that are not pairs of joints", where=where, expected=f"0…{shape[1] - 1}")
    return int(shape[0])
