"""Processes that tests start: waited for generously, never left behind, never with a file left open."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from pipeline.storage.sealed_folders import complaints_about

ROOT = Path(__file__).resolve().parent.parent
WAIT_S = 3600.0
"""How long a test waits for a process that should end: many times what a busy machine needs."""


def copy_tree(source: Path, copy: Path, *left_out: str) -> None:
    """Copy a folder with what Python and numba have compiled of it, but for what is being written just then."""
    shutil.copytree(
        source, copy, ignore=shutil.ignore_patterns("*.pyc.*", "*.tmp.*", "compiling.lock", *left_out)
    )


@contextmanager
def started(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, cwd: Path = ROOT
) -> Iterator[subprocess.Popen[str]]:
    """A process that can import the project; it and what it started are gone afterwards, and its pipes closed."""
    with subprocess.Popen(
        list(command),
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **(environment or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            if os.name == "posix":
                with suppress(ProcessLookupError, PermissionError):
                    os.killpg(process.pid, signal.SIGKILL)
            process.kill()


def finished(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, cwd: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    """What a process said, and its exit status."""
    with started(command, environment=environment, cwd=cwd) as process:
        out, err = process.communicate(timeout=WAIT_S)
        return subprocess.CompletedProcess(list(command), process.returncode, out, err)


def python(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """What ``python ARGUMENTS`` said, and its exit status."""
    return finished([sys.executable, *arguments], environment=environment)


def is_complete(folder: Path) -> bool:
    """Whether a folder has a sealed manifest and every file of it at the right size."""
    return not complaints_about(folder, hashes=False)
