"""Counts as rows of stacked bars with a colour for each kind, e.g. claims by verdict."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from matplotlib.patches import Patch

from pipeline.palette import hex_colour
from pipeline.pictures import style as look

_ROW_HEIGHT = 0.3
"""Height of a row, inches."""

_HATCH = "/////"
"""Hatch pattern, which distinguishes a kind without colours."""

_LIGHT = {"amber", "sky", "yellow", "silver"}
"""Light colours, on which numbers are printed in black."""


def draw_tallies(
    canvas: look.Canvas,
    rows: Sequence[tuple[str, Mapping[str, int]]],
    colours: Mapping[str, str],
    *,
    hatched: Collection[str] = (),
    width: float = look.PANEL_SIZE[0],
) -> None:
    """Draw rows of stacked bars with their counts as numbers.

    Parameters
    ----------
    canvas : Canvas
    rows : sequence of (str, mapping of str to int)
        Rows from the top: name, and counts by kind.
    colours : mapping of str to str
        Kinds in the order of the bars, with their colours.
    hatched : collection of str
        Kinds whose bars are hatched, which a print without colours shows.
    width : float
        Width of the picture, inches.
    """
    kinds = [kind for kind in colours if any(counts.get(kind) for _, counts in rows)]
    longest = max(sum(counts.values()) for _, counts in rows)
    looks: dict[str, dict[str, Any]] = {
        kind: {"facecolor": hex_colour(colours[kind]), "edgecolor": "white", "linewidth": 0.0,
               "hatch": _HATCH if kind in hatched else None}
        for kind in kinds
    }  # fmt: skip
    with look.applied_style():
        figure = canvas.new_figure(width, _ROW_HEIGHT * len(rows) + look.FRAME)
        axes = figure.add_subplot()
        for number, (_, counts) in enumerate(rows):
            start = 0
            for kind in kinds:
                count = counts.get(kind, 0)
                if count:
                    axes.barh(number, count, left=start, height=0.74, **looks[kind])
                    ink = "black" if colours[kind] in _LIGHT else "white"
                    ground = hex_colour(colours[kind]) if kind in hatched else "none"
                    axes.text(start + 0.5 * count, number, str(count), color=ink, ha="center", va="center_baseline",
                              bbox={"facecolor": ground, "edgecolor": "none", "pad": 0.6},
                              fontsize=look.NOTE_SIZE if count > 0.04 * longest else 0.75 * look.NOTE_SIZE)  # fmt: skip
                start += count
        axes.set_yticks(range(len(rows)), [name for name, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(0, longest)
        axes.tick_params(left=False, right=False, top=False, bottom=False, labelbottom=False)
        axes.spines[:].set_visible(False)
        look.finish(figure, canvas, {kind: Patch(**looks[kind]) for kind in kinds}, room=True)
