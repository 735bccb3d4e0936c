"""Rows and cells of tables of points (CSV, TRC), and checks of positions before they are written."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_numbers
from pipeline.validation import require_range

NOTHING = re.compile(r"|#?n/?a|none|null|missing|--?|-?nan\(.*\)|-?1[.,]#\w+|#[a-z/0]+[!?]", re.IGNORECASE)
"""Pattern of a cell that marks a missing value (in addition to NaN) or a value that a spreadsheet could not compute."""


@dataclass
class Rows:
    """Rows of a table of points, split into cells.

    Attributes
    ----------
    where : str
        Name of the file.
    cells : list of list of str
        Cells of the R rows.
    lines : sequence of int
        Line of the file at which each row ends.
    notes : list of str
    decimal_comma : bool
    header : list of str
        Titles of the columns; empty if there are no titles.
    settings : dict of str to float
        Numbers from the lines above the titles, by their names in lower case.
    """

    where: str
    cells: list[list[str]]
    lines: Sequence[int]
    notes: list[str]
    decimal_comma: bool = False
    header: list[str] = field(default_factory=list)
    settings: dict[str, float] = field(default_factory=dict)

    def place(self, row: int) -> str:
        """Return the file name and line number of a row, for messages."""
        return f"{self.where}, line {self.lines[row]}"

    def texts(self, column: int) -> list[str]:
        """Return the cells of a table column (R,) as text without surrounding blanks."""
        return [row[column].strip() for row in self.cells]

    def numbers(self, columns: Sequence[int]) -> np.ndarray:
        """Return columns of a table as float64 (R, C); NaN for cells that are empty, marked as missing or cut off."""
        words = [row[c].strip() if c < len(row) else "" for row in self.cells for c in columns]
        if self.decimal_comma:
            words = [word.replace(",", ".") for word in words]

        def location(n: int) -> str:
            row, column = n // len(columns), columns[n % len(columns)]
            cell = f"column {self.header[column]!r}" if self.header else f"cell {column + 1}"
            return f"{self.place(row)}, {cell}"

        words = ["nan" if NOTHING.fullmatch(word) else word.removesuffix("px") for word in words]
        return read_numbers(words, location).reshape(len(self.cells), len(columns))

    def column(self, column: int) -> np.ndarray:
        """Return a column of a table as numbers (R,).  Raises InvalidInput if a number is missing."""
        numbers = self.numbers([column])[:, 0]
        if np.isnan(numbers).any():
            location = self.place(int(np.isnan(numbers).argmax()))
            raise damaged(
                "a number is missing", f"{location}, column {self.header[column]!r}", code="missing_number"
            )
        return numbers


def positions_to_write(
    names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float, where: str, *, distinct: bool
) -> np.ndarray:
    """Return positions as float64 (T, P, 3), after checking that a table can store them without loss.

    Parameters
    ----------
    names : sequence of str
        P point names.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float
    where : str
        Name of the file, for the error.
    distinct : bool
        True if all names must differ.

    Raises
    ------
    InvalidInput
        If the shapes do not match, or a name, the rate or a coordinate cannot be written.
    """
    positions = np.asarray(positions_mm, float)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or 0 in positions.shape:
        raise damaged(
            "the positions do not match the names",
            where,
            f"shape (frames, {len(names)}, 3), no size zero",
            positions.shape,
            code="wrong_shape",
            shape=positions.shape,
        )
    for k, name in enumerate(names):
        readable = name and name == name.strip() and name.isprintable()  # line ends are not printable
        if not readable or (distinct and name in names[:k]):
            raise damaged(
                "the table cannot store the point name", where, received=repr(name), code="unwritable_name"
            )
    require_range(f"{where}, frame_rate_hz", frame_rate_hz, above=0, unit="Hz")
    if np.isinf(positions).any():
        raise damaged("a position is infinite", where, code="not_finite")
    return positions
