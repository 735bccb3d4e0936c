"""Locks between processes: file locks, which the system releases when the owner ends for any reason."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: processes do not wait, and the first of two results is kept
    fcntl = None  # type: ignore[assignment]


@contextmanager
def exclusive(
    path: Path, waiting: Callable[[], AbstractContextManager[None]] = nullcontext
) -> Iterator[None]:
    """Hold an exclusive lock between processes during the ``with`` block.

    The lock file exists only while a process holds the lock or waits for it.

    Parameters
    ----------
    path : Path
        Lock file, in an existing folder.
    waiting : callable
        Function that returns the context manager in which this process waits for another owner.
    """
    if fcntl is None:
        yield
        return
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                with waiting():
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
            if _is_file_of(descriptor, path):
                break
        except BaseException:
            os.close(descriptor)
            raise
        os.close(
            descriptor
        )  # the last owner removed this file: another process may hold a new file of this name
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def remove_unheld(folder: Path, pattern: str) -> None:
    """Remove the lock files in a folder that no process holds, for example those of killed processes."""
    if fcntl is None:
        return
    with suppress(OSError):
        for path in folder.glob(pattern):
            descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _is_file_of(descriptor, path):
                    path.unlink()
            except BlockingIOError:
                pass
            finally:
                os.close(descriptor)


def _is_file_of(descriptor: int, path: Path) -> bool:
    """Return True if the file at a path is still the file that was opened."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False
