"""Lines that commands print, with the standard library alone."""

from __future__ import annotations

import sys

_CODES = {"bold": "1", "dim": "2"}


def tell(text: str, style: str = "") -> None:
    """Print a line, on a terminal in a style: ``bold`` or ``dim``; what could steer the terminal is spelled out."""
    text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    if style and sys.stdout.isatty():
        text = f"\x1b[{_CODES[style]}m{text}\x1b[0m"
    print(text)
