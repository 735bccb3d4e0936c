"""Type of the recordings that readers of motion files return, in the axes of the file."""

from __future__ import annotations

from html import escape

import numpy as np

from pipeline.shortened import shortened
from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.joints import WALKER15
from pipeline.skeleton.player import player
from pipeline.skeleton.source_mapping import UpAxis

MILLIMETRES = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4, "ft": 304.8}
"""Size in mm of each unit of length, by the short name of the unit."""


@shortened
class MotionCapture:
    """Recording of points over time, returned by a reader of `pipeline.formats`.

    Attributes
    ----------
    names : tuple of str
        P point names: markers, segment origins or bone ends.
    positions_mm : (T, P, 3) float64
        Positions in millimetres, in the axes of the file; NaN where not valid.
    valid : (T, P) bool
        True for measured samples.
    frame_rate_hz : float
    units : str
        Unit of length from the file or the caller (``"mm"``, ``"m"``, ``"in/0.45"``…).
    notes : tuple of str
        Sentences on oddities of the file that do not prevent reading, such as a wrong frame count.
    units_assumed : bool
        True if neither the file nor the caller stated the unit.
    up : UpAxis
        Axis that points up, if the caller stated it.
    complaints : tuple of Complaint
        Complaints about the mapping of points to joints; their sentences are also in `notes`.
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

    def _repr_html_(self) -> str:
        """Return an HTML player for notebooks, with bones between the joints of WALKER15."""
        positions = np.where(self.valid[..., None], self.positions_mm, np.nan)
        bones = WALKER15.bones if self.names == WALKER15.joints else ()
        seconds = len(positions) / self.frame_rate_hz
        return f"<p>{escape(repr(self))}</p>{player(positions, seconds, self.up, bones)}"
