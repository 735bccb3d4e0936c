"""Printing of lines and sections to standard output, without the package `rich`."""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Any

from pipeline.validation import printable

MIN_WRAPPED = 12
"""Smallest width, in characters, of the last column of a printed table."""
_CODES = {"bold": "1", "dim": "2"}


def exists(name: str) -> bool:
    """Return True if an argument names an existing file or folder; False if it is too long for a file name."""
    return os.path.exists(name)  # noqa: PTH110 - the method of Path raises for long names


def tell_json(value: Any) -> None:
    """Print a value as JSON, so that other programs can read it."""
    print(json.dumps(value, indent=1, default=str))


def tell(text: str, style: str = "") -> None:
    """Print a line with escaped control characters; on a terminal, in the style ``bold`` or ``dim``."""
    text = printable(text)
    if style and sys.stdout.isatty():
        text = f"\x1b[{_CODES[style]}m{text}\x1b[0m"
    print(text)


def tell_section(title: str, lines: Iterable[str]) -> None:
    """Print a title in bold and, below it, indented lines."""
    tell(title, "bold")
    for line in lines:
        tell(f"  {line}")


def tell_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table that fits the width of the terminal; text in the first and last column is wrapped."""
    every = [headings, *rows]
    columns = shutil.get_terminal_size((160, 24)).columns
    widths = [max(len(row[k]) for row in every) for k in range(len(headings))]
    widths[0] = min(widths[0], columns // 2)
    widths[-1] = max(columns - sum(widths[:-1]) - 2 * len(widths[1:]), MIN_WRAPPED)
    for number, row in enumerate(every):
        cells = [textwrap.wrap(cell, width) for cell, width in zip(row, widths, strict=True)]
        for line in zip_longest(*cells, fillvalue=""):
            padded = (f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
            tell("  ".join(padded).rstrip(), "" if number else "bold")
