"""Reader of MAT files (MATLAB 5 to 7) that Qualisys Track Manager exports; code in them is never run."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from pipeline.formats.budget import require_memory
from pipeline.formats.contract import damaged

_TYPES = "0bBhHiIf0d00qQ0BBH"
"""NumPy type of the numbers in an element, by its kind; the last three are compressed, UTF-8 and UTF-16."""


def load_mat(data: bytes, where: str, *_: object) -> tuple[dict[str, np.ndarray], list[str]]:
    """Read the labelled markers of a trial, as the arrays of an exported NPZ file and the names of these arrays.

    Without markers, the segments of the skeletons are returned; their names begin with the skeleton's name and a colon.

    Raises
    ------
    InvalidInput
        If the file has another MAT version, or does not contain exactly one trial.
    """
    try:
        (trial,) = _values(memoryview(data)[128:])
        if isinstance(trial, np.ndarray):
            # Compressed motion takes more than half its size, but the zeros of a force plate take much less.
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
        names = [prefix + _text(label) for prefix, labels, _ in blocks for label in labels[3:]]
    except (AttributeError, LookupError, TypeError, ValueError):
        expected = (
            "a struct with Trajectories.Labeled or Skeletons, saved with '-v7' in MATLAB; or C3D, TRC, CSV"
        )
        message = "the file is not a trial of Qualisys Track Manager"
        raise damaged(
            message, where, expected, f"{data[:19]!r}", code="wrong_format", begins=bytes(data[:19])
        ) from None
    require_memory(40 * sum(positions.size for *_, positions in blocks), where)
    arrays = {
        "names": np.array(names),
        "positions_mm": np.concatenate([positions for *_, positions in blocks], axis=1),
        "frame_rate_hz": rate,
    }
    return arrays, list(arrays)


def load_matrices(data: bytes, where: str) -> dict[str, np.ndarray]:
    """Read the matrices of numbers in a MAT file, by name; other variables are left out.

    Raises
    ------
    InvalidInput
        If the file has another MAT version or is damaged.
    """
    matrices: dict[str, np.ndarray] = {}
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
            is_numeric = len(parts) == 4 and isinstance(parts[3], np.ndarray) and 6 <= parts[0][0] & 255 <= 15
            if is_numeric and parts[3].size == np.prod(parts[1]):  # a matrix that unpacks to too much is cut
                matrices[_name(parts)] = np.asarray(parts[3]).reshape(parts[1][::-1]).T
    except (LookupError, TypeError, ValueError, zlib.error) as error:
        raise damaged(
            "the file is not a MAT file of MATLAB 5 to 7",
            where,
            "a file saved with '-v7' in MATLAB",
            f"{data[:19]!r}",
            code="wrong_format",
            begins=bytes(data[:19]),
        ) from error
    return matrices


def _name(matrix: Any) -> str:
    """Name of a variable, from its elements."""
    return str(matrix[2].tobytes().decode("ascii"))


def _text(matrix: Any) -> str:
    """Text of a matrix, from its elements flags, shape, name and content."""
    return str(matrix[3].tobytes().decode(f"utf-{8 * matrix[3].itemsize}"))


def _array(matrix: Any) -> np.ndarray:
    """Numbers of a matrix, as an array (frames, columns, rows)."""
    return np.asarray(matrix[3]).reshape(-1, *matrix[1][1::-1])


def _values(data: memoryview) -> Any:
    """Parse consecutive elements; an array of structs becomes a list of dictionaries by field name."""
    values = []
    while data:
        kind, size = np.frombuffer(data[:8], "I").tolist()
        word = 8
        if kind >> 16:  # a short element: kind and size in four bytes, the content in the next four
            kind, size, word = kind & 0xFFFF, kind >> 16, 4
        content, data = data[word : word + size], data[word + size + -size % word :]
        values.append(_values(content) if kind == 14 else np.frombuffer(content, _TYPES[kind]))
    if len(values) > 5 and values[0][0] & 255 == 2:  # a struct
        names = values[4].view(f"S{values[3][0]}").astype(str).tolist()
        return [dict(zip(names, values[k:], strict=False)) for k in range(5, len(values), len(names))]
    return values
