"""Segments of C3D files without points: 4 × 4 matrices, which markerless systems write instead of markers."""

from __future__ import annotations

import numpy as np

from pipeline.formats.c3d.header import BLOCK, Header, floats
from pipeline.formats.c3d.parameters import Parameters
from pipeline.formats.contract import LARGEST, damaged

_NUMBERS = 17
"""Numbers per matrix: the sixteen elements, column by column, and a reliability."""


def segment_origins(
    data: bytes, header: Header, parameters: Parameters, where: str
) -> tuple[list[str], np.ndarray, float] | None:
    """Return the segments' names, origins (T, S, 3) in the file's unit, and frame rate, Hz; None without segments.

    Raises
    ------
    InvalidInput
        If the matrices run past the end of the file, or the counts or the rate cannot be used.
    """
    segments = int((parameters.numbers("ROTATION:USED") or [0])[0])
    if segments < 1:
        return None
    ratio = int((parameters.numbers("ROTATION:RATIO") or [1])[0]) or 1
    rate = (parameters.numbers("ROTATION:RATE") or [header.rate * ratio])[0]
    start = (int((parameters.numbers("ROTATION:DATA_START") or [header.data_block])[0]) - 1) * BLOCK
    frames = (header.last - header.first + 1) * ratio
    needed = 4 * _NUMBERS * segments * frames
    if start < BLOCK or frames < 1 or start + needed > len(data) or not 0 < rate < 1e6:
        raise damaged(
            "the file is truncated, or the declared counts of its rotations are wrong",
            f"{where}, ROTATION",
            f"{max(start, 0) + needed} bytes",
            f"{frames} frames of {segments} segments at {rate:g} Hz in {len(data)} bytes",
            code="truncated",
            part="rotations",
        )
    numbers = floats(data[start : start + needed], header.processor).reshape(frames, segments, _NUMBERS)
    origins = numbers[:, :, 12:15].copy()
    # An invalid pose (not measured) has another number than 1 in its corner, or a negative reliability.
    usable = (numbers[:, :, 15] == 1) & (numbers[:, :, 16] >= 0) & (np.abs(origins) < LARGEST).all(axis=-1)
    origins[~usable] = np.nan
    labels = (parameters.texts("ROTATION:LABELS") + [""] * segments)[:segments]
    names = [label.removesuffix("_4X4") or f"segment_{k}" for k, label in enumerate(labels, start=1)]
    return names, origins, float(rate)
