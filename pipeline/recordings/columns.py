"""Columns of a recording file, with checks of input errors that rerun does not report.

Rerun drops values outside a partition and truncates fractions of a sequence.  A timeline with two types makes an
invalid file, and without the strict mode a wrong shape logs nothing.  Here each of these is an error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr

from pipeline.palette import NAMES, rgb_colour
from pipeline.recordings.layout import METRES, Extent
from pipeline.validation import InvalidInput, require_choice, require_finite, require_shape

rr.set_strict_mode(True)  # otherwise a wrong shape warns and logs nothing


def body(
    entity: str, positions_mm: np.ndarray, bones: Sequence[tuple[int, int]], space: int
) -> tuple[np.ndarray, np.ndarray, Extent]:
    """Return the joints, the ends of the bones, and their bounding box, in the units and axes of the file.

    Parameters
    ----------
    entity : str
        Name of the entity in messages.
    positions_mm : (T, J, space) float
        Millimetres, NaN where missing; in an image the second coordinate points up.
    bones : sequence of (int, int)
        B pairs of joints.
    space : int
        2 or 3.

    Returns
    -------
    joints : (T, J, space) float32
        Metres; in an image the second coordinate points down.
    ends : (T, B, 2, space) float32
        Metres.
    extent : Extent

    Raises
    ------
    InvalidInput
        If shapes do not fit, a bone names no joint, or positions are infinite or all missing.
    """
    x = require_shape(f"{entity}, positions", positions_mm, ("T", "J", space)).astype(float)
    if not x.size or np.isinf(x).any() or np.isnan(x).all():
        raise InvalidInput(
            "positions are infinite or all missing", entity, received=f"shape {x.shape}", code="not_finite"
        )
    pairs = np.asarray(bones)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.min() < 0 or pairs.max() >= x.shape[1]:
        raise InvalidInput(
            "bones are not pairs of joints", entity, f"0…{x.shape[1] - 1}", code="not_pairs_of_joints"
        )
    joints = (x * METRES * ([1, -1] if space == 2 else [1, 1, 1])).astype(np.float32)
    low, high = (tuple(f(joints, axis=(0, 1)).tolist()) for f in (np.nanmin, np.nanmax))
    return joints, joints[:, pairs], Extent(low, high)


def camera_pose(entity: str, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, Extent]:
    """Return centres (T, 3), m, axes (T, 3, 3) and bounding box of cameras with matrices (T, 3, 4), mm.

    The columns of `axes` point right, down and away from the camera.
    """
    turned = require_finite(entity, require_shape(entity, matrix, ("T", 3, 4)))[..., :3]
    centre = -np.linalg.solve(turned, matrix[..., 3:])[..., 0] * METRES
    away = turned[:, 2] / np.linalg.norm(turned[:, 2], axis=-1, keepdims=True)
    down = turned[:, 1] - (turned[:, 1] * away).sum(axis=-1, keepdims=True) * away
    down = down / np.linalg.norm(down, axis=-1, keepdims=True)
    axes = np.stack([np.cross(down, away), down, away], axis=-1)
    low, high = (tuple(end(centre, axis=0).tolist()) for end in (np.min, np.max))
    return centre, axes, Extent(low, high)


def pinhole(focal: Any, centre: Any, size: Any, distance: float) -> rr.Pinhole:
    """Return a pinhole camera with the given image size; the viewer draws its image at `distance`, m."""
    (along, across), (column, row) = focal, centre
    return rr.Pinhole.from_fields(
        image_from_camera=[[along, 0.0, column], [0.0, across, row], [0.0, 0.0, 1.0]],
        resolution=size,
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=distance,
    )


def time_column(entity: str, timeline: str, values: Any, rows: int) -> rr.TimeColumn:
    """Return the column of a timeline: durations for the timeline ``time``, integers for all others."""
    where = f"{entity} on {timeline}"
    v = vector(where, values)
    if len(v) != rows or (np.diff(v) <= 0).any():
        expected, received = f"{rows} increasing values", f"{len(v)} values"
        raise InvalidInput(
            "the timeline must have one increasing value for each row",
            where,
            expected,
            received,
            code="not_increasing",
            rows=rows,
        )
    if timeline == "time":
        nanoseconds = np.rint(v * 1e9).astype(np.int64).astype("timedelta64[ns]")
        return rr.TimeColumn(timeline, duration=nanoseconds)
    cut = v[np.abs(v - np.rint(v)) > 1e-6]  # rerun would truncate these silently
    if cut.size:
        raise InvalidInput(
            "the values of the timeline are not integers", where, received=f"{cut[0]:g}", code="not_whole"
        )
    return rr.TimeColumn(timeline, sequence=np.rint(v).astype(np.int64))


def vector(where: str, values: Any) -> np.ndarray:
    """Return a non-empty vector (N,) of finite numbers as float64."""
    v = require_finite(where, require_shape(where, values, ("N",))).astype(float)
    if not v.size:
        raise InvalidInput("no values", where, code="no_values")
    return v


def band(
    entity: str, places: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, Extent, list[Any]] | None:
    """Return a mask of the rows with complete intervals, their bounding box, and the columns of the band.

    A band is stored as a measurement at its middle, with half its width as the standard deviation.  The result is None
    if no row has both ends.
    """
    ends = np.stack(
        [
            require_shape(f"{entity}, {name}", end, (len(places),)).astype(float)
            for name, end in (("low", low), ("high", high))
        ]
    )
    finite = np.isfinite(ends).all(axis=0)
    if not finite.any():
        return None
    ends = ends[:, finite]
    first, last = (places[finite][k] for k in (0, -1))
    extent = Extent((first, ends.min()), (last, ends.max()))
    half = 0.5 * (ends[1] - ends[0])
    columns = rr.Measurements.columns(values=ends.mean(axis=0), variances=half**2)
    return finite, extent, partitioned(columns, ends.shape[1], 1)


def rgb(where: str, colour: str) -> tuple[int, int, int]:
    """Return the red, green and blue values of a colour of `pipeline.palette` for a dark background."""
    return rgb_colour(require_choice(f"{where}, colour", colour, NAMES), dark_ground=True)


def partitioned(columns: Any, rows: int, each: int) -> list[Any]:
    """Divide recording columns of ``rows * each`` values into rows of `each` values."""
    return [*columns.partition([each] * rows)]
