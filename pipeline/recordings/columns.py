"""What goes into a recording, checked: the mistakes that the library underneath lets pass in silence.

Part of `pipeline.recording`.  A partition that does not cover its values drops the rest, a sequence cuts
fractions off, a timeline with two types makes a file that does not verify, and without the strict mode a
wrong shape logs nothing; each of them is a refusal or a failed assertion here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr

from pipeline.recordings.layout import METRES, Extent
from pipeline.validation import InvalidInput

rr.set_strict_mode(True)  # otherwise a wrong shape warns and logs nothing

COLOURS = {
    "grey": (205, 205, 205),
    "orange": (230, 159, 0),
    "blue": (86, 180, 233),
    "green": (0, 158, 115),
    "yellow": (240, 228, 66),
    "vermilion": (213, 94, 0),
    "purple": (204, 121, 167),
}
"""Okabe and Ito's colours: told apart by colour-blind people, legible on the viewer's dark ground."""


def body(
    entity: str, positions_mm: np.ndarray, bones: Sequence[tuple[int, int]], space: int
) -> tuple[np.ndarray, np.ndarray, Extent]:
    """Joints, bone ends and the box around them, as the file holds them.

    Parameters
    ----------
    entity : str
        For the refusal.
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
    x, pairs = np.asarray(positions_mm, dtype=float), np.asarray(bones)
    fits = x.ndim == 3 and x.shape[-1] == space and 0 not in x.shape
    require(fits, "positions of the wrong shape", entity, f"(T, J, {space})", str(x.shape))
    require(not np.isinf(x).any() and not np.isnan(x).all(), "positions infinite or all missing", entity)
    fits = pairs.ndim == 2 and pairs.shape[1] == 2 and pairs.min() >= 0 and pairs.max() < x.shape[1]
    require(fits, "bones that are not pairs of joints", entity, f"0…{x.shape[1] - 1}", str(bones))
    joints = (x * METRES * ([1, -1] if space == 2 else [1, 1, 1])).astype(np.float32)
    low, high = (f(joints, axis=(0, 1))[:2].tolist() for f in (np.nanmin, np.nanmax))
    return joints, joints[:, pairs], Extent((low[0], low[1]), (high[0], high[1]))


def time_column(entity: str, timeline: str, values: np.ndarray, rows: int) -> rr.TimeColumn:
    """One timeline's values; its name alone says its type, so that no timeline ever gets two."""
    where = f"{entity} on {timeline}"
    v = finite(where, values)
    fits = len(v) == rows and bool((np.diff(v) > 0).all())
    require(fits, "an index that does not fit", where, f"{rows} increasing values", f"{len(v)} values")
    if timeline == "time":
        nanoseconds = np.rint(v * 1e9).astype(np.int64).astype("timedelta64[ns]")
        return rr.TimeColumn(timeline, duration=nanoseconds)
    cut = v[v != np.rint(v)]  # the library would drop these fractions without a word
    require(not cut.size, "a sequence that is not of integers", where, "", str(cut[:1]))
    return rr.TimeColumn(timeline, sequence=v.astype(np.int64))


def finite(where: str, values: np.ndarray) -> np.ndarray:
    """A vector of finite numbers, as float64."""
    v = np.asarray(values, dtype=float)
    fits = v.ndim == 1 and v.size > 0 and bool(np.isfinite(v).all())
    require(fits, "not a vector of finite numbers", where, "(N,)", f"shape {v.shape}")
    return v


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of one of `COLOURS`."""
    require(colour in COLOURS, "an unknown colour", "", ", ".join(COLOURS), repr(colour))
    return COLOURS[colour]


def partitioned(columns: Any, rows: int, each: int) -> list[Any]:
    """`each` values to every row; the library drops in silence whatever the lengths do not cover."""
    parts = [*columns.partition([each] * rows)]
    for part in parts:
        cells = part.as_arrow_array()
        assert len(cells) == rows, "a partition of the wrong length"
        assert len(cells.flatten()) == rows * each, "a partition that loses values"
    return parts


def require(holds: bool, what: str, where: str, expected: str = "", received: str = "") -> None:
    """Nothing, if the condition holds; else a refusal."""
    if not holds:
        raise InvalidInput(what, where=where, expected=expected, received=received)
