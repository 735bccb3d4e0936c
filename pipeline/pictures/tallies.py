"""Counts in rows of bars, a colour to each kind of count: how many claims have which verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipeline.palette import hex_colour
from pipeline.pictures import style as look

_ROW = 0.3
"""Height of a row, inches."""

_SWATCH = 5.0
"""Width of the lines of the legend, points."""

_LIGHT = {"amber", "sky", "yellow", "silver"}
"""Colours on which numbers are black."""


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
        From the top: its name, and how many there are of each kind.
    colours : mapping of str to str
        The kinds in order, with the name of the colour of each.
    width : float
        Inches.
    """
    shown = [kind for kind in colours if any(counts.get(kind) for _, counts in rows)]
    most = max(sum(counts.values()) for _, counts in rows)
    with look.applied_style():
        figure = look.new_figure(width, _ROW * len(rows) + look.FRAME)
        axes = figure.add_subplot()
        for place, (_, counts) in enumerate(rows):
            start = 0
            for kind in shown:
                count = counts.get(kind, 0)
                if count:
                    axes.barh(place, count, left=start, height=0.74, color=hex_colour(colours[kind]))
                    ink = "black" if colours[kind] in _LIGHT else "white"
                    axes.text(start + 0.5 * count, place, str(count), color=ink, ha="center", va="center_baseline",
                              fontsize=look.NOTE_SIZE if count > 0.04 * most else 0.75 * look.NOTE_SIZE)  # fmt: skip
                start += count
        axes.set_yticks(range(len(rows)), [name for name, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(0, most)
        axes.tick_params(left=False, right=False, top=False, bottom=False, labelbottom=False)
        axes.spines[:].set_visible(False)
        handles = [look.legend_handle(kind, hex_colour(colours[kind]), width=_SWATCH) for kind in shown]
        look.finish(figure, canvas, handles, room=True)
