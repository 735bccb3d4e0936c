"""Joints that were not measured, drawn hollow: wire spheres in 3D, rings in an image."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

from pipeline.recordings.columns import body, partitioned, rgb
from pipeline.recordings.layout import GROUND, METRES, Extent

RING = 2.6
"""Radius of a ring in an image, relative to the radius of the bones."""

_INSIDE, _ABOVE = 0.6, 40.0
"""Radius of the hollow part of a ring, relative to the ring, and drawing order of the hollow parts.

Points have the drawing order 30.
"""

_SPHERE = 4.5
"""Radius of a wire sphere, relative to the radius of the bones."""


def hollow_joints(
    entity: str, positions_mm: np.ndarray, colour: str, thickness_mm: float
) -> tuple[Any, list[Any], Extent]:
    """Return the static style, the columns and the bounding box of joints that are drawn hollow.

    Positions (T, J, 3) become wire spheres.  Points (T, J, 2) become discs in the background's colour, which turn the
    points below them into rings.
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
