"""What tables of points (CSV, TRC) share: reading numbers from cells, and checking what is to be written."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_numbers
from pipeline.validation import require_range

_NOTHING = {"", "na", "n/a", "#n/a", "none", "null", "-", "--"}
"""What tables write for a value that is missing, beside NaN."""


def read_cells(cells: Sequence[str], place: Callable[[int], str]) -> np.ndarray:
    """Numbers (N,) float64 in N cells, NaN where a cell says that there is none; `place` as of `read_numbers`."""
    return read_numbers(["nan" if not cell or cell.lower() in _NOTHING else cell for cell in cells], place)


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
    positions = np.asarray(positions_mm, dtype=float)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or 0 in positions.shape:
        expected = f"(frames, {len(names)}, 3), none zero"
        raise damaged("the positions do not have the shape of the names", where, expected, positions.shape)
    for k, name in enumerate(names):
        readable = name and name == name.strip() and name.isprintable()  # what ends a line is not printable
        if not readable or (distinct and name in names[:k]):
            raise damaged("the table cannot hold the point name", where, received=repr(name))
    require_range(f"{where}, frame_rate_hz", frame_rate_hz, above=0, unit="Hz")
    if np.isinf(positions).any():
        raise damaged("a position is infinite", where)
    return positions
