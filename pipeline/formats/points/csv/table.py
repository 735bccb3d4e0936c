"""Parsing of a table of points as text: rows, numbers, and the columns identified by the header."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import NOTHING, Rows
from pipeline.formats.points.even_times import unit_of_times
from pipeline.formats.text import LENGTHS, number, read_text, unit_of
from pipeline.skeleton.complaint import Remark
from pipeline.validation import listed

_DIGITS = {
    "ms": 3, "msec": 3, "millis": 3, "milliseconds": 3, "us": 6, "µs": 6, "usec": 6, "microseconds": 6, "ns": 9,
    "nanoseconds": 9,
}  # fmt: skip
"""Endings of titles of time columns in fractions of a second, each with the number of decimal digits: 3 for ms."""
_ROLES = {
    "time": {
        *(
            word + unit
            for word in ("time", "t", "ts", "timestamp", "zeit", "temps", "tiempo", "tempo", "tijd")
            for unit in ("", "s", "sec", "seconds", *_DIGITS)
        ),
        "seconds",
        "timeframenumbersoriginalx",  # from Visual3D, as "item"
        "timeframenumbersx",
    },
    "frame": {"frame", "item", *(f"frame{kind}" for kind in ("number", "index", "idx", "id", "num", "no"))},
    "point": {
        *("name", "label", "bodypart", "bone", "jointtype"),
        *(
            point + word
            for point in ("joint", "point", "landmark", "keypoint", "marker")
            for word in ("", "id", "index", "name")
        ),
    },
    "unit": {"unit", "units"},
    "person": {"person", "personid", "subject", "subjectid", "track", "trackid"},
}
"""Titles, by the role of the column, of columns without coordinates; in lower case, without blanks and underscores."""
UNSURE = re.compile(
    r"item|tempo|bone|(?:joint|.*point|landmark|marker|frame|person|subject|track)_?(?:id|idx|index|type|no|num.*)"
)
"""Pattern of titles whose meaning is uncertain; such a column is ignored if another column has the same role."""
_MAX_LINES_ABOVE = 50
"""Largest number of lines of text above the header of a table."""
_SETTING = re.compile(r"\W*([A-Za-z][\w ]*?) *[:=\t;,][:=\s;,]*([^\s;]+)")
"""Pattern of a setting, such as ``Frames: 3``, in a line above the header: name and value."""
_ZONE = re.compile(r"(Z|[+-]\d\d:?\d\d)$")
_QUOTED = re.compile(r"(?<=[(\s])'([^']*)'(?=[,)])")
_BRACKETED = re.compile(r"[ _.]?[(\[] *(\w+) *[)\]](?=$|[ _.]?[(\[])")
_SMOOTHED = re.compile(
    r"(?<![^\W_])(?:raw|orig(?:inal)?|unfiltered|(filt(?:ered)?|interp(?:olated)?|processed|smooth(?:ed)?))"
    r"(?![^\W_])[\W_]*",
    re.IGNORECASE,
)
"""Pattern of words in a title that mean raw or smoothed data; the group matches only the words for smoothed data."""
_POSITION = re.compile(r"[ _.](position|pos)$", re.IGNORECASE)
_ROTATION = re.compile(r"[ _.](rotation|rot|euler)$", re.IGNORECASE)
_WAYS = (
    r"(?:(?P<point>.+)[ _.:-])?(?P<axis>{0})",  # head_x, x
    r"(?P<axis>{0})(?P<point>[ _.:-].+?|\d+)",  # x_head, x0
    r"(?P<point>.+?)(?:[ _.:-]t?)?(?P<axis>{0})",  # headX, head_tx
    r"(?P<point>.+)[ _.:-](?P<axis>[123])",  # head_1
)
"""Patterns of a point's name and an axis in a column title, in the order in which they are tried."""


