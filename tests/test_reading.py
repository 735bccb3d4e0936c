"""Tests that the project reads only regular files of limited size and of the expected type."""

from __future__ import annotations

import errno
import gzip
import io
import os
import socket
import stat
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
import pytest

from pipeline import reading
from pipeline.reading import MAX_DEPTH, read_arrays, read_file, read_json, unpacked
from pipeline.validation import fits, is_relative
from tests.rejects import PYTHON, rejects


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as first, pytest.MonkeyPatch.context() as patch:
        patch.chdir(path.parent)  # the name of a socket is short
        first.bind(path.name)


SPECIAL: dict[str, Callable[[Path], None]] = {
    "pipe": _pipe,
    "socket": _socket,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "folder": Path.mkdir,
}


@pytest.mark.skipif(os.name != "posix", reason="pipes, sockets and devices of POSIX")
@pytest.mark.parametrize("kind", SPECIAL)
def test_what_is_not_a_regular_file_is_rejected_and_not_waited_for(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "manifest.json"
    SPECIAL[kind](path)
    with rejects("unreadable", "manifest.json", errno=errno.EINVAL):
        read_file(path)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="pipes of Linux")
def test_a_pipe_that_takes_the_name_of_a_file_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, before = tmp_path / "manifest.json", Path(__file__).stat()
    os.mkfifo(path)
    monkeypatch.setattr(Path, "stat", lambda path: before)  # as it was before the pipe came
    with pytest.raises(OSError, match="not a regular file"):
        reading.open_regular(path)
    monkeypatch.undo()
    assert stat.S_ISFIFO(path.stat().st_mode)


