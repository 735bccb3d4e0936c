"""A table of points as text: its rows, its numbers, and the columns that its header names."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import Rows
from pipeline.formats.text import read_text
from pipeline.skeleton.recorded import MILLIMETRES

_ROLES = {
    "time": {"time", "time_s", "t", "t_s", "timestamp", "timestamp_s", "time_seconds", "time_sec", "seconds"},
    "frame": {"frame", "frame#", "frame_number", "frame_index", "frame_id"},
    "point": {"joint", "point", "marker", "name"},
    "unit": {"unit", "units"},
    "person": {"person", "person_id", "subject", "subject_id", "track_id"},
}
_REMARK = re.compile(r"(#|//|%)[^\t;,\n]*([\t;,][^\t;,\n]*)?\n")
"""A line of words in front of the header: with two cells at most, for a header has more."""
_BRACKETED = re.compile(r"[ _.]?[(\[] *(\w+) *[)\]]$")
_POSITION = re.compile(r"[ _.](position|pos)$", re.IGNORECASE)
_ROTATION = re.compile(r"[ _.](rotation|rot|euler)$", re.IGNORECASE)
_COORDINATE = re.compile(
    rf"(?:(?P<point>.+)[ _.:-])?(?P<axis>[xyz])(?:[ _.](?P<unit>{'|'.join(MILLIMETRES)}))?", re.IGNORECASE
)


def read_table(path: Path) -> Rows:
    """Read a table whose cells are separated by commas, semicolons or tabs.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is no table, or a row is not as long as the header.
    """
    where = path.name
    text, notes = read_text(path)
    begin = 0
    while remark := _REMARK.match(text, begin):
        begin = remark.end()
    text, remarks = text[begin:], text.count("\n", 0, begin)  # lines before the header
    head = text.lstrip().split("\n", 1)[0]
    delimiter = max("\t;,", key=head.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    rows, lines = [], []
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append(row)
                lines.append(reader.line_num + remarks)
    except csv.Error as error:
        raise damaged("the quoting is broken", f"{where}, line {reader.line_num + remarks}") from error
    if len(rows) < 2:
        raise damaged("there is no table", where, "a header and a row", f"{len(rows)} rows")
    header = [cell.strip() for cell in rows.pop(0)]
    while not header[-1]:
        header.pop()  # delimiters at the end of the line
    table = Rows(where, rows, lines[1:], notes, delimiter != ",", header)
    for k, row in enumerate(rows):
        while len(row) > len(header) and not row[-1].strip():
            row.pop()
        if len(row) != len(header):
            raise damaged(
                "the row has another number of cells than the header", table.place(k), len(header), len(row)
            )
    return table


@dataclass(frozen=True)
class Columns:
    """What each column of a table holds."""

    roles: dict[str, int] = field(default_factory=dict)
    """Columns that are no coordinates: ``time``, ``frame``, ``point``, ``unit``, ``person``."""
    axes: dict[str, dict[str, int]] = field(default_factory=dict)
    """Columns x, y, z of each point; of the point ``""`` in a long table."""
    units: set[str] = field(default_factory=set)


def read_header(table: Rows, *, rate_is_given: bool = False) -> Columns:
    """Find out what the columns hold, by their titles; columns that are not read are noted.

    Parameters
    ----------
    table : Rows
    rate_is_given : bool
        Whether the rows of a wide table may be frames without a time or a number.

    Raises
    ------
    InvalidInput
        If the header names no points or neither times nor frames, a point lacks an axis, or two columns hold
        the same thing.
    """
    columns, place = Columns(), f"{table.where}, line 1"
    twice, beginning = "two columns hold the same thing", ", ".join(table.header[:8])
    unread: list[str] = []
    coordinates: list[tuple[str, str, str, int]] = []
    for column, title in enumerate(table.header):
        plain = _BRACKETED.sub(r"_\1", title)
        role = next((role for role, titles in _ROLES.items() if plain.lower() in titles), None)
        if role is not None:
            if role in columns.roles:
                raise damaged(twice, place, received=f"{table.header[columns.roles[role]]} and {title}")
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
            raise damaged(twice, place, received=f"{table.header[axes[axis]]} and {table.header[column]}")
        axes[axis] = column
        columns.units.update({unit} - {""})
    for point, axes in columns.axes.items():
        if set(axes) != set("xyz"):
            raise damaged(
                f"the point {point!r} lacks an axis" if point else "an axis is missing",
                place,
                "x, y and z",
                ", ".join(sorted(axes)),
            )
        columns.axes[point] = {axis: axes[axis] for axis in "xyz"}
    if not columns.axes or (is_long and "point" not in columns.roles):
        raise damaged(
            "the header names no points",
            place,
            "columns such as head_x, head_y, head_z; or joint, x, y, z",
            beginning,
        )
    if not {"time", "frame"} & set(columns.roles) and (is_long or not rate_is_given):
        raise damaged(
            "there is no column of times or frame numbers",
            place,
            "time or frame" + ("" if is_long else ", or the option frame_rate_hz: a row is a frame then"),
            beginning,
        )
    _drop_rotations(columns, unread, table.header)
    if unread:
        table.notes.append("Columns that are not read: " + ", ".join(unread) + ".")
    return columns


def _drop_rotations(columns: Columns, unread: list[str], header: list[str]) -> None:
    """Keep the positions of a table that says of each point which columns are its position and which its rotation."""
    positions = {name: _POSITION.sub("", name) for name in columns.axes if _POSITION.search(name)}
    if len(set(positions.values())) < len(positions) or set(positions.values()) & set(columns.axes):
        return
    for name in [name for name in columns.axes if positions and _ROTATION.search(name)]:
        unread += [header[column] for column in columns.axes.pop(name).values()]
    for name, plain in positions.items():
        columns.axes[plain] = columns.axes.pop(name)


def unit_of_length(table: Rows, columns: Columns, otherwise: str) -> str:
    """Unit of length that the header or a column of units names; else `otherwise`.

    Raises
    ------
    InvalidInput
        If there is more than one.
    """
    declared = set(columns.units)
    if "unit" in columns.roles:
        declared |= {cell.lower() for cell in table.texts(columns.roles["unit"])}
    if len(declared) > 1:
        raise damaged(
            "the unit of length is not the same throughout",
            table.where,
            "one unit",
            ", ".join(sorted(declared)),
        )
    return declared.pop() if declared else otherwise
