"""Memory budget for reading one file, and conversion of a reader's errors to `InvalidInput`.

The budget is 64 times the bytes read, and at most 1 GiB.  Readers call `require_memory` before they allocate arrays.
Memory in proportion to the text of a file needs no check.  The same budget bounds the run time, because reading is a
linear pass over data that fit into memory.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path
from typing import TypeVar

from pipeline.reading import fault_of
from pipeline.validation import InvalidInput

PER_BYTE, MIN_BYTES, MAX_BYTES = 64, 2**20, 2**30
"""Memory budget of a clip: bytes of memory per byte read, and the smallest and largest budget in bytes."""
POINT = 128
"""Bytes of memory for each point in each frame: three or four numbers, and their copies in a reader."""

_read: ContextVar[list[int] | None] = ContextVar("sizes of the files read of the clip", default=None)

Content = TypeVar("Content")


def read_one(path: Path, reader: Callable[..., Content], **options: object) -> Content:
    """Read one file or folder (motion, keypoints or a model) within a memory budget.

    Parameters
    ----------
    path : Path
    reader : callable
    options : object
        Arguments passed to the reader.

    Raises
    ------
    InvalidInput
        If the reader rejects the file, or fails with any other error, including lack of memory.
    """
    before = _read.set([])
    try:
        return reader(path, **options)
    except InvalidInput:
        raise
    except Exception as error:
        raise InvalidInput(
            f"the file cannot be read: {fault_of(error)}",
            path.name,
            f"a complete {path.suffix.lower()} file" if path.suffix else "",
            code="unreadable",
            error=type(error).__name__,
        ) from error
    finally:
        _read.reset(before)


def count_bytes(size: int, where: str) -> None:
    """Add the size of a file to the number of bytes read for the current clip.

    Raises InvalidInput if the file is larger than half the largest budget.
    """
    if size > MAX_BYTES // 2:
        raise InvalidInput(
            "the file is too large",
            where,
            f"{MAX_BYTES // 2} bytes or less: export a shorter part of the trial",
            size,
            code="file_too_large",
            budget=MAX_BYTES // 2,
        )
    if (sizes := _read.get()) is not None:
        sizes.append(size)


def require_memory(
    needed: int,
    where: str,
    what: str = "the file needs too much memory",
    code: str = "too_much_memory",
) -> None:
    """Raise InvalidInput if a clip needs more memory, bytes, than its budget.

    `what` and `code` are the message and the code of the error.
    """
    sizes = _read.get()
    budget = MAX_BYTES if sizes is None else min(max(PER_BYTE * sum(sizes), MIN_BYTES), MAX_BYTES)
    if needed > budget:
        expected = f"{budget} bytes or less for a file of this size"
        raise InvalidInput(what, where, expected, needed, code=code, budget=budget)


def require_points(
    frames: int,
    points: int,
    where: str,
    what: str = "too many frames and points",
    code: str = "too_many_points",
) -> None:
    """Raise InvalidInput if the frames and points of a clip exceed its memory budget."""
    require_memory(POINT * frames * points, where, what, code)
