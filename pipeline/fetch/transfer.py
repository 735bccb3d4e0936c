"""Transfer of recordings from the mirror, the address or the origin, resumed and verified.

A file is written as ``<name>.part``, which a later run continues, and renamed when its sha256 is right.
"""

from __future__ import annotations

import errno
import hashlib
import http.client
import os
import urllib.error
import urllib.parse
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.validation import InvalidInput

TIMEOUT_S = 30.0
_CHUNK = 1 << 16
_ATTEMPTS = 3
"""Requests to one address, as long as each answer adds to the file."""
_SILENCES = 2
"""Consecutive incomplete answers of a host after which it is not asked again in this run."""
_NOT_THERE = "it has no such file"


@dataclass(frozen=True)
class Progress:
    """Progress of the transfer.

    Attributes
    ----------
    path : str
        Current file, as in the table.
    files_done, files_total : int
    bytes_done, bytes_total : int
        Over all files; failed ones count as done.
    """

    path: str
    files_done: int
    files_total: int
    bytes_done: int
    bytes_total: int


@dataclass
class FetchReport:
    """Result for every file.

    Attributes
    ----------
    fetched, present : list of str
        Received in this run; right before.
    failed : list of (str, str)
        Path and reason.
    without_address : list of str
        Files without a public address that the mirror did not have.
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


class Transfer:
    """One pass over the rows; remembers which hosts do not answer."""

    def __init__(
        self,
        rows: list[dict[str, str]],
        raw: Path,
        mirrors: Sequence[Path],
        opener: Callable[..., Any],
        progress: Callable[[Progress], None],
    ) -> None:
        self.rows, self.raw, self.mirrors, self.opener, self.progress = rows, raw, mirrors, opener, progress
        self.silences: Counter[str] = Counter()
        self.bytes_total = sum(int(row["bytes"]) for row in rows)
        self.files_done = self.bytes_done = 0

    def report(self) -> FetchReport:
        """Transfer every file, in the order of the table."""
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
            self._tell(row, 0)
        return report

    def _tell(self, row: Mapping[str, str], received: int) -> None:
        done = self.bytes_done + received
        self.progress(Progress(row["path"], self.files_done, len(self.rows), done, self.bytes_total))

    def _get(self, row: Mapping[str, str]) -> tuple[str, str]:
        """Transfer one file; return the outcome and why it failed."""
        target = self.raw / row["path"]
        part = target.with_name(target.name + ".part")
        with _disk(target):
            if target.is_dir():
                return "failed", "a folder stands in its place"
            if target.is_file() and _digest(target) == row["sha256"]:
                return "present", ""
            if target.exists() or target.is_symlink():
                return "failed", "another file is in its place: move it away"
            target.parent.mkdir(parents=True, exist_ok=True)
        addresses = [row[name] for name in ("address", "origin") if row[name]]
        tries: list[tuple[str, Callable[[], str]]] = [
            *(("mirror", partial(_copy, mirror / row["path"], row, part)) for mirror in self.mirrors),
            *((address, partial(self._receive, row, part, address)) for address in dict.fromkeys(addresses)),
        ]
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
        if not addresses and all(reason == f"mirror: {_NOT_THERE}" for reason in reasons):
            return "without address", ""
        return "failed", "; ".join(reasons)

    def _receive(self, row: Mapping[str, str], part: Path, address: str) -> str:
        """Receive a file from an address; return why it failed, empty if it did not.

        Continues what an earlier run or address left in `part`; if the result is wrong, starts over once.
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
                return reason or "not asked, for this host did not answer before"
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
                return reason  # nothing was added: another request would not help
        return reason

    def _ask(self, row: Mapping[str, str], part: Path, address: str, host: str, start: int) -> str:
        """Send one request, from byte `start` on; return why it failed, empty if it did not."""
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
        """Append an answer to `part`; return why it is incomplete or too long, empty if it is neither."""
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
                self._tell(row, start)
        if start > size:
            _forget(part)
            return f"longer than {size} bytes"
        return "" if start == size else f"cut short at {start} of {size} bytes"


def _copy(path: Path, row: Mapping[str, str], part: Path) -> str:
    """Copy a file from the mirror; return why it failed, empty if it did not."""
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
    """Remove what was received; return 0, the remaining size."""
    with _disk(part):
        part.unlink(missing_ok=True)
    return 0


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@contextmanager
def _disk(target: Path) -> Iterator[None]:
    """Raise InvalidInput for an error of the disk, which ends the run, unlike an error of an address."""
    try:
        yield
    except OSError as error:
        raise InvalidInput(f"cannot write data: {error.strerror or error} ({target})") from error
