"""Recordings of the figures for the Rerun viewer; the only package that imports rerun.

A `Recording` shows results; it can be made again from the tables, which are their record.

Conventions
-----------
Arguments are in millimetres; the file has metres, which the viewer's grid and camera assume.
World: right-handed, x right, y forward, z up.  This is the viewer's default, so the file does not state it.
Images: the viewer's vertical axis points down, so the file has the negative vertical coordinate.
A timeline called ``time`` is a duration in seconds; every other one is a sequence of integers (``view_angle_deg``,
``sigma2_mm2``, ``frame``).  The viewer plots against the open timeline and shows only entities with rows on it.
Hence each abscissa needs a recording, and every moving entity has rows on the recording's timeline.
Colours are those of `pipeline.palette`.

How to record a figure
----------------------
Charts whose abscissa is the recording's timeline are added automatically, as curves ``curves/<quantity>/<series>``.
Skeletons, images, bars and matrices are added one by one.  The layout (`pipeline.scenes`) comes last.

>>> from pipeline.charts import Chart
>>> from pipeline.recordings import Recording
>>> from pipeline.scenes import Columns, Notes, Rows, Space3D
>>> ERROR = Chart(x="view_angle_deg", y="error_mm", by="method", label="Error", unit="mm")
>>> def record(table, original, folder):
...     with Recording(
...         folder / "recording.rrd", name="zhang2007_fig5", about="# Errors", timeline="view_angle_deg",
...         at=range(-90, 91), charts=[ERROR], tables={"table": table},
...     ) as rec:
...         rec.skeleton("world/original", original)
...         rec.blueprint(Columns(Rows(*rec.plots), Space3D(name="original"), Notes()))
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.recordings.recording import Recording

__all__ = ["Recording"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, because rerun takes long to import."""
    if name in __all__:
        return getattr(import_module("pipeline.recordings.recording"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
