"""Style of every picture: fonts, line widths, sizes, resolution, legend and files.

To change how pictures look, change this module; colours are those of `pipeline.palette`.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.textpath import text_to_path

from pipeline.charts import Chart, Sheet
from pipeline.palette import hex_colour
from pipeline.validation import InvalidInput

PNG_DPI = 200

FAMILY = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
"""Fonts of vector pictures, the same as those of the page.

The layout is computed with DejaVu Sans, whose letters are wider.
"""

TITLE_SIZE, NOTE_SIZE, SMALL_SIZE = 8, 7, 6.5
"""Font sizes, points, of titles, of notes inside the axes, and of small labels."""

NOTE_COLOUR = "#404040"

PANEL_SIZE = (3.7, 2.35)
"""Width and height of a panel including its labels, inches."""

PAGE_WIDTH = 7.3
"""Width of a picture that has no chart panels, inches."""

MAX_WIDTH = 7.5
"""Largest width of a picture, inches, which is the width of the text on a page."""

MIN_SHRUNK = 0.8
"""Smallest factor by which a picture is reduced to a given width."""

FRAME = 0.1
"""Margin that is added to the width and the height of a picture, inches."""

LEGEND_LINE = 0.24
"""Height of one line of a legend above the picture, inches."""

LINE_STYLES: dict[str, Any] = {"solid": "-", "dashed": "--", "dotted": ":", "points": "none"}

LINE_WIDTH, REFERENCE_WIDTH, LEGEND_WIDTH = 1.2, 0.7, 0.9
"""Line widths, points: of a series, of a reference line, and the smallest width in a legend."""

REFERENCE_DASHES, PUBLISHED_DASHES = (0, (1, 1.6)), (0, (5, 2))
"""Dash patterns of reference lines, and of published values."""

POINT_SIZE = 3.2
"""Diameter of a plotted point, points."""

BAND_OPACITY, INTERVAL_OPACITY = 0.12, 0.25
"""Opacities of bands that show the spread, and of bands that show confidence intervals."""

BONE_WIDTHS = {"broad": 3.6, "strong": 1.3, "usual": 1.2, "light": 0.8, "ground": 0.4}
"""Line widths, points, of the bones of stick figures and of the ground line."""

OUTLINE_WIDTH, PATH_OVER_MATRIX_WIDTH = 0.9, 1.6
"""Line widths, points, of the outline and of the path over a matrix."""

TICK_STEPS = (1, 2, 5, 10)
"""Permitted leading digits of the distance between the ticks of an abscissa."""

MATRIX_COLOURS = "viridis"

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # part of matplotlib, so every machine draws the same letters
    "font.size": TITLE_SIZE,
    "axes.labelsize": TITLE_SIZE,
    "axes.titlesize": TITLE_SIZE,
    "axes.titlelocation": "left",
    "axes.titlepad": 4,
    "axes.linewidth": 0.6,
    "axes.unicode_minus": True,
    "xtick.labelsize": NOTE_SIZE,
    "ytick.labelsize": NOTE_SIZE,
    "xtick.direction": "in",
    "xtick.major.pad": 6,  # clear of the lowest number of the ordinate
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3,
    "ytick.major.size": 3,
    "xtick.minor.size": 1.6,
    "ytick.minor.size": 1.6,
    "lines.linewidth": LINE_WIDTH,
    "lines.markersize": POINT_SIZE,
    "lines.dashed_pattern": (4.0, 1.8),
    "legend.fontsize": NOTE_SIZE,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.columnspacing": 1.2,
    "svg.hashsalt": "gait",
    "svg.fonttype": "none",  # text as text
    "pdf.fonttype": 42,  # the letters are embedded as TrueType
}


@dataclass(frozen=True)
class Canvas:
    """Files of a picture (``path_stem.svg``, ``path_stem.png`` and others), and the charts of its figure.

    Attributes
    ----------
    path_stem : Path
        Path without a suffix; the folder must exist.
    sheet : Sheet
    tables : mapping of str to table
        Tidy tables of the charts by name.
    caption : str
        Description in the metadata of the files; it is not drawn.
    title : str
        Title of the vector file for readers of screens.
    formats : sequence of str
        Suffixes of the files.
    width_mm : float
        Width of the picture; 0: as wide as its panels.
    dpi : int
        Resolution of raster files.
    panels : sequence of str
        Letters of the charts that are drawn; empty: all.
    """

    path_stem: Path
    sheet: Sheet = field(default_factory=Sheet)
    tables: Mapping[str, Any] = field(default_factory=dict)
    caption: str = ""
    title: str = ""
    formats: Sequence[str] = ("svg", "png")
    width_mm: float = 0.0
    dpi: int = PNG_DPI
    panels: Sequence[str] = ()
    after_layout: list[Callable[[], None]] = field(default_factory=list)
    """Functions that draw after the layout, because they need the final positions of the axes."""

    @property
    def drawn(self) -> list[Chart]:
        """Charts of the figure that the picture contains."""
        charts = [chart for chart in self.sheet.charts if chart.picture]
        letters = [chr(ord("a") + number) for number in range(len(charts))]
        if unknown := set(self.panels) - set(letters):
            raise InvalidInput(
                "the picture has no panel with this letter",
                "figure.panels",
                ", ".join(letters),
                ", ".join(sorted(unknown)),
                code="unknown_choice",
            )
        return [
            chart
            for letter, chart in zip(letters, charts, strict=True)
            if not self.panels or letter in self.panels
        ]

    def new_figure(self, width: float, height: float) -> Figure:
        """Return an empty figure of the given size, inches, at most `MAX_WIDTH` wide.

        With `width_mm`, the figure has this width, and its height is scaled.  Call this inside `applied_style`.
        """
        if self.width_mm and self.width_mm < (least := MIN_SHRUNK * width * 25.4):
            raise InvalidInput(
                "the text of the picture would be too small to read at this width",
                "figure.width_mm",
                f"at least {least:.0f}",
                self.width_mm,
                code="too_narrow",
                least=least,
            )
        wide = self.width_mm / 25.4 or min(width, MAX_WIDTH)
        high = height * wide / width if self.width_mm else height
        figure = Figure(figsize=(wide, high), dpi=PNG_DPI, layout="constrained")
        FigureCanvasAgg(figure)
        return figure


@contextmanager
def applied_style() -> Iterator[None]:
    """Apply the style of this package instead of the user's settings, and restore these settings afterwards."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def legend_handle(label: str, colour: str, *, line: Any = "-", width: float = LINE_WIDTH) -> Line2D:
    """Return the legend entry of a series; `line` is a key of `LINE_STYLES` or a dash pattern."""
    marker = "o" if line == "points" else "none"
    line = LINE_STYLES.get(line, line) if isinstance(line, str) else line
    return Line2D([], [], label=label, color=colour, linestyle=line, marker=marker, linewidth=width)


