"""Safe reading of files that this package wrote; their content is checked in the same way as foreign input.

A file must be a regular one, the size and depth of its content are bounded, and its values must have the expected type.
"""

from __future__ import annotations

import errno
import io
import json
import math
import os
import re
import stat
import struct
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
"""Maximum size, bytes, of a file of arrays; 10 000 walkers need 640 MB."""
MAX_TABLE_BYTES = 2**30
MAX_UNPACKED_BYTES = 2**23
"""Maximum unpacked size, bytes, of a compressed table: three times the largest table in the light archives."""
MAX_JSON_BYTES, MAX_JSON_VALUES, MAX_DEPTH = 2**26, 2**22, 64
"""Maximum size in bytes, number of values, and nesting depth of a JSON file.

The manifest of 10 000 walkers has 6 MB, and the package writes at most eight levels.
"""

_STRING = re.compile(r'"(?:[^"\\]++|\\.)*+"?', re.DOTALL)


_FAULTS: tuple[tuple[tuple[type[Exception], ...], str], ...] = (
    ((zipfile.BadZipFile, zlib.error, NotImplementedError), "the archive is damaged"),
    ((UnicodeError,), "a text is not UTF-8"),
    ((EOFError, struct.error), "the file is truncated"),
    ((KeyError, AttributeError), "an entry is missing"),
    ((IndexError,), "values are missing"),
    ((RecursionError,), "it is nested too deep"),
    ((MemoryError,), "it needs more memory than there is"),
    ((ArithmeticError,), "a number is too large, too small or zero"),
    ((TypeError,), "a value has another type than expected"),
    ((SyntaxError, tokenize.TokenError), "the header of an array is damaged"),
)
"""Descriptions of a file's fault by the type of the error in reading it; special types precede general ones."""
_TRUNCATED = re.compile(
    r"negative seek|cannot reshape|buffer|not enough|EOF|unpack|truncat|read length|Expected \d+ bytes"
)
"""Pattern of messages of ValueError, from numpy and zipfile, about arrays that are shorter than stated."""


def fault_of(error: BaseException) -> str:
    """Return the fault of a file in plain words, from the error that was raised when the file was read.

    Examples
    --------
    >>> fault_of(KeyError("id")), fault_of(ValueError("cannot reshape array of size 3 into shape (2,2)"))
    ("an entry is missing: 'id'", 'the array is truncated')
    """
    if isinstance(error, OSError):
        return error.strerror or "it cannot be opened"
    if isinstance(error, KeyError) and error.args and isinstance(error.args[0], str):
        return f"an entry is missing: {error.args[0]!r:.60}"
    if "allow_pickle" in str(error):
        return "an array has objects, which are never read"
    if isinstance(error, ValueError) and _TRUNCATED.search(str(error)):
        return "the array is truncated"
    faults = (words for kinds, words in _FAULTS if isinstance(error, kinds))
    return next(faults, "a value cannot be used")


def open_regular(path: Path) -> BinaryIO:
    """Return an open binary stream of a regular file.

    Raises
    ------
    OSError
        If the file cannot be opened, or is a folder, pipe, socket or device.  The function does not wait for a pipe.
    """
    if stat.S_ISREG(path.stat().st_mode):
        # O_NONBLOCK: a pipe may have taken the name since the check, and opening it would wait for a writer.
        opened = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        file = os.fdopen(opened, "rb")
        if stat.S_ISREG(os.fstat(opened).st_mode):
            return file
        file.close()
    raise OSError(errno.EINVAL, "it is not a regular file")


def read_file(path: Path, *, at_most: int = MAX_TABLE_BYTES, subject: str = "the file") -> bytes:
    """Return the content of a regular file.

    Parameters
    ----------
    path : Path
    at_most : int
        Maximum size in bytes.
    subject : str
        Name of the file in messages, e.g. ``"the table"``.

    Raises
    ------
    InvalidInput
        If the file is missing, too large or not a regular file, or cannot be read.
    """
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(size + 1) if size <= at_most else b""
    except (FileNotFoundError, NotADirectoryError):
        raise InvalidInput(f"{subject} is missing", path, code="no_file") from None
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"{subject} cannot be read: {getattr(error, 'strerror', '') or error}",
            path,
            code="unreadable",
            errno=getattr(error, "errno", None),
        ) from error
    if max(size, len(content)) > at_most:
        raise InvalidInput(
            f"{subject} is larger than {at_most} bytes", path, code="file_too_large", at_most=at_most
        )
    return content


