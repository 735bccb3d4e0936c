"""Frame of each row of a table, and frame rate from its times."""

from __future__ import annotations

import re

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import Columns
from pipeline.validation import require_range


def frame_index(table: Rows, columns: Columns) -> np.ndarray:
    """Frame of each row (R,), counted from the first: by its number if there is one, else by its time or its place.

    Raises
    ------
    InvalidInput
        If a frame number is not whole.
    """
    if not {"frame", "time"} & set(columns.roles):
        return np.arange(len(table.cells))
    if "frame" not in columns.roles:
        return np.unique(table.column(columns.roles["time"]), return_inverse=True)[1]
    frames = table.column(columns.roles["frame"])
    fractional = np.flatnonzero(frames != np.round(frames))
    if fractional.size:
        k = int(fractional[0])
        raise damaged("the frame number is not whole", table.place(k), received=f"{frames[k]:g}")
    return (frames - frames.min()).astype(int)


def frame_rate(table: Rows, columns: Columns, index: np.ndarray, given: float | None) -> float:
    """Frames per second (Hz) from the times, or as given.

    Parameters
    ----------
    table : Rows
    columns : Columns
    index : (R,) int
        Frame of each row.
    given : float or None
        Frames per second that the caller states.

    Raises
    ------
    InvalidInput
        If the rate is unknown, times are not uniform within 1 %, or they contradict the rate that was given.
    """
    if given is not None:
        require_range(f"{table.where}, option frame_rate_hz", given, above=0, unit="Hz")
    if "time" not in columns.roles or index.max() == 0:
        if given is None:
            raise damaged(
                "the frame rate is unknown",
                table.where,
                "a column of times with two frames or more, or the option frame_rate_hz",
            )
        return float(given)
    times = table.column(columns.roles["time"])
    order = np.lexsort((times, index))
    frame, time = index[order], times[order]
    period = float((time[-1] - time[0]) / frame[-1])
    # Printed times are rounded: one unit of their last decimal is not a departure from uniformity.
    pieces = [re.split("[.,]", cell) for cell in table.texts(columns.roles["time"])]
    decimals = max(len(piece[-1]) if len(piece) > 1 else 0 for piece in pieces)
    rounding = 10.0**-decimals if 0 < decimals < 12 and 10.0**-decimals < period / 2 else 0.0
    departure = np.abs(np.diff(time) - np.diff(frame) * period)
    if period < 1e-9 or departure.max(initial=0) > 0.01 * period + rounding:
        k = int(order[departure.argmax() + 1])
        raise damaged(
            "the times are not uniform",
            table.place(k),
            f"{period:g} s from frame to frame, within 1 %",
            f"{times[k]:g} s in frame {index[k]} after the first",
        )
    # Times that are uniform as printed are exact; otherwise their ends are known to one rounding.
    doubt = rounding / (period * frame[-1]) if departure.max(initial=0) > 1e-6 * period else 0.0
    rate = float(f"{1 / period:.12g}")
    if given is None and doubt > 0.01:
        raise damaged(
            "the times are printed too coarsely to tell the frame rate within 1 %",
            table.where,
            "the option frame_rate_hz",
            f"{rate:.4g} Hz give or take {100 * doubt:.2g} %",
        )
    if abs(rate - round(rate)) <= doubt * rate < 0.5:  # the one whole number of hertz that explains them
        rate = float(round(rate))
    if not 1 <= rate <= 1e6 or (given is not None and abs(rate / given - 1) > 0.01 + doubt):
        raise damaged(
            "the times are not in seconds, or contradict the frame rate that was given",
            table.where,
            f"{given:g} Hz" if given is not None else "1 Hz or more",
            f"{rate:g} Hz",
        )
    return float(given) if given is not None else rate
