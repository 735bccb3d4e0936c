"""Joints that nobody measured, drawn hollow: spheres of wire in space, rings in an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr

from pipeline.recordings.columns import body, partitioned, rgb
from pipeline.recordings.layout import GROUND, METRES, Extent

RING = 2.6
"""Radius of such a joint in an image, over that of the bones."""

_INSIDE, _ABOVE = 0.6, 40.0
"""Share of a ring's radius that is hollow; the order in which insides are drawn: after points, whose order is 30."""

_SPHERE = 4.5
"""Radius of a sphere of wire, over that of the bones."""


@dataclass(frozen=True)
class Hollow:
    """What is sent: the static style, the columns of all rows, the box around them, how many rows."""

    style: Any
    columns: list[Any]
    extent: Extent
    rows: int


def wire_spheres(
    entity: str, positions_mm: np.ndarray, estimated: np.ndarray, colour: str, thickness_mm: float
) -> Hollow:
    """Return a sphere of wire at each of the joints (J,) bool of positions (T, J, 3)."""
    centres, extent = _centres(entity, positions_mm, estimated, 3)
    half = [[_SPHERE * thickness_mm * METRES] * 3] * centres.shape[1]
    style = rr.Ellipsoids3D.from_fields(
        half_sizes=half, colors=rgb(entity, colour), fill_mode=rr.components.FillMode.MajorWireframe
    )
    columns = rr.Ellipsoids3D.columns(centers=centres.reshape(-1, 3))
    return Hollow(style, partitioned(columns, *centres.shape[:2]), extent, len(centres))


def insides_of_rings(
    entity: str, points_mm: np.ndarray, estimated: np.ndarray, thickness_mm: float
) -> Hollow:
    """Return discs of the ground's colour over the joints (J,) bool of points (T, J, 2): what makes rings of them."""
    centres, extent = _centres(entity, points_mm, estimated, 2)
    radius = _INSIDE * RING * thickness_mm * METRES
    style = rr.Points2D.from_fields(colors=GROUND, radii=radius, draw_order=_ABOVE)
    columns = rr.Points2D.columns(positions=centres.reshape(-1, 2))
    return Hollow(style, partitioned(columns, *centres.shape[:2]), extent, len(centres))


def _centres(
    entity: str, positions_mm: np.ndarray, estimated: np.ndarray, space: int
) -> tuple[np.ndarray, Extent]:
    chosen = np.asarray(positions_mm)[:, np.asarray(estimated, dtype=bool)]
    centres, _, extent = body(entity, chosen, [(0, 0)], space)
    return centres, extent
