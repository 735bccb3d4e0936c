"""What tables of points (CSV, TRC) share: rows of cells with numbers in them, and checking what is to be written."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_numbers
from pipeline.validation import require_range

NOTHING = re.compile(r"|#?n/?a|none|null|missing|--?|-?nan\(.*\)|-?1[.,]#\w+|#[a-z/0]+[!?]", re.IGNORECASE)
"""What tables write for a value that is missing, beside NaN; spreadsheets, for one that cannot be computed."""


@dataclass
class Rows:
    """Lines of a table as cells.

    Attributes
    ----------
    where : str
        Name of the file.
    cells : list of list of str
        Of each of R rows.
    lines : sequence of int
        Line of the file at which each row ends.
    notes : list of str
    decimal_comma : bool
    header : list of str
        Titles of the columns; empty if they have none.
    settings : dict of str to float
        Numbers that the lines above the titles state, by their names in small letters.
    """

    where: str
    cells: list[list[str]]
    lines: Sequence[int]
    notes: list[str]
    decimal_comma: bool = False
    header: list[str] = field(default_factory=list)
    settings: dict[str, float] = field(default_factory=dict)

    def place(self, row: int) -> str:
        """File and line of a row."""
        return f"{self.where}, line {self.lines[row]}"

    def texts(self, column: int) -> list[str]:
        """A column (R,) as text without blanks around it."""
        return [row[column].strip() for row in self.cells]

    def numbers(self, columns: Sequence[int]) -> np.ndarray:
        """Some columns (R, C) as float64, NaN where a cell says that there is none or the row has ended."""
        words = [row[c].strip() if c < len(row) else "" for row in self.cells for c in columns]
        if self.decimal_comma:
            words = [word.replace(",", ".") for word in words]

        def place(n: int) -> str:
            row, column = n // len(columns), columns[n % len(columns)]
            cell = f"column {self.header[column]!r}" if self.header else f"cell {column + 1}"
            return f"{self.place(row)}, {cell}"

        words = ["nan" if NOTHING.fullmatch(word) else word.removesuffix("px") for word in words]
        return read_numbers(words, place).reshape(len(self.cells), len(columns))

    def column(self, column: int) -> np.ndarray:
        """A column of numbers (R,).  Raises InvalidInput if one is missing."""
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
    """Return positions (T, P, 3) as float64 if a table can hold them and give them back to the bit.

    Parameters
    ----------
    names : sequence of str
        P point names.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float
    where : str
        The file, for the error.
    distinct : bool
        Whether all names must differ.

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, the rate or a coordinate cannot be written.
    """
    positions = np.asarray(positions_mm, float)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or 0 in positions.shape:
        raise damaged(
            "the positions do not have the shape of the names",
            where,
            f"(frames, {len(names)}, 3), none zero",
            positions.shape,
            code="wrong_shape",
            shape=positions.shape,
        )
    for k, name in enumerate(names):
        readable = name and name == name.strip() and name.isprintable()  # what ends a line is not printable
        if not readable or (distinct and name in names[:k]):
            raise damaged(
                "the table cannot hold the point name", where, received=repr(name), code="unwritable_name"
            )
    require_range(f"{where}, frame_rate_hz", frame_rate_hz, above=0, unit="Hz")
    if np.isinf(positions).any():
        raise damaged("a position is infinite", where, code="not_finite")
    return positions
