"""Printed pictures of the figures, each as an SVG and a PNG; the only package that imports matplotlib.

The same input gives the same bytes on every run.  All sizes, letters and line widths are in `pipeline.pictures.style`,
all colours in `pipeline.palette`; what is drawn is described by `pipeline.charts` and `pipeline.scenes`.

========================  ==================================================================================
`Picture`                 what the `draw` of a figure is given
`draw_charts`             charts in panels, from tidy tables
`draw_postures`           rows of stick figures, original and reconstructed
`draw_walking`            a walker who walks: what a camera sees, and his reconstruction turning (SVG)
`draw_tallies`            counts in rows of bars, a colour to each kind
`embedded`, `reduced`     a picture that is drawn, reduced: as text inside a page, or its bytes
`packed_vector`           a vector picture as text inside a page
========================  ==================================================================================

>>> from pipeline import pictures
>>> from pipeline.charts import Chart, Sheet
>>> from pipeline.palette import Style
>>> METHODS = {"least_squares": Style("approach I", "least_squares"), "map": Style("approach II", "map")}
>>> CHARTS = Sheet(charts=[
...     Chart(x="view_angle_deg", x_label="View", x_unit="°", y=y, by="method", styles=METHODS, label=label, unit=unit)
...     for y, label, unit in [("absolute_error_mm2", "Absolute error", "mm²"), ("relative_error", "Its share", "")]
... ])
>>> def picture(table, stem):
...     pictures.draw_charts(stem, CHARTS, {"table": table})
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.pictures.charts import draw_charts
    from pipeline.pictures.embedding import embedded, packed_vector, reduced
    from pipeline.pictures.picture import Picture
    from pipeline.pictures.postures import draw_postures
    from pipeline.pictures.tallies import draw_tallies
    from pipeline.pictures.walking import Walking, draw_walking

__all__ = [
    "Picture", "Walking", "draw_charts", "draw_postures", "draw_tallies", "draw_walking", "embedded", "packed_vector",
    "reduced",
]  # fmt: skip

_MODULES = {
    "Picture": "picture", "Walking": "walking", "draw_charts": "charts", "draw_postures": "postures",
    "draw_tallies": "tallies", "draw_walking": "walking", "embedded": "embedding", "packed_vector": "embedding",
    "reduced": "embedding",
}  # fmt: skip
"""Module of each public name."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: matplotlib takes long to import, and few commands draw."""
    if name in _MODULES:
        return getattr(import_module(f"pipeline.pictures.{_MODULES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
