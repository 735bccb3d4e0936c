"""Rows of skeletons: the central posture, then each of the other postures over the central posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.stick_figures import Bones, add_bones
from pipeline.scenes import SkeletonRow
from pipeline.validation import require_finite

_MAX_HEIGHT = 2.2
"""Largest height of a skeleton, inches."""

_MIN_WIDTH = 3.6
"""Smallest width of the picture, inches: the width of its legend."""


def draw_skeletons(
    canvas: look.Canvas, rows: Sequence[SkeletonRow], bones: Bones, *, legend: tuple[str, str]
) -> None:
    """Draw rows of skeletons, all at the same scale, on a ground line.

    Parameters
    ----------
    canvas : Canvas
    rows : sequence of SkeletonRow
        Rows from the top, all with the same number of postures.
    bones : sequence of (int, int)
        Pairs of joints.
    legend : (str, str)
        Names of a row's central posture and of the other postures.

    Raises
    ------
    InvalidInput
        If a skeleton has numbers that are not finite.
    """
    bodies = np.stack(
        [require_finite(f"skeletons {row.label}", np.stack([row.centre, *row.others])) for row in rows]
    )
    low, tops = min(0.0, bodies[..., 1].min()), bodies[..., 1].max(axis=(1, 2))
    left, right = bodies[..., 0].min(), bodies[..., 0].max()
    count, step = bodies.shape[1], 1.04 * (right - left)
    # Inches per millimetre, the same for all skeletons.
    inches = min((look.PAGE_WIDTH - look.FRAME) / (count * step), _MAX_HEIGHT / (tops.max() - low))
    head, foot = 0.24 / inches, 0.03 / inches
    heights = inches * (tops + head - low + foot)
    looks = (("silver", look.BONE_WIDTHS["broad"]), ("reconstruction", look.BONE_WIDTHS["strong"]))
    with look.applied_style():
        width = max(inches * count * step + 2 * look.FRAME, _MIN_WIDTH)
        figure = canvas.new_figure(width, heights.sum() + look.FRAME * len(rows) + look.LEGEND_LINE)
        grid = figure.add_gridspec(len(rows), 1, height_ratios=heights)
        for number, (row, body, high) in enumerate(zip(rows, bodies, tops, strict=True)):
            axes = figure.add_subplot(grid[number])
            axes.set_axis_off()
            axes.set_aspect("equal")
            axes.set_xlim(left, left + count * step)
            axes.set_ylim(low - foot, high + head)
            axes.text(left, high + head, row.label, va="top", fontsize=look.TITLE_SIZE)
            axes.axhline(0.0, color=hex_colour("reference"), linewidth=look.BONE_WIDTHS["ground"])
            shift = np.column_stack([step * np.arange(count), np.zeros(count)])[:, None]
            for bodies_of_row, (colour, thick) in zip(
                (body[:1] + shift, body[1:] + shift[1:]), looks, strict=True
            ):
                add_bones(axes, bodies_of_row, bones, colour=colour, width=thick)
        entries = {
            name: look.legend_handle(name, hex_colour(colour), width=thick)
            for name, (colour, thick) in zip(legend, looks, strict=True)
        }
        look.finish(figure, canvas, entries)
