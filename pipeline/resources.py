"""Files that travel with the package: options, papers and mappings (``conf``), the table of recordings (``data``).

In a clone they are folders next to the package; in an installed package they are folders inside it.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parent

NAME = "gait-pipeline"
"""Name of the distribution."""


def _folder(name: str) -> Path:
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


CONF = _folder("conf")
"""Options and presets, the papers' data, mappings of skeletons."""
DATA = _folder("data")
"""The table of public recordings."""


@cache
def project() -> dict[str, Any] | None:
    """Return the table ``project`` of the ``pyproject.toml`` next to the package; None in an installed package."""
    path = PACKAGE.parent / "pyproject.toml"
    if not ((PACKAGE.parent / "conf").is_dir() and path.is_file()):
        return None
    content: dict[str, Any] = tomllib.loads(path.read_text("utf-8")).get("project", {})
    return content if content.get("name") == NAME else None


def version() -> str:
    """Return the version of the package, installed or in a clone."""
    own = project()
    return str(own["version"]) if own else metadata.version(NAME)
