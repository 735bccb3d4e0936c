"""Reader and writer of TRC files: marker trajectories as text, for OpenSim and markerless pipelines.

The header has five lines: kind of file, names of the settings, their values, marker names, axis names.  Each frame is
a line with its number, time in seconds, and x, y, z of each marker.  Columns are separated by tabs, commas, semicolons
or spaces.  An empty cell is a missing coordinate, except with spaces, where no cell may be empty.  The line of axis
names identifies the columns of numbers, and blank columns between them are skipped.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.formats.contract import LARGEST, compare_frames, damaged, leave_out_placeholders, motion_capture
from pipeline.formats.points.cells import Rows, positions_to_write
from pipeline.formats.points.even_times import at_equal_intervals
from pipeline.formats.text import millimetres_in, number, read_text, unit_of
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import harmless


@dataclass(frozen=True)
class Table:
    """Header settings, marker names, times and positions of a TRC file.

    Attributes
    ----------
    settings : dict of str to str
        Settings of the header, by their names in lower case.
    rate : float or None
        Frame rate that the header declares, Hz.
    names : tuple of str
        Names of the P markers.
    times : (R,) float64
        Seconds, NaN where blank.
    positions : (R, P, 3) float64
        In the unit of the file, NaN where blank.
    rows : Rows
        Rows below the header, and notes.
    """

    settings: dict[str, str]
    rate: float | None
    names: tuple[str, ...]
    times: np.ndarray
    positions: np.ndarray
    rows: Rows


_AXIS = re.compile(r"[XYZ]\d*", re.IGNORECASE)


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the markers of a TRC file in the file's axes.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Frames per second, used if the file has no rate (DataRate 0) and no times.
    units : str, optional
        Unit of length if the file has no setting Units; default ``"mm"``.

    Returns
    -------
    MotionCapture
        A marker with a blank or NaN coordinate is NaN and invalid in that frame.  These are noted and tolerated: other
        counts of frames or markers than declared, a truncated last line, missing frames, uneven times (resampled),
        blank or repeated names or columns.

    Raises
    ------
    InvalidInput
        If the file is not TRC, the columns do not match the names, the unit or the frame rate is unknown, or the
        times contradict the frame rate.
    """
    table, where = read_table(path), path.name
    stated = unit_of(table.settings.get("units", "")) or units
    unit = stated or "mm"
    positions = table.positions * millimetres_in(unit, f"{where}, Units in line 3")
    notes = table.rows.notes
    leave_out_placeholders(positions, notes)
    rate = table.rate
    if np.isnan(table.times).all():
        rate = rate or frame_rate_hz
        if rate is None:
            raise damaged(
                "the frame rate is unknown",
                f"{where}, column Time",
                "the option frame_rate_hz",
                code="unknown_rate",
            )
    else:
        positions, rate = at_equal_intervals(table.times, positions, rate, table.rows.place, notes)
    return motion_capture(table.names, positions, rate, unit, notes, units_assumed=not stated)


