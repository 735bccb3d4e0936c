"""Processes that tests start: each has a generous time limit, and is killed with its pipes closed at the end."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from pipeline.storage.sealed_folders import complaints_about

ROOT = Path(__file__).resolve().parent.parent
WAIT_S = 3600.0
"""Seconds that a test waits for a process, many times the duration on a busy machine."""


def copy_tree(source: Path, copy: Path, *left_out: str) -> None:
    """Copy a folder including files compiled by Python and numba, except temporary files that are being written."""
    shutil.copytree(
        source, copy, ignore=shutil.ignore_patterns("*.pyc.*", "*.tmp.*", "compiling.lock", *left_out)
    )


@contextmanager
def started(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, cwd: Path = ROOT
) -> Iterator[subprocess.Popen[str]]:
    """Start a process that can import the project; at the end, kill it with its children and close its pipes."""
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


class Forked:
    """Fork of this process in a separate session, with pipes from its standard output and standard error.

    It is a program that has imported everything: to start Python and import anew would take longer than most runs.
    """

    def __init__(self, main: Callable[[], int]) -> None:
        out, err = os.pipe(), os.pipe()
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", DeprecationWarning
            )  # of forks in a process with threads, which stay behind
            self.pid = os.fork()
        if self.pid == 0:
            self._run(main, out[1], err[1])
        os.close(out[1])
        os.close(err[1])
        self.returncode: int | None = None
        self.stdout: TextIO = os.fdopen(out[0])
        self.stderr: TextIO = os.fdopen(err[0])

    @staticmethod
    def _run(main: Callable[[], int], out: int, err: int) -> None:
        status = 70
        try:
            os.setsid()
            for number, stream in enumerate((os.open(os.devnull, os.O_RDONLY), out, err)):
                os.dup2(stream, number)
                os.close(stream)
            sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            status = main()
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(status)

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def communicate(self) -> tuple[str, str]:
        """Wait for the end of the process and its children; return the remaining output and record the exit status."""
        patience = threading.Timer(WAIT_S, os.killpg, (self.pid, signal.SIGKILL))
        patience.start()
        message = self.stdout.read(), self.stderr.read()  # little enough for the pipe of the second
        patience.cancel()
        self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return message


@contextmanager
def forked(main: Callable[[], int]) -> Iterator[Forked]:
    """Fork a process that runs `main`; at the end, kill it with its children."""
    process = Forked(main)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
        if process.returncode is None:
            os.waitpid(process.pid, 0)
        process.stdout.close()
        process.stderr.close()


def finished(
    command: Sequence[str], *, environment: Mapping[str, str] | None = None, cwd: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    """Run a process to its end; return its output and its exit status."""
    with started(command, environment=environment, cwd=cwd) as process:
        out, err = process.communicate(timeout=WAIT_S)
        return subprocess.CompletedProcess(list(command), process.returncode, out, err)


def python(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run ``python ARGUMENTS``; return the output and the exit status."""
    return finished([sys.executable, *arguments], environment=environment)


def is_complete(folder: Path) -> bool:
    """Return whether a folder has a sealed manifest, and every listed file with the listed size."""
    return not complaints_about(folder, hashes=False)
