"""A recording as it is read: points over time, in the axes of its file."""

from __future__ import annotations

import numpy as np

from pipeline.shortened import shortened
from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.source_mapping import UpAxis

MILLIMETRES = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Millimetres in one unit of length, by the unit's short name."""


@shortened
class MotionCapture:
    """A recording as every reader of `pipeline.formats` returns it.

    Attributes
    ----------
    names : tuple of str
        P point names: markers, segment origins or bone ends.
    positions_mm : (T, P, 3) float64
        Positions in millimetres, in the file's own axes; NaN where not valid.
    valid : (T, P) bool
        False where the point was not measured.
    frame_rate_hz : float
    units : str
        The unit of length that the file declares or that the caller gave (``"mm"``, ``"m"``, ``"in/0.45"``…).
    notes : tuple of str
        What is odd in the file but readable, one sentence each (a frame count that disagrees, …).
    units_assumed : bool
        Whether neither the file nor the caller stated the unit.
    up : UpAxis
        Axis that points up, if the caller stated it.
    complaints : tuple of Complaint
        What is doubtful in the mapping of its points to joints; the sentences are among `notes`, too.
    """

    names: tuple[str, ...]
    positions_mm: np.ndarray
    valid: np.ndarray
    frame_rate_hz: float
    units: str
    notes: tuple[str, ...] = ()
    units_assumed: bool = False
    up: UpAxis = UpAxis.auto
    complaints: tuple[Complaint, ...] = ()
