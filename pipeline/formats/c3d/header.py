"""The first block of a C3D file, and how its processor writes numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from pipeline.validation import InvalidInput

BLOCK = 512
_INTEL, _DEC, MIPS = 84, 85, 86
_BYTE_ORDER = {_INTEL: "<", _DEC: "<", MIPS: ">"}


@dataclass(frozen=True)
class Header:
    """What the first block declares, and the number of the processor that wrote it."""

    processor: int
    parameters_at: int
    """First byte of the parameter section."""
    parameter_blocks: int
    points: int
    analog: int
    """Analog samples of all channels in one frame of points."""
    analog_per_channel: int
    first: int
    last: int
    scale: float
    data_block: int
    rate: float


def read_header(handle: BinaryIO, size: int, where: str) -> Header:
    """The header of an open file of `size` bytes.

    Raises
    ------
    InvalidInput
        If the file is not C3D, ends before its parameters, or was written by an unknown processor.
    """
    head = np.frombuffer(handle.read(BLOCK), dtype=np.uint8)
    if head.size < 2 or head[1] != 0x50 or head[0] < 2:
        raise InvalidInput(
            "this is not a C3D file",
            where=f"{where}, byte 0",
            expected="a block number above 1, then 0x50",
            received=head[:2].tobytes().hex(" ") or "an empty file",
        )
    parameters_at = (int(head[0]) - 1) * BLOCK
    if size < parameters_at + BLOCK:
        raise InvalidInput(
            "the file is truncated before the end of its parameters",
            where=where,
            expected=f"at least {parameters_at + BLOCK} bytes",
            received=f"{size}",
        )
    handle.seek(parameters_at)
    _, _, blocks, processor = handle.read(4)
    if processor not in _BYTE_ORDER:
        raise InvalidInput(
            "the processor type is unknown",
            where=f"{where}, byte {parameters_at + 3}",
            expected="84 (Intel), 85 (DEC) or 86 (MIPS)",
            received=str(processor),
        )
    words = integers(head[:24], processor).astype(int)
    scale, rate = (float(floats(head[at : at + 4], processor)[0]) for at in (12, 20))
    return Header(
        processor=processor,
        parameters_at=parameters_at,
        parameter_blocks=blocks,
        points=int(words[1]),
        analog=int(words[2]),
        analog_per_channel=int(words[9]),
        first=int(words[3]),
        last=int(words[4]),
        scale=scale,
        data_block=int(words[8]),
        rate=rate,
    )


def integers(raw: np.ndarray, processor: int, *, signed: bool = False) -> np.ndarray:
    """16-bit integers (N,) from 2N bytes, as float64: counts are unsigned, coordinates signed."""
    return raw.view(f"{_BYTE_ORDER[processor]}{'i' if signed else 'u'}2").astype(float)


def floats(raw: np.ndarray, processor: int) -> np.ndarray:
    """32-bit reals (N,) from 4N bytes, as float64."""
    if processor != _DEC:
        with np.errstate(invalid="ignore"):  # a signalling NaN in a damaged file
            return raw.view(f"{_BYTE_ORDER[processor]}f4").astype(float)
    # VAX F_floating: two little-endian words, the more significant first; value 0.1f (binary) 2^(e-128).
    halves = raw.view("<u2").astype(np.int64).reshape(-1, 2)
    bits = halves[:, 0] << 16 | halves[:, 1]
    negative, exponent = bits >> 31, bits >> 23 & 0xFF
    magnitude = np.ldexp(1.0 + (bits & 0x7FFFFF) / 2.0**23, exponent - 129)
    number = np.where(negative == 1, -magnitude, magnitude)
    # No hidden one below exponent 1: plain zero, or the operand that the machine traps on.
    return np.where(exponent > 0, number, np.where(negative == 1, np.nan, 0.0))
