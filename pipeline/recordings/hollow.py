"""Joints that nobody measured, drawn hollow: spheres of wire in space, rings in an image."""

from __future__ import annotations

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


def hollow_joints(
    entity: str, positions_mm: np.ndarray, colour: str, thickness_mm: float
) -> tuple[Any, list[Any], Extent]:
    """Return the static style, the columns of all rows and the box around joints that are drawn hollow.

    Of positions (T, J, 3) spheres of wire, of points (T, J, 2) discs of the ground's colour, which make rings of them.
    """
    space = positions_mm.shape[-1]
    centres, _, extent = body(entity, positions_mm, [(0, 0)], space)
    places, thickness = centres.reshape(-1, space), thickness_mm * METRES
    if space == 3:
        half = [[_SPHERE * thickness] * 3] * centres.shape[1]
        style: Any = rr.Ellipsoids3D.from_fields(
            half_sizes=half, colors=rgb(entity, colour), fill_mode=rr.components.FillMode.MajorWireframe
        )
        columns: Any = rr.Ellipsoids3D.columns(centers=places)
    else:
        style = rr.Points2D.from_fields(colors=GROUND, radii=_INSIDE * RING * thickness, draw_order=_ABOVE)
        columns = rr.Points2D.columns(positions=places)
    return style, partitioned(columns, *centres.shape[:2]), extent
