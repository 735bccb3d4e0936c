"""Counts in rows of stacked bars with a colour for each kind, e.g. claims by verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipeline.palette import hex_colour
from pipeline.pictures import style as look

_ROW_HEIGHT = 0.3
"""Height of a row, inches."""

_SWATCH_WIDTH = 5.0
"""Width of the lines of the legend, points."""

_LIGHT = {"amber", "sky", "yellow", "silver"}
"""Light colours, on which numbers are black."""


def draw_tallies(
    canvas: look.Canvas,
    rows: Sequence[tuple[str, Mapping[str, int]]],
    colours: Mapping[str, str],
    *,
    width: float = look.PANEL_SIZE[0],
) -> None:
    """Draw rows of stacked bars with their numbers.

    Parameters
    ----------
    canvas : Canvas
    rows : sequence of (str, mapping of str to int)
        Rows from the top: name, and counts by kind.
    colours : mapping of str to str
        Kinds in the order of the bars, with their colours.
    width : float
        Width of the picture, inches.
    """
    kinds = [kind for kind in colours if any(counts.get(kind) for _, counts in rows)]
    longest = max(sum(counts.values()) for _, counts in rows)
    with look.applied_style():
        figure = look.new_figure(width, _ROW_HEIGHT * len(rows) + look.FRAME)
        axes = figure.add_subplot()
        for number, (_, counts) in enumerate(rows):
            start = 0
            for kind in kinds:
                count = counts.get(kind, 0)
                if count:
                    axes.barh(number, count, left=start, height=0.74, color=hex_colour(colours[kind]))
                    ink = "black" if colours[kind] in _LIGHT else "white"
                    axes.text(start + 0.5 * count, number, str(count), color=ink, ha="center", va="center_baseline",
                              fontsize=look.NOTE_SIZE if count > 0.04 * longest else 0.75 * look.NOTE_SIZE)  # fmt: skip
                start += count
        axes.set_yticks(range(len(rows)), [name for name, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(0, longest)
        axes.tick_params(left=False, right=False, top=False, bottom=False, labelbottom=False)
        axes.spines[:].set_visible(False)
        handles = [look.legend_handle(kind, hex_colour(colours[kind]), width=_SWATCH_WIDTH) for kind in kinds]
        look.finish(figure, canvas, handles, room=True)
