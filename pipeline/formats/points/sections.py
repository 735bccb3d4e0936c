"""Readers of tables exported by motion capture programs: a preamble, lines of titles, and numbers.

Vicon Nexus (CSV, ``Trajectories``), Qualisys Track Manager (TSV, ``MARKER_NAMES``) and OptiTrack Motive (CSV,
``Format Version``) are recognised by their first lines.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_memory
from pipeline.formats.contract import compare_frames, damaged, leave_out_placeholders, motion_capture
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.even_times import at_equal_intervals
from pipeline.formats.text import millimetres_in, number, read_text, unit_of
from pipeline.skeleton.recorded import MotionCapture


def exported(path: Path, frame_rate_hz: float | None, units: str | None) -> MotionCapture | None:
    """Read a table exported by Nexus, QTM or Motive; return None for other tables.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float or None
        Frames per second, if the file does not state it.
    units : str or None
        Unit of length, if the file does not state it.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or is an export of one of these programs and damaged.
    """
    text, notes = read_text(path)
    head = text[:4000]
    separator = max(
        ",;\t", key="".join(re.findall(".*[A-Za-z]{2}.*", head)).count
    )  # most frequent in lines with words
    lines = [line.strip(' ,;\t"') for line in head.split("\n")]
    first = next(filter(None, lines), "")
    if first.lower().startswith("format version"):
        return _optitrack(_Lines(path.name, text, separator, notes), units)
    if any(line.startswith(("MARKER_NAMES", "DATA_INCLUDED")) for line in lines):
        return _qualisys(_Lines(path.name, text, separator, notes), frame_rate_hz, units)
    if first.lower() in (
        "trajectories",
        "devices",
        "model outputs",
        "joints",
        "segments",
        "events",
        "objects",
    ):
        return _nexus(_Lines(path.name, text, separator, notes), units)
    return None


class _Lines:
    """Lines of a file, split into cells without surrounding blanks."""

    def __init__(self, where: str, text: str, separator: str, notes: list[str]) -> None:
        try:
            read = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
            self.cells = [[cell.strip() for cell in row] for row in read]
        except csv.Error as error:
            raise damaged("a cell has unbalanced quotation marks", where, code="broken_quotes") from error
        self.where, self.notes, self.ended = where, notes, text.endswith("\n")
        self.declared = np.nan  # declared number of frames
        if separator != ",":
            self.cells = [[cell.replace(",", ".") for cell in row] for row in self.cells]

    def place(self, line: int) -> str:
        return f"{self.where}, line {line + 1}"

    def motion(
        self,
        names: list[str],
        first: int,
        columns: list[int],
        leading: dict[str, int],
        rate: float | None,
        unit: str,
        millimetres: float,
        width: int = 0,
        *,
        zero_is_missing: bool = False,
    ) -> MotionCapture:
        """Build the recording from the lines of the table from index `first` on.

        `columns` are x, y, z of each point, and `leading` has the column of ``frame`` or ``time``.  Lines may have as
        many cells as the last column needs, or `width` if that is larger.
        """
        all_columns = [*leading.values(), *columns]
        numbers = self._numbers(first, all_columns, max(*all_columns, width - 1))
        positions = numbers[:, len(leading) :].reshape(len(numbers), -1, 3) * millimetres
        compare_frames(self.declared, len(numbers), self.notes)
        if zero_is_missing:
            positions[(positions == 0).all(axis=-1)] = np.nan
        leave_out_placeholders(positions, self.notes, millimetres)
        columns_by_name = dict(zip(leading, numbers.T, strict=False))

        def place(k: int) -> str:
            return self.place(first + k)

        if "time" in columns_by_name:
            positions, rate = at_equal_intervals(columns_by_name["time"], positions, rate, place, self.notes)
        elif rate is None:
            raise damaged(
                "the frame rate is unknown",
                self.where,
                "FREQUENCY, or the option frame_rate_hz",
                code="unknown_rate",
            )
        elif "frame" in columns_by_name:  # frames without a line are missing
            counter = columns_by_name["frame"]
            wrong = np.flatnonzero(np.isnan(counter) | (np.diff(counter, prepend=counter[0] - 1) <= 0))
            if wrong.size:
                raise damaged(
                    "the frame number does not increase from the line before",
                    place(int(wrong[0])),
                    code="frame_order",
                )
            times = (counter - counter[0]) / rate
            positions, rate = at_equal_intervals(times, positions, rate, place, self.notes)
        return motion_capture(names, positions, rate, unit, self.notes)

    def _numbers(self, first: int, columns: list[int], last: int) -> np.ndarray:
        """Return the numbers (T, C) from line `first` to the next empty line; a truncated last line is dropped."""
        stop = next((k for k in range(first, len(self.cells)) if not any(self.cells[k])), len(self.cells))
        rows = self.cells[first:stop]
        is_truncated = stop == len(self.cells) and not self.ended
        if is_truncated and len(rows) > 1 and len(rows[-1]) < len(rows[-2]):
            rows.pop()
            self.notes.append(f"The last line ({stop}) is truncated and is not read.")
        if not rows:
            raise damaged(
                "the table has no frames", self.where, "lines of numbers below the titles", code="no_frames"
            )
        require_memory(
            64 * len(rows) * len(columns),
            self.where,
            "the table has too many titles for its numbers",
            code="titles_alone",
        )
        # Missing points at the end of a line are often omitted with their separators.
        if longer := [k for k, row in enumerate(rows) if any(row[last + 1 :])]:
            raise damaged(
                "the number of cells in the line does not match the titles",
                self.place(first + longer[0]),
                last + 1,
                len(rows[longer[0]]),
                code="wrong_count",
                needed=last + 1,
                count=len(rows[longer[0]]),
            )
        return Rows(self.where, rows, range(first + 1, stop + 1), self.notes).numbers(columns)


def _nexus(lines: _Lines, units: str | None) -> MotionCapture:
    """Read an export of Vicon Nexus: its section Trajectories has lines of rate, names, titles, units, and numbers."""
    starts = [k for k, row in enumerate(lines.cells) if row and row[0].lower() == "trajectories"]
    if not starts or starts[0] + 5 > len(lines.cells):
        raise damaged(
            "the file has no trajectories",
            lines.where,
            "a section Trajectories",
            ", ".join(row[0] for row in lines.cells if len([c for c in row if c]) == 1)[:60],
            code="no_trajectories",
        )
    begin = starts[0]
    rate = number((lines.cells[begin + 1] or [""])[0])
    if not 0 < rate < 1e6:
        raise damaged(
            "the frame rate cannot be used",
            lines.place(begin + 1),
            "hertz",
            str(lines.cells[begin + 1])[:40],
            code="unusable_rate",
        )
    heading, titles, unit_row = (lines.cells[begin + k] for k in (2, 3, 4))
    has_units = not np.isfinite(number((unit_row or [""])[0] or "x"))  # older exports have no line of units
    unit_row = unit_row if has_units else []
    axes = [title.upper() for title in titles]
    named = {k: name for k, name in enumerate(heading) if name and axes[k : k + 3] == ["X", "Y", "Z"]}
    columns = [k + axis for k in named for axis in range(3)]
    if not named or axes.count("Y") != len(named) or axes.count("Z") != len(named):
        raise damaged(
            "the names are not above the columns X, Y, Z",
            lines.place(begin + 2),
            f"{axes.count('Y')} names",
            len(named),
            code="misplaced_names",
        )
    # Computed quantities may follow the trajectories in columns with other titles.
    if others := [name for k, name in enumerate(heading) if name and k not in named]:
        lines.notes.append("Columns that are not read: " + ", ".join(others[:8]) + ".")
    stated = {unit_row[k].lower() for k in columns if k < len(unit_row)} - {""}
    unit = stated.pop() if len(stated) == 1 else units or "mm"
    millimetres = millimetres_in(unit, lines.place(begin + 4))
    width = max(len(heading), len(titles)) if others else 0
    names, first = list(named.values()), begin + 4 + has_units
    return lines.motion(names, first, columns, {"frame": 0}, rate, unit, millimetres, width)


def _qualisys(lines: _Lines, frame_rate_hz: float | None, units: str | None) -> MotionCapture:
    """Read an export of Qualisys Track Manager: settings, names, then x, y, z of each marker (0, 0, 0 if missing)."""
    settings = {row[0].upper(): row[1:] for row in lines.cells if row and row[0]}
    kind = (settings.get("DATA_INCLUDED") or ["3D"])[0]
    if kind != "3D":
        raise damaged(
            "the table has no markers",
            lines.where,
            "an export of 3D data",
            kind,
            code="no_markers",
            kind=kind,
        )
    names = [name for name in settings.get("MARKER_NAMES", []) if name]
    end = len(lines.cells)
    first = next((k for k, row in enumerate(lines.cells, 1) if row and row[0].upper() == "MARKER_NAMES"), end)
    while first < end and not (lines.cells[first] and np.isfinite(number(lines.cells[first][0] or "x"))):
        first += 1
    if first == end or not names:
        raise damaged(
            "the table has no frames", lines.where, "lines of numbers after MARKER_NAMES", code="no_frames"
        )
    titles = [title.lower() for title in lines.cells[first - 1]]
    width = max(k for k, cell in enumerate(lines.cells[first], 1) if cell)
    leading: list[str] = [title for title in ("frame", "time") if title in titles[:2]]
    if not leading and width - 3 * len(names) in (1, 2):
        leading = ["frame", "time"][: width - 3 * len(names)]
    columns = [len(leading) + k for k in range(3 * len(names))]
    declared = number((settings.get("FREQUENCY") or [""])[0])
    rate = declared if 0 < declared < 1e6 else frame_rate_hz
    unit = units or "mm"
    millimetres = millimetres_in(unit, lines.where)
    leading_columns = {title: k for k, title in enumerate(leading)}
    lines.declared = number((settings.get("NO_OF_FRAMES") or [""])[0])
    return lines.motion(names, first, columns, leading_columns, rate, unit, millimetres, zero_is_missing=True)


def _optitrack(lines: _Lines, units: str | None) -> MotionCapture:
    """Read bones or markers from an export of OptiTrack Motive.

    The lines above the numbers state type, name and kind of each column.
    """
    settings = dict(zip(lines.cells[0][::2], lines.cells[0][1::2], strict=False))
    at = next((k for k, row in enumerate(lines.cells) if row[:1] == ["Frame"]), 0)
    above = lines.cells[1:at]
    by_title = {row[1].lower(): row for row in above if len(row) > 2 and row[1]}
    # Older exports have these lines without titles.
    by_title = by_title or dict(zip(("type", "name"), filter(any, above), strict=False))
    kinds = above[-1] if above else []
    if not at or not {"type", "name"} <= set(by_title) or "Position" not in kinds:
        raise damaged(
            "the titles of the columns cannot be read",
            lines.where,
            "lines Type and Name over columns of Position, and a line Frame, Time",
            code="unreadable_header",
        )
    unit = unit_of(settings.get("Length Units", "")) or units or ""
    millimetres = millimetres_in(unit, f"{lines.place(0)}, Length Units")
    declared = number(settings.get("Export Frame Rate") or settings.get("Capture Frame Rate") or "")
    columns: dict[tuple[str, str], list[int]] = {}
    for k, axis in enumerate(lines.cells[at]):
        kind, name = (by_title[title][k : k + 1] or [""] for title in ("type", "name"))
        if (
            kinds[k : k + 1] == ["Position"]
            and axis in ("X", "Y", "Z")
            and kind[0] in ("Bone", "Marker", "Labeled Marker", "Rigid Body", "Bone Marker")
        ):
            columns.setdefault((name[0], kind[0]), []).append(k)
    triples = {key: triple for key, triple in columns.items() if len(triple) == 3 and key[0]}
    # Marker positions expected by the skeleton (Bone Marker) are used only without bones and measured markers.
    triples = {key: triple for key, triple in triples.items() if key[1] != "Bone Marker"} or triples
    if not triples:
        raise damaged(
            "the file has no positions of bones or markers",
            lines.where,
            "Type Bone or Marker",
            code="no_points",
        )
    # A bone and a marker with the same name are different points.
    names = [
        name if kind == "Bone" or (name, "Bone") not in triples else f"{name}_marker"
        for name, kind in triples
    ]
    selected = [column for triple in triples.values() for column in triple]
    rate = declared if 0 < declared < 1e6 else None
    lines.declared = number(settings.get("Total Exported Frames", ""))
    return lines.motion(names, at + 1, selected, {"time": 1}, rate, unit, millimetres, len(lines.cells[at]))
