"""A table of points as text: its rows, its numbers, and what its header says of its columns."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.formats.points.point_table import notes_on_the_end, number_in, read_characters
from pipeline.formats.text import LARGEST
from pipeline.skeleton import MILLIMETRES
from pipeline.validation import InvalidInput

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


@dataclass(frozen=True)
class Table:
    """The rows of a file, all as long as its header."""

    where: str
    header: list[str]
    rows: list[list[str]]
    lines: list[int]
    """Line of the file at which each row ends."""
    decimal_comma: bool
    notes: list[str]

    def cells(self, column: int) -> list[str]:
        """A column (R,) as text without blanks around it."""
        return [row[column].strip() for row in self.rows]

    def numbers(self, column: int, *, needed: bool = False) -> np.ndarray:
        """A column (R,) as float64; empty cells are NaN, or refused where a number is `needed`."""
        cells = self.cells(column)
        read = [number_in(cell.replace(",", ".") if self.decimal_comma else cell) for cell in cells]
        numbers = np.array([math.inf if number is None else number for number in read])
        usable = np.abs(numbers) <= LARGEST
        if not needed:
            usable |= np.isnan(numbers)
        if not usable.all():
            k = int(np.argmin(usable))
            raise InvalidInput(
                f"the cell of column {self.header[column]!r} is not a usable number",
                where=f"{self.where}, line {self.lines[k]}",
                expected=f"a number below {LARGEST:g}" + ("" if needed else ", or nothing"),
                received=repr(cells[k][:30]),
            )
        return numbers


def read_table(path: Path) -> Table:
    """The table in a file; commas, semicolons or tabs separate its cells.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is no table, or a row is not as long as the header.
    """
    where = str(path)
    text, notes = read_characters(path)
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
        raise InvalidInput("the quoting is broken", where=f"{where}, line {reader.line_num}") from error
    if len(rows) < 2:
        raise InvalidInput(
            "there is no table", where=where, expected="a header and a row", received=f"{len(rows)} rows"
        )
    header = [cell.strip() for cell in rows[0]]
    while not header[-1]:
        header.pop()  # delimiters at the end of the line
    for k, row in enumerate(rows[1:], start=1):
        while len(row) > len(header) and not row[-1].strip():
            row.pop()
        if len(row) != len(header):
            raise InvalidInput(
                "the row has another number of cells than the header",
                where=f"{where}, line {lines[k]}",
                expected=f"{len(header)}",
                received=f"{len(row)}",
            )
    notes += notes_on_the_end(text)
    return Table(where, header, rows[1:], lines[1:], delimiter != ",", notes)


@dataclass(frozen=True)
class Columns:
    """What each column of a table holds."""

    roles: dict[str, int] = field(default_factory=dict)
    """Columns that are no coordinates: ``time``, ``frame``, ``point``, ``unit``."""
    axes: dict[str, dict[str, int]] = field(default_factory=dict)
    """Columns x, y, z of each point; of the point ``""`` in a long table."""
    units: set[str] = field(default_factory=set)


def read_header(table: Table) -> Columns:
    """What the columns hold, by their titles; columns that are not read are noted.

    Raises
    ------
    InvalidInput
        If the header names no points or neither times nor frames, a point lacks an axis, or two columns hold
        the same thing.
    """
    columns = Columns()
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
            raise InvalidInput(
                f"the point {point!r} lacks an axis" if point else "an axis is missing",
                where=f"{table.where}, line 1",
                expected="x, y and z",
                received=", ".join(sorted(axes)),
            )
        columns.axes[point] = {axis: axes[axis] for axis in "xyz"}
    if not columns.axes or (is_long and "point" not in columns.roles):
        raise InvalidInput(
            "the header names no points",
            where=f"{table.where}, line 1",
            expected="columns such as head_x, head_y, head_z; or joint, x, y, z",
            received=", ".join(table.header[:8]),
        )
    if not {"time", "frame"} & set(columns.roles):
        raise InvalidInput(
            "there is no column of times or frame numbers",
            where=f"{table.where}, line 1",
            expected="time or frame",
            received=", ".join(table.header[:8]),
        )
    if unread:
        table.notes.append("Columns that are not read: " + ", ".join(unread) + ".")
    return columns


def _refuse_twice(table: Table, first: str, second: str) -> None:
    raise InvalidInput(
        "two columns hold the same thing", where=f"{table.where}, line 1", received=f"{first} and {second}"
    )


def unit_of_length(table: Table, columns: Columns, otherwise: str) -> str:
    """The unit that the header or a column of units names, one of `MILLIMETRES`; else `otherwise`.

    Raises
    ------
    InvalidInput
        If the unit is unknown or not the same throughout.
    """
    declared = set(columns.units)
    if "unit" in columns.roles:
        declared |= {cell.lower() for cell in table.cells(columns.roles["unit"])}
    unit = declared.pop() if len(declared) == 1 else "" if declared else otherwise
    if unit not in MILLIMETRES:
        raise InvalidInput(
            "the unit of length is unknown or not the same throughout",
            where=table.where,
            expected="one of " + ", ".join(MILLIMETRES),
            received=", ".join(sorted({*declared, unit} - {""})),
        )
    return unit
