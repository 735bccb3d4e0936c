"""Reader of MAT files (MATLAB 5 to 7); code in them is never run.

It reads trials that Qualisys Track Manager exports, structs of the MoCap Toolbox, and one matrix for each marker.
"""

from __future__ import annotations

import zlib
from collections import Counter
from contextlib import suppress
from typing import Any

import numpy as np

from pipeline.formats.budget import require_memory
from pipeline.formats.contract import damaged
from pipeline.validation import InvalidInput, listed

_TYPES = "0bBhHiIf0d00qQ0BBH"
"""NumPy type of the numbers in a MAT element, by kind of element; the last three are compressed, UTF-8 and UTF-16."""
_TOOLBOX = {"freq", "markerName", "data"}
"""Fields by which a struct of the MoCap Toolbox is recognised; ``data`` has the markers in its columns."""
_RATES = {
    "rate",
    "freq",
    "frequency",
    "framerate",
    "frame_rate",
    "frame_rate_hz",
    "fps",
    "fs",
    "samplingfrequency",
}
"""Possible names, in lower case, of a frame rate that is stored next to matrices of markers."""
MIN_MARKERS = 3
"""Smallest number of matrices of equal length that are interpreted as markers."""


def load_mat(data: bytes, where: str, *_: object) -> tuple[dict[str, np.ndarray], list[str]]:
    """Read the markers in a MAT file; return them as arrays like those of an NPZ file, and the names of the arrays.

    The arrays are named as in exported files, or as in AMASS if the unit of length is unknown.

    Several structs of the MoCap Toolbox are several people.  Without markers, the segments of Qualisys' skeletons are
    returned; their names begin with the skeleton's name and a colon.

    Raises
    ------
    InvalidInput
        If the file has another MAT version or contains no markers; the message lists its variables.
    """
    arrays: dict[str, np.ndarray] = {}
    with suppress(AttributeError, LookupError, TypeError, ValueError):
        arrays = _qualisys(data, where)
    arrays = arrays or _markers(data, where)
    return arrays, list(arrays)


