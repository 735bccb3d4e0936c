"""The house style of figures: letters, lines, colours; the caption; both files, written whole.

Part of `pipeline.pictures`, the door to matplotlib.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.textpath import TextPath

from pipeline.validation import InvalidInput

COLOURS = {
    "black": "#000000",
    "orange": "#D55E00",
    "blue": "#0072B2",
    "green": "#009E73",
    "purple": "#CC79A7",
    "amber": "#E69F00",
    "sky": "#56B4E9",
    "grey": "#7F7F7F",
}
"""Okabe and Ito's colours, those dark enough for thin lines first; series take them in this order."""

STYLE: dict[Any, Any] = {
    "font.family": "STIXGeneral",  # comes with the library, so every machine draws the same letters
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.linewidth": 0.6,
    "axes.unicode_minus": True,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "xtick.minor.size": 1.6,
    "ytick.minor.size": 1.6,
    "lines.linewidth": 1.2,
    "lines.dashed_pattern": (4.0, 1.8),
    "legend.fontsize": 8,
    "svg.hashsalt": "gait",
    "svg.fonttype": "path",
}

CAPTION_SIZE = 7.5
"""In points."""

MARGIN = 0.08
"""Inches left and right of the caption."""

DOTS_PER_INCH = 200
"""Of the PNG."""


@contextmanager
def house_style() -> Iterator[None]:
    """The style of every figure, whatever a person's own settings say; their settings come back after."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of so many inches, to be made and finished inside `house_style`."""
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def finish(figure: Figure, path_stem: Path, caption: str, *, header: float = 0.0) -> None:
    """Set the caption under the figure and write ``.svg`` and ``.png``, the same bytes for the same input.

    Parameters
    ----------
    figure : Figure
    path_stem : Path
        Without a suffix.
    caption : str
        May be empty; a formula between dollar signs is never broken.
    header : float
        Inches to keep free at the top.

    Raises
    ------
    InvalidInput
        If the folder does not exist.
    """
    if not path_stem.parent.is_dir():
        raise InvalidInput("the folder of the figure does not exist", where=str(path_stem.parent))
    line = 1.25 * CAPTION_SIZE / 72
    lines = _wrapped(caption, figure.get_figwidth() - 2 * MARGIN)
    room = (len(lines) + 0.7) * line if lines else 0.0
    width, height = figure.get_figwidth(), figure.get_figheight() + room
    figure.set_size_inches(width, height)
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(rect=(0, room / height, 1, 1 - (room + header) / height))
    if lines:
        place = (room - 0.35 * line) / height
        text = "\n".join(lines)
        figure.text(MARGIN / width, place, text, fontsize=CAPTION_SIZE, va="top", linespacing=1.15)
    # The solver of the layout leaves the last bits of a place to chance, and the vector file would show them.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        left, low, wide, high = (round(float(side), 6) for side in axes.get_position(original=True).bounds)
        axes.set_position((left, low, wide, high))
    # Neither dates nor versions in the files; temporary names first, so that no reader sees half a figure.
    for suffix, metadata in (("svg", {"Date": None, "Creator": None}), ("png", {"Software": None})):
        content = io.BytesIO()
        figure.savefig(content, format=suffix, metadata=metadata, dpi=DOTS_PER_INCH)
        partial = path_stem.with_name(f".{path_stem.name}.{os.getpid()}.part.{suffix}")
        try:
            partial.write_bytes(content.getvalue())
            partial.replace(path_stem.with_name(f"{path_stem.name}.{suffix}"))
        finally:
            partial.unlink(missing_ok=True)


def _wrapped(caption: str, inches: float) -> list[str]:
    """Lines of a caption that fit a width, measured in its own letters."""
    font = FontProperties(family=STYLE["font.family"])

    def width(text: str) -> float:
        return float(TextPath((0, 0), text, size=CAPTION_SIZE, prop=font).get_extents().width)

    space = width("a a") - width("aa")
    limit = 0.95 * 72 * inches  # letters on a grid of dots run wider than their outlines
    lines: list[str] = []
    used = 0.0
    for word in re.findall(r"(?:\$[^$]*\$|\S)+", caption):
        if lines and used + space + width(word) <= limit:
            lines[-1] += f" {word}"
            used += space + width(word)
        else:
            lines.append(word)
            used = width(word)
    return lines
