"""Lines that commands print, without rich."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from pipeline.validation import printable

_CODES = {"bold": "1", "dim": "2"}


def tell(text: str, style: str = "") -> None:
    """Print a line, on a terminal in a style: ``bold`` or ``dim``; what could steer the terminal is spelled out."""
    text = printable(text)
    if style and sys.stdout.isatty():
        text = f"\x1b[{_CODES[style]}m{text}\x1b[0m"
    print(text)


def tell_section(title: str, lines: Iterable[str]) -> None:
    """Print a title and lines below it."""
    tell(title, "bold")
    for line in lines:
        tell(f"  {line}")