def unpacked(
    content: bytes, path: Path, *, at_most: int = MAX_UNPACKED_BYTES, subject: str = "the file"
) -> bytes:
    """Return the unpacked content of a gzip file with a single member.

    Parameters
    ----------
    content : bytes
        Packed content of the file.
    path : Path
    at_most, subject
        Maximum unpacked size, and name of the file in messages, as for `read_file`.

    Raises
    ------
    InvalidInput
        If the data are damaged, truncated, or too large once unpacked.
    """
    member = zlib.decompressobj(wbits=31)
    try:
        data = member.decompress(content, at_most + 1)
    except zlib.error as error:
        raise InvalidInput(
            f"{subject} cannot be read: the compressed data are damaged", path, code="broken_gzip"
        ) from error
    if len(data) > at_most:
        raise InvalidInput(
            f"{subject} is larger than {at_most} bytes once unpacked",
            path,
            code="too_large_unpacked",
            at_most=at_most,
        )
    if not member.eof or member.unused_data:
        raise InvalidInput(
            f"{subject} cannot be read: the compressed data are truncated or followed by other data",
            path,
            code="broken_gzip",
        )
    return data


@contextmanager
def as_written(where: object) -> Iterator[None]:
    """Convert errors in the ``with`` block, which reads files of this package, to InvalidInput.

    The block uses files of this package, so an error means that another version wrote the files.
    """
    try:
        yield
    except InvalidInput:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        what = "another version wrote these files, or they were changed: make the figure again"
        raise InvalidInput(f"{fault_of(error)}: {what}", where, code="other_version") from error


def read_json(path: Path, kind: Any = Any, content: bytes | None = None, *, subject: str = "the file") -> Any:
    """Return the content of a JSON file, after checking that its values have the expected type.

    Parameters
    ----------
    path : Path
    kind : type hint
        Expected type, as for `fits`.
    content : bytes, optional
        Content of the file, if it has been read.
    subject : str
        Name of the file in messages, as for `read_file`.

    Raises
    ------
    InvalidInput
        As `read_file`; also if the file is not JSON, is nested too deep, or has too many or other values.
    """
    try:
        if content is None:
            content = read_file(path, at_most=MAX_JSON_BYTES, subject=subject)
        text = content.decode("utf-8")
        outside = np.frombuffer(_STRING.sub("", text).encode(), np.uint8)
        brackets = outside[np.isin(outside, list(b"[{]}"))]
        opens = np.isin(brackets, list(b"[{"))
        depth = np.cumsum(np.where(opens, 1, -1)).max(initial=0)
        if depth > MAX_DEPTH:
            raise InvalidInput(
                f"{subject} is nested more than {MAX_DEPTH} levels deep", path, code="too_deep"
            )
        if opens.sum() + (outside == ord(",")).sum() > MAX_JSON_VALUES:
            raise InvalidInput(
                f"{subject} has more than {MAX_JSON_VALUES} values", path, code="too_many_values"
            )
        value = json.loads(text)
    except InvalidInput:
        raise
    except ValueError as error:
        raise InvalidInput(f"{subject} is not valid JSON", path, code="not_json") from error
    if not fits(value, kind):
        raise InvalidInput(f"{subject} has missing or unexpected entries", path, code="other_entries")
    return value


def read_arrays(
    path: Path, content: bytes | None = None, *, subject: str = "the file"
) -> dict[str, np.ndarray]:
    """Return the arrays of an uncompressed ``.npz`` file.

    Parameters
    ----------
    path : Path
    content : bytes, optional
        Content of the file, if it has been read.
    subject : str
        Name of the file in messages, as for `read_file`.

    Raises
    ------
    InvalidInput
        As `read_file`; also if the file is damaged or compressed, or an array needs more memory than the file has
        bytes.
    """
    content = read_file(path, at_most=MAX_BYTES, subject=subject) if content is None else content
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > len(content):
                raise InvalidInput(f"{subject} cannot be read: it is compressed", path, code="compressed")
            for entry in entries:
                member = io.BytesIO(archive.read(entry))
                major, _ = np.lib.format.read_magic(member)
                shape, _, dtype = getattr(np.lib.format, f"read_array_header_{major}_0")(member)
                if math.prod(shape) * max(dtype.itemsize, 1) > entry.file_size:
                    what = f"{subject} cannot be read: {entry.filename:.60} is truncated"
                    raise InvalidInput(what, path, code="truncated")
                member.seek(0)
                name = entry.filename.removesuffix(".npy")
                array = np.lib.format.read_array(member, allow_pickle=False)
                arrays[name] = array.astype(dtype.newbyteorder("="), copy=False)
    except InvalidInput:
        raise
    except (KeyError, ValueError, AttributeError, NotImplementedError, EOFError, RuntimeError, zipfile.BadZipFile,
            zlib.error, TypeError, OverflowError, MemoryError, SyntaxError, tokenize.TokenError) as error:  # fmt: skip
        raise InvalidInput(
            f"{subject} cannot be read: {fault_of(error)}", path, code="not_understood"
        ) from error
    return arrays