def coordinates(
    titles: Sequence[str], axes: Sequence[str] = "xyz", others: Sequence[str] = ()
) -> list[tuple[str, str, str, int]]:
    """Return point, axis, unit of length and column index for each title that names a coordinate.

    The spellings in `_WAYS` are compared in their order, up to the first one with a complete point.

    Parameters
    ----------
    titles : sequence of str
        Column titles; a unit may follow at the end, in brackets.
    axes : sequence of str
        Axes that a complete point needs.
    others : sequence of str
        Further components that a point may have.

    Returns
    -------
    list of tuple
        Point, axis, unit and column.  Incomplete points are returned for the first spelling only.

    Examples
    --------
    >>> coordinates(["time", "x_LASI", "y_LASI"], "xy"), coordinates(["LASIX [inches]", "LASIY [inches]"], "xy")
    ([('LASI', 'x', '', 1), ('LASI', 'y', '', 2)], [('LASI', 'x', 'in', 0), ('LASI', 'y', 'in', 1)])
    """
    ways: list[list[tuple[str, str, str, int]]] = []
    for way in _WAYS:
        pattern = way.format("|".join((*axes, *others))) + rf"(?:[ _.](?P<unit>{LENGTHS}|px|pixels?))?"
        columns: list[tuple[str, str, str, int]] = []
        for column, title in enumerate(titles):
            if match := re.fullmatch(pattern, _BRACKETED.sub(r"_\1", title), re.IGNORECASE):
                point, axis, unit = match.group("point", "axis", "unit")
                axis = axes[int(axis) - 1] if axis in ("1", "2", "3")[: len(axes)] else axis.lower()
                columns.append(((point or "").lstrip(" _.:-"), axis, unit_of(unit or ""), column))
        axes_of: dict[str, set[str]] = {}
        for point, axis, *_ in columns:
            axes_of.setdefault(point, set()).add(axis)
        complete = {point for point, point_axes in axes_of.items() if point_axes >= set(axes)}
        ways.append(columns)
        if complete:
            return columns if way == _WAYS[0] else [column for column in columns if column[0] in complete]
    return ways[0]


def role_of(title: str) -> tuple[str, str]:
    """Return a column's role, such as ``time``, and its title in lower case; the role of a coordinate is empty."""
    plain = _BRACKETED.sub(r"_\1", title).lower().replace(" ", "_").lstrip("_%#").rstrip("._#")
    together = plain.replace("_", "")
    return next((role for role, titles in _ROLES.items() if together in titles), ""), plain


def read_table(path: Path, titles: str = "") -> Rows:
    """Read a table whose cells are separated by commas, semicolons, tabs or blanks.

    Lines of text may precede the table.

    `titles` is the line of titles for a file without one.  Titles in several lines are joined, for example points above
    their axes, or axes above their units.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is not a table, or the length of a row differs from the header.
    """
    where = path.name
    text, notes = read_text(path)
    begin, titled, delimiter = _begin((titles + text).split("\n"))
    above, text = (titles + text).split("\n")[:begin], "\n".join((titles + text).split("\n")[begin:])
    stated = [match.groups() for line in above if (match := _SETTING.match(line[:200]))]
    settings = {name.lower(): number(value.strip(',"').replace(",", ".")) for name, value in stated}
    begin -= bool(titles)
    if delimiter == " ":
        text = "\n".join(" ".join(line.split()) for line in text.split("\n"))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    rows: list[list[str]] = []
    lines, title_notes = [], []
    try:
        for row in reader:
            if row in rows[:titled] and not _holds_numbers(row):
                title_notes = ["The titles are repeated below: does the file contain several tables?"]
            elif any(cell.strip() for cell in row):
                rows.append(row)
                lines.append(reader.line_num + begin)
    except csv.Error as error:
        raise damaged(
            "a cell has unbalanced quotation marks",
            f"{where}, line {reader.line_num + begin}",
            code="broken_quotes",
        ) from error
    if rows and len(rows[0]) == 4 and not _holds_numbers(rows[0][:1]) and _holds_numbers(rows[0][1:]):
        rows, lines = _numbered(rows), [0, *lines]
    if len(rows) <= titled:
        raise damaged(
            "the file has no table",
            where,
            "a header and a row",
            f"{len(rows)} rows",
            code="no_table",
            rows=len(rows),
        )
    # Titles in several lines may be written as ('nose', 'x').
    words = [["_".join(_QUOTED.findall(cell)) or cell.strip() for cell in row] for row in rows[:titled]]
    header = _without_raw(_joined(words), notes)
    table = Rows(
        where, rows[titled:], lines[titled:], notes + title_notes, delimiter != ",", header, settings
    )
    for k, row in enumerate(table.cells):
        while len(row) > len(header) and not row[-1].strip():
            row.pop()
        if len(row) != len(header):
            raise damaged(
                "the number of cells in the row does not match the header",
                table.place(k),
                len(header),
                len(row),
                code="wrong_count",
                needed=len(header),
                count=len(row),
            )
    return table


def _without_raw(header: list[str], notes: list[str]) -> list[str]:
    """Remove the words for raw and smoothed data from column titles.

    The titles of raw columns that also exist smoothed become empty.
    """
    plain = {
        title: word.rstrip(" _.:-") if (word := _SMOOTHED.sub("", title)) != title else title
        for title in header
    }
    best = {plain[k]: k for k in sorted(header, key=lambda title: _SMOOTHED.findall(title.lower()) or ["a"])}
    raw = [title for title in header if best[plain[title]] != title]
    if raw:
        notes.append(f"Raw columns with a smoothed or filtered copy are not read: {listed(raw)}.")
        return [plain[title] if best[plain[title]] == title else "" for title in header]
    return header


