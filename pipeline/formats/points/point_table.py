"""What tables of points as text (csv, trc) share: their characters, their cells, and what can be written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.validation import InvalidInput


def read_characters(path: Path) -> tuple[str, list[str]]:
    """The file's text as it stands, UTF-8 or else Latin-1, and a note where it is the latter.

    Raises
    ------
    InvalidInput
        If there is no such file, it cannot be read, or it holds a zero byte, as no text does.
    """
    where = str(path)
    if not path.is_file():
        raise InvalidInput("there is no such file", where=where)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InvalidInput("the file cannot be read", where=where, received=str(error.strerror)) from error
    if b"\0" in raw:
        raise InvalidInput(
            "this is not a text file", where=f"{path}, byte {raw.index(0)}", received="a zero byte"
        )
    try:
        return raw.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        return raw.decode("latin-1"), ["The text is not UTF-8; its names were read as Latin-1."]


def notes_on_the_end(text: str) -> list[str]:
    """A note if the last line has no end, for then the file may have been cut; else nothing."""
    if text.endswith(("\n", "\r")):
        return []
    return ["The last line has no line end: if the file was cut, its last number may be short."]


def number_in(cell: str) -> float | None:
    """The number in a cell without blanks around it: NaN if it is empty, None if it is no number.

    Examples
    --------
    >>> number_in("-1.5"), number_in(""), number_in("1_0"), number_in("left")
    (-1.5, nan, None, None)
    """
    try:
        return None if "_" in cell else float(cell or "nan")  # Python reads 1_0 as ten
    except ValueError:
        return None


def positions_to_write(
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    where: str,
    *,
    cannot_hold: str,
    distinct: bool,
) -> np.ndarray:
    """Positions (T, P, 3) as float64 that a table can hold and give back to the bit.

    Parameters
    ----------
    names : sequence of str
        P point names.
    positions_mm : (T, P, 3) array
        NaN where missing.
    frame_rate_hz : float
    where : str
        The file, for the refusal.
    cannot_hold : str
        The sentence of the refusal of a name.
    distinct : bool
        Whether two points may not have the same name.

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, the rate or a coordinate cannot be written.
    """
    positions = np.asarray(positions_mm, dtype=float)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or 0 in positions.shape:
        raise InvalidInput(
            "the positions do not have the shape of the names",
            where=where,
            expected=f"(frames, {len(names)}, 3), none zero",
            received=str(positions.shape),
        )
    for k, name in enumerate(names):
        readable = name and name == name.strip() and name.isprintable()  # what ends a line is not printable
        if not readable or (distinct and name in names[:k]):
            raise InvalidInput(cannot_hold, where=where, received=repr(name))
    if not (math.isfinite(frame_rate_hz) and frame_rate_hz > 0) or np.isinf(positions).any():
        raise InvalidInput("the frame rate and the positions must be finite", where=where)
    return positions
