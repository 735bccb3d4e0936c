"""Recordings of the figures for the rerun viewer, and reading them; the only package that imports rerun.

A `Recording` is a view of results, not their record: it can be made again from the tables.

Conventions
-----------
Callers give millimetres; the file holds metres, which is what the viewer's grid and camera assume.
World: right-handed, x right, y forward, z up: the viewer's default, so it is not stated in the file.
Images: the viewer's vertical axis points down, so the file holds minus the vertical coordinate.
A timeline called ``time`` is a duration in seconds; every other one is a sequence of integers (``view_angle_deg``,
``sigma2_mm2``, ``frame``).  The viewer plots against the open timeline and shows only what has rows on it, hence
one recording for each abscissa: everything that moves has rows on the recording's timeline.
Colours are those of `pipeline.palette`.

How to record a figure
----------------------
Curves are taken from the same tidy table and styles as the picture; skeletons, images, bars and matrices are added one
by one; the layout comes last.

>>> from pipeline import recordings
>>> from pipeline.skeleton import WALKER15
>>> METHODS = {"map": recordings.Style("approach II", "map")}
>>> def record(table, original, folder):
...     with recordings.Recording(
...         folder / "recording.rrd", name="zhang2007_fig5", about="# Errors", timeline="view_angle_deg"
...     ) as rec:
...         for measure, sd in (("absolute_error_mm2", "absolute_error_sd_mm2"), ("relative_error", "")):
...             rec.curves(table, x="view_angle_deg", y=measure, sd=sd, by="method", styles=METHODS)
...         rec.skeleton("world/original", original, WALKER15.bones, index={"view_angle_deg": range(-90, 91)})
...         rec.blueprint(
...             recordings.Columns(
...                 recordings.Rows(
...                     recordings.Plot(name="absolute error (mm²)", origin="curves/absolute_error_mm2"),
...                     recordings.Plot(name="relative error", origin="curves/relative_error"),
...                 ),
...                 recordings.Rows(recordings.Space3D(name="original"), recordings.Notes(), shares=(3, 2)),
...             )
...         )

The curves are entities ``curves/<column>/<series>``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.palette import Style
    from pipeline.recordings.layout import (
        Bars,
        Columns,
        Image2D,
        Matrix,
        Notes,
        Plot,
        Rows,
        Space3D,
        Tabs,
        View,
    )
    from pipeline.recordings.reading import digest, entities, read_column, views
    from pipeline.recordings.recording import Recording
    from pipeline.recordings.viewer import screenshot, verify

__all__ = [
    "Bars", "Columns", "Image2D", "Matrix", "Notes", "Plot", "Recording", "Rows", "Space3D", "Style", "Tabs", "View",
    "digest", "entities", "read_column", "screenshot", "verify", "views",
]  # fmt: skip

_MODULES = {
    "pipeline.palette": ("Style",),
    "pipeline.recordings.layout": (
        "Bars", "Columns", "Image2D", "Matrix", "Notes", "Plot", "Rows", "Space3D", "Tabs", "View",
    ),
    "pipeline.recordings.reading": ("digest", "entities", "read_column", "views"),
    "pipeline.recordings.recording": ("Recording",),
    "pipeline.recordings.viewer": ("screenshot", "verify"),
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import a public name at its first use, since rerun takes long to import."""
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
