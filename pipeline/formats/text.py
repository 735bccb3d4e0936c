"""Parsing of text, numbers and units of length in motion files."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from pipeline.formats.budget import MAX_BYTES, PER_BYTE, require_memory
from pipeline.formats.contract import LARGEST, damaged, read_bytes
from pipeline.skeleton.recorded import MILLIMETRES


def read_text(path: Path) -> tuple[str, list[str]]:
    r"""Read the text of a file in UTF-8, UTF-16, Shift-JIS or Latin-1; line ends become ``\n``.

    Returns
    -------
    text : str
    notes : list of str
        Notes on a text that is not UTF-8, or whose last line has no end, so that the file may be truncated.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is empty, contains a zero byte, or needs too much memory.
    """
    data, notes = read_bytes(path), []
    if 0 in data[:2] or {*data[:2]} == {254, 255}:  # UTF-16, with or without a byte order mark
        data = data.decode("utf-16-be" if data[0] in (0, 254) else "utf-16-le").encode()
    if (at := data.find(0)) >= 0:
        raise damaged(
            "the file is not a text file", f"{path.name}, byte {at}", received="a zero byte", code="zero_byte"
        )
    if len(data) > MAX_BYTES // PER_BYTE:  # smaller files cannot exceed the budget, however short their words
        words = data.translate(_WORDS).count(b"x ")
        message = "the file is too large: export a shorter part of the trial"
        require_memory(_TEXT * len(data) + _WORD * words, path.name, message, code="file_too_large")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text, encoding = data.decode("latin-1"), "Latin-1"
        with suppress(UnicodeDecodeError):
            # Two letters in a row (one may be chance), whose first bytes do not occur in EUC and GB 2312.
            if re.search(rb"([\x82\x83\x88-\x9f][\x40-\xfc]){2}", data):
                text, encoding = data.decode("cp932"), "Shift-JIS"
        notes.append(f"The text is not UTF-8; it was read as {encoding}.")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.endswith("\n"):
        notes.append(
            "The last line has no line end: if the file is truncated, its last number may be cut short."
        )
    return text, notes


_WORDS = bytes(32 if byte in b" \t\n\r,;:[{" else 120 for byte in range(256))
"""Translation table for counting words: separators become blanks, and all other bytes become x."""
_TEXT, _WORD = 4, 100
"""Bytes of memory per byte of text (with its copies), and per word (as a string and as a number)."""


def number(word: str) -> float:
    """Parse a word as a number; return infinity if the word is not a number.

    Examples
    --------
    >>> number("-1.5"), number("nan"), number("1_0"), number("left"), number("30000/1001")
    (-1.5, nan, inf, inf, 29.97002997002997)
    """
    over, slash, under = word.partition("/")
    try:
        if slash:
            return float(over) / float(under)
        return float(word) if word.isascii() and "_" not in word else np.inf  # Python reads 1_0 as ten
    except (ValueError, ZeroDivisionError):
        return np.inf


def read_numbers(words: Sequence[str], location: Callable[[int], str]) -> np.ndarray:
    """Parse N words as numbers (N,) float64; NaN is allowed.

    Parameters
    ----------
    words : sequence of str
    location : callable
        Function that gives the location of the n-th word in the file, for the error.

    Raises
    ------
    InvalidInput
        If a word is not a number, or its magnitude is above `LARGEST`.
    """
    joined = "".join(words)
    try:
        if "_" in joined or not joined.isascii():
            raise ValueError
        numbers = np.array(list(map(float, words)))
    except ValueError:  # slower, but finds the wrong word
        numbers = np.array(list(map(number, words)))
    wrong = np.flatnonzero(np.abs(numbers) > LARGEST)
    if wrong.size:
        n = int(wrong[0])
        raise damaged(
            "the value is not a number, or is too large",
            location(n),
            f"a number of at most {LARGEST:g}",
            f"{words[n]!r:.40}",
            code="not_number",
            text=words[n],
        )
    return numbers


def read_vector(words: Sequence[str], count: int, where: str) -> np.ndarray:
    """Parse the words of a line as `count` finite numbers and return them as float64.

    Raises
    ------
    InvalidInput
        If the number of words is wrong, or a word is not a finite number.
    """
    numbers = np.array(list(map(number, words)))
    if len(numbers) != count or not np.all(np.abs(numbers) <= LARGEST):
        raise damaged(
            "the line does not have the expected numbers",
            where,
            f"{count} numbers" if count > 1 else "a number",
            " ".join(words)[:60] or "nothing",
            code="unusable_line",
            needed=count,
        )
    return numbers


def unit_of(words: str) -> str:
    """Return the abbreviation of a unit of length; other words are returned in lower case.

    Examples
    --------
    >>> unit_of("Meters"), unit_of("MM"), unit_of("Inches")
    ('m', 'mm', 'in')
    """
    name = words.lower().replace("metre", "meter")
    return _NAMES.get(name.removesuffix("s"), name)


_NAMES = {
    "millimeter": "mm",
    "centimeter": "cm",
    "decimeter": "dm",
    "meter": "m",
    "inch": "in",
    "inche": "in",
    "foot": "ft",
    "feet": "ft",
}


LENGTHS = "|".join((*MILLIMETRES, *(f"{name.replace('ter', 't(?:er|re)')}s?" for name in _NAMES)))
"""Regular expression that matches the names of units of length."""


def millimetres_in(units: str, where: str) -> float:
    """Return the size in millimetres of a unit of length such as ``cm`` or ``in/0.45``.

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
    divided_by = number(divisor) if slash else 1.0
    millimetres = MILLIMETRES[name] / divided_by if name in MILLIMETRES and divided_by > 0 else np.nan
    if not 1e-6 < millimetres < 1e6:
        raise damaged(
            "the unit of length is unknown",
            where,
            f"{', '.join(MILLIMETRES)}, or for example in/0.45, in the file or as the option units",
            f"{units!r:.40}",
            code="unknown_unit",
            unit=units,
        )
    return millimetres