def _numbered(rows: list[list[str]]) -> list[list[str]]:
    """Add a header and frame numbers to a table whose rows contain a point's name and three numbers.

    A repeated name begins a new frame.
    """
    table, joints, frame = [["frame", "joint", "x", "y", "z"]], set[str](), 0
    for row in rows:
        if row[0] in joints:
            frame, joints = frame + 1, set()
        joints.add(row[0])
        table.append([str(frame), *row])
    return table


def _begin(lines: list[str]) -> tuple[int, int, str]:
    """Return the index of the header's first line, the number of header lines, and the separator of cells.

    The header ends above the first line with an equal number of numbers.  It extends upwards while a title is repeated.
    """
    for n, (line, below) in enumerate(itertools.pairwise(lines[:_MAX_LINES_ABOVE])):
        separator = max("\t;,", key=line.count)
        split = separator if separator in line else None
        cells, numbers = line.split(split), below.split(split)
        if len(cells) == len(numbers) > 2 and not _holds_numbers(cells) and _holds_numbers(numbers):
            first = max(n - 3 * (cells[0] == "ITEM"), 0)  # Visual3D: name, type and folder of a signal
            while first and (above := lines[first - 1].split(split)) and len(above) == len(cells):
                titles = list(filter(None, _joined([row.split(split) for row in lines[first : n + 1]])))
                if len(set(titles)) == len(titles):
                    break
                first -= 1
            return first, n - first + 1, separator if split else " "
    return 0, 1, max("\t;,", key=next(filter(str.strip, lines), "").count)


def _joined(rows: list[list[str]]) -> list[str]:
    """Join column titles that span several lines.

    Titles above the last line extend to the right.  Blank titles at the end are dropped.
    """
    joined = rows[-1]
    for row in rows[-2::-1]:
        before, above = "", []
        for cell in row:
            above.append(before := cell or before)
        joined = ["_".join(filter(None, pair)) for pair in itertools.zip_longest(above, joined, fillvalue="")]
    while joined and not joined[-1]:
        joined.pop()
    return joined


def _holds_numbers(cells: list[str]) -> bool:
    filled = [cell.strip(' "').removesuffix("px").replace(",", ".") for cell in cells]
    return sum(bool(NOTHING.fullmatch(cell)) or number(cell) != np.inf for cell in filled) > len(filled) / 2


@dataclass(frozen=True)
class Columns:
    """Roles of the columns of a table of points, and columns of the coordinates."""

    roles: dict[str, int]
    """Column index of each role, except coordinates: ``time``, ``frame``, ``point``, ``unit``, ``person``."""
    axes: dict[str, dict[str, int]]
    """Column indices of x, y, z for each point; a long table has one point with the name ``""``."""
    units: set[str]


def read_header(table: Rows, *, rate_is_given: bool = False) -> Columns:
    """Identify the roles of columns from their titles, and add a note about columns that are not read.

    Parameters
    ----------
    table : Rows
    rate_is_given : bool
        True if the rows of a wide table may be frames without a time or a number.

    Raises
    ------
    InvalidInput
        If the header names no points, or neither times nor frames, a point lacks an axis, or two columns have the
        same content.
    """
    columns, location = Columns({}, {}, set()), f"{table.where}, line 1"
    duplicate, beginning = "two columns have the same meaning", ", ".join(table.header[:8])
    titled = enumerate(map(role_of, table.header))
    for column, (role, title) in sorted(titled, key=lambda entry: bool(UNSURE.fullmatch(entry[1][1]))):
        if role and not (role in columns.roles and UNSURE.fullmatch(title)):
            if role in columns.roles:
                received = f"{table.header[columns.roles[role]]} and {table.header[column]}"
                raise damaged(
                    duplicate,
                    location,
                    received=received,
                    code="column_twice",
                    columns=[table.header[columns.roles[role]], table.header[column]],
                )
            columns.roles[role] = column
    roles = set(columns.roles.values())
    titled_points = coordinates(["" if k in roles else title for k, title in enumerate(table.header)])
    groups = {point for point, *_ in titled_points}
    positions = [point for point in groups if len(groups) == 1 or _POSITION.fullmatch(f" {point}")]
    if (
        "point" in columns.roles and len(positions) == 1 and "" not in groups
    ):  # pos_x, pos_y, pos_z of each point, with or without rot_x
        titled_points = [("" if entry[0] in positions else entry[0], *entry[1:]) for entry in titled_points]
    is_long = any(not point for point, *_ in titled_points)
    read = roles | {column for *_, column in titled_points}
    unread = [title for k, title in enumerate(table.header) if title and k not in read]
    if not is_long and "point" in columns.roles:  # for example, the name of the trial
        unread.append(table.header[columns.roles.pop("point")])
    for point, axis, unit, column in titled_points:
        if bool(point) == is_long:
            unread.append(table.header[column])
            continue
        axes = columns.axes.setdefault(point, {})
        if axis in axes:
            raise damaged(
                duplicate,
                location,
                received=f"{table.header[axes[axis]]} and {table.header[column]}",
                code="column_twice",
                columns=[table.header[axes[axis]], table.header[column]],
            )
        axes[axis] = column
        columns.units.update({unit} - {""})
    for point, axes in columns.axes.items():
        if set(axes) != set("xyz"):
            raise damaged(
                f"the point {point!r} lacks an axis" if point else "an axis is missing",
                location,
                "x, y and z; run `reconstruct` on keypoints of a video",
                ", ".join(sorted(axes)),
                code="missing_axis",
                point=point,
                axes=sorted(axes),
            )
        columns.axes[point] = {axis: axes[axis] for axis in "xyz"}
    if not columns.axes or (is_long and "point" not in columns.roles):
        raise damaged(
            "the header names no points",
            location,
            "columns head_x, head_y, head_z…, or joint, x, y, z; run `reconstruct` on keypoints of a video",
            beginning,
            code="no_points",
        )
    if not {"time", "frame"} & set(columns.roles) and (is_long or not rate_is_given):
        raise damaged(
            "the table has no column of times or frame numbers",
            location,
            "time or frame" + ("" if is_long else ", or the option frame_rate_hz, if each row is a frame"),
            beginning,
            code="no_times",
        )
    _drop_rotations(columns, unread, table.header)
    if unread:
        table.notes.append(f"Columns that are not read: {listed(unread)}.")
    return columns


