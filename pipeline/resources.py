"""Files that travel with the package: options, papers and mappings (``conf``), the table of recordings (``data``).

In a clone they are folders beside the package; in an installed package they are folders inside it.
"""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


CONF = _folder("conf")
"""Options and presets, the papers' data, mappings of skeletons."""
DATA = _folder("data")
"""The table of public recordings."""
