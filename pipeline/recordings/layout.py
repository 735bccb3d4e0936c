"""Blueprint of the Rerun viewer for a layout that `pipeline.scenes` describes as plain values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.scenes import (
    Bars,
    Columns,
    Image2D,
    Matrix,
    Plot,
    Rows,
    Space3D,
    Split,
    View,
)  # fmt: skip
from pipeline.validation import InvalidInput

METRES = 1e-3
"""Length of a millimetre in metres."""

_HALF_VIEW = 0.49
"""Tangent of half the viewer's field of view, as measured on the screen."""

_FILL_SHARE = 0.84
"""Fraction of a view that its content fills."""

_WINDOW_HEIGHT = 850.0
"""Total height of the views in a typical window of the viewer, points of the screen."""

_FRAME, _LEGEND_LINE, _LEGEND_MARGIN = 50.0, 19.0, 14.0
"""Heights, points of the screen: a plot's title with its axis, a line of the legend, the legend's margins."""

MAX_LEGEND_ROOM = 1.5
"""Largest space for a legend, relative to the height of the curves."""

GROUND = (24, 26, 31)
"""Background colour of skeleton views, the same in the light and the dark theme of the viewer."""


@dataclass(frozen=True)
class Extent:
    """Bounding box of a recorded entity, in the coordinates of a plot, an image or space.

    Coordinates are abscissa and ordinate in a plot, right and down in an image, m, and x, y, z in space, m.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]


Extents = Mapping[str, Extent | None]


def blueprint(layout: View | Split, *, timeline: str, extents: Extents, playing: bool) -> rrb.Blueprint:
    """Return the blueprint that shows a layout in the viewer.

    Parameters
    ----------
    layout : View or Split
    timeline : str
        Timeline that the viewer opens.
    extents : mapping
        Entity → box around it, or None for entities without one.
    playing : bool
        Start the viewer by playing in a loop.

    Raises
    ------
    InvalidInput
        If a view or a range would be empty.
    """
    return rrb.Blueprint(
        _part(layout, timeline, extents, _WINDOW_HEIGHT),
        rrb.TimePanel(
            state="collapsed",
            timeline=timeline,
            play_state="playing" if playing else "paused",
            loop_mode="all" if playing else None,
        ),
        rrb.BlueprintPanel(state="collapsed"),  # hidden skeletons can be shown in its tree
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _below(path: str, entities: Collection[str]) -> list[str]:
    """Return the entities whose path is, or begins with, the given path."""
    return [entity for entity in entities if f"{entity}/".startswith(f"{path}/")]


def _part(part: View | Split, timeline: str, extents: Extents, height: float) -> rrb.Container | rrb.View:
    if isinstance(part, View):
        return _view(part, timeline, extents, height)
    shares = np.ones(len(part.parts)) if part.shares is None else np.asarray(part.shares, float)
    heights = height * (shares / shares.sum() if isinstance(part, Rows) else np.ones(len(shares)))
    parts = [_part(p, timeline, extents, float(h)) for p, h in zip(part.parts, heights, strict=True)]
    match part:
        case Columns():
            return rrb.Horizontal(*parts, column_shares=part.shares)
        case Rows():
            return rrb.Vertical(*parts, row_shares=part.shares)
        case _:
            return rrb.Tabs(*parts, active_tab=0)


def legend_room(names: int, height: float) -> float:
    """Return the space for a legend above curves, relative to the height of the curves.

    Parameters
    ----------
    names : int
        Number of names in the legend.
    height : float
        Height of the view, points of the screen.

    Examples
    --------
    >>> round(legend_room(3, 270.0), 2), round(legend_room(13, 270.0), 2)
    (0.48, 1.5)
    """
    curves, legend = height - _FRAME, _LEGEND_LINE * names + _LEGEND_MARGIN
    return min(legend / max(curves - legend, 1.0), MAX_LEGEND_ROOM)


def _view(view: View, timeline: str, extents: Extents, height: float) -> rrb.View:
    for path in (*(view.contents or (view.origin,)), *getattr(view, "focus", ())):
        if not _below(path, extents):
            raise InvalidInput(
                f"the recording has no entity at {path!r}",
                view.name,
                received=", ".join(sorted(extents)[:8]),
                code="nothing_to_show",
                path=path,
            )
    contents = [f"/{path}/**" for path in view.contents] or "$origin/**"
    common: dict[str, Any] = {"origin": f"/{view.origin}", "name": view.name, "contents": contents}
    match view:
        case Space3D():
            position, target = framed(view, extents)
            eye = rrb.EyeControls3D(position=position, look_target=target, eye_up=(0, 0, 1))
            grid = rrb.LineGrid3D(visible=True, spacing=0.5, color=(255, 255, 255, 28))
            return rrb.Spatial3DView(
                **common, eye_controls=eye, line_grid=grid, background=GROUND, overrides=_hidden(view)
            )
        case Image2D():
            (left, top), (right, bottom) = image_bounds(view, extents)
            bounds = rrb.VisualBounds2D(x_range=(left, right), y_range=(top, bottom))
            return rrb.Spatial2DView(
                **common, background=GROUND, visual_bounds=bounds, overrides=_hidden(view)
            )
        case Plot():
            (left, _), (right, _) = _box(view, extents, margin=0.0)
            (_, low), (_, high) = _box(view, extents, margin=0.05)
            low, high = _ordered(view, view.y_range or (low, high))
            paths = view.contents or (view.origin,)
            series = {entity.removesuffix("/interval") for path in paths for entity in _below(path, extents)}
            high += legend_room(len(series), height) * (high - low)
            return rrb.TimeSeriesView(
                **common,
                axis_x=_abscissa(timeline, _ordered(view, (left, right))),
                axis_y=rrb.ScalarAxis(range=(low, high)),
                plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
            )
        case Bars():
            return rrb.BarChartView(**common)
        case Matrix():
            return rrb.Spatial2DView(**common)
        case _:  # notes
            return rrb.TextDocumentView(**common)


def framed(view: Space3D, extents: Extents) -> tuple[np.ndarray, np.ndarray]:
    """Return the position and the target of the viewer's eye, m, for which the content fills the view."""
    low, high = _box(view, extents, margin=0.0, paths=view.focus)
    target, (across, along, height) = (low + high) / 2.0, high - low
    way = np.array(view.eye_mm) - np.array(view.target_mm)
    way = way / np.linalg.norm(way)
    distance = max(height, np.hypot(across, along) / view.aspect) / (2.0 * _HALF_VIEW * _FILL_SHARE)
    return target + distance * way, target


