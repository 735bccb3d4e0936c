"""Files that travel with the package: options, papers and mappings (``conf``), the table of recordings (``data``).

In a clone they are folders beside the package; in an installed package they are folders inside it.
"""

from __future__ import annotations

import tomllib
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


CONF = _folder("conf")
"""Options and presets, the papers' data, mappings of skeletons."""
DATA = _folder("data")
"""The table of public recordings."""


def version() -> str:
    """Return the version of the package, installed or in a clone."""
    project = PACKAGE.parent / "pyproject.toml"
    if (PACKAGE.parent / "conf").is_dir() and project.is_file():
        return str(tomllib.loads(project.read_text("utf-8"))["project"]["version"])
    return metadata.version("gait-pipeline")
