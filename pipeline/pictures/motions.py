"""Picture of one filmed motion: camera images, reconstructions from the side, a plan from above, and error charts."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.charts import add_charts
from pipeline.pictures.stick_figures import Bones, add_bones
from pipeline.scenes import MotionScene
from pipeline.validation import require_finite

_STRIP_WIDTH, _STRIP_HEIGHT, _CHARTS_HEIGHT = 5.0, 1.3, 1.5
"""Width and height of a row of skeletons, and height of the charts below all rows of skeletons, inches."""

_NAMES_WIDTH = 1.0
"""Width, inches, for the names of the rows in the charts."""

_SCALE_MM = 1000.0
"""Length of the scale bar of the plan from above, mm."""

_TRUTH: dict[str, Any] = {"colour": "silver", "width": look.BONE_WIDTHS["broad"]}
"""Colour and line width of the skeletons of the ground truth."""


def draw_motion(canvas: look.Canvas, scene: MotionScene, bones: Bones) -> None:
    """Draw a motion as rows of skeletons at the same scale, with charts side by side below the rows.

    Parameters
    ----------
    canvas : Canvas
    scene : MotionScene
    bones : sequence of (int, int)
        Pairs of joints.

    Raises
    ------
    InvalidInput
        If a skeleton of the rows is not finite.
    """
    rows = [("what the camera saw", scene.image, None, "original"), *scene.rows]
    with look.applied_style():
        heights = [*[_STRIP_HEIGHT] * len(rows), _CHARTS_HEIGHT]
        figure = canvas.new_figure(look.PAGE_WIDTH, sum(heights) + look.LEGEND_LINE)
        shares = [_STRIP_WIDTH, look.PAGE_WIDTH - _STRIP_WIDTH]
        halves = figure.add_gridspec(2, 1, height_ratios=[sum(heights[:-1]), heights[-1]])
        grid = halves[0].subgridspec(len(rows), 2, width_ratios=shares, hspace=0.02, wspace=0.02)
        for number, (label, body, truth, colour) in enumerate(rows):
            axes = figure.add_subplot(grid[number, 0])
            axes.set_title(label, fontsize=look.NOTE_SIZE, pad=1)
            _draw_strip(axes, body, truth, bones, colour)
        _draw_plan(figure.add_subplot(grid[:, 1]), scene)
        errors = halves[1].subgridspec(1, len(canvas.drawn))
        width = (figure.get_figwidth() - _NAMES_WIDTH) / len(canvas.drawn)
        entries = add_charts(figure, canvas, errors, width)
        truth_entry = look.legend_handle("truth", hex_colour(_TRUTH["colour"]), width=_TRUTH["width"])
        look.finish(figure, canvas, {"truth": truth_entry, **entries})


def _draw_strip(axes: Axes, body: np.ndarray, truth: np.ndarray | None, bones: Bones, colour: str) -> None:
    """Draw the skeletons at all instants side by side, over the skeletons of the ground truth.

    Each skeleton is centred on the mean of the ground truth at its instant.
    """
    axes.set_axis_off()
    axes.set_aspect("equal")
    middle = np.nanmean(body if truth is None else truth, axis=1, keepdims=True)
    bodies = (
        [body - middle]
        if truth is None
        else [require_finite("a motion", motion) - middle for motion in (truth, body)]
    )
    across, up = np.nanmax(np.abs(np.concatenate(bodies)), axis=(0, 1))
    tall = 2.1 * up
    # The skeletons fill the strip: wide postures make all of them smaller, narrow ones increase their spacing.
    step = max(1.9 * across, tall * _STRIP_WIDTH / (_STRIP_HEIGHT * len(body)))
    shift = np.column_stack([step * np.arange(len(body)), np.zeros(len(body))])[:, None]
    if truth is not None:
        add_bones(axes, bodies[0] + shift, bones, **_TRUTH)
    add_bones(axes, bodies[-1] + shift, bones, colour=colour, width=look.BONE_WIDTHS["strong"])
    axes.set_xlim(-0.5 * step, (len(body) - 0.5) * step)
    axes.set_ylim(-0.5 * tall, 0.5 * tall)


def _draw_plan(axes: Axes, scene: MotionScene) -> None:
    """Draw the body's path and the cameras from above, with a scale bar.

    Each camera has its path, and the position and the field of view in the middle of this path.
    """
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_title("from above", fontsize=look.NOTE_SIZE, pad=1)
    broad: dict[str, Any] = {"color": hex_colour("silver"), "linewidth": 1.6 * look.BONE_WIDTHS["broad"]}
    axes.plot(*scene.ground.T, solid_capstyle="round", **broad)
    for number, (label, colour, path, footprint) in enumerate(scene.cameras):
        stroke = hex_colour(colour)
        axes.plot(*path.T, color=stroke, linewidth=look.LINE_WIDTH)
        axes.fill(*footprint.T, color=stroke, alpha=look.BAND_OPACITY, linewidth=0)
        axes.plot(*footprint[0], marker="o", color=stroke, linestyle="none")
        # A moving camera is labelled at an end of its path, alternately first and last.
        label_position = footprint[0] if np.ptp(path, axis=0).max() < 1.0 else path[-(number % 2)]
        axes.annotate(
            label, label_position, (8, 6), textcoords="offset points", color=stroke, fontsize=look.SMALL_SIZE
        )
    left, low = np.min([part.min(axis=0) for _, _, *parts in scene.cameras for part in parts], axis=0)
    ends = np.array([[left, low], [left + _SCALE_MM, low]]) - [0.0, 0.3 * _SCALE_MM]
    axes.plot(*ends.T, color=look.NOTE_COLOUR, linewidth=look.LINE_WIDTH, solid_capstyle="butt")
    axes.annotate(f"{_SCALE_MM / 1000:g} m", ends.mean(axis=0), (0, -3), textcoords="offset points",
                  ha="center", va="top", color=look.NOTE_COLOUR, fontsize=look.SMALL_SIZE)  # fmt: skip
    axes.margins(0.12)
