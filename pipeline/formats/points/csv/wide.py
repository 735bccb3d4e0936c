"""Writing a wide table: a row for each frame, three columns for each point."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.points.cells import positions_to_write


def write_wide(
    path: str | Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float
) -> None:
    """Write positions as a wide table in millimetres, every digit kept, missing samples empty.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P point names, all different.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, the rate or a coordinate cannot be written.
    """
    positions = positions_to_write(names, positions_mm, frame_rate_hz, Path(path).name, distinct=True)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(f"{name}_{axis}_mm" for name in names for axis in "xyz")])
    for frame, row in enumerate(positions.reshape(len(positions), -1).tolist()):
        writer.writerow([repr(frame / float(frame_rate_hz)), *("" if x != x else repr(x) for x in row)])
    Path(path).write_text(text.getvalue(), encoding="utf-8", newline="\n")