def ring_handle(label: str, size: float) -> Line2D:
    """Return the legend entry of rings whose diameter is `size`, points."""
    return Line2D(
        [], [], label=label, linestyle="none", marker="o", markersize=size, markerfacecolor="white",
        markeredgecolor=hex_colour("original"), markeredgewidth=LINE_WIDTH / 2,
    )  # fmt: skip


def _legend_above(figure: Figure, entries: Mapping[str, Any]) -> float:
    """Add a legend at the upper right of a figure, and return the height of the legend, inches."""
    widths = [text_width(label, NOTE_SIZE) + NOTE_SIZE * (2.4 + 0.8 + 1.2) for label in entries]  # points
    room = 72 * figure.get_figwidth() - 8
    columns = len(entries) if sum(widths) < room else max(1, min(len(entries), int(room / max(widths))))
    figure.legend(
        handles=list(entries.values()), labels=list(entries), loc="upper right", ncols=columns, borderaxespad=0.2,
        handler_map={tuple: HandlerTuple(ndivide=1, pad=0)},
    )  # fmt: skip
    lines = -(-len(entries) // columns)
    return LEGEND_LINE + (lines - 1) * 1.65 * NOTE_SIZE / 72


def finish(figure: Figure, canvas: Canvas, entries: Mapping[str, Any], *, room: bool = False) -> None:
    """Add the legend above a figure and write its files. The same input gives the same bytes.

    Parameters
    ----------
    figure : Figure
    canvas : Canvas
    entries : mapping of str to artist, or tuple of artists over one another
        Entries of the legend by label; without entries there is no legend.
    room : bool
        Increase the figure's height by that of the legend.
    """
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    header = _legend_above(figure, entries) if entries else 0.0
    # A legend with many lines must leave space for the axes.
    figure.set_figheight(max(figure.get_figheight() + header * room, 2.5 * header))
    engine.set(rect=(0, 0, 1, 1 - header / figure.get_figheight()))
    # The last bits of the solver's positions vary between runs, so they are rounded away for the vector file.
    engine.execute(figure)
    figure.set_layout_engine(
        None
    )  # not "none", which installs a placeholder engine and draws every file twice
    for axes in figure.axes:
        left, low, wide, high = (round(float(side), 6) for side in axes.get_position(original=True).bounds)
        axes.set_position((left, low, wide, high))
    for draw in canvas.after_layout:
        draw()
    for suffix in canvas.formats:
        _write(figure, canvas, suffix)


_WITHOUT = {"svg": ("Date", "Creator"), "png": ("Software",), "pdf": ("CreationDate", "Creator", "Producer")}
"""Metadata that contain dates or versions, by format; they are left out of the files."""


def _write(figure: Figure, canvas: Canvas, suffix: str) -> None:
    """Write one file under a temporary name and then rename it, so that no reader sees an incomplete file."""
    stem, content = canvas.path_stem, io.BytesIO()
    caption = {"pdf": "Subject", "png": "Description"}.get(suffix)
    metadata: dict[str, Any] = {caption: canvas.caption} if caption and canvas.caption else {}
    metadata |= dict.fromkeys(_WITHOUT[suffix])
    figure.savefig(content, format=suffix, metadata=metadata, dpi=canvas.dpi)
    written = content.getvalue()
    if suffix == "svg":
        text = written.decode().replace("'DejaVu Sans'", FAMILY)
        start = text.index(">", text.index("<svg ")) + 1
        words = f"<title>{escape(canvas.title or 'figure')}</title><desc>{escape(canvas.caption)}</desc>"
        written = f'{text[: start - 1]} role="img">\n{words}{text[start:]}'.encode()
    partial = stem.with_name(f".{stem.name}.{os.getpid()}.part.{suffix}")
    partial.write_bytes(written)
    partial.replace(stem.with_name(f"{stem.name}.{suffix}"))


def wrapped(text: str, width: float, size: float = TITLE_SIZE) -> str:
    """Return a text broken into lines of at most `width` points. A longer word has a line of its own."""
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(lines)


@cache
def text_width(text: str, size: float) -> float:
    """Return the width of a text, points, in the font of the style."""
    font = FontProperties(family=STYLE["font.family"], size=size)
    return text_to_path.get_text_width_height_descent(text, font, ismath="$" in text)[0]
