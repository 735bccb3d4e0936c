"""The user's cache: what follows from the sources alone, kept under a digest of their content, the *edition*.

Nothing in it can be out of date, for other sources have another name; without it everything is only slower.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from pipeline.reading import read_file, read_json
from pipeline.resources import CONF, PACKAGE
from pipeline.storage.provenance import PACKAGES, versions
from pipeline.storage.publishing import new_file
from pipeline.storage.sealed_folders import digest
from pipeline.validation import InvalidInput

KEPT = 12
"""Editions whose folders are kept, the latest."""

_EDITION, _OURS = re.compile(r"[0-9a-f]{32}"), re.compile(r"[0-9a-f]{32}\.json")


def place() -> Path:
    """Return the folder of all that is kept: ``GAIT_PIPELINE_CACHE``, or one in the user's cache."""
    above = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return Path(os.environ.get("GAIT_PIPELINE_CACHE") or above / "gait-pipeline")


def _digest() -> str:
    """Return a digest of all sources and options, and of the Python and libraries that read them."""
    found = hashlib.sha256(repr((sys.version, versions(PACKAGES))).encode())
    for root in (PACKAGE, CONF):
        for path in sorted(path for kind in ("py", "yaml") for path in root.rglob(f"*.{kind}")):
            found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()[:32]


edition = cache(_digest)
"""The digest at the start."""


def remembered(
    what: Sequence[object], make: Callable[[], Any], *, of: Callable[[], str] | None = None
) -> Any:
    """Return the plain value that `make` returns, which follows from the sources and from `what` alone.

    Parameters
    ----------
    what : sequence
        Values whose ``repr`` tells all of them.
    make : callable
        Returns what JSON can hold, or None, which is not kept; it is not called if something is.
    of : callable, optional
        Returns a digest, 32 hexadecimal digits, of the part of the sources that it follows from; by default of all.
    """
    name, before = digest(repr(what).encode())[:32] + ".json", (of or edition)()
    if (kept := read(name, of=before)) is not None:
        with suppress(InvalidInput):
            return read_json(place() / name, content=kept)
    if (made := make()) is not None and (of or _digest)() == before:  # else somebody has edited meanwhile
        write(name, json.dumps(made).encode(), of=before)
    return made


def read(name: str, *, of: str = "") -> bytes | None:
    """Return what is kept under a name, of an edition or of all; None if nothing is, or something else by now."""
    with suppress(OSError, RuntimeError, InvalidInput):
        seal, _, content = read_file(place() / of / name).partition(b"\n")
        return content if seal == digest(content).encode() else None
    return None


def write(name: str, content: bytes, *, of: str = "") -> None:
    """Keep something under a name, of an edition or of all; where nothing can be written, nothing is kept."""
    with suppress(OSError, RuntimeError, InvalidInput):
        folder = place() / of
        new = not folder.is_dir()
        folder.mkdir(parents=True, exist_ok=True)
        others = [path for path in place().iterdir() if _EDITION.fullmatch(path.name)] if new else []
        for old in sorted(others, key=lambda path: path.stat().st_mtime)[:-KEPT]:
            _remove(old)
        with new_file(folder / name, replace=True) as path:
            path.write_bytes(digest(content).encode() + b"\n" + content)


def _remove(old: Path) -> None:
    """Remove an edition; files that are not ours stay, and their folder."""
    with suppress(OSError):
        for path in old.iterdir():
            if _OURS.fullmatch(path.name):
                path.unlink()
        old.rmdir()
