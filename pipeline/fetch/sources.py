"""Download of the recordings that a table of addresses lists.

Each file of ``data/sources.csv`` is copied from a mirror (a folder), or downloaded from its address or its origin, in
this order.
"""

from __future__ import annotations

import csv
import fnmatch
import io
import re
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.fetch.transfer import FetchReport, Progress, Transfer, mirrored
from pipeline.reading import read_file
from pipeline.validation import InvalidInput, is_relative

NEEDED_COLUMNS = ("path", "source", "bytes", "sha256", "address", "origin")
"""Columns that a table of addresses must have."""


def open_http(request: urllib.request.Request, *, timeout: float) -> Any:
    """Return the response to an HTTP or HTTPS request; redirections to other protocols are not followed."""
    director = urllib.request.OpenerDirector()
    for handler in (
        urllib.request.ProxyHandler(),
        urllib.request.UnknownHandler(),
        urllib.request.HTTPHandler(),
        urllib.request.HTTPSHandler(),
        urllib.request.HTTPDefaultErrorHandler(),
        urllib.request.HTTPRedirectHandler(),
        urllib.request.HTTPErrorProcessor(),
    ):
        director.add_handler(handler)
    return director.open(request, timeout=timeout)


def fetch(
    sources: Path,
    raw: Path,
    *,
    mirror: Sequence[Path] = (),
    only: Sequence[str] | None = None,
    opener: Callable[..., Any] = open_http,
    progress: Callable[[Progress], None] = lambda _: None,
) -> FetchReport:
    """Download the missing files of a table of addresses, and report the result for each file.

    There is one connection at a time.  Existing files are verified by their sha256.  An interrupted run is resumed by
    the next run.

    Parameters
    ----------
    sources : Path
        Table of addresses, with at least the columns `NEEDED_COLUMNS`.
    raw : Path
        Folder for the files; nothing is written elsewhere.
    mirror : sequence of Path
        Folders with copies of the files, which are used first.
    only : sequence of str, optional
        Names of sources, paths or patterns such as ``cmu/16/*``; all files if not given.
    opener : callable
        Function with the signature ``opener(request, timeout=seconds)``, like ``urllib.request.urlopen``.
    progress : callable
        Function that is called with a `Progress` after each file.

    Raises
    ------
    InvalidInput
        If the table is invalid, a mirror is not a folder, `only` matches no file, or `raw` cannot be written.
    """
    rows = _selected(read_sources(sources), only)
    for folder in mirror:
        if not folder.is_dir():
            raise InvalidInput("the mirror is not a folder", folder, code="no_folder")
    return Transfer(rows, raw, mirror, opener, progress).report()


def resolve(row: Mapping[str, str], *, raw: Path, mirror: Sequence[Path] = ()) -> Path | None:
    """Return the path of a recording in `raw` or in a mirror; None if neither contains the recording.

    A file with another size than in the table is ignored.  A mirror may be the folder of a single source, for example
    ``shelf/cmu`` for files that are listed as ``cmu/…``.

    Raises
    ------
    InvalidInput
        If the path in the row leaves the folder.
    """
    _check_path(row["path"], "the table of sources")
    for path in (raw / row["path"], *(mirrored(folder, row["path"]) for folder in mirror)):
        if path.is_file() and path.stat().st_size == int(row["bytes"]):
            return path
    return None


def read_sources(sources: Path) -> list[dict[str, str]]:
    """Return the rows of a table of addresses, after validation.

    Raises
    ------
    InvalidInput
        If the table cannot be read or lacks a column, or a path, size or digest is invalid or listed twice.
    """
    try:
        with io.StringIO(read_file(sources).decode("utf-8"), newline="") as stream:
            reader = csv.DictReader(stream, strict=True)
            header, rows = reader.fieldnames or (), list(reader)
    except (InvalidInput, csv.Error, UnicodeDecodeError) as error:
        raise InvalidInput(f"cannot read the table of sources: {error}", code="unreadable") from error
    where = sources.name
    if missing := [name for name in NEEDED_COLUMNS if name not in header]:
        raise InvalidInput(
            f"the table of sources has no column {missing[0]!r}", where, code="no_column", column=missing[0]
        )
    paths: set[str] = set()
    for row in rows:
        if None in row or None in row.values():
            raise InvalidInput(
                "a row and the header of the table of sources differ in length",
                where,
                received=f"{row['path']!r}",
                code="wrong_count",
            )
        path = row["path"]
        _check_path(path, where)
        if path in paths:
            raise InvalidInput(
                "the table of sources lists a path twice", where, received=path, code="path_twice"
            )
        paths.add(path)
        if not re.fullmatch(r"[0-9a-f]{64}", row["sha256"]):
            raise InvalidInput(
                "must be 64 hexadecimal digits",
                f"{where}, {path}: sha256",
                received=row["sha256"] or "none",
                code="not_sha256",
            )
        if not re.fullmatch(r"[1-9]\d{0,14}", row["bytes"]):
            raise InvalidInput(
                "must be a file size in bytes",
                f"{where}, {path}: bytes",
                received=row["bytes"] or "none",
                code="not_size",
            )
    return rows


def _check_path(path: str, where: str) -> None:
    """Raise InvalidInput unless a path is relative and stays inside the data folder."""
    if not is_relative(path) or path.endswith(".part"):
        raise InvalidInput(
            "a path must stay inside the data folder",
            where,
            "a relative path such as cmu/16/16_15.amc",
            repr(path),
            code="path_outside",
        )


def _selected(rows: list[dict[str, str]], only: Sequence[str] | None) -> list[dict[str, str]]:
    """Return the rows of a table of addresses that match one of several sources, paths or patterns."""
    if only is None:
        return rows
    selected: set[str] = set()
    for pattern in only:
        matches = {
            r["path"] for r in rows if r["source"] == pattern or fnmatch.fnmatchcase(r["path"], pattern)
        }
        if not matches:
            sources = sorted({r["source"] for r in rows})
            raise InvalidInput(
                "the table of sources does not list this source or path",
                expected=f"a source ({', '.join(sources)}) or a path",
                received=pattern,
                typed=True,
                code="nothing_listed",
                sources=sources,
                wanted=pattern,
            )
        selected |= matches
    return [row for row in rows if row["path"] in selected]
