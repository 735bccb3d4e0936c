"""Places of keypoints in time."""

from __future__ import annotations

import numpy as np

from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import set_to_seconds
from pipeline.formats.points.even_times import at_equal_intervals
from pipeline.validation import InvalidInput


def timed(table: Rows, column: int, frames: np.ndarray, rate: float) -> tuple[np.ndarray, float]:
    """Frames of rows by their times, not whole where these are uneven, and frames a second.

    Parameters
    ----------
    table : Rows
    column : int
        Of the times.
    frames : (R,) int
        As numbered or in turn; they decide which rows are of one time.
    rate : float
        That is declared, which stays where the times tell none; 0: none is.
    """
    first, which = np.unique(frames, return_index=True, return_inverse=True)[1:]
    try:
        set_to_seconds(table, column)
        times = table.column(column)[first]
        grid, own = at_equal_intervals(
            times, times[:, None, None], None, lambda k: table.place(first[k]), table.notes
        )
    except InvalidInput as error:
        table.notes.append(f"The times are not used: {error}.")
        return frames, rate
    if rate and abs(own / rate - 1.0) > 1e-3:
        table.notes.append(f"By the times there are {own:g} frames a second, not {rate:g} as is declared.")
        rate = 0.0
    seen = np.flatnonzero(np.isfinite(grid[:, 0, 0]))
    return frames.min() + np.interp(times, grid[seen, 0, 0], seen).round(5)[which], rate or own
