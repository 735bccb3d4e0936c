"""Transfer of recordings from a mirror or from their addresses, with verification by sha256.

A file is received completely (the largest has some megabytes), written as ``<name>.part``, and renamed.
"""

from __future__ import annotations

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
from pathlib import Path
from typing import Any

from pipeline.reading import read_file
from pipeline.validation import InvalidInput

TIMEOUT_S = 30.0
_MAX_SILENCES = 2
"""Number of consecutive requests without response after which a host is skipped for the rest of the run."""
_MISSING = "it does not have the file"


@dataclass(frozen=True)
class Progress:
    """Progress of the transfer of all files.

    Attributes
    ----------
    path : str
        Path of the last finished file, as in the table.
    files_done, files_total : int
    bytes_done, bytes_total : int
        Sizes over all files; failed files count as done.
    """

    path: str
    files_done: int
    files_total: int
    bytes_done: int
    bytes_total: int


@dataclass
class FetchReport:
    """Results of a transfer: the files in each category, and reasons for failures.

    Attributes
    ----------
    fetched, present : list of str
        Paths of files received in this run, and of files that were already present.
    failed : list of (str, str)
        Path and reason.
    without_address : list of str
        Paths of files without a public address that no mirror has.
    """

    fetched: list[str] = field(default_factory=list)
    present: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    without_address: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        counts = f"{len(self.fetched)} fetched, {len(self.present)} present, {len(self.failed)} failed"
        lines = [f"failed: {path}: {reason}" for path, reason in self.failed]
        lines += [f"no public address, available only from a mirror: {path}" for path in self.without_address]
        return "\n".join([counts, *lines])


def mirrored(folder: Path, path: str) -> Path:
    """Return the path of a file in a mirror; the mirror may also be the folder of a single source.

    Examples
    --------
    >>> mirrored(Path("shelf"), "cmu/16/16_15.amc").as_posix()
    'shelf/cmu/16/16_15.amc'
    >>> mirrored(Path("shelf/cmu"), "cmu/16/16_15.amc").as_posix()
    'shelf/cmu/16/16_15.amc'
    """
    is_source_folder = folder.name == Path(path).parts[0] and not (folder / path).exists()
    return (folder.parent if is_source_folder else folder) / path


class Transfer:
    """Transfer of the files in the rows of a table; hosts that do not respond are skipped."""

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
        """Transfer all files in the order of the table, and return the report."""
        report = FetchReport()
        for row in self.rows:
            outcome, reason = self._get(row)
            if outcome == "failed":
                report.failed.append((row["path"], reason))
            else:
                getattr(report, outcome).append(row["path"])
            self.files_done += 1
            self.bytes_done += int(row["bytes"])
            totals = self.files_done, len(self.rows), self.bytes_done, self.bytes_total
            self.progress(Progress(row["path"], *totals))
        return report

    def _get(self, row: Mapping[str, str]) -> tuple[str, str]:
        """Transfer a file; return the name of its category in the report, and the reason if it failed."""
        target = self.raw / row["path"]
        with _disk(target):
            if target.is_dir():
                return "failed", "a folder has the same path: move it away"
            if target.is_file() and _digest(read_file(target)) == row["sha256"]:
                return "present", ""
            if target.exists() or target.is_symlink():
                return "failed", "a different file has the same path: move it away"
            target.parent.mkdir(parents=True, exist_ok=True)
        addresses = list(dict.fromkeys(row[name] for name in ("address", "origin") if row[name]))
        reasons = []
        sources: list[Path | str] = [*self.mirrors, *addresses]
        for source in sources:
            try:
                content = self._content(row, source)
                if _digest(content) != row["sha256"]:
                    raise _Failed("sha256 differs")
            except _Failed as failure:
                reasons.append(f"{'mirror' if isinstance(source, Path) else source}: {failure}")
                continue
            with _disk(target):
                part = target.with_name(target.name + ".part")
                with part.open("wb") as stream:
                    stream.write(content)
                    stream.flush()
                    os.fsync(stream.fileno())
                part.replace(target)
            return "fetched", ""
        if not addresses and all(reason == f"mirror: {_MISSING}" for reason in reasons):
            return "without_address", ""
        return "failed", "; ".join(reasons)

    def _content(self, row: Mapping[str, str], source: Path | str) -> bytes:
        """Return the content of a listed file from a mirror or an address."""
        if isinstance(source, Path):
            try:
                return read_file(mirrored(source, row["path"]))
            except InvalidInput as error:
                raise _Failed(_MISSING if error.code == "no_file" else error.what) from error
        try:
            url = urllib.parse.urlsplit(source)
        except ValueError:
            raise _Failed("not an address") from None
        if url.scheme not in ("http", "https") or not url.netloc:
            raise _Failed("not an http(s) address")
        if self.silences[url.netloc] >= _MAX_SILENCES:
            raise _Failed("skipped, because this host did not respond before")
        return self._ask(row, source, url.netloc)

    def _ask(self, row: Mapping[str, str], address: str, host: str, *, again: bool = True) -> bytes:
        """Send a request and return the complete response.

        If the response is incomplete and `again` is True, the request is repeated once.
        """
        request = urllib.request.Request(address, headers={"User-Agent": "gait-pipeline"})
        size = int(row["bytes"])
        self.silences[host] += 1
        try:
            with self.opener(request, timeout=TIMEOUT_S) as answer:
                self.silences[host] = 0
                if not str(answer.geturl()).startswith(("http://", "https://")):
                    raise _Failed("redirected away from http(s)")
                content: bytes = answer.read(size + 1)
            if len(content) > size:
                raise _Failed(f"longer than {size} bytes")
            if len(content) == size:
                return content
            failure: Exception = urllib.error.URLError(f"{len(content)} of {size} bytes")
        except urllib.error.HTTPError as error:
            error.close()
            self.silences[host] = 0
            raise _Failed(f"HTTP {error.code} {error.reason}") from error
        except (OSError, http.client.HTTPException) as error:
            failure = error
        if again and not self.silences[host]:
            return self._ask(row, address, host, again=False)
        raise _Failed(f"no complete response ({getattr(failure, 'reason', None) or repr(failure)})")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


class _Failed(Exception):
    """Error if a mirror or an address does not provide a file; its message is the reason."""


@contextmanager
def _disk(target: Path) -> Iterator[None]:
    """Convert a disk error to InvalidInput, which ends the run; network errors do not end the run."""
    try:
        yield
    except OSError as error:
        raise InvalidInput(
            f"cannot write data: {error.strerror or error} ({target})",
            code="cannot_write",
            error=error.strerror,
        ) from error
