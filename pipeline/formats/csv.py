"""Tables of points as text, wide or long, recognised by their header.

Wide: a column ``time`` or ``frame``, then three columns for each point: ``head_x, head_y, head_z``
(``head.x``, ``head x``, ``HEAD_X`` and ``head_x_mm`` are read too).
Long: one row for each frame and point: ``frame`` or ``time``; ``joint``, ``point``, ``marker`` or ``name``;
``x, y, z`` (or ``x_mm``…); and ``unit`` where the table says it in a column.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.refusal import Refusal
from pipeline.skeleton import MILLIMETRES, MotionCapture

_LARGEST = 1e9
"""No position of a person is so many units away; a damaged file's may be, and would overflow later."""
_ROLES = {
    "time": {"time", "time_s", "t", "t_s"},
    "frame": {"frame", "frame#", "frame_number"},
    "point": {"joint", "point", "marker", "name"},
    "unit": {"unit", "units"},
}
_BRACKETED = re.compile(r"[ _.]?[(\[] *(\w+) *[)\]]$")
_COORDINATE = re.compile(
    rf"(?:(?P<point>.+)[ _.])?(?P<axis>[xyz])(?:[ _.](?P<unit>{'|'.join(MILLIMETRES)}))?", re.IGNORECASE
)


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str = "mm") -> MotionCapture:
    """The points of a table, in millimetres and in the file's own axes.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Needed when the table has no column of times; must agree with it within 1 % if it has.
    units : str
        The unit of length where the table itself names none.

    Returns
    -------
    MotionCapture
        Empty cells, NaN and absent rows are NaN and not valid.

    Raises
    ------
    Refusal
        If the header names no points, a cell is not a number, a point stands twice in one frame, times
        are not uniform within 1 %, or the unit or the rate cannot be known.
    """
    table = _read_table(Path(path))
    columns = _read_header(table)
    unit = _unit(table, columns, units)
    index = _frame_index(table, columns)
    rate = _rate(table, columns, index, frame_rate_hz)
    frames = int(index.max()) + 1
    coordinates = [[table.numbers(column) for column in axes.values()] for axes in columns.axes.values()]
    if "point" in columns.roles:
        cells = table.cells(columns.roles["point"])
        names = tuple(dict.fromkeys(cells))
        place = {name: k for k, name in enumerate(names)}
        sample = index * len(names) + np.array([place[cell] for cell in cells])
        values = np.transpose(coordinates[0])
    else:
        names = tuple(columns.axes)
        sample = (index[:, None] * len(names) + np.arange(len(names))).reshape(-1)
        values = np.transpose(coordinates, (2, 0, 1)).reshape(-1, 3)
    if "" in names:
        raise Refusal("a point has no name", where=f"{path}, line {table.lines[cells.index('')]}")
    # A row may name a far frame or a new point; memory stays in proportion to the file.
    if frames * len(names) > 1000 + 64 * len(sample):
        raise Refusal(
            "the table is nearly empty: frame numbers jump, or points have too many names",
            where=str(path),
            expected="a value for most frames and points",
            received=f"{len(sample)} samples for {frames} frames of {len(names)} points",
        )
    order = np.argsort(sample, kind="stable")
    again = order[1:][np.diff(sample[order]) == 0]
    if again.size:
        k = int(again.min())
        raise Refusal(
            f"the point {names[sample[k] % len(names)]!r} stands twice in one frame (two people?)",
            where=f"{path}, line {table.lines[k * len(index) // len(sample)]}",
            expected="one row for each frame and point",
        )
    positions = np.full((frames * len(names), 3), np.nan)
    positions[sample] = values * MILLIMETRES[unit]
    valid = np.isfinite(positions).all(axis=-1)
    positions[~valid] = np.nan
    if absent := len(positions) - len(sample):
        table.notes.append(f"{absent} of {len(positions)} samples have no row and are missing.")
    return MotionCapture(
        names=names,
        positions_mm=positions.reshape(frames, len(names), 3),
        valid=valid.reshape(frames, len(names)),
        frame_rate_hz=rate,
        units=unit,
        channels=(),
        angles_deg=np.empty((frames, 0)),
        notes=tuple(table.notes),
    )


def write(path: str | Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float) -> None:
    """Write positions as a long table in millimetres, every digit kept, missing samples empty.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P point names, all different.
    positions_mm : (T, P, 3) array
        NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    Refusal
        If the shapes do not fit each other, or a name, the rate or a coordinate cannot be written.
    """
    positions = np.asarray(positions_mm, dtype=float)
    where = str(path)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or 0 in positions.shape:
        raise Refusal(
            "the positions do not have the shape of the names",
            where=where,
            expected=f"(frames, {len(names)}, 3), none zero",
            received=str(positions.shape),
        )
    for k, name in enumerate(names):
        if not name or name != name.strip() or not name.isprintable() or name in names[:k]:
            raise Refusal("the table cannot hold the point name", where=where, received=repr(name))
    if not (math.isfinite(frame_rate_hz) and frame_rate_hz > 0) or np.isinf(positions).any():
        raise Refusal("the frame rate and the positions must be finite", where=where)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("frame", "time_s", "joint", "x_mm", "y_mm", "z_mm"))
    for frame, posture in enumerate(positions.tolist()):
        time = repr(frame / float(frame_rate_hz))
        for name, point in zip(names, posture, strict=True):
            writer.writerow((frame, time, name, *("" if x != x else repr(x) for x in point)))
    Path(path).write_text(text.getvalue(), encoding="utf-8", newline="\n")