def test_a_missing_and_a_large_file_are_rejected_before_they_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with rejects("no_file", "a.csv"):
        read_file(path)
    path.write_bytes(b"12345")
    assert read_file(path, at_most=5) == b"12345"
    with rejects("file_too_large", "a.csv", at_most=4):
        read_file(path, at_most=4)
    with path.open("wb") as file:
        file.truncate(2**43)  # eight terabytes; the disk stores nothing of it
    with rejects("file_too_large", "a.csv", at_most=2**30):
        read_file(path)


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"[" * 200_000, "too_deep"),
        (b'{"a":' * 200_000, "too_deep"),
        (b'["\\\\",' + b"[" * 70, "too_deep"),
        (b"[" + b"0," * 2**22 + b"0]", "too_many_values"),
        (("[" * 70 + "\u2222").encode("utf-16"), "not_json"),
        (b'{"a": 1', "not_json"),
        (b"\xff", "not_json"),
        (b'{"a": "1"}', "other_entries"),
        (b"[1]", "other_entries"),
        (b"{}", "other_entries"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_json_is_bounded_and_of_the_expected_type(tmp_path: Path, content: bytes, code: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with rejects(code, "a.json"):
        read_json(path, _One)


class _Optional(TypedDict, total=False):
    b: list[float]


class _One(_Optional):
    a: int


def test_brackets_inside_text_have_no_depth(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"a": 1, "b": [1, 2.5], "c": "' + "[{" * 1000 + '\\"[["}')
    assert read_json(path, _One)["b"] == [1, 2.5]
    path.write_text("[" * MAX_DEPTH + "]" * MAX_DEPTH)
    assert read_json(path) is not None


def test_unclosed_text_of_quotes_takes_linear_time(tmp_path: Path) -> None:
    """An unclosed string with many quotes is rejected in linear time."""
    path = tmp_path / "a.json"
    path.write_text('"' + '\\"' * 500_000)
    with rejects("not_json"):
        read_json(path)


@pytest.mark.parametrize(
    ("value", "kind", "fit"),
    [
        (1, int, True), (True, int, False), (1, float, True), (1.5, int, False), ("1", int | None, False),
        (None, int | None, True), ([1, "a"], tuple[int, str], True), ([1], tuple[int, str], False),
        ([1, 2], tuple[int, ...], True), ({"a": {"b": 1}}, dict[str, dict[str, int]], True),
        ({"a": [1]}, dict[str, dict[str, int]], False), ({"a": True}, Any, True), ([1], np.ndarray, False),
    ],
)  # fmt: skip
def test_a_value_of_json_fits_a_type_or_does_not(value: Any, kind: Any, fit: bool) -> None:
    assert fits(value, kind) is fit


def test_a_compressed_file_is_bounded_by_what_it_unpacks_to(tmp_path: Path) -> None:
    table = b"a,b\n" + b"0,0\n" * 1000
    assert unpacked(gzip.compress(table), tmp_path) == table
    assert unpacked(gzip.compress(table), tmp_path, at_most=len(table)) == table
    bomb = gzip.compress(bytes(58_000_000))
    assert len(bomb) < 60_000
    with rejects("too_large_unpacked", at_most=2**23):
        unpacked(bomb, tmp_path)
    for damaged in (gzip.compress(table)[:-9], gzip.compress(table) * 2, b"abc", b""):
        with rejects("broken_gzip"):
            unpacked(damaged, tmp_path)


def _headed(header: str) -> bytes:
    """Return the bytes of a NumPy array file with the given header text."""
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()


def _npz(name: str, content: bytes, compression: int = zipfile.ZIP_STORED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as archive:
        archive.writestr(name, content)
    return stream.getvalue()


def _npy(array: np.ndarray, shape: tuple[int, ...] = ()) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, allow_pickle=False)
    return (
        stream.getvalue().replace(b"(3,), }" + b" " * 8, f"{shape}, }}".encode().ljust(15))
        if shape
        else stream.getvalue()
    )


def test_arrays_need_no_more_memory_than_their_file_has_bytes(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    path.write_bytes(_npz("x.npy", _npy(np.arange(3.0))))
    np.testing.assert_array_equal(read_arrays(path)["x"], [0.0, 1.0, 2.0])
    for content, code in (
        (_npz("x.npy", _npy(np.zeros(10**6)), zipfile.ZIP_DEFLATED), "compressed"),
        (_npz("x.npy", _npy(np.arange(3.0), (10**12,))), "truncated"),
        (_npz("x.npy", b"abc"), "not_understood"),
        (_npz("x.npy", _headed("{'descr': '<f8', 'fortran_order': False, 'shape': (3,")), "not_understood"),
        (_npz("x.npy", _headed("(" * 9000)), "not_understood"),
        (_npz("x.npy", _headed("{[]: 1}")), "not_understood"),
        (_npz("x.npy", _headed("-" * 9000 + "1")), "not_understood"),
        (
            _npz("x.npy", _headed(f"{{'descr': '<f8', 'fortran_order': False, 'shape': (0, {10**30})}}")),
            "not_understood",
        ),
        (b"abc", "not_understood"),
    ):
        path.write_bytes(content)
        with rejects(code, "arrays.npz"):
            read_arrays(path)


@pytest.mark.parametrize(
    "name",
    [
        "../x.json",
        "../../../x.json",
        "/etc/x",
        "a/../../x",
        "a//b",
        "./a",
        "a/",
        "",
        ".",
        "..",
        "C:/a",
        "a\\b",
        "a\nb",
        "a\0",
        3,
    ],
)
def test_a_name_that_leaves_its_folder_is_not_a_plain_relative_path(name: object) -> None:
    assert not is_relative(name)
    assert is_relative("zhang2007_fig5/table_=1.csv")
    assert is_relative("..a/.b")


def _error_of(read: Callable[[], object]) -> Exception:
    try:
        read()
    except Exception as error:
        return error
    raise AssertionError("no error")


@pytest.mark.parametrize(
    ("read", "words"),
    [
        (lambda: {}["id"], "an entry is missing: 'id'"),
        (lambda: [][0], "values are missing"),
        (lambda: len(3), "a value has another type than expected"),  # type: ignore[arg-type]
        (lambda: b"\xff".decode(), "a text is not UTF-8"),
        (lambda: zipfile.ZipFile(io.BytesIO(b"x")), "the archive is damaged"),
        (lambda: zlib.decompress(b"x"), "the archive is damaged"),
        (lambda: struct.unpack("<d", b"x"), "the file is truncated"),
        (lambda: np.zeros(3).reshape(2, 2), "the array is truncated"),
        (lambda: np.frombuffer(b"xyz", np.int64), "the array is truncated"),
        (lambda: io.BytesIO(b"x").seek(-1), "the array is truncated"),
        (lambda: 1 // 0, "a number is too large, too small or zero"),
        (lambda: int(float("inf")), "a number is too large, too small or zero"),
        (lambda: float("x"), "a value cannot be used"),
        (lambda: Path("/nowhere").read_bytes(), "No such file or directory"),
    ],
)
def test_an_error_is_described_without_the_words_of_python(read: Callable[[], object], words: str) -> None:
    assert reading.fault_of(_error_of(read)) == words
    assert not PYTHON.search(words)
