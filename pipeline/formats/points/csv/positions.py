"""Tables of points as text, wide or long as their header says.

Wide: a column ``time`` or ``frame``, then three columns for each point: ``head_x, head_y, head_z``
(``head.x``, ``head x``, ``head:x``, ``head-x``, ``HEAD_X`` and ``head_x_mm`` are read too).
Long: one row for each frame and point: ``frame`` or ``time``; ``joint``, ``point``, ``marker`` or ``name``;
``x, y, z`` (or ``x_mm``…); and ``unit`` where the table says it in a column.
Both may have a column ``person`` or ``subject``: of several people, names begin with it (``anna:head``).
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, leave_out_placeholders, motion_capture
from pipeline.formats.points.cells import Rows, positions_to_write
from pipeline.formats.points.csv.table import Columns, read_header, read_table, set_to_seconds, unit_of_length
from pipeline.formats.points.sections import exported
from pipeline.formats.text import millimetres_in
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import require_range


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the points of a table, plain or exported by Nexus, QTM or Motive, in the file's axes.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Needed if the table has no column of times, and enough for a wide one that has no numbers of frames either;
        must agree with the times within 1 % if it has.
    units : str, optional
        Unit of length if the table names none; ``"mm"`` if not given.

    Returns
    -------
    MotionCapture
        Empty cells, NaN and absent rows are NaN and not valid.

    Raises
    ------
    InvalidInput
        If the header names no points, a cell is not a number, a point stands twice in one frame, times
        are not uniform within 1 %, or the unit or the rate cannot be known.
    """
    if (motion := exported(Path(path), frame_rate_hz, units)) is not None:
        return motion
    table = read_table(Path(path))
    columns = read_header(table, rate_is_given=frame_rate_hz is not None)
    if "time" in columns.roles:
        set_to_seconds(table, columns.roles["time"])
    unit = unit_of_length(table, columns, "mm" if units is None else units)
    millimetres = millimetres_in(unit, table.where)
    index = frame_index(table, columns)
    rate = frame_rate(table, columns, index, frame_rate_hz)
    frames = int(index.max()) + 1
    names, point = _points(table, columns)
    values = table.numbers([column for axes in columns.axes.values() for column in axes.values()]).reshape(
        -1, 3
    )
    sample = (index[:, None] * len(names) + point).reshape(-1)
    # A row may name a far frame or a new point.
    empty = "the table is nearly empty: frame numbers jump, or points have too many names"
    require_points(frames, len(names), table.where, empty)
    order = np.argsort(sample, kind="stable")
    again = order[1:][np.diff(sample[order]) == 0]
    if again.size:
        k = int(again.min())
        raise damaged(
            f"the point {names[sample[k] % len(names)]!r} stands twice in one frame (two people?)",
            table.place(k * len(index) // len(sample)),
            "one row for each frame and point",
        )
    positions = np.full((frames * len(names), 3), np.nan)
    positions[sample] = values * millimetres
    if absent := len(positions) - len(sample):
        table.notes.append(f"{absent} of {len(positions)} samples have no row and are missing.")
    assumed = units is None and not (columns.units or "unit" in columns.roles)
    shaped = positions.reshape(frames, len(names), 3)
    leave_out_placeholders(shaped, table.notes, millimetres)
    return motion_capture(names, shaped, rate, unit, table.notes, units_assumed=assumed)


def _points(table: Rows, columns: Columns) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of the points (P,), and which of them each row holds, (R, 1) of a long or (R, P') of a wide table.

    Where the rows belong to several people, names begin with theirs.
    """
    rows = len(table.cells)
    if "point" in columns.roles:
        named = [[name] for name in table.texts(columns.roles["point"])]
    else:
        named = [list(columns.axes)] * rows
    if any(not names[0] for names in named):
        raise damaged("a point has no name", table.place(next(k for k in range(rows) if not named[k][0])))
    if "person" in columns.roles:
        people = [who[:80] for who in table.texts(columns.roles["person"])]
        if len(set(people)) > 1:
            named = [[f"{who}:{name}" for name in names] for who, names in zip(people, named, strict=True)]
    place: dict[str, int] = {}
    point = np.array([[place.setdefault(name, len(place)) for name in names] for names in named])
    return tuple(place), point


def write(
    path: str | Path,
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    *,
    wide: bool = False,
) -> None:
    """Write positions as a table in millimetres, every digit kept, missing samples empty.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P point names, all different.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float
    wide : bool
        A row for each frame, three columns for each point, instead of a row for each frame and point.

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, the rate or a coordinate cannot be written.
    """
    positions = positions_to_write(names, positions_mm, frame_rate_hz, Path(path).name, distinct=True)
    times = np.arange(len(positions)) / float(frame_rate_hz)
    cells = [["" if x != x else x for x in row] for row in positions.reshape(len(positions), -1).tolist()]
    if wide:
        header = ["time_s", *(f"{name}_{axis}_mm" for name in names for axis in "xyz")]
        rows = [[time, *row] for time, row in zip(times.tolist(), cells, strict=True)]
    else:
        header = ["frame", "time_s", "joint", "x_mm", "y_mm", "z_mm"]
        rows = [
            [frame, time, name, *row[3 * k : 3 * k + 3]]
            for frame, (time, row) in enumerate(zip(times.tolist(), cells, strict=True))
            for k, name in enumerate(names)
        ]
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    Path(path).write_text(text.getvalue(), encoding="utf-8", newline="\n")


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
