"""Real recordings, fetched by a table of addresses and checked by their sha256.

Every file of ``data/sources.csv`` is looked for in a mirror (a folder), then at its address, then at its
origin.  It is received as ``<name>.part``, resumed by a later run, and takes its name only when it is right.
"""

from __future__ import annotations

import csv
import errno
import fnmatch
import functools
import hashlib
import http.client
import os
import re
import urllib.error
import urllib.parse
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from pipeline.refusal import Refusal

NEEDED_COLUMNS = ("path", "source", "bytes", "sha256", "address", "origin")
TIMEOUT_S = 30.0
_CHUNK = 1 << 16
_ATTEMPTS = 3
"""Times that one address is asked, as long as each answer brings the file further."""
_SILENCES = 2
"""Times in a row that a host may give no whole answer before it is left alone for this run."""
_NOT_THERE = "it has no such file"


@dataclass(frozen=True)
class Progress:
    """How far the fetching is.

    Attributes
    ----------
    path : str
        The file at hand, as the table names it.
    outcome : str
        ``receiving``, ``present``, ``fetched``, ``failed`` or ``without address``.
    files_done, files_total : int
    bytes_done, bytes_total : int
        Over all files; what failed counts as done.
    """

    path: str
    outcome: str
    files_done: int
    files_total: int
    bytes_done: int
    bytes_total: int


@dataclass
class FetchReport:
    """What became of every file.

    Attributes
    ----------
    fetched, present : list of str
        Received now; right already.
    failed : list of (str, str)
        Path and why.
    without_address : list of str
        Files that have no public address and that no mirror had: nothing was tried.
    """

    fetched: list[str] = field(default_factory=list)
    present: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    without_address: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        counts = f"{len(self.fetched)} fetched, {len(self.present)} present, {len(self.failed)} failed"
        lines = [f"failed: {path}: {why}" for path, why in self.failed]
        lines += [f"no public address, only a mirror can have it: {path}" for path in self.without_address]
        return "\n".join([counts, *lines])


def open_http(request: urllib.request.Request, *, timeout: float) -> Any:
    """The answer to a request over http(s), which no redirection can lead to a file or another protocol."""
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
    mirror: Path | None = None,
    only: Sequence[str] | None = None,
    opener: Callable[..., Any] = open_http,
    progress: Callable[[Progress], None] = lambda _: None,
) -> FetchReport:
    """What was fetched, what was there, and what failed and why.

    One connection at a time.  A file that is there already is read and its sha256 compared.  Interrupted, it
    leaves ``.part`` files from which the next run goes on.

    Parameters
    ----------
    sources : Path
        The table of addresses, with at least the columns `NEEDED_COLUMNS`.
    raw : Path
        The folder that receives the files; no other folder is written to.
    mirror : Path, optional
        A folder with the same paths, asked first.
    only : sequence of str, optional
        Names of sources, paths or patterns such as ``cmu/16/*``; all files if not given.
    opener : callable
        Called as ``opener(request, timeout=seconds)``, as ``urllib.request.urlopen`` is.
    progress : callable
        Called with a `Progress` after every piece and every file.

    Raises
    ------
    Refusal
        If the table cannot be used (a path that leaves the folder, a missing column, …), the mirror is not a
        folder, `only` names nothing, or `raw` cannot be written.
    """
    rows = _selected(read_sources(sources), only)
    if mirror is not None and not Path(mirror).is_dir():
        raise Refusal("the mirror is not a folder", where=str(mirror))
    return _Run(rows, Path(raw), mirror and Path(mirror), opener, progress).report()


def resolve(row: Mapping[str, str], *, raw: Path, mirror: Path | None = None) -> Path | None:
    """Where a recording is now: in `raw`, else in the mirror, else None.

    A file of another size than the table says is passed over, for it is not that recording.

    Raises
    ------
    Refusal
        If the row's path leaves the folder.
    """
    _check_path(row["path"], "the table of sources")
    for folder in (raw, mirror):
        if folder is not None:
            path = Path(folder) / row["path"]
            if path.is_file() and path.stat().st_size == int(row["bytes"]):
                return path
    return None


