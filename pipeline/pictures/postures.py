"""Rows of stick figures: originals as broad light lines, reconstructions as thin lines over the originals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.stick_figures import RING_SIZE, Bones, add_bones, add_rings
from pipeline.scenes import PostureRow
from pipeline.validation import require_finite

_LOOKS: tuple[dict[str, Any], ...] = (
    {"colour": "silver", "width": look.BONE_WIDTHS["broad"]},
    {"colour": "reconstruction", "width": look.BONE_WIDTHS["usual"]},
)
"""Line styles of the original and the reconstruction. Both lines stay visible where they overlap."""

_GROUP_WIDTH, _MAX_ROW_HEIGHT = 3.5, 1.35
"""Largest width of a group of posture rows, and largest height of a row, inches."""


def draw_postures(
    canvas: look.Canvas, groups: Sequence[tuple[str, Sequence[PostureRow]]], bones: Bones
) -> None:
    """Draw groups of rows of stick figures; the groups are side by side.

    All figures have one scale.  The original and the reconstruction of a posture share one origin, so that a
    displacement is visible.

    Parameters
    ----------
    canvas : Canvas
    groups : sequence of (str, sequence of PostureRow)
        Title of a group, e.g. ``"(a) Approach I"``, and its rows from the top.
    bones : sequence of (int, int)
        Pairs of joints.

    Raises
    ------
    InvalidInput
        If a posture has numbers that are not finite.
    """
    all_rows = [row for _, rows in groups for row in rows]
    figures = [_centred(row) for row in all_rows]
    count = len(all_rows[0].original)
    reach = max(np.abs(f[..., 0]).max() for f in figures)
    low, high = (pick([pick(f[..., 1]) for f in figures]) for pick in (np.min, np.max))
    # Neighbours may overlap a little.  Half a step is then less than the reach, so the ends get the full reach.
    step, drop = max(1.8 * reach, 0.45 * (high - low)), 1.12 * (high - low)
    end = max(0.5 * step, 1.02 * reach)
    names = 0.12 + 0.065 * max(len(row.label) for row in all_rows)  # inches of the labels on the left
    wide = min(_GROUP_WIDTH, look.MAX_WIDTH / len(groups) - 0.1)
    inches = min(
        (wide - names) / ((count - 1) * step + 2 * end), _MAX_ROW_HEIGHT / drop
    )  # per millimetre, the same for all figures
    deepest, margin = max(len(rows) for _, rows in groups), names / inches
    with look.applied_style():
        width, height = names + inches * ((count - 1) * step + 2 * end), inches * deepest * drop
        figure = canvas.new_figure((width + 0.1) * len(groups), height + 0.2 + look.LEGEND_LINE)
        for number, (title, rows) in enumerate(groups):
            axes = figure.add_subplot(1, len(groups), number + 1)
            axes.set_axis_off()
            axes.set_aspect("equal")
            axes.set_xlim(-end - margin, (count - 1) * step + end)
            axes.set_ylim(low + 0.94 * (high - low) + 0.08 * drop - deepest * drop, high + 0.02 * drop)
            axes.set_title(title, pad=5)
            for i, row in enumerate(rows):
                axes.text(-end - margin, 0.5 * (low + high) - i * drop, row.label, va="center")
                shift = np.column_stack([step * np.arange(count), np.full(count, -i * drop)])[:, None]
                for which in (0, 1):
                    bodies, figure_look = _centred(row)[which] + shift, _LOOKS[which]
                    add_bones(axes, bodies, bones, **figure_look)
                    if row.estimated is not None and row.estimated.any():
                        add_rings(
                            axes,
                            bodies,
                            row.estimated,
                            colour=figure_look["colour"],
                            width=figure_look["width"],
                        )
        entries = {
            name: look.legend_handle(name, hex_colour(figure_look["colour"]), width=figure_look["width"])
            for name, figure_look in zip(("original", "reconstructed"), _LOOKS, strict=True)
        }
        if any(row.estimated is not None and row.estimated.any() for row in all_rows):
            entries |= {(ring := "joint that was not measured"): look.ring_handle(ring, RING_SIZE)}
        look.finish(figure, canvas, entries)


def _centred(row: PostureRow) -> np.ndarray:
    """Return original and reconstructed postures of a row, (2, n, J, 2), each pair centred horizontally.

    Each pair of postures is centred on the horizontal mean of its original.
    """
    pair = require_finite(f"postures {row.label}", np.stack([row.original, row.reconstructed]).astype(float))
    pair[..., 0] -= pair[0, :, :, 0].mean(axis=-1)[:, None]
    return pair
