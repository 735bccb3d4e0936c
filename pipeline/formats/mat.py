"""MAT files of MATLAB 5 to 7 with a trial as Qualisys Track Manager exports it; nothing in them is run."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from pipeline.formats.budget import require_memory
from pipeline.formats.contract import damaged

_TYPES = "0bBhHiIf0d00qQ0BBH"
"""Types of numbers by the kind of element that holds them; the last three are compressed, UTF-8 and UTF-16."""


def load_mat(data: bytes, where: str, *_: object) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the labelled markers of a trial as the arrays of an NPZ file that is exported here, and their names.

    Without markers the segments of its skeletons are returned, each behind its skeleton's name and a colon.

    Raises
    ------
    InvalidInput
        If the file is of another version, or holds anything but one trial.
    """
    try:
        (trial,) = _values(memoryview(data)[128:])
        if isinstance(trial, np.ndarray):
            # Compressed: motion to more than half its size, the zeros of a force plate further.
            (trial,) = _values(memoryview(zlib.decompressobj().decompress(trial.data, 24 * trial.size)))
        (trial,) = trial
        rate = trial["FrameRate"][3]
        markers = [
            block
            for trajectories in trial.get("Trajectories", ())
            for block in trajectories.get("Labeled", ())
        ]
        blocks = [
            ("", block["Labels"], _array(block["Data"])[:, :3].swapaxes(1, 2))
            for block in markers
            if block["Labels"][3:]
        ] or [
            (f"{_text(block['SkeletonName'])}:", block["SegmentLabels"], _array(block["PositionData"]))
            for block in trial["Skeletons"]
        ]
        names = [who + _text(label) for who, labels, _ in blocks for label in labels[3:]]
    except (AttributeError, LookupError, TypeError, ValueError):
        expected = (
            "one struct with Trajectories.Labeled or Skeletons, saved with '-v7' in MATLAB; or C3D, TRC, CSV"
        )
        what = "the file is not a trial of Qualisys Track Manager"
        raise damaged(
            what, where, expected, f"{data[:19]!r}", code="wrong_format", begins=bytes(data[:19])
        ) from None
    require_memory(40 * sum(positions.size for *_, positions in blocks), where)
    arrays = {
        "names": np.array(names),
        "positions_mm": np.concatenate([positions for *_, positions in blocks], axis=1),
        "frame_rate_hz": rate,
    }
    return arrays, list(arrays)


def load_matrices(data: bytes, where: str) -> dict[str, np.ndarray]:
    """Return the matrices of numbers in a file by name; other variables are left out.

    Raises
    ------
    InvalidInput
        If the file is of another version or damaged.
    """
    found: dict[str, np.ndarray] = {}
    rest = memoryview(data)[128:]
    try:
        while rest:
            kind, size = np.frombuffer(rest[:8], "I").tolist()
            content, rest = rest[8 : 8 + size], rest[8 + size :]  # compressed elements are not padded
            if kind == 15:
                require_memory(24 * size, where)
                element = memoryview(zlib.decompressobj().decompress(content, 24 * size))
                kind, content = int(np.frombuffer(element[:4], "I")[0]), element[8:]
            parts = _values(content) if kind == 14 else []
            of_numbers = len(parts) == 4 and isinstance(parts[3], np.ndarray) and 6 <= parts[0][0] & 255 <= 15
            if of_numbers and parts[3].size == np.prod(parts[1]):  # one that unpacks to very much is cut
                found[_name(parts)] = np.asarray(parts[3]).reshape(parts[1][::-1]).T
    except (LookupError, TypeError, ValueError, zlib.error) as error:
        raise damaged(
            "the file is not a MAT file of MATLAB 5 to 7",
            where,
            "one saved with '-v7' in MATLAB",
            f"{data[:19]!r}",
            code="wrong_format",
            begins=bytes(data[:19]),
        ) from error
    return found


def _name(matrix: Any) -> str:
    """Name of a variable."""
    return str(matrix[2].tobytes().decode("ascii"))


def _text(matrix: Any) -> str:
    """Text of a matrix, whose elements are flags, shape, name, and content."""
    return str(matrix[3].tobytes().decode(f"utf-{8 * matrix[3].itemsize}"))


def _array(matrix: Any) -> np.ndarray:
    """Numbers of a matrix (frames, columns, rows)."""
    return np.asarray(matrix[3]).reshape(-1, *matrix[1][1::-1])


def _values(data: memoryview) -> Any:
    """Elements in a row, each of an array of structs by the names of its fields."""
    values = []
    while data:
        kind, size = np.frombuffer(data[:8], "I").tolist()
        word = 8
        if kind >> 16:  # a short one: kind and size in four bytes, the content in the next
            kind, size, word = kind & 0xFFFF, kind >> 16, 4
        content, data = data[word : word + size], data[word + size + -size % word :]
        values.append(_values(content) if kind == 14 else np.frombuffer(content, _TYPES[kind]))
    if len(values) > 5 and values[0][0] & 255 == 2:  # a struct
        names = values[4].view(f"S{values[3][0]}").astype(str).tolist()
        return [dict(zip(names, values[k:], strict=False)) for k in range(5, len(values), len(names))]
    return values
