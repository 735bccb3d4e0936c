"""Reader and writer of ``mm`` files of the BioMotion Lab: a walk as text.

A file has 3 × markers + 1 rows: all x, all y, all z, and at the end period, size and speed.  The five columns are mean,
cosine 1, sine 1, cosine 2, sine 2.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.formats.contract import LARGEST, damaged
from pipeline.formats.fourier_walks.series import BLOCKS, FourierWalk, from_blocks, motion_of
from pipeline.formats.text import read_numbers, read_text
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import InvalidInput, require_range, require_shape

_COLUMNS = [0, 2, 1, 4, 3]
"""Column indices of an ``mm`` file in the order p0, p1, q1, p2, q2; the same indices restore the file's order."""

MAX_ROWS = 1000
"""Largest number of rows of an ``mm`` file; a file with fifteen markers has 46 rows."""


def load(path: Path) -> tuple[FourierWalk, list[str]]:
    """Return the walk in an ``mm`` file, and the notes on the file's text.

    Raises
    ------
    InvalidInput
        If a row does not have five numbers, or the number of rows is not 3 × markers + 1.
    """
    text, notes = read_text(path)
    rows: list[np.ndarray] = []
    for number, line in enumerate(text.split("\n"), 1):
        words = line.replace(",", " ").split()
        if not words:
            continue
        where = f"{path.name}, line {number}"
        values = read_numbers(words, lambda _, where=where: where)  # type: ignore[misc]
        if len(values) != BLOCKS or not np.isfinite(values).all():
            raise damaged(
                "the row cannot be used",
                where,
                f"{BLOCKS} numbers: mean, cosine 1, sine 1, cosine 2, sine 2",
                line[:60],
                code="unusable_line",
            )
        rows.append(values)
        if len(rows) > MAX_ROWS:
            raise damaged("the file has too many rows", where, f"{MAX_ROWS} or fewer", code="too_many_rows")
    if len(rows) < 4 or len(rows) % 3 != 1:
        raise damaged(
            "the number of rows is not that of an mm file",
            path.name,
            "3 × markers + 1",
            len(rows),
            code="wrong_count",
            count=len(rows),
        )
    blocks = np.stack(rows, axis=1)[_COLUMNS]
    # Period, size and speed are in the first three columns, in the order of the columns.
    blocks[:, -1] = rows[-1]
    return from_blocks(blocks, path.name), notes


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read an ``mm`` file as a recording of several strides.

    Parameters
    ----------
    path : Path
    frame_rate_hz, units
        Not used: periods are in frames at 120 Hz, coordinates in millimetres.

    Raises
    ------
    InvalidInput
        If the file is not an mm file.
    """
    walk, notes = load(path)
    notes.append(
        f"Fourier series: {walk.stride_hz:.3g} Hz, size {walk.size:g}, {walk.speed_mm_s / 1000:.3g} m/s;"
        f" x forwards, y to the left."
    )
    return motion_of({"": walk}, notes, path.name)


def write(path: Path, walk: FourierWalk) -> None:
    """Write a walk as an ``mm`` file.

    Parameters
    ----------
    path : Path
    walk : FourierWalk
        Walk in the axes of the files: x forwards, y to the left, z up.

    Raises
    ------
    InvalidInput
        If the shape is wrong, or a number cannot be written.
    """
    coefficients = require_shape("the walker", np.asarray(walk.coefficients, float), (BLOCKS, "P", 3))
    require_range("the period", walk.period, above=0, unit="frames")
    last = np.zeros((BLOCKS, 1))
    last[:3, 0] = walk.period, walk.size, np.nan_to_num(walk.speed)
    by_axis = coefficients.swapaxes(1, 2).reshape(BLOCKS, -1)[_COLUMNS]
    rows = np.concatenate([by_axis, last], axis=1).T
    if not (np.abs(rows) <= LARGEST).all():
        raise InvalidInput(
            "a Fourier coefficient of the walk is too large to be written", path.name, code="not_number"
        )
    lines = [" ".join(f"{value:.6f}" for value in row) for row in rows.tolist()]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
