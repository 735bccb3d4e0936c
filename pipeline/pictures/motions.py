"""Motions side by side: what a camera saw, what was made of it from other views, and whole trajectories.

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

LEGEND = 0.26
"""Inches at the top of the figure."""

STRIP = 0.8
"""Inches of a row of skeletons."""

BLOCK = 3.05
"""Inches of a block's width."""

_STRIPS = 0.76
"""Part of that width for the instants; the rest is for whole trajectories."""

_LINES = {"truth": ("black", 0.7), "green": ("green", 1.3), "amber": ("amber", 1.3), "red": ("orange", 1.3)}
_TRAJECTORIES = ("purple", "sky", "blue", "orange")


@dataclass(frozen=True, kw_only=True)
class MotionBlock:
    """One clip before one camera.

    Attributes
    ----------
    title : str
    image : (I, J, 2) float
        What the camera saw at I instants, right and up; NaN where it saw nothing.
    truth, reconstruction : (V, I, J, 2) float
        From V other views, mm, the second axis up.
    paths_true, paths : (P, F, 2) float
        Whole trajectories of P joints from the first of these views.
    lights : tuple of str
        ``green``, ``amber`` or ``red`` of each bone.
    """

    title: str
    image: np.ndarray
    truth: np.ndarray
    reconstruction: np.ndarray
    paths_true: np.ndarray
    paths: np.ndarray
    lights: tuple[str, ...]


def motions(
    path_stem: Path,
    rows: Sequence[Sequence[MotionBlock]],
    bones: Sequence[tuple[int, int]],
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
        If there is nothing to draw, rows differ in length, lights are unknown, or numbers are not finite.
    """
    _check(str(path_stem), rows, bones, len(views))
    across, strips = len(rows[0]), 1 + len(views)
    with house_style():
        # The names of the strips stand once, on the left.
        named = 0.62
        width, height = named + BLOCK * across, len(rows) * (strips * STRIP + 0.26) + LEGEND
        figure = new_figure(width, height)
        grid = figure.add_gridspec(
            len(rows) * strips,
            1 + 2 * across,
            width_ratios=[named, *[BLOCK * _STRIPS, BLOCK * (1 - _STRIPS)] * across],
            hspace=0.0,
            wspace=0.0,
        )
        for r, row in enumerate(rows):
            for s, name in enumerate(("image", *views)):
                words = figure.add_subplot(grid[r * strips + s, 0])
                words.set_axis_off()
                words.text(0.0, 0.5, name.replace(" ", "\n"), va="center", fontsize=7.5)
            for c, block in enumerate(row):
                for s in range(strips):
                    axes = figure.add_subplot(grid[r * strips + s, 1 + 2 * c])
                    _strip(axes, block, s, bones)
                    if not s:
                        axes.set_title(block.title, loc="left", fontsize=8.5, pad=3)
                _paths(figure.add_subplot(grid[r * strips + 1 : (r + 1) * strips, 2 + 2 * c]), block)
        names = {"truth": "truth", "green": "decided", "amber": "in doubt", "red": "as good as its mirror"}
        proxies = [
            Line2D([], [], color=COLOURS[colour], linewidth=thickness, label=names[light])
            for light, (colour, thickness) in _LINES.items()
        ]
        figure.legend(handles=proxies, loc="upper right", ncols=4, frameon=False, borderaxespad=0.2)
        finish(figure, path_stem, caption, header=LEGEND)


def _strip(axes: Axes, block: MotionBlock, strip: int, bones: Sequence[tuple[int, int]]) -> None:
    """Skeletons of one view at every instant, side by side, each over its own middle."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    bodies = [block.image] if not strip else [block.truth[strip - 1], block.reconstruction[strip - 1]]
    # Both are moved by the truth's middle, so that they stay as they lie to one another.
    middle = np.nanmean(bodies[0], axis=1, keepdims=True)
    moved = [body - middle for body in bodies]
    every = np.concatenate(moved)
    reach = np.nanmax(np.abs(every), axis=(0, 1))
    tall = 2.08 * float(reach[1])
    # The strip is filled: wide postures make all of them smaller, narrow ones stand farther apart.
    step = max(1.9 * float(reach[0]), tall * BLOCK * _STRIPS / (STRIP * len(bodies[0])))
    for which, body in enumerate(moved):
        for k, posture in enumerate(body):
            strips = posture[np.asarray(bones)] + [k * step, 0.0]
            lights = ["truth"] * len(strips) if not strip or not which else list(block.lights)
            for light in dict.fromkeys(lights):
                colour, thickness = _LINES[light]
                lines = [line for line, name in zip(strips, lights, strict=True) if name == light]
                axes.add_collection(
                    LineCollection(lines, colors=COLOURS[colour], linewidths=thickness, capstyle="round"),
                    autolim=False,
                )
    axes.set_xlim(-0.5 * step, (len(bodies[0]) - 0.5) * step)
    axes.set_ylim(-0.5 * tall, 0.5 * tall)


def _paths(axes: Axes, block: MotionBlock) -> None:
    """Whole trajectories, the true ones thin and black."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    for number, (true, path) in enumerate(zip(block.paths_true, block.paths, strict=True)):
        axes.plot(*path.T, color=COLOURS[_TRAJECTORIES[number % len(_TRAJECTORIES)]], linewidth=1.1)
        axes.plot(*true.T, color=COLOURS["black"], linewidth=0.5)
    axes.margins(0.06)


def _check(
    where: str, rows: Sequence[Sequence[MotionBlock]], bones: Sequence[tuple[int, int]], views: int
) -> None:
    if not rows or not rows[0] or len({len(row) for row in rows}) > 1:
        raise InvalidInput("nothing to draw", where=where, expected="rows of as many blocks, at least one")
    for row in rows:
        for block in row:
            here = f"{where}, {block.title}"
            instants, joints = np.shape(block.image)[:2]
            space = (views, instants, joints, 2)
            given = (np.shape(block.image), np.shape(block.truth), np.shape(block.reconstruction))
            if given != ((instants, joints, 2), space, space) or not instants:
                raise InvalidInput(
                    "postures of the wrong shape", where=here, expected=str(space), received=str(given)
                )
            if np.shape(block.paths) != np.shape(block.paths_true) or np.ndim(block.paths) != 3:
                raise InvalidInput("trajectories of the wrong shape", where=here)
            if len(block.lights) != len(bones) or not set(block.lights) <= set(_LINES) - {"truth"}:
                raise InvalidInput(
                    "no light for every bone", where=here, expected=f"{len(bones)} of green, amber, red"
                )
            arrays = (block.truth, block.reconstruction, block.paths, block.paths_true)
            seen = np.isfinite(block.image).all(axis=2).any(axis=1)
            if not seen.all() or not all(np.isfinite(array).all() for array in arrays):
                raise InvalidInput("positions that are not finite", where=here)