def _qualisys(data: bytes, where: str) -> dict[str, np.ndarray]:
    """Return names, positions and frame rate from a MAT file of Qualisys that contains one trial.

    If the content is different, raises ValueError, AttributeError, LookupError or TypeError.
    """
    (trial,) = _values(memoryview(data)[128:])
    if isinstance(trial, np.ndarray):
        # Compressed motion takes more than half its size, but the zeros of a force plate take much less.
        (trial,) = _values(memoryview(zlib.decompressobj().decompress(trial.data, 24 * trial.size)))
    (trial,) = trial
    rate = trial["FrameRate"][3]
    markers = [
        block for trajectories in trial.get("Trajectories", ()) for block in trajectories.get("Labeled", ())
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
    require_memory(40 * sum(positions.size for *_, positions in blocks), where)
    positions = np.concatenate([positions for *_, positions in blocks], axis=1)
    return {"names": np.array(names), "positions_mm": positions, "frame_rate_hz": rate}


def _markers(data: bytes, where: str) -> dict[str, np.ndarray]:
    """Return names, positions and rate from MoCap Toolbox structs, or from matrices of single markers."""
    variables = _variables(data, where)
    structs = {
        name: value[0]
        for name, value in variables.items()
        if isinstance(value, list) and len(value) == 1 and isinstance(value[0], dict)
    }
    try:
        if takes := {name: struct for name, struct in structs.items() if set(struct) >= _TOOLBOX}:
            return _of_toolbox(takes, where)
        fields = [(name, _numbers(value)) for struct in structs.values() for name, value in struct.items()]
    except InvalidInput:
        raise
    except (AttributeError, LookupError, TypeError, ValueError):
        fields = []
    numbers = {name: value for name, value in (*variables.items(), *fields) if isinstance(value, np.ndarray)}
    points = {}
    for name, value in numbers.items():
        if value.ndim == 2 and max(value.shape) > 4 and 3 in value.shape:
            points[name] = value if value.shape[1] == 3 else value.T
        elif value.ndim == 2 and value.shape[0] == 4 < value.shape[1]:
            points[name] = value[:3].T
    frames, count = Counter(map(len, points.values())).most_common(1)[0] if points else (0, 0)
    if count < MIN_MARKERS:
        received = [f"{name} {value.shape}" for name, value in numbers.items()]
        received += [f"struct {name} ({listed([*struct])})" for name, struct in structs.items()]
        raise damaged(
            "the file contains no markers",
            where,
            "a struct of Qualisys or the MoCap Toolbox, or a matrix (frames, 3) for each marker",
            listed(received) or f"{data[:19]!r}",
            code="wrong_format",
            begins=bytes(data[:19]),
        )
    points = {name: value for name, value in points.items() if len(value) == frames}
    rates = [value.ravel() for name, value in numbers.items() if name.lower() in _RATES and value.size == 1]
    return _of_unknown_unit([*points], np.stack([*points.values()], axis=1), rates)


def _of_toolbox(takes: dict[str, Any], where: str) -> dict[str, np.ndarray]:
    """Return names, positions and frame rate from the MoCap Toolbox structs of a file.

    If there are several, each marker name begins with the struct's name and a colon.
    """
    rates = {float(_numbers(take["freq"]).item()) for take in takes.values()}
    if len(rates) > 1:
        raise damaged(
            "the structs of the file have different frame rates",
            where,
            received=sorted(rates),
            code="unknown_rate",
        )
    names, blocks = [], []
    for name, take in takes.items():
        labels = [_text(label) for label in take["markerName"][3:]]
        names += [f"{name}:{label}" if len(takes) > 1 else label for label in labels]
        blocks.append(_numbers(take["data"]).reshape(-1, len(labels), 3))
    frames = max(map(len, blocks))
    require_memory(40 * frames * 3 * len(names), where)
    padded = [np.pad(block.astype(float), ((0, frames - len(block)), (0, 0), (0, 0)), constant_values=np.nan)
              for block in blocks]  # fmt: skip
    return _of_unknown_unit(names, np.concatenate(padded, axis=1), [np.array(sorted(rates))])


def _of_unknown_unit(
    names: list[str], positions: np.ndarray, rates: list[np.ndarray]
) -> dict[str, np.ndarray]:
    """Return names and positions as arrays of AMASS; the reader infers their unit from the length of the legs."""
    arrays = {"marker_labels": np.array(names), "marker_data": positions}
    return arrays | ({"mocap_framerate": rates[0]} if rates else {})


def load_matrices(data: bytes, where: str) -> dict[str, np.ndarray]:
    """Return the numeric matrices in a MAT file by name, and ignore other variables.

    Raises
    ------
    InvalidInput
        If the file has another MAT version or is damaged.
    """
    return {name: value for name, value in _variables(data, where).items() if isinstance(value, np.ndarray)}


def _variables(data: bytes, where: str) -> dict[str, Any]:
    """Return the variables of a MAT file by name: numeric matrices as arrays, other variables as elements."""
    variables: dict[str, Any] = {}
    rest = memoryview(data)[128:]
    try:
        while rest:
            kind, size = np.frombuffer(rest[:8], "I").tolist()
            content, rest = rest[8 : 8 + size], rest[8 + size :]  # compressed elements are not padded
            if kind == 15:
                require_memory(24 * size, where)
                element = memoryview(zlib.decompressobj().decompress(content, 24 * size))
                kind, content = int(np.frombuffer(element[:4], "I")[0]), element[8:]
            if kind == 14 and (name := _name(_values(content, at_most=3))):
                parts = _values(content)
                variables[name] = parts if (matrix := _numbers(parts)) is None else matrix
    except (LookupError, TypeError, ValueError, zlib.error) as error:
        raise damaged(
            "the file is not a MAT file of MATLAB 5 to 7",
            where,
            "a file saved with '-v7' in MATLAB",
            f"{data[:19]!r}",
            code="wrong_format",
            begins=bytes(data[:19]),
        ) from error
    return variables


def _numbers(parts: Any) -> Any:
    """Return the numeric matrix that elements of a MAT file describe; None for other content or a truncated matrix."""
    if len(parts) == 4 and isinstance(parts[3], np.ndarray) and 6 <= parts[0][0] & 255 <= 15:
        return np.asarray(parts[3]).reshape(parts[1][::-1]).T if parts[3].size == np.prod(parts[1]) else None
    return None


def _name(matrix: Any) -> str:
    """Return the name of a MAT variable from the variable's elements."""
    return str(matrix[2].tobytes().decode("ascii"))


def _text(matrix: Any) -> str:
    """Return the text of a character matrix from its elements: flags, shape, name and content."""
    return str(matrix[3].tobytes().decode(f"utf-{8 * matrix[3].itemsize}"))


def _array(matrix: Any) -> np.ndarray:
    """Return a three-dimensional MAT matrix as an array (frames, columns, rows)."""
    return np.asarray(matrix[3]).reshape(-1, *matrix[1][1::-1])


def _values(data: memoryview, at_most: int = 2**31) -> Any:
    """Parse consecutive elements of a MAT file; an array of structs becomes a list of dictionaries by field name."""
    values: list[Any] = []
    while data and len(values) < at_most:
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
