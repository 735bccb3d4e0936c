"""Printed pictures of the figures, each as an SVG and a PNG; the only package that imports matplotlib.

The same input gives the same bytes on every run.  All sizes, letters and line widths are in `pipeline.pictures.style`,
all colours in `pipeline.palette`.  Every ``draw_…`` takes the path without a suffix first and a ``caption`` last.

========================  ==================================================================================
`draw_lines`              lines over an abscissa, a line to each series, in panels, from a tidy table
`series`                  the lines of another table, column or style, for the ``series`` of a `Panel`
`intervals`               the same lines again, with the interval of their mean or median as a band
`draw_heat_map`           a matrix with a path through it, panels of lines beside it
`draw_postures`           rows of stick figures, original and reconstructed
`draw_skeletons`          rows of stick figures, one posture and variations of it
`draw_motions`            images, other views and whole trajectories of clips, by camera
`draw_walking`            a walker who walks: what a camera sees, and his reconstruction turning (SVG)
`draw_tallies`            counts in rows of bars, a colour to each kind
`embedded`, `reduced`     a picture that is drawn, reduced: as text inside a page, or its bytes
========================  ==================================================================================

How to draw a figure
--------------------
A figure names its series once, for the picture and for the recording, and hands its table over as it is: a
`pandas.DataFrame`, or a dict of equally long arrays.

>>> from pipeline import pictures
>>> METHODS = {
...     "least_squares": pictures.Style("approach I", "least_squares"),
...     "map": pictures.Style("approach II", "map", line="dashed"),
... }
>>> def picture(table, stem):
...     pictures.draw_lines(
...         stem,
...         [
...             pictures.Panel(y="absolute_error_mm2", band="absolute_error_sd_mm2", ylabel="Absolute error (mm$^2$)"),
...             pictures.Panel(y="relative_error", ylabel="Relative error", references=[("y", 1.0, "average walker")]),
...         ],
...         table,
...         x="view_angle_deg",
...         by="method",
...         styles=METHODS,
...         xlabel="Viewpoint (degree)",
...         caption="Bands: ±1 standard deviation over walkers.",
...     )

What all panels share can be said once with ``panel = functools.partial(pictures.Panel, from_zero=True, xticks=30)``;
a panel to each camera is ``[panel(y="error_mm", where={"camera": camera}) for camera in cameras]``; many thin lines of
one style, one to each performance, are ``panel(y="value", units="performance")``; what no column holds goes into
``series=[pictures.Series(x=…, y=…, label="published", colour="published", line="points")]``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.palette import Style
    from pipeline.pictures.embedding import embedded, reduced
    from pipeline.pictures.lines import draw_lines, intervals, series
    from pipeline.pictures.matrix import HeatMap, draw_heat_map
    from pipeline.pictures.motions import MotionBlock, draw_motions
    from pipeline.pictures.panels import Panel, Series
    from pipeline.pictures.postures import PostureRow, draw_postures
    from pipeline.pictures.skeletons import SkeletonRow, draw_skeletons
    from pipeline.pictures.tallies import draw_tallies
    from pipeline.pictures.walking import Walking, draw_walking

__all__ = [
    "HeatMap", "MotionBlock", "Panel", "PostureRow", "Series", "SkeletonRow", "Style", "Walking", "draw_heat_map",
    "draw_lines", "draw_motions", "draw_postures", "draw_skeletons", "draw_tallies", "draw_walking", "embedded",
    "intervals", "reduced", "series",
]  # fmt: skip

_MODULES = {
    "pipeline.palette": ("Style",),
    "pipeline.pictures.embedding": ("embedded", "reduced"),
    "pipeline.pictures.lines": ("draw_lines", "intervals", "series"),
    "pipeline.pictures.matrix": ("HeatMap", "draw_heat_map"),
    "pipeline.pictures.motions": ("MotionBlock", "draw_motions"),
    "pipeline.pictures.panels": ("Panel", "Series"),
    "pipeline.pictures.postures": ("PostureRow", "draw_postures"),
    "pipeline.pictures.skeletons": ("SkeletonRow", "draw_skeletons"),
    "pipeline.pictures.tallies": ("draw_tallies",),
    "pipeline.pictures.walking": ("Walking", "draw_walking"),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: matplotlib takes long to import, and few commands draw."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