def read_sources(sources: Path) -> list[dict[str, str]]:
    """The rows of a table of addresses, each checked.

    Raises
    ------
    Refusal
        If the table cannot be read, lacks a column, names a path twice or outside the folder, or a size or
        digest is not one.
    """
    try:
        with Path(sources).open(newline="", encoding="utf-8") as stream:
            reader = csv.DictReader(stream, strict=True)
            header, rows = reader.fieldnames or (), list(reader)
    except (OSError, csv.Error, UnicodeDecodeError) as error:
        raise Refusal(f"cannot read the table of sources: {error}") from error
    where = Path(sources).name
    if missing := [name for name in NEEDED_COLUMNS if name not in header]:
        raise Refusal(f"the table of sources has no column {missing[0]!r}", where=where)
    seen: set[str] = set()
    for row in rows:
        if None in row or None in row.values():
            raise Refusal("a row is not as long as the header", where=where, received=f"{row['path']!r}")
        path = row["path"]
        _check_path(path, where)
        if path in seen:
            raise Refusal("a path stands twice in the table", where=where, received=path)
        seen.add(path)
        if not re.fullmatch(r"[0-9a-f]{64}", row["sha256"]):
            raise Refusal(
                "the sha256 is not one",
                where=f"{where}, {path}",
                expected="64 hexadecimal digits",
                received=row["sha256"] or "none",
            )
        if not re.fullmatch(r"[1-9]\d{0,14}", row["bytes"]):
            raise Refusal(
                "the size is not a number of bytes", where=f"{where}, {path}", received=row["bytes"]
            )
    return rows


def _check_path(path: str, where: str) -> None:
    """Refuse a path that could name anything but a file inside the folder."""
    parts = PurePosixPath(path).parts
    strange = not parts or path.startswith("/") or ".." in parts or re.search(r"[\\:\0]", path)
    if strange or path != str(PurePosixPath(path)) or path.endswith(".part"):
        raise Refusal(
            "a path must stay inside the data folder",
            where=where,
            expected="a relative path such as cmu/16/16_15.amc",
            received=repr(path),
        )


def _selected(rows: list[dict[str, str]], only: Sequence[str] | None) -> list[dict[str, str]]:
    """The rows that the caller wants."""
    if only is None:
        return rows
    chosen: set[str] = set()
    for wanted in only:
        found = {r["path"] for r in rows if r["source"] == wanted or fnmatch.fnmatchcase(r["path"], wanted)}
        if not found:
            raise Refusal(
                "the table of sources has nothing of that name",
                expected="a source (" + ", ".join(sorted({r["source"] for r in rows})) + ") or a path",
                received=wanted,
            )
        chosen |= found
    return [row for row in rows if row["path"] in chosen]


