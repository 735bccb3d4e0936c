"""Reading files that this package wrote: foreign input like any other, since anyone may have changed them.

A file must be a regular one, its size and the depth of its content are bounded, and its values must fit a type.
"""

from __future__ import annotations

import errno
import io
import json
import math
import os
import re
import stat
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from pipeline.validation import InvalidInput, fits

MAX_BYTES = 2**33
"""Size of the largest file of arrays: 10 000 walkers have 640 MB."""
MAX_TABLE_BYTES = 2**30
MAX_UNPACKED_BYTES = 2**23
"""Size of a compressed table once unpacked: three times the largest that light archives contain."""
MAX_JSON_BYTES, MAX_JSON_VALUES, MAX_DEPTH = 2**26, 2**22, 64
"""Bounds of a JSON file: the manifest of 10 000 walkers has 6 MB, and none of ours is more than eight deep."""

_STRING = re.compile(r'"(?:[^"\\]++|\\.)*+"?', re.DOTALL)


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file.

    Raises
    ------
    OSError
        If it cannot be opened, or is a folder, pipe, socket or device, which is not waited for.
    """
    if stat.S_ISREG(path.stat().st_mode):
        # Without O_NONBLOCK a pipe that has taken the name since would be waited for.
        opened = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        file = os.fdopen(opened, "rb")
        if stat.S_ISREG(os.fstat(opened).st_mode):
            return file
        file.close()
    raise OSError(errno.EINVAL, "it is not a regular file")


def read_file(path: Path, *, at_most: int = MAX_TABLE_BYTES) -> bytes:
    """Return the content of a regular file.

    Raises
    ------
    InvalidInput
        If it is missing, not a regular file, or larger than `at_most` bytes, or cannot be read.
    """
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(size + 1) if size <= at_most else b""
    except (FileNotFoundError, NotADirectoryError):
        raise InvalidInput("the file is missing", path, code="no_file") from None
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"the file cannot be read: {getattr(error, 'strerror', '') or error}",
            path,
            code="unreadable",
            errno=getattr(error, "errno", None),
        ) from error
    if max(size, len(content)) > at_most:
        raise InvalidInput(
            f"the file is larger than {at_most} bytes", path, code="file_too_large", at_most=at_most
        )
    return content


def unpacked(content: bytes, path: Path, *, at_most: int = MAX_UNPACKED_BYTES) -> bytes:
    """Return the content of a gzip file of one member.

    Raises
    ------
    InvalidInput
        If it is damaged, truncated, or larger than `at_most` bytes once unpacked.
    """
    member = zlib.decompressobj(wbits=31)
    try:
        made = member.decompress(content, at_most + 1)
    except zlib.error as error:
        raise InvalidInput(f"the file cannot be read: {error}", path, code="broken_gzip") from error
    if len(made) > at_most:
        raise InvalidInput(
            f"the file is larger than {at_most} bytes once unpacked",
            path,
            code="too_large_unpacked",
            at_most=at_most,
        )
    if not member.eof or member.unused_data:
        raise InvalidInput(
            "the file cannot be read: the compressed data end too early or too late", path, code="broken_gzip"
        )
    return made


@contextmanager
def as_written(where: object) -> Iterator[None]:
    """Raise InvalidInput for an error of a ``with`` block that uses our files: their content is not what we write."""
    try:
        yield
    except InvalidInput:
        raise
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        words = f"{type(error).__name__}: {error}"
        what = "the files have other content than this version writes"
        raise InvalidInput(
            what, where, "the figure, made again", f"{words:.160}", code="other_version"
        ) from error


def read_json(path: Path, kind: Any = Any, content: bytes | None = None) -> Any:
    """Return the content of a JSON file that fits a type, as `fits` does; `content` holds its bytes if they were read.

    Raises
    ------
    InvalidInput
        As `read_file`; and if it is not JSON, nested too deep, has too many values, or one of another type.
    """
    try:
        text = (read_file(path, at_most=MAX_JSON_BYTES) if content is None else content).decode("utf-8")
        outside = np.frombuffer(_STRING.sub("", text).encode(), np.uint8)
        brackets = outside[np.isin(outside, list(b"[{]}"))]
        opens = np.isin(brackets, list(b"[{"))
        depth = np.cumsum(np.where(opens, 1, -1)).max(initial=0)
        if depth > MAX_DEPTH:
            raise InvalidInput(f"the file is nested more than {MAX_DEPTH} deep", path, code="too_deep")
        if opens.sum() + (outside == ord(",")).sum() > MAX_JSON_VALUES:
            raise InvalidInput(
                f"the file holds more than {MAX_JSON_VALUES} values", path, code="too_many_values"
            )
        value = json.loads(text)
    except InvalidInput:
        raise
    except ValueError as error:
        raise InvalidInput("the file cannot be understood: it is not JSON", path, code="not_json") from error
    if not fits(value, kind):
        raise InvalidInput(
            "the file cannot be understood: it has other entries than expected", path, code="other_entries"
        )
    return value


def read_arrays(path: Path, content: bytes | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of an ``.npz`` file that is not compressed; `content` if it has been read.

    Raises
    ------
    InvalidInput
        As `read_file`; and if it is damaged, compressed, or an array needs more memory than the file has bytes.
    """
    content = read_file(path, at_most=MAX_BYTES) if content is None else content
    arrays, code = {}, "not_understood"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > len(content):
                code = "compressed"
                raise ValueError("it is compressed")
            for entry in entries:
                member = io.BytesIO(archive.read(entry))
                major, _ = np.lib.format.read_magic(member)
                shape, _, dtype = getattr(np.lib.format, f"read_array_header_{major}_0")(member)
                if math.prod(shape) * max(dtype.itemsize, 1) > entry.file_size:
                    code = "truncated"
                    raise ValueError(f"{entry.filename} is truncated")
                member.seek(0)
                name = entry.filename.removesuffix(".npy")
                arrays[name] = np.lib.format.read_array(member, allow_pickle=False)
    except (KeyError, ValueError, AttributeError, NotImplementedError, EOFError, RuntimeError, zipfile.BadZipFile,
            zlib.error, TypeError, OverflowError, MemoryError, SyntaxError, tokenize.TokenError) as error:  # fmt: skip
        raise InvalidInput(f"the file cannot be understood: {error!r:.160}", path, code=code) from error
    return arrays