def read_table(path: Path) -> Table:
    """Read the header and rows of a TRC file.  Raises the same exceptions as `read`."""
    where = path.name
    text, notes = read_text(path)
    lines = text.lstrip("\n").split("\n")
    if len(lines) < 5 or not lines[0].lstrip('"').startswith("PathFileType"):
        raise damaged(
            "this is not a TRC file",
            f"{where}, line 1",
            "five lines of header that begin with PathFileType",
            f"{lines[0]!r:.40}",
            code="wrong_format",
        )
    separator = max("\t,;", key=lines[3].count)
    cells = partial(_cells, separator=separator if lines[3].count(separator) > 1 else None)
    settings = _settings(cells(lines[1]), cells(lines[2]))
    rate = _rate(settings, where)
    # Some writers leave out the line of axis names, or the blank line after it.
    axes = cells(lines[4]) if not np.isfinite(number(cells(lines[4])[0] or "x")) else []
    first = 5 if axes else 4
    filled = [k for k in range(first, len(lines)) if lines[k].strip(" \t,;")]
    rows = Rows(where, [cells(lines[k]) for k in filled], [k + 1 for k in filled], notes)
    frames = number(settings.get("numframes", ""))
    _leave_out_cut(rows, text.endswith("\n"), frames)
    if separator != "," and any("," in cell for row in rows.cells[:1] for cell in row):
        rows.decimal_comma = True
        notes.append("Commas inside numbers were read as decimal points.")
    count = len(rows.cells)
    if not count:
        raise damaged("the file has no frames", where, "rows of numbers after the header", code="no_frames")
    compare_frames(frames, count, notes)
    declared = number(settings.get("nummarkers", ""))
    names, columns = _markers(cells(lines[3]), axes, rows, declared)
    if np.isfinite(declared) and declared != len(names):
        notes.append(f"The file declares {declared:g} markers but names {len(names)}; the names are used.")
    if short := [k for k, row in enumerate(rows.cells) if len(row) <= columns[-1]]:
        raise damaged(
            "the number of cells in the line does not match the header",
            rows.place(short[0]),
            columns[-1] + 1,
            len(rows.cells[short[0]]),
            code="wrong_count",
            needed=columns[-1] + 1,
            count=len(rows.cells[short[0]]),
        )
    numbers = rows.numbers([0, 1, *columns])
    positions = numbers[:, 2:].reshape(count, len(names), 3)
    return Table(settings, rate, names, numbers[:, 1], positions, rows)


def write(path: Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float) -> None:
    """Write marker positions as TRC in millimetres with all digits; cells of missing samples are blank.

    Parameters
    ----------
    path : Path
    names : sequence of str
        P marker names.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the shapes do not match, or a name, the rate or a coordinate cannot be written.
    """
    positions = positions_to_write(names, positions_mm, frame_rate_hz, path.name, distinct=False)
    if quoted := [name for name in names if name != name.strip('"')]:
        raise damaged(
            "the table cannot store the point name", path.name, received=quoted[0], code="unwritable_name"
        )
    names = [*map(harmless, names)]
    rate = repr(float(frame_rate_hz))
    frames, markers = positions.shape[:2]
    axes = (f"{axis}{k}" for k in range(1, markers + 1) for axis in "XYZ")
    # The file was never cut or resampled, so its original settings equal the written ones.
    settings = {
        "DataRate": rate,
        "CameraRate": rate,
        "NumFrames": str(frames),
        "NumMarkers": str(markers),
        "Units": "mm",
        "OrigDataRate": rate,
        "OrigDataStartFrame": "1",
        "OrigNumFrames": str(frames),
    }
    header = [
        ("PathFileType", "4", "(X/Y/Z)", harmless(path.name)),
        tuple(settings),
        tuple(settings.values()),
        ("Frame#", "Time", *itertools.chain.from_iterable((name, "", "") for name in names)),
        ("", "", *axes),
    ]
    rows = (
        (str(k + 1), f"{k / frame_rate_hz:.12g}", *("" if x != x else repr(x) for x in row))
        for k, row in enumerate(positions.reshape(frames, -1).tolist())
    )
    text = "".join("\t".join(cells) + "\n" for cells in itertools.chain(header, rows))
    path.write_text(text, encoding="utf-8", newline="\n")


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip(' "') for cell in line.split(separator)] or [""]


def _settings(keys: list[str], values: list[str]) -> dict[str, str]:
    """Return the settings of the header by name (in lower case), without blank columns."""
    if sum(map(bool, keys)) == sum(map(bool, values)):
        keys, values = [key for key in keys if key], [value for value in values if value]
    return {key.lower(): value for key, value in zip(keys, values, strict=False) if key}


