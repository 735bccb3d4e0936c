"""Locks between processes by a file that the system releases with its owner, however that one ends."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nobody waits, and of two results the first is kept
    fcntl = None  # type: ignore[assignment]


@contextmanager
def exclusive(
    path: Path, waiting: Callable[[], AbstractContextManager[None]] = nullcontext
) -> Iterator[None]:
    """Hold a lock for the ``with`` block; its file exists only while somebody holds it or waits for it.

    Parameters
    ----------
    path : Path
        In a folder that exists.
    waiting : callable
        Makes the context in which another owner is waited for.
    """
    if fcntl is None:
        yield
        return
    while True:
        held = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                with waiting():
                    fcntl.flock(held, fcntl.LOCK_EX)
            if _is(held, path):
                break
        except BaseException:
            os.close(held)
            raise
        os.close(held)  # its owner has removed it: somebody else may hold another file of this name
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(held)


def remove_unheld(folder: Path, pattern: str) -> None:
    """Remove lock files of killed processes."""
    if fcntl is None:
        return
    with suppress(OSError):
        for path in folder.glob(pattern):
            held = os.open(path, os.O_RDWR | os.O_CLOEXEC)
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _is(held, path):
                    path.unlink()
            except BlockingIOError:
                pass
            finally:
                os.close(held)


def _is(held: int, path: Path) -> bool:
    """Return whether an open file is the one of this name."""
    try:
        return os.path.samestat(os.fstat(held), path.stat())
    except FileNotFoundError:
        return False