def _drop_rotations(columns: Columns, unread: list[str], header: list[str]) -> None:
    """If a table labels rotations and positions, drop rotation columns and remove the word for position from names."""
    positions = {name: _POSITION.sub("", name) for name in columns.axes if _POSITION.search(name)}
    if len(set(positions.values())) < len(positions) or set(positions.values()) & set(columns.axes):
        return
    for name in [name for name in columns.axes if positions and _ROTATION.search(name)]:
        unread += [header[column] for column in columns.axes.pop(name).values()]
    for name, plain in positions.items():
        columns.axes[plain] = columns.axes.pop(name)


def set_to_seconds(table: Rows, column: int) -> None:
    """Convert a column of times to seconds, in place, from dates or from the unit in the column's title.

    Calendar times are counted from the first time.
    """
    words = [word.replace(",", ".") if table.decimal_comma else word for word in table.texts(column)]
    title = role_of(table.header[column])[1]
    digits = next((digits for end, digits in _DIGITS.items() if title.endswith(end)), 0)
    scale = 10.0**-digits
    if any(":" in word for word in words):
        dates = [
            word if "-" in word else f"1970-01-01 {word}"
            for word in (_ZONE.sub("", word.replace("/", "-")) for word in words)
        ]
        times, scale = np.array(dates, "datetime64[us]").astype(float), 1e-6
    else:
        times = np.array(list(map(number, words)))
    first = times[0] if len(times) and 1e9 <= abs(times[0]) < np.inf else 0.0
    unique = np.unique(times[np.isfinite(times)]) - first
    # Such large numbers cannot be seconds.
    large = scale == 1.0 and len(unique) > 1 and unique[-1] >= 1e9
    if large and (unit := unit_of_times(np.median(np.diff(unique)))):
        table.notes.append(Remark(f"The times are read as {unit[0]}.", "times"))
        scale, digits = 1 / unit[1], 9
    if scale == 1.0 and not first:
        return
    decimals = max(len(word.partition(".")[2]) for word in words) + digits
    for row, time in zip(table.cells, times, strict=True):
        if np.isfinite(time):
            row[column] = f"{(time - first) * scale:.{decimals}f}".replace(
                ".", "," if table.decimal_comma else "."
            )


def unit_of_length(table: Rows, columns: Columns, otherwise: str) -> str:
    """Return the unit of length that the header or a column of units states; `otherwise` if the table states none.

    Raises
    ------
    InvalidInput
        If there is more than one unit.
    """
    declared = set(columns.units)
    if "unit" in columns.roles:
        declared |= {unit_of(cell) for cell in table.texts(columns.roles["unit"])}
    if len(declared) > 1:
        raise damaged(
            "the table has several units of length",
            table.where,
            "one unit",
            ", ".join(sorted(declared)),
            code="mixed_units",
            units=sorted(declared),
        )
    return declared.pop() if declared else otherwise
