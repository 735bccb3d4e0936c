"""Data files that are installed with the package, and optional packages that only some commands need.

The folder ``conf`` has options, papers and mappings, and ``data`` the table of recordings.  In a clone they are next to
the package; an installed package contains them.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parent

NAME = "gait-pipeline"
"""Name under which this package is distributed."""


def _folder(name: str) -> Path:
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


CONF = _folder("conf")
"""Folder of options, presets, data of the papers, and mappings of skeletons."""
DATA = _folder("data")
"""Folder with the table of public recordings."""


@cache
def project() -> dict[str, Any] | None:
    """Return the table ``project`` of ``pyproject.toml`` in a clone; None in an installed package."""
    path = PACKAGE.parent / "pyproject.toml"
    if not ((PACKAGE.parent / "conf").is_dir() and path.is_file()):
        return None
    content: dict[str, Any] = tomllib.loads(path.read_text("utf-8")).get("project", {})
    return content if content.get("name") == NAME else None


def version() -> str:
    """Return the version of this package, which may be installed or a clone."""
    content = project()
    return str(content["version"]) if content else metadata.version(NAME)


_DISTRIBUTIONS = {
    "cv2": "opencv-python-headless", "ai_edge_litert": "ai-edge-litert", "PIL": "pillow", "hydra": "hydra-core",
    "rerun": "rerun-sdk", "yaml": "pyyaml", "dask_jobqueue": "dask-jobqueue",
}  # fmt: skip
"""Name of a package for pip, by the name of the package's module, if these names differ."""

_TARGETS = {"papers": "make install", "video": "make video", "cluster": "make cluster"}
"""Command that installs an extra into the folder ``.venv`` of a clone."""


def missing_package(error: ModuleNotFoundError) -> str:
    """Return the pip name of the package that is missing; empty if the missing module is part of this project.

    Examples
    --------
    >>> missing_package(ModuleNotFoundError(name="PIL.Image"))
    'pillow'
    """
    first = (error.name or "").partition(".")[0]
    return "" if first == "pipeline" else _DISTRIBUTIONS.get(first, first)


@cache
def _extras() -> dict[str, str]:
    """Return the name of the extra that installs each optional package, by package name."""
    if content := project():
        optional = [
            (text, name) for name, texts in content["optional-dependencies"].items() for text in texts
        ]
    else:
        texts = metadata.requires(NAME) or []
        optional = [
            (text, match[1]) for text in texts if (match := re.search(r"extra == ['\"]([\w-]+)", text))
        ]
    return {re.split(r"[^\w.-]", text, maxsplit=1)[0].lower(): name for text, name in optional}


def install_hint(package: str) -> str:
    """Return a phrase with a missing package, the extra that contains it, and the command that installs it.

    Examples
    --------
    >>> install_hint("a_package_of_yours")
    'a_package_of_yours, which is not installed: pip install a_package_of_yours'
    """
    extra = _extras().get(package)
    if extra is None:
        return f"{package}, which is not installed: pip install {package}"
    in_clone = _TARGETS.get(extra, f"pip install '.[{extra}]'")
    command = in_clone if project() else f"pip install '{NAME}[{extra}]'"
    return f"{package} (extra `{extra}`), which is not installed: {command}"


@contextmanager
def optional_packages() -> Iterator[None]:
    """Raise ModuleNotFoundError, with extra and install command, if a package is missing in the ``with`` block."""
    try:
        yield
    except ModuleNotFoundError as error:
        if not (package := missing_package(error)):
            raise
        raise ModuleNotFoundError(f"this needs {install_hint(package)}", name=error.name) from None