def _rate(settings: dict[str, str], where: str) -> float | None:
    """Return the frame rate, Hz, that the header declares; None if the rate is missing or not above 0."""
    written = settings.get("datarate", "")
    value = number(written.replace(",", ".")) if written else 0.0
    if not abs(value) < LARGEST:
        raise damaged(
            "the setting DataRate cannot be used",
            f"{where}, line 3",
            "a positive number",
            f"{written:.40}",
            code="unusable_rate",
            text=written,
        )
    return value if value > 0 else None


def _leave_out_cut(rows: Rows, ended: bool, declared: float) -> None:
    """Drop a truncated last row: shorter than the other rows, or unfinished in a file with too few frames."""
    count = len(rows.cells)
    widest = max(map(len, rows.cells[:-1]), default=0)
    cut = count and (len(rows.cells[-1]) < widest or (not ended and count < declared))
    if cut and not (ended and count == declared):
        rows.cells.pop()
        rows.notes.append(f"The last line ({rows.lines[-1]}) is truncated and is not read.")


def _markers(
    heading: list[str], axes: list[str], rows: Rows, declared: float
) -> tuple[tuple[str, ...], list[int]]:
    """Return the names of the markers, and the column indices of their coordinates x, y, z."""
    location = f"{rows.where}, line 4"
    if heading[0].lower().rstrip("#") != "frame" or len(heading) < 3:
        raise damaged(
            "the line of marker names cannot be read",
            location,
            "Frame#, Time and names",
            f"{heading[:2]!r:.40}",
            code="unreadable_header",
        )
    named = [(column, name) for column, name in enumerate(heading) if column > 1 and name]
    if (
        len(named) > 2
        and len(named) % 3 == 0
        and all(len({name for _, name in named[k : k + 3]}) == 1 for k in range(0, len(named), 3))
    ):  # each name is repeated over its three columns
        named = named[::3]
    at = [column for column, name in enumerate(axes) if _AXIS.fullmatch(name)]
    count = len(at) // 3 or len(named)
    width = max(map(_width, rows.cells))
    in_a_row = [column for column, _ in named] == list(range(2, 2 + 3 * len(named), 3))
    if in_a_row and len(named) < count and width <= 2 + 3 * len(named):
        count, at = len(named), at[: 3 * len(named)]  # more axes than names, but no numbers under them
    # Blank columns may occur in all lines, only in the header, or only in the numbers.
    if len(at) != 3 * count or at[0] < 2 or not any(len(cells) > at[-1] for cells in rows.cells):
        at = list(range(2, 2 + 3 * count))
    if width > at[-1] + 1:
        filled = sorted(
            {column for cells in rows.cells for column, cell in enumerate(cells) if cell and column > 1}
        )
        if in_a_row and len(named) == count and width == 2 + 3 * declared:
            filled = at  # columns of declared markers without names and axes
        if len(filled) != 3 * count:
            longer = next(k for k, cells in enumerate(rows.cells) if _width(cells) > at[-1] + 1)
            raise damaged(
                "the number of cells in the line does not match the header",
                rows.place(longer),
                at[-1] + 1,
                width,
                code="wrong_count",
                needed=at[-1] + 1,
                count=width,
            )
        at = filled
    starts = at[::3]
    if len(named) == count:
        return tuple(name for _, name in named), at
    by_column = dict(named)
    names = tuple(by_column.pop(start, f"point_{k}") for k, start in enumerate(starts, start=1))
    if by_column:
        raise damaged(
            "the marker names do not match the columns",
            location,
            f"{count} names, each over three columns",
            f"{len(named)} names",
            code="misplaced_names",
            count=len(named),
        )
    rows.notes.append(
        f"{count - len(named)} markers have no name; they are named point_1, point_2… by position."
    )
    return names, at


def _width(cells: list[str]) -> int:
    """Return the number of cells of a line up to its last cell that is not blank."""
    return max((k for k, cell in enumerate(cells, start=1) if cell), default=0)
