"""Reading one file: what it may ask for is known before it is taken, and whatever goes wrong is its refusal.

A file may take 64 times the bytes that were read of it, and 1 GiB at most.  Readers count what they are about to
allocate and ask `require_memory`; what is in proportion to the text of a file by itself needs no question.  Work is
bounded by the same counts: nothing that is read takes longer than a linear pass over what fits into memory.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path
from typing import TypeVar

from pipeline.validation import InvalidInput

PER_BYTE, LEAST, MOST = 64, 2**20, 2**30
"""Bytes of memory for each byte read, and the least and the most for one clip."""
POINT = 128
"""Bytes of one point in one frame: three or four numbers, and the copies of them that a reader makes."""

_read: ContextVar[list[int] | None] = ContextVar("sizes of the files read of the clip", default=None)

Content = TypeVar("Content")


def read_one(path: Path, reader: Callable[..., Content], **options: object) -> Content:
    """Return what a reader makes of one file or folder: motion, keypoints or a model.

    Parameters
    ----------
    path : Path
    reader : callable
    options : object
        Passed on to the reader.

    Raises
    ------
    InvalidInput
        If the file is refused, or the reader fails by any error, want of memory included.
    """
    before = _read.set([])
    try:
        return reader(path, **options)
    except InvalidInput:
        raise
    except Exception as error:
        reason = str(error).partition("\n")[0]
        raise InvalidInput(
            "the file cannot be read",
            path.name,
            f"a whole {path.suffix.lower()} file" if path.suffix else "",
            f"{type(error).__name__}: {reason:.160}" if reason else type(error).__name__,
            code="unreadable",
            error=type(error).__name__,
        ) from error
    finally:
        _read.reset(before)


def count_bytes(size: int, where: str) -> None:
    """Add the bytes of a file to those read of the clip.  Raises InvalidInput if a copy of them leaves no room."""
    if size > MOST // 2:
        raise InvalidInput(
            "the file is too large",
            where,
            f"{MOST // 2} bytes or less: export a shorter part of the trial",
            size,
            code="file_too_large",
            budget=MOST // 2,
        )
    if (sizes := _read.get()) is not None:
        sizes.append(size)


def require_memory(
    needed: int,
    where: str,
    what: str = "the file asks for too much memory",
    code: str = "too_much_memory",
) -> None:
    """Raise InvalidInput if a clip asks for more bytes than its budget; `what` and `code` say why it may."""
    sizes = _read.get()
    budget = MOST if sizes is None else min(max(PER_BYTE * sum(sizes), LEAST), MOST)
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
    """Raise InvalidInput if so many frames of so many points are beyond the budget of a clip."""
    require_memory(POINT * frames * points, where, what, code)