def image_bounds(view: Image2D, extents: Extents) -> tuple[np.ndarray, np.ndarray]:
    """Return the upper left and the lower right corner of the view of an image, m."""
    low, high = _box(view, extents, margin=(1.0 / _FILL_SHARE - 1.0) / 2.0, paths=view.focus)
    if view.next_to is None:
        return low, high
    position, target = framed(view.next_to, extents)
    half = np.array([0.0, _HALF_VIEW * np.linalg.norm(position - target)])
    middle, wide = (low + high) / 2.0, np.array([(high - low)[0] / 2.0, 0.0])
    return middle - half - wide, middle + half + wide


def _hidden(view: Space3D | Image2D) -> dict[Any, Any] | None:
    """Return viewer settings that hide all entities of a view except the focused entities and their children."""
    if not view.focus:
        return None
    tops = view.contents or (view.origin,)
    hidden: dict[Any, Any] = {path: rrb.EntityBehavior(visible=False) for path in tops}
    return hidden | {path: rrb.EntityBehavior(visible=True) for path in view.focus}


def _ordered(view: View, limits: tuple[float, float]) -> tuple[float, float]:
    """Return the limits of an axis; equal limits get a margin of 1 on either side."""
    low, high = limits
    if low == high:
        return low - 1.0, high + 1.0
    if not (np.isfinite([low, high]).all() and low < high):
        raise InvalidInput(
            "the range of an axis is empty", view.name, "low < high", f"{low}, {high}", code="empty_range"
        )
    return low, high


def _box(
    view: View, extents: Extents, *, margin: float, paths: tuple[str, ...] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Return the two corners of the bounding box of the given entities, or of a view's whole content, with a margin.

    The margin is relative to the size of the box.
    """
    paths = paths or view.contents or (view.origin,)
    axes = 3 if isinstance(view, Space3D) else 2  # the image of a camera in space is not part of the box
    below = (extents[entity] for path in paths for entity in _below(path, extents))
    boxes = [box for box in below if box and len(box.low) == axes]
    if not boxes:
        raise InvalidInput(
            f"the view has no entity that a {type(view).__name__} can show", view.name, code="nothing_shown"
        )
    low = np.min([box.low for box in boxes], axis=0)
    high = np.max([box.high for box in boxes], axis=0)
    size = np.where(high > low, high - low, np.maximum(1.0, np.abs(high)))  # a constant needs an axis, too
    return low - margin * size, high + margin * size


def _abscissa(timeline: str, limits: tuple[float, float]) -> rrb.TimeAxis:
    boundary = rr.TimeRangeBoundary.absolute
    if timeline == "time":
        start, end = (boundary(seconds=float(v)) for v in limits)
    else:
        start, end = (boundary(seq=round(v)) for v in limits)
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
