"""Reader and writer of tables of points as text; the header determines if a table is wide or long.

Wide: a column ``time`` or ``frame``, then three columns for each point: ``head_x, head_y, head_z``
(``head.x``, ``head x``, ``head:x``, ``head-x``, ``HEAD_X`` and ``head_x_mm`` are read too).
Long: one row for each frame and point: ``frame`` or ``time``; ``joint``, ``point``, ``marker`` or ``name``;
``x, y, z`` (or ``x_mm``…); and optionally ``unit``.
Both may have a column ``person`` or ``subject``; with several people, names begin with it (``anna:head``).
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import compare_frames, damaged, leave_out_placeholders, motion_capture
from pipeline.formats.points.cells import Rows, positions_to_write
from pipeline.formats.points.csv import bids
from pipeline.formats.points.csv.table import (
    UNSURE,
    Columns,
    read_header,
    read_table,
    role_of,
    set_to_seconds,
    unit_of_length,
)
from pipeline.formats.points.even_times import at_equal_intervals
from pipeline.formats.points.sections import exported
from pipeline.formats.text import millimetres_in
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import harmless


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the points of a table (plain, or exported by Nexus, QTM or Motive) in the file's axes.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Frames per second, required if the table has no times.  A wide table then needs no frame numbers.  The rate
        must agree with the times within 1 %, and uneven times are resampled to it.  If all rows are a whole number
        of these frames apart, the rate of the times is used instead.
    units : str, optional
        Unit of length if the table does not state it; default ``"mm"``.

    Returns
    -------
    MotionCapture
        Samples of empty cells, NaN and missing rows are NaN and invalid.

    Raises
    ------
    InvalidInput
        If the header names no points, a cell is not a number, a point is repeated within a frame, times do not
        increase, or the unit or the rate is unknown.
    """
    if (motion := exported(path, frame_rate_hz, units)) is not None:
        return motion
    titles, stated = bids.titles_and_rate(path)
    table = read_table(path, titles)
    frequency = table.settings.get("frequency", np.inf)
    frame_rate_hz = stated or frame_rate_hz or (frequency if 0 < frequency < 1e6 else None)
    columns = read_header(table, rate_is_given=frame_rate_hz is not None)
    unit = unit_of_length(table, columns, "mm" if units is None else units)
    millimetres = millimetres_in(unit, table.where)
    times, first, index = _frames(table, columns, frame_rate_hz)
    declared = (table.settings[key] for key in ("frames", "no_of_frames") if key in table.settings)
    compare_frames(next(declared, np.nan), len(times), table.notes)
    names, point = _points(table, columns)
    values = table.numbers([column for axes in columns.axes.values() for column in axes.values()]).reshape(
        -1, 3
    )
    sample = (index[:, None] * len(names) + point).reshape(-1)
    # Each row may name a new point.
    empty = "the table is nearly empty: it has too many point names for its rows"
    require_points(len(times), len(names), table.where, empty, code="nearly_empty")
    order = np.argsort(sample, kind="stable")
    repeated = order[1:][np.diff(sample[order]) == 0]
    if repeated.size:
        k = int(repeated.min())
        raise damaged(
            f"the point {names[sample[k] % len(names)]!r} is repeated within a frame (two people?)",
            table.place(k * len(index) // len(sample)),
            "one row for each frame and point",
            code="point_twice",
            point=names[sample[k] % len(names)],
        )
    positions = np.full((len(times) * len(names), 3), np.nan)
    positions[sample] = values * millimetres
    if absent := len(positions) - len(sample):
        table.notes.append(f"{absent} of {len(positions)} samples have no row and are missing.")
    assumed = units is None and not (columns.units or "unit" in columns.roles)
    shaped = positions.reshape(len(times), len(names), 3)
    leave_out_placeholders(shaped, table.notes, millimetres)
    shaped, rate = at_equal_intervals(
        times, shaped, frame_rate_hz, lambda k: table.place(int(first[k])), table.notes
    )
    return motion_capture(names, shaped, rate, unit, table.notes, units_assumed=assumed)


def _frames(
    table: Rows, columns: Columns, rate_option: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the times (T,) of the frames, s, the first row of each frame, and the frame index of each row (R,).

    A frame is identified by its number, else by its time, else by its row.  In a wide table, a column such as
    `FrameNumber` may count something else: if its numbers repeat, the time identifies the frame.

    Raises
    ------
    InvalidInput
        If a frame number is not whole, or neither times nor the frame rate are available.
    """
    times = np.arange(len(table.cells), dtype=float)
    if timed := "time" in columns.roles:
        set_to_seconds(table, columns.roles["time"])
        times = table.column(columns.roles["time"])
    frames = table.column(columns.roles["frame"]) if "frame" in columns.roles else times
    fractional = np.flatnonzero(frames != np.round(frames))
    if "frame" in columns.roles and fractional.size:
        k = int(fractional[0])
        raise damaged(
            "the frame number is not whole",
            table.place(k),
            received=f"{frames[k]:g}",
            code="frame_not_whole",
            frame=float(frames[k]),
        )
    each, first, index = np.unique(frames, return_index=True, return_inverse=True)
    if (
        timed
        and len(each) < len(frames)
        and not {"point", "person"} & set(columns.roles)
        and UNSURE.fullmatch(role_of(table.header[columns.roles.get("frame", 0)])[1])
    ):
        # For example, a slower camera repeats its frame number until its next frame.
        each, first, index = np.unique(times, return_index=True, return_inverse=True)
    if timed and len(each) > 1:
        return times[first], first, index
    if rate_option is None:
        expected = "a column of times with two frames or more, or the option frame_rate_hz"
        raise damaged("the frame rate is unknown", table.where, expected, code="unknown_rate")
    return (each - each[0]) / rate_option, first, index


def _points(table: Rows, columns: Columns) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the point names (P,), and the indices of the points in each row.

    The indices are (R, 1) for a long table and (R, P') for a wide table.

    With several people, point names begin with the person's name.
    """
    rows = len(table.cells)
    if "point" in columns.roles:
        named = [[name] for name in table.texts(columns.roles["point"])]
    else:
        named = [list(columns.axes)] * rows
    if any(not names[0] for names in named):
        raise damaged(
            "the name of a point is empty",
            table.place(next(k for k in range(rows) if not named[k][0])),
            code="no_name",
        )
    if "person" in columns.roles:
        people = [person[:80] for person in table.texts(columns.roles["person"])]
        if len(set(people)) > 1:
            named = [
                [f"{person}:{name}" for name in names] for person, names in zip(people, named, strict=True)
            ]
    index: dict[str, int] = {}
    point = np.array([[index.setdefault(name, len(index)) for name in names] for names in named])
    return tuple(index), point


def write(
    path: Path,
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    *,
    wide: bool = False,
) -> None:
    """Write positions as a table in millimetres with all digits; cells of missing samples are empty.

    Parameters
    ----------
    path : Path
    names : sequence of str
        P point names, all different.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float
    wide : bool
        True for a row per frame with three columns per point; False for a row per frame and point.

    Raises
    ------
    InvalidInput
        If the shapes do not match, or a name, the rate or a coordinate cannot be written.
    """
    positions = positions_to_write(names, positions_mm, frame_rate_hz, path.name, distinct=True)
    names = [*map(harmless, names)]
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
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])