class _Run:
    """One pass over the rows, and what it learns of the hosts on the way."""

    def __init__(
        self,
        rows: list[dict[str, str]],
        raw: Path,
        mirror: Path | None,
        opener: Callable[..., Any],
        progress: Callable[[Progress], None],
    ) -> None:
        self.rows, self.raw, self.mirror, self.opener, self.progress = rows, raw, mirror, opener, progress
        self.silences: Counter[str] = Counter()
        self.bytes_total = sum(int(row["bytes"]) for row in rows)
        self.files_done = self.bytes_done = 0

    def report(self) -> FetchReport:
        """Get every file, in the order of the table."""
        report = FetchReport()
        for row in self.rows:
            outcome, why = self._get(row)
            if outcome == "failed":
                report.failed.append((row["path"], why))
            else:
                files = {"fetched": report.fetched, "present": report.present}
                files.get(outcome, report.without_address).append(row["path"])
            self.files_done += 1
            self.bytes_done += int(row["bytes"])
            self._tell(row, outcome, 0)
        return report

    def _tell(self, row: Mapping[str, str], outcome: str, received: int) -> None:
        done = self.bytes_done + received
        self.progress(Progress(row["path"], outcome, self.files_done, len(self.rows), done, self.bytes_total))

    def _get(self, row: Mapping[str, str]) -> tuple[str, str]:
        """Outcome for one file, and why it failed."""
        target = self.raw / row["path"]
        part = target.with_name(target.name + ".part")
        with _disk(target):
            if target.is_dir():
                return "failed", "a folder stands in its place"
            if target.is_file() and _digest(target) == row["sha256"]:
                return "present", ""
            target.parent.mkdir(parents=True, exist_ok=True)
        addresses = [row[name] for name in ("address", "origin") if row[name]]
        tries: list[tuple[str, Callable[[], str]]] = [
            (address, functools.partial(self._receive, row, part, address))
            for address in dict.fromkeys(addresses)
        ]
        if self.mirror is not None:
            tries.insert(0, ("mirror", functools.partial(_copy, self.mirror / row["path"], row, part)))
        reasons = []
        for place, attempt in tries:
            reason = attempt()
            if not reason:
                with _disk(target):
                    with part.open("rb+") as stream:
                        os.fsync(stream.fileno())
                    part.replace(target)
                return "fetched", ""
            reasons.append(f"{place}: {reason}")
        if not addresses and reasons in ([], [f"mirror: {_NOT_THERE}"]):
            return "without address", ""
        return "failed", "; ".join(reasons)

    def _receive(self, row: Mapping[str, str], part: Path, address: str) -> str:
        """Receive from an address; empty if the file is right, else why not.

        What an earlier run or address left in `part` is continued; if the whole is then wrong, once more from
        the start.
        """
        try:
            url = urllib.parse.urlsplit(address)
        except ValueError:
            return "not an address"
        host = url.netloc
        if url.scheme not in ("http", "https") or not host:
            return "not an http(s) address"
        size, reason = int(row["bytes"]), ""
        for _ in range(_ATTEMPTS):
            if self.silences[host] >= _SILENCES:
                return reason or "not asked, for this host gave no answer before"
            start = _size(part)
            if start > size:
                start = _forget(part)
            if start < size:
                reason = self._ask(row, part, address, host, start)
            if _size(part) == size:
                with _disk(part):
                    if _digest(part) == row["sha256"]:
                        return ""
                _forget(part)
                reason = "sha256 differs"
                if start == 0:
                    return reason
            elif start == _size(part):
                return reason  # no step further: asking again would not help
        return reason

    def _ask(self, row: Mapping[str, str], part: Path, address: str, host: str, start: int) -> str:
        """One request, from byte `start` on; empty if it all came, else why not.  Never keeps surplus."""
        request = urllib.request.Request(address, headers={"User-Agent": "gait-pipeline"})
        if start:
            request.add_header("Range", f"bytes={start}-")
        try:
            with self.opener(request, timeout=TIMEOUT_S) as answer:
                self.silences[host] = 0
                if not str(answer.geturl()).startswith(("http://", "https://")):
                    return "redirected away from http(s)"
                if answer.status not in (200, 206):
                    return f"HTTP {answer.status}"
                if answer.status == 200:
                    start = 0  # the server sends the whole, whatever was asked for
                elif not answer.headers.get("Content-Range", "").startswith(f"bytes {start}-"):
                    _forget(part)
                    return "it sent another part of the file than was asked for"
                return self._keep(row, part, answer, start)
        except urllib.error.HTTPError as error:
            error.close()
            self.silences[host] = 0
            if error.code == 416:
                _forget(part)
            return f"HTTP {error.code} {error.reason}"
        except (OSError, http.client.HTTPException) as error:
            self.silences[host] += 1
            return f"no whole answer ({getattr(error, 'reason', None) or repr(error)})"

    def _keep(self, row: Mapping[str, str], part: Path, answer: Any, start: int) -> str:
        """Append an answer to `part`; empty if it all came, else why not."""
        size = int(row["bytes"])
        with _disk(part):
            stream = part.open("ab" if start else "wb", buffering=0)
        with stream:
            while chunk := answer.read(_CHUNK):
                start += len(chunk)
                if start > size:
                    break
                with _disk(part):
                    if stream.write(chunk) != len(chunk):
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                self._tell(row, "receiving", start)
        if start > size:
            _forget(part)
            return f"longer than {size} bytes"
        return "" if start == size else f"cut short at {start} of {size} bytes"


def _copy(path: Path, row: Mapping[str, str], part: Path) -> str:
    """Copy from the mirror; empty if the file is right, else why not."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return _NOT_THERE
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    if hashlib.sha256(content).hexdigest() != row["sha256"]:
        return "sha256 differs"
    with _disk(part):
        part.write_bytes(content)
    return ""


def _size(part: Path) -> int:
    with _disk(part):
        return part.stat().st_size if part.exists() else 0


def _forget(part: Path) -> int:
    """Remove what was received; 0, the size that remains."""
    with _disk(part):
        part.unlink(missing_ok=True)
    return 0


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextmanager
def _disk(target: Path) -> Iterator[None]:
    """Turn a failing disk into a sentence: unlike an address that fails, it would fail every file."""
    try:
        yield
    except OSError as error:
        raise Refusal(f"cannot write data: {error.strerror or error} ({target})") from error