@dataclass(frozen=True)
class _Table:
    where: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    """Line of the file at which each row ends."""
    decimal_comma: bool
    notes: list[str]

    def cells(self, column: int) -> list[str]:
        return [row[column].strip() for row in self.rows]

    def numbers(self, column: int, *, needed: bool = False) -> np.ndarray:
        """A column (R,) as float64; empty cells are NaN, or refused where a number is `needed`."""
        cells = self.cells(column)
        numbers = np.array([_number(c.replace(",", ".") if self.decimal_comma else c) for c in cells])
        usable = np.abs(numbers) <= _LARGEST
        if not needed:
            usable |= np.isnan(numbers)
        if not usable.all():
            k = int(np.argmin(usable))
            raise Refusal(
                f"the cell of column {self.header[column]!r} is not a usable number",
                where=f"{self.where}, line {self.lines[k]}",
                expected=f"a number below {_LARGEST:g}" + ("" if needed else ", or nothing"),
                received=repr(cells[k][:30]),
            )
        return numbers


def _number(cell: str) -> float:
    """The number in a cell: NaN if it is empty, infinite if it is no number."""
    try:
        return math.inf if "_" in cell else float(cell or "nan")  # Python reads 1_0 as ten
    except ValueError:
        return math.inf


def _read_table(path: Path) -> _Table:
    where = str(path)
    if not path.is_file():
        raise Refusal("there is no such file", where=where)
    notes: list[str] = []
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise Refusal("the file cannot be read", where=where, received=str(error.strerror)) from error
    if b"\0" in raw:
        raise Refusal("this is not a text file", where=f"{path}, byte {raw.index(0)}", received="a zero byte")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
        notes.append("The text is not UTF-8; its names were read as Latin-1.")
    head = text.lstrip().split("\n", 1)[0]
    delimiter = max("\t;,", key=head.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    rows, lines = [], []
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                lines.append(reader.line_num)
    except csv.Error as error:
        raise Refusal("the quoting is broken", where=f"{where}, line {reader.line_num}") from error
    if len(rows) < 2:
        raise Refusal(
            "there is no table", where=where, expected="a header and a row", received=f"{len(rows)} rows"
        )
    header = [cell.strip() for cell in rows[0]]
    while not header[-1]:
        header.pop()  # delimiters at the end of the line
    for k, row in enumerate(rows[1:], start=1):
        while len(row) > len(header) and not row[-1].strip():
            row.pop()
        if len(row) != len(header):
            raise Refusal(
                "the row has another number of cells than the header",
                where=f"{where}, line {lines[k]}",
                expected=f"{len(header)}",
                received=f"{len(row)}",
            )
    if not text.endswith(("\n", "\r")):
        notes.append("The last line has no line end: if the file was cut, its last number may be short.")
    return _Table(where, header, rows[1:], lines[1:], delimiter != ",", notes)


@dataclass(frozen=True)
class _Columns:
    roles: dict[str, int] = field(default_factory=dict)
    """Columns that are no coordinates: ``time``, ``frame``, ``point``, ``unit``."""
    axes: dict[str, dict[str, int]] = field(default_factory=dict)
    """Columns x, y, z of each point; of the point ``""`` in a long table."""
    units: set[str] = field(default_factory=set)


def _read_header(table: _Table) -> _Columns:
    columns = _Columns()
    unread: list[str] = []
    coordinates: list[tuple[str, str, str, int]] = []
    for column, title in enumerate(table.header):
        plain = _BRACKETED.sub(r"_\1", title)
        role = next((role for role, titles in _ROLES.items() if plain.lower() in titles), None)
        if role is not None:
            if role in columns.roles:
                _refuse_twice(table, table.header[columns.roles[role]], title)
            columns.roles[role] = column
        elif match := _COORDINATE.fullmatch(plain):
            point, axis, unit = match.group("point", "axis", "unit")
            coordinates.append((point or "", axis.lower(), (unit or "").lower(), column))
        else:
            unread.append(title)
    is_long = any(not point for point, *_ in coordinates)
    if not is_long and "point" in columns.roles:  # a name of the trial, say
        unread.append(table.header[columns.roles.pop("point")])
    for point, axis, unit, column in coordinates:
        if bool(point) == is_long:
            unread.append(table.header[column])
            continue
        axes = columns.axes.setdefault(point, {})
        if axis in axes:
            _refuse_twice(table, table.header[axes[axis]], table.header[column])
        axes[axis] = column
        columns.units.update({unit} - {""})
    for point, axes in columns.axes.items():
        if set(axes) != set("xyz"):
            raise Refusal(
                f"the point {point!r} lacks an axis" if point else "an axis is missing",
                where=f"{table.where}, line 1",
                expected="x, y and z",
                received=", ".join(sorted(axes)),
            )
        columns.axes[point] = {axis: axes[axis] for axis in "xyz"}
    if not columns.axes or (is_long and "point" not in columns.roles):
        raise Refusal(
            "the header names no points",
            where=f"{table.where}, line 1",
            expected="columns such as head_x, head_y, head_z; or joint, x, y, z",
            received=", ".join(table.header[:8]),
        )
    if not {"time", "frame"} & set(columns.roles):
        raise Refusal(
            "there is no column of times or frame numbers",
            where=f"{table.where}, line 1",
            expected="time or frame",
            received=", ".join(table.header[:8]),
        )
    if unread:
        table.notes.append("Columns that are not read: " + ", ".join(unread) + ".")
    return columns


def _refuse_twice(table: _Table, first: str, second: str) -> None:
    raise Refusal(
        "two columns hold the same thing", where=f"{table.where}, line 1", received=f"{first} and {second}"
    )


def _unit(table: _Table, columns: _Columns, otherwise: str) -> str:
    declared = set(columns.units)
    if "unit" in columns.roles:
        declared |= {cell.lower() for cell in table.cells(columns.roles["unit"])}
    unit = declared.pop() if len(declared) == 1 else "" if declared else otherwise
    if unit not in MILLIMETRES:
        raise Refusal(
            "the unit of length is unknown or not the same throughout",
            where=table.where,
            expected="one of " + ", ".join(MILLIMETRES),
            received=", ".join(sorted({*declared, unit} - {""})),
        )
    return unit


def _frame_index(table: _Table, columns: _Columns) -> np.ndarray:
    """The frame of each row (R,), counted from the first: by number if there is one, else by time."""
    if "frame" not in columns.roles:
        return np.unique(table.numbers(columns.roles["time"], needed=True), return_inverse=True)[1]
    frames = table.numbers(columns.roles["frame"], needed=True)
    fractional = np.flatnonzero(frames != np.round(frames))
    if fractional.size:
        k = int(fractional[0])
        raise Refusal(
            "the frame number is not whole",
            where=f"{table.where}, line {table.lines[k]}",
            received=f"{frames[k]:g}",
        )
    return (frames - frames.min()).astype(int)


def _rate(table: _Table, columns: _Columns, index: np.ndarray, given: float | None) -> float:
    """Frames per second from the times, or as given."""
    if given is not None and not (math.isfinite(given) and given > 0):
        raise Refusal("the frame rate is not positive", where=table.where, received=f"{given:g}")
    if "time" not in columns.roles or index.max() == 0:
        if given is None:
            raise Refusal(
                "the frame rate is unknown",
                where=table.where,
                expected="a column of times with two frames or more, or the option frame_rate_hz",
            )
        return float(given)
    times = table.numbers(columns.roles["time"], needed=True)
    order = np.lexsort((times, index))
    frame, time = index[order], times[order]
    period = float((time[-1] - time[0]) / frame[-1])
    # Printed times are rounded: one unit of their last decimal is not a departure from uniformity.
    pieces = [re.split("[.,]", cell) for cell in table.cells(columns.roles["time"])]
    decimals = max(len(piece[-1]) if len(piece) > 1 else 0 for piece in pieces)
    rounding = 10.0**-decimals if 0 < decimals < 12 and 10.0**-decimals < period / 2 else 0.0
    departure = np.abs(np.diff(time) - np.diff(frame) * period)
    if period < 1e-9 or departure.max(initial=0) > 0.01 * period + rounding:
        k = int(order[departure.argmax() + 1])
        raise Refusal(
            "the times are not uniform",
            where=f"{table.where}, line {table.lines[k]}",
            expected=f"{period:g} s from frame to frame, within 1 %",
            received=f"{times[k]:g} s in frame {index[k]} after the first",
        )
    # Times that are uniform as printed are exact; otherwise their ends are known to one rounding.
    doubt = rounding / (period * frame[-1]) if departure.max(initial=0) > 1e-6 * period else 0.0
    rate = float(f"{1 / period:.12g}")
    if given is None and doubt > 0.01:
        raise Refusal(
            "the times are printed too coarsely to tell the frame rate within 1 %",
            where=table.where,
            expected="the option frame_rate_hz",
            received=f"{rate:.4g} Hz give or take {100 * doubt:.2g} %",
        )
    if abs(rate - round(rate)) <= doubt * rate < 0.5:  # the one whole number of hertz that explains them
        rate = float(round(rate))
    if not 1 <= rate <= 1e6 or (given is not None and abs(rate / given - 1) > 0.01 + doubt):
        raise Refusal(
            "the times are not in seconds, or contradict the frame rate that was given",
            where=table.where,
            expected=f"{given:g} Hz" if given is not None else "1 Hz or more",
            received=f"{rate:g} Hz",
        )
    return float(given) if given is not None else rate
