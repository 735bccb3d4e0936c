"""Printing of lines and sections to standard output, without the library rich."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from typing import Any

from pipeline.validation import printable

_CODES = {"bold": "1", "dim": "2"}


def tell_json(value: Any) -> None:
    """Print a value as JSON, for other programs."""
    print(json.dumps(value, indent=1, default=str))


def tell(text: str, style: str = "") -> None:
    """Print a line with escaped control characters, on a terminal in the style ``bold`` or ``dim``."""
    text = printable(text)
    if style and sys.stdout.isatty():
        text = f"\x1b[{_CODES[style]}m{text}\x1b[0m"
    print(text)


def tell_section(title: str, lines: Iterable[str]) -> None:
    """Print a title in bold, and indented lines below it."""
    tell(title, "bold")
    for line in lines:
        tell(f"  {line}")
