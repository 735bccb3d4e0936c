"""C3D files: points as 32-bit reals in Intel byte order, millimetres."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.c3d.header import BLOCK
from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import positions_to_write

_LABELS = 255
"""Largest number of labels in one C3D parameter."""
_COUNTER = 65535
"""Largest signed integer of 16 bits."""


def write(path: Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float) -> None:
    """Write positions as C3D, millimetres, in single precision. A missing sample has the residual -1.

    Parameters
    ----------
    path : Path
    names : sequence of str
        P point names.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the shapes do not fit, a name has more than 127 bytes, or a coordinate cannot be written.
    """
    where = path.name
    positions = positions_to_write(names, positions_mm, frame_rate_hz, where, distinct=False)
    frames, points = positions.shape[:2]
    labels = [name.encode() for name in names]
    if max(map(len, labels)) > 127 or points > _COUNTER:
        raise damaged(
            "C3D cannot store these names or this number of points",
            where,
            "names of at most 127 bytes, and at most 65535 points",
            code="unwritable_name",
        )
    missing = np.isnan(positions).any(axis=-1)
    samples = np.zeros((frames, points, 4), "<f4")
    samples[..., :3] = np.where(missing[..., None], 0.0, positions)
    samples[..., 3] = np.where(missing, -1.0, 0.0)

    def build(data_block: int) -> bytes:
        point = [
            _integers("USED", [points]),
            _integers("FRAMES", [min(frames, _COUNTER)]),
            _integers("DATA_START", [data_block]),
            _reals("SCALE", -1.0),
            _reals("RATE", frame_rate_hz),
            _texts("UNITS", [b"mm"], scalar=True),
            _texts("X_SCREEN", [b"+X"], scalar=True),
            _texts("Y_SCREEN", [b"+Z"], scalar=True),
        ]
        for block, begin in enumerate(range(0, points, _LABELS), start=1):
            number = str(block) if block > 1 else ""
            point.append(_texts(f"LABELS{number}", labels[begin : begin + _LABELS]))
            point.append(_texts(f"DESCRIPTIONS{number}", [b""] * len(labels[begin : begin + _LABELS])))
        trial = [
            _integers("ACTUAL_START_FIELD", [1, 0]),
            _integers("ACTUAL_END_FIELD", [frames & 0xFFFF, frames >> 16]),
        ]
        analog = [_integers("USED", [0]), _reals("RATE", 0.0), _reals("GEN_SCALE", 1.0)]
        records = b""
        for group, (title, parameters) in enumerate(
            (("POINT", point), ("ANALOG", analog), ("TRIAL", trial)), start=1
        ):
            records += struct.pack("<bb", len(title), -group) + title.encode() + struct.pack("<Hb", 3, 0)
            for name, body in parameters:
                content = struct.pack("<bb", len(name), group) + name.encode()
                records += content + struct.pack("<H", len(body) + 3) + body + b"\0"
        blocks = -(-(len(records) + 6) // BLOCK)
        head = bytes([1, 80, min(blocks, 255), 84])
        return (head + records).ljust(blocks * BLOCK, b"\0")

    section = build(0)
    data_block = 2 + len(section) // BLOCK
    if data_block > _COUNTER:
        raise damaged("C3D cannot store this number of names", where, code="too_many_names")
    section = build(data_block)
    header = struct.pack(
        "<BBHHHHHfHHf", 2, 80, points, 0, 1, min(frames, _COUNTER), 0, -1.0, data_block, 0, frame_rate_hz
    )
    data = samples.tobytes()
    if frames < _COUNTER:  # with more frames, some readers take all bytes to the end of the file as frames
        data = data.ljust(-(-len(data) // BLOCK) * BLOCK, b"\0")
    path.write_bytes(header.ljust(BLOCK, b"\0") + section + data)


def _integers(name: str, values: Sequence[int]) -> tuple[str, bytes]:
    dimensions = bytes([1, len(values)]) if len(values) > 1 else b"\0"
    return name, struct.pack("<b", 2) + dimensions + struct.pack(f"<{len(values)}H", *values)


def _reals(name: str, value: float) -> tuple[str, bytes]:
    return name, struct.pack("<bBf", 4, 0, value)


def _texts(name: str, texts: Sequence[bytes], *, scalar: bool = False) -> tuple[str, bytes]:
    width = max(1, *map(len, texts))
    dimensions = bytes([1, width]) if scalar else bytes([2, width, len(texts)])
    return name, struct.pack("<b", -1) + dimensions + b"".join(text.ljust(width) for text in texts)
