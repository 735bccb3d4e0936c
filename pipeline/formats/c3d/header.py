"""Header block of a C3D file, and decoding of numbers in the byte order of the processor that wrote the file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.formats.contract import damaged

BLOCK = 512
_INTEL, _DEC, MIPS = 84, 85, 86
_BYTE_ORDER = {_INTEL: "<", _DEC: "<", MIPS: ">"}


@dataclass(frozen=True)
class Header:
    """Counts, scale and rate that the header block declares, and the code of the processor that wrote the file."""

    processor: int
    parameters_at: int
    """Position of the first byte of the parameter section."""
    parameter_blocks: int
    points: int
    analog: int
    """Number of analog samples per frame of points, summed over all channels."""
    analog_per_channel: int
    first: int
    last: int
    scale: float
    data_block: int
    rate: float


def read_header(data: bytes, where: str) -> Header:
    """Read the header of a C3D file.

    Raises
    ------
    InvalidInput
        If the file is not C3D, ends before its parameters, or was written by an unknown processor.
    """
    if len(data) < 2 or data[1] != 0x50 or data[0] < 2:
        raise damaged(
            "this is not a C3D file",
            f"{where}, byte 0",
            "a block number above 1, then 0x50",
            data[:2].hex(" "),
            code="wrong_format",
        )
    begin = (data[0] - 1) * BLOCK
    if len(data) < begin + BLOCK:
        raise damaged(
            "the file is truncated before the end of its parameters",
            where,
            f"at least {begin + BLOCK} bytes",
            len(data),
            code="truncated",
            part="parameters",
        )
    _, _, blocks, processor = data[begin : begin + 4]
    if processor not in _BYTE_ORDER:
        raise damaged(
            "the processor type is unknown",
            f"{where}, byte {begin + 3}",
            "84 (Intel), 85 (DEC) or 86 (MIPS)",
            processor,
            code="unknown_processor",
        )
    words = integers(data[:24], processor).astype(int).tolist()
    scale, rate = (float(floats(data[at : at + 4], processor)[0]) for at in (12, 20))
    return Header(
        processor=processor,
        parameters_at=begin,
        parameter_blocks=blocks,
        points=words[1],
        analog=words[2],
        analog_per_channel=words[9],
        first=words[3],
        last=words[4],
        scale=scale,
        data_block=words[8],
        rate=rate,
    )


def integers(raw: bytes, processor: int, *, signed: bool = False) -> np.ndarray:
    """Decode 2N bytes as 16-bit integers and return them as float64 (N,).

    Counts are unsigned, coordinates are signed.
    """
    return np.frombuffer(raw, f"{_BYTE_ORDER[processor]}{'i' if signed else 'u'}2").astype(float)


def floats(raw: bytes, processor: int) -> np.ndarray:
    """Decode 4N bytes as 32-bit floats and return them as float64 (N,)."""
    if processor != _DEC:
        with np.errstate(invalid="ignore"):  # a signalling NaN in a damaged file
            return np.frombuffer(raw, f"{_BYTE_ORDER[processor]}f4").astype(float)
    # VAX F_floating: two little-endian words, the more significant word first; the value is 0.1f (binary) 2^(e-128).
    halves = np.frombuffer(raw, "<u2").astype(np.int64).reshape(-1, 2)
    bits = halves[:, 0] << 16 | halves[:, 1]
    negative, exponent = bits >> 31, bits >> 23 & 0xFF
    magnitude = np.ldexp(1.0 + (bits & 0x7FFFFF) / 2.0**23, exponent - 129)
    number = np.where(negative == 1, -magnitude, magnitude)
    # Exponent 0 has no hidden bit: it is zero, or with the sign bit the reserved operand.
    return np.where(exponent > 0, number, np.where(negative == 1, np.nan, 0.0))
