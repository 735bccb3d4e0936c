"""What text files of motion share: their characters, their numbers and their unit of length."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.skeleton import MILLIMETRES
from pipeline.validation import InvalidInput

LARGEST = 1e9
"""No length or angle of a recording is larger; a damaged file's may be, and would overflow later."""


def read_text(path: Path) -> str:
    """The file's text, lines ended by one character.

    Raises
    ------
    InvalidInput
        If the file cannot be read or is empty.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            "the file cannot be read", where=path.name, received=error.strerror or ""
        ) from None
    if not data.strip():
        raise InvalidInput("the file is empty", where=path.name)
    return data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")


def parse_numbers(words: Sequence[str]) -> list[float]:
    """Numbers as a data file writes them: not Python's ``1_000`` nor digits of other scripts.

    Raises
    ------
    ValueError
        If a word is no such number.
    """
    joined = "".join(words)
    if "_" in joined or not joined.isascii():
        raise ValueError
    return list(map(float, words))


def is_number(word: str) -> bool:
    """Whether `parse_numbers` takes the word."""
    try:
        parse_numbers([word])
    except ValueError:
        return False
    return True


def millimetres_in(units: str, where: str) -> float:
    """Millimetres in a unit of length such as ``cm`` or ``in/0.45``.

    Raises
    ------
    InvalidInput
        If the unit is unknown.

    Examples
    --------
    >>> round(millimetres_in("in/0.45", "16.asf"), 3)
    56.444
    """
    name, slash, divisor = units.partition("/")
    divided_by = float(divisor) if is_number(divisor) else 0.0 if slash else 1.0
    millimetres = MILLIMETRES[name] / divided_by if name in MILLIMETRES and divided_by > 0 else np.nan
    if not 1e-6 < millimetres < 1e6:
        raise InvalidInput(
            "the unit of length is unknown",
            where=where,
            expected="one of " + ", ".join(MILLIMETRES) + ", or e.g. in/0.45",
            received=units,
        )
    return millimetres
