"""Motions side by side: what a camera saw, its reconstruction from other views, and whole trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.palette import hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.stick_figures import Bones, add_bones, bone_pairs
from pipeline.scenes import MotionBlock
from pipeline.validation import InvalidInput, require_finite, require_shape

_NAMES_WIDTH, _BLOCK_WIDTH, _STRIP_HEIGHT, _TITLE_HEIGHT = 0.62, 3.05, 0.8, 0.26
"""Inches: the column with names of views, a block, a row of skeletons, the title of a block."""

_INSTANTS_SHARE = 0.76
"""Share of a block's width for the instants; the rest is for whole trajectories."""

_TRUTH: dict[str, Any] = {"colour": "original", "width": look.BONE_WIDTHS["faint"]}
_CONFIDENCE = {
    "green": ("decided", "decided"),
    "amber": ("in_doubt", "in doubt"),
    "red": ("undecided", "as good as its mirror"),
}
"""Confidence in a limb → its colour, and what the legend says."""

_TRAJECTORIES = ("purple", "sky", "blue", "orange")


def draw_motions(
    path_stem: Path,
    rows: Sequence[Sequence[MotionBlock]],
    bones: Bones,
    *,
    views: Sequence[str],
    caption: str = "",
) -> None:
    """Draw rows of blocks into ``path_stem.svg`` and ``path_stem.png``; each block has a scale of its own.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    rows : sequence of sequences of MotionBlock
        From the top; all with as many blocks.
    bones : sequence of (int, int)
        Pairs of joints.
    views : sequence of str
        Names of the V other views.
    caption : str

    Raises
    ------
    InvalidInput
        If there is nothing to draw, rows differ in length, a confidence is unknown, or numbers are not finite.
    """
    _check(str(path_stem), rows, bones, len(views))
    across, strips = len(rows[0]), 1 + len(views)
    with look.applied_style():
        width = _NAMES_WIDTH + _BLOCK_WIDTH * across
        height = len(rows) * (strips * _STRIP_HEIGHT + _TITLE_HEIGHT) + look.LEGEND_LINE
        figure = look.new_figure(width, height)
        parts = [_BLOCK_WIDTH * _INSTANTS_SHARE, _BLOCK_WIDTH * (1 - _INSTANTS_SHARE)]
        grid = figure.add_gridspec(
            len(rows) * strips,
            1 + 2 * across,
            width_ratios=[_NAMES_WIDTH, *parts * across],
            hspace=0.0,
            wspace=0.0,
        )
        for r, row in enumerate(rows):
            for s, name in enumerate(("image", *views)):  # the names stand once, on the left
                words = figure.add_subplot(grid[r * strips + s, 0])
                words.set_axis_off()
                words.text(0.0, 0.5, name.replace(" ", "\n"), va="center", fontsize=look.CAPTION_SIZE)
            for c, block in enumerate(row):
                for s in range(strips):
                    axes = figure.add_subplot(grid[r * strips + s, 1 + 2 * c])
                    _draw_strip(axes, block, s, bones)
                    if not s:
                        axes.set_title(block.title, fontsize=look.NOTE_SIZE, pad=3)
                _draw_paths(figure.add_subplot(grid[r * strips + 1 : (r + 1) * strips, 2 + 2 * c]), block)
        handles = [look.legend_handle("truth", hex_colour(_TRUTH["colour"]), width=_TRUTH["width"])]
        handles += [
            look.legend_handle(words, hex_colour(of), width=look.BONE_WIDTHS["strong"])
            for of, words in _CONFIDENCE.values()
        ]
        header = look.legend_above_figure(figure, handles)
        look.finish(figure, path_stem, caption, header=header)


def _draw_strip(axes: Axes, block: MotionBlock, strip: int, bones: Bones) -> None:
    """Draw skeletons of one view at every instant, side by side, each over its own middle."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    bodies = [block.image] if not strip else [block.truth[strip - 1], block.reconstruction[strip - 1]]
    # Both are moved by the truth's middle, so that they stay as they lie to one another.
    middle = np.nanmean(bodies[0], axis=1, keepdims=True)
    moved = [body - middle for body in bodies]
    count = len(bodies[0])
    reach = np.nanmax(np.abs(np.concatenate(moved)), axis=(0, 1))
    tall = 2.08 * float(reach[1])
    # The strip is filled: wide postures make all of them smaller, narrow ones stand farther apart.
    step = max(1.9 * float(reach[0]), tall * _BLOCK_WIDTH * _INSTANTS_SHARE / (_STRIP_HEIGHT * count))
    shift = np.stack([step * np.arange(count), np.zeros(count)], axis=-1)[:, None]
    add_bones(axes, moved[0] + shift, bones, **_TRUTH)
    for level, (of, _) in _CONFIDENCE.items():
        chosen = [bone for bone, its in zip(bones, block.confidence, strict=True) if its == level]
        if strip and chosen:
            add_bones(axes, moved[1] + shift, chosen, colour=of, width=look.BONE_WIDTHS["strong"])
    axes.set_xlim(-0.5 * step, (count - 0.5) * step)
    axes.set_ylim(-0.5 * tall, 0.5 * tall)


def _draw_paths(axes: Axes, block: MotionBlock) -> None:
    """Draw whole trajectories, the true ones thin and black."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    for number, (true, path) in enumerate(zip(block.paths_true, block.paths, strict=True)):
        of = hex_colour(_TRAJECTORIES[number % len(_TRAJECTORIES)])
        axes.plot(*path.T, color=of, linewidth=look.PATH_WIDTHS["reconstructed"])
        axes.plot(*true.T, color=hex_colour("original"), linewidth=look.PATH_WIDTHS["true"])
    axes.margins(0.06)


def _check(where: str, rows: Sequence[Sequence[MotionBlock]], bones: Bones, views: int) -> None:
    if not rows or not rows[0] or len({len(row) for row in rows}) > 1:
        raise InvalidInput("nothing to draw", where=where, expected="rows of as many blocks, at least one")
    for block in [block for row in rows for block in row]:
        here = f"{where}, {block.title}"
        instants, joints = require_shape(f"{here}, image", block.image, ("I", "J", 2)).shape[:2]
        bone_pairs(here, bones, joints)
        for name in ("truth", "reconstruction"):
            array = require_shape(f"{here}, {name}", getattr(block, name), (views, instants, joints, 2))
            require_finite(f"{here}, {name}", array)
        paths = require_shape(f"{here}, paths_true", block.paths_true, ("P", "F", 2)).shape
        for name in ("paths", "paths_true"):
            require_finite(f"{here}, {name}", require_shape(f"{here}, {name}", getattr(block, name), paths))
        if len(block.confidence) != len(bones) or not set(block.confidence) <= set(_CONFIDENCE):
            raise InvalidInput(
                "no confidence for every bone",
                where=here,
                expected=f"{len(bones)} of {', '.join(_CONFIDENCE)}",
            )
        if not instants or not np.isfinite(block.image).all(axis=2).any(axis=1).all():
            raise InvalidInput("an instant at which the camera saw nothing", where=here)
