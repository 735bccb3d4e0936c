"""C3D files: the trajectories of 3D points, without any native code.

A C3D file is a 512-byte header, a section of named parameters, and frames of points with analog samples
between them.  This reader takes the points only.  Before it reads them it compares what the file declares
with the bytes that are there, so that a damaged file ends in a `Refusal` and never in a shorter recording.

Numbers stand twice in a C3D file, in the header and among the parameters.  Where the two disagree, the
size of the file is the referee: exactly one of the declared layouts must fill it.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pipeline.refusal import Refusal
from pipeline.skeleton import MILLIMETRES, MotionCapture

_BLOCK = 512
_INTEL, _DEC, _MIPS = 84, 85, 86
_BYTE_ORDER = {_INTEL: "<", _DEC: "<", _MIPS: ">"}
_COUNTER_LIMIT = 65535
"""Largest count that the 16-bit words of the header and of POINT:FRAMES can hold."""

_LARGEST_MM = 1e9
"""A thousand kilometres: no position of a person, but a number that a damaged file may hold."""


def read(path: str | Path, *, units: str | None = None) -> MotionCapture:
    """The points of a C3D file, in millimetres and in the file's own axes.

    Parameters
    ----------
    path : str or Path
    units : str, optional
        Unit of length to use in place of POINT:UNITS, one of `pipeline.skeleton.MILLIMETRES`.

    Returns
    -------
    MotionCapture
        Points whose residual is negative or whose coordinates are no numbers are NaN and not valid.

    Raises
    ------
    Refusal
        If the file is not C3D, is truncated, contradicts itself, or does not say its unit or its rate.
    """
    path = Path(path)
    if not path.is_file():
        raise Refusal("there is no such file", where=str(path))
    try:
        with path.open("rb") as handle:
            return _read(handle, str(path), units)
    except OSError as error:
        raise Refusal("the file cannot be read", where=str(path), received=str(error.strerror)) from error


def _read(handle: BinaryIO, where: str, units: str | None) -> MotionCapture:
    notes: list[str] = []
    size = os.fstat(handle.fileno()).st_size
    header = _read_header(handle, size, where)
    parameters = _read_parameters(handle, header, size, where, notes)
    scale = _scale(header, parameters, where)
    layout = _layout(header, parameters, 4 if scale < 0 else 2, size, where, notes)
    millimetres, unit = _unit(parameters, units, where, notes)
    rate = _rate(header, parameters, where, notes)
    names = _labels(parameters, layout.points, notes)
    if header.first > 1:
        notes.append(f"The first frame is number {header.first} of its trial.")

    handle.seek(layout.start)
    raw = np.frombuffer(handle.read(layout.needed), dtype=np.uint8)
    if raw.size != layout.needed:
        raise Refusal(
            "the file became shorter while it was read",
            where=where,
            expected=f"{layout.needed} bytes",
            received=f"{raw.size}",
        )
    # A frame is its points, then its analog samples; the stride jumps over the latter.
    points = raw.reshape(layout.frames, layout.stride)[:, : 4 * layout.width * layout.points]
    words = np.ascontiguousarray(points).reshape(-1)
    numbers = (
        _floats(words, header.processor) if scale < 0 else _integers(words, header.processor, signed=True)
    )
    numbers = numbers.reshape(layout.frames, layout.points, 4)
    positions = numbers[..., :3] * (millimetres if scale < 0 else millimetres * scale)
    # The fourth word holds the residual and the cameras that saw the point; negative means not measured.
    measured = numbers[..., 3] >= 0
    valid = measured & (np.abs(positions) < _LARGEST_MM).all(axis=-1)
    positions[~valid] = np.nan
    if beyond := int(np.count_nonzero(measured & ~valid)):
        notes.append(f"{beyond} samples declared as measured are not numbers or lie beyond any laboratory.")
    at_origin = int(np.count_nonzero((positions == 0).all(axis=-1)))
    if at_origin:
        notes.append(f"{at_origin} samples declared as measured lie exactly at the origin.")
    return MotionCapture(
        names=names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=rate,
        units=unit,
        channels=(),
        angles_deg=np.empty((layout.frames, 0)),
        notes=tuple(notes),
    )


def _integers(raw: np.ndarray, processor: int, *, signed: bool = False) -> np.ndarray:
    """16-bit integers (N,) from 2N bytes, as float64: counts are unsigned, coordinates signed."""
    return raw.view(f"{_BYTE_ORDER[processor]}{'i' if signed else 'u'}2").astype(float)


def _floats(raw: np.ndarray, processor: int) -> np.ndarray:
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


@dataclass(frozen=True)
class _Header:
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


def _read_header(handle: BinaryIO, size: int, where: str) -> _Header:
    head = np.frombuffer(handle.read(_BLOCK), dtype=np.uint8)
    if head.size < 2 or head[1] != 0x50 or head[0] < 2:
        raise Refusal(
            "this is not a C3D file",
            where=f"{where}, byte 0",
            expected="a block number above 1, then 0x50",
            received=head[:2].tobytes().hex(" ") or "an empty file",
        )
    parameters_at = (int(head[0]) - 1) * _BLOCK
    if size < parameters_at + _BLOCK:
        raise Refusal(
            "the file is truncated before the end of its parameters",
            where=where,
            expected=f"at least {parameters_at + _BLOCK} bytes",
            received=f"{size}",
        )
    handle.seek(parameters_at)
    _, _, blocks, processor = handle.read(4)
    if processor not in _BYTE_ORDER:
        raise Refusal(
            "the processor type is unknown",
            where=f"{where}, byte {parameters_at + 3}",
            expected="84 (Intel), 85 (DEC) or 86 (MIPS)",
            received=str(processor),
        )
    words = _integers(head[:24], processor).astype(int)
    scale, rate = (float(_floats(head[at : at + 4], processor)[0]) for at in (12, 20))
    return _Header(
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


@dataclass(frozen=True)
class _Parameters:
    """The parameter section, and where in it each ``GROUP:NAME`` has its (kind, dimensions, first byte)."""

    section: bytes
    at: int
    processor: int
    where: str
    entries: dict[str, tuple[int, tuple[int, ...], int]]

    def _content(self, key: str, width: int) -> np.ndarray:
        _, dimensions, begin = self.entries[key]
        end = begin + math.prod(dimensions) * width
        if end > len(self.section):
            raise Refusal(
                f"the parameter {key} runs past the end of its section",
                where=f"{self.where}, byte {self.at + begin}",
                expected=f"{end - begin} bytes",
                received=f"{len(self.section) - begin}",
            )
        return np.frombuffer(self.section[begin:end], dtype=np.uint8)

    def numbers(self, key: str) -> list[float]:
        """The finite values of a numeric parameter, integers read as unsigned; empty if it is absent."""
        kind = self.entries[key][0] if key in self.entries else 0
        if kind == 1:
            values = self._content(key, 1).astype(float)
        elif kind == 2:
            values = _integers(self._content(key, 2), self.processor)
        elif kind == 4:
            values = _floats(self._content(key, 4), self.processor)
        else:
            return []
        return [float(value) for value in values if math.isfinite(value)]

    def texts(self, key: str) -> list[str]:
        """The strings of a text parameter without trailing blanks; empty if it is absent."""
        if key not in self.entries or self.entries[key][0] != -1:
            return []
        length, *counts = self.entries[key][1] or (1,)
        if length == 0:  # so many strings of no characters
            return []
        content = self._content(key, 1).tobytes()
        pieces = [content[i * length : (i + 1) * length] for i in range(math.prod(counts))]
        return [_text(piece) for piece in pieces]


def _text(raw: bytes) -> str:
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return text.split("\0", 1)[0].strip()


def _read_parameters(
    handle: BinaryIO, header: _Header, size: int, where: str, notes: list[str]
) -> _Parameters:
    begin = header.parameters_at
    end = begin + header.parameter_blocks * _BLOCK
    if end > size:
        raise Refusal(
            "the parameter section runs past the end of the file",
            where=f"{where}, byte {begin + 2}",
            expected=f"at least {end} bytes",
            received=f"{size}",
        )
    # The block count is one byte, so a long section is known only by where the data begin.
    end = max(end, min((header.data_block - 1) * _BLOCK, size))
    handle.seek(begin)
    section = handle.read(end - begin)
    groups: dict[int, str] = {}
    found: list[tuple[int, str, tuple[int, tuple[int, ...], int]]] = []
    at = 4
    while at + 2 <= len(section):
        name_length, group = (np.frombuffer(section[at : at + 2], dtype=np.int8)).tolist()
        if name_length == 0 or group == 0:
            break
        link = at + 2 + abs(name_length)  # where the distance to the next record stands
        if link + 4 > len(section):
            raise Refusal("a parameter record is cut off", where=f"{where}, byte {begin + at}")
        name = _text(section[at + 2 : link]).upper()
        step = int.from_bytes(section[link : link + 2], "big" if header.processor == _MIPS else "little")
        if group < 0:
            groups.setdefault(-group, name)
        else:
            kind = int(np.frombuffer(section[link + 2 : link + 3], dtype=np.int8)[0])
            rank = section[link + 3]
            found.append((group, name, (kind, tuple(section[link + 4 : link + 4 + rank]), link + 4 + rank)))
        if step == 0:
            break
        if link + step > len(section):
            raise Refusal(
                f"the record {name!r} points past the end of the parameters",
                where=f"{where}, byte {begin + link}",
                expected=f"a step of at most {len(section) - link}",
                received=str(step),
            )
        at = max(link + step, link + 2)
    entries: dict[str, tuple[int, tuple[int, ...], int]] = {}
    for group, name, entry in found:
        key = f"{groups.get(group, group)}:{name}"
        if key in entries:
            notes.append(f"The parameter {key} stands twice; the first one is used.")
        entries.setdefault(key, entry)
    return _Parameters(section=section, at=begin, processor=header.processor, where=where, entries=entries)


def _scale(header: _Header, parameters: _Parameters, where: str) -> float:
    """The scale of integer coordinates; negative for files of reals."""
    scale = (parameters.numbers("POINT:SCALE") or [header.scale])[0]
    agrees = math.isfinite(header.scale) and (header.scale < 0) == (scale < 0)
    if agrees and scale > 0:
        agrees = math.isclose(scale, header.scale, rel_tol=1e-3)
    if scale == 0 or not agrees:
        raise Refusal(
            "the scale of the points is unusable",
            where=f"{where}, byte 12 and POINT:SCALE",
            expected="twice the same number, not zero",
            received=f"{header.scale:g} and {scale:g}",
        )
    return scale


@dataclass(frozen=True)
class _Layout:
    start: int
    """First byte of the data section."""
    points: int
    analog: int
    frames: int
    width: int
    """Bytes of one number: 4 for reals, 2 for integers."""

    @property
    def stride(self) -> int:
        return self.width * (4 * self.points + self.analog)

    @property
    def needed(self) -> int:
        return self.frames * self.stride

    def fills(self, size: int) -> bool:
        """Whether the frames end within the last block of the file."""
        return 0 <= size - self.start - self.needed < _BLOCK


def _layout(
    header: _Header, parameters: _Parameters, width: int, size: int, where: str, notes: list[str]
) -> _Layout:
    """How the data section is divided: the one declared layout that the file's size bears out."""

    def counts(name: str, *values: float) -> list[int]:
        positive = sorted({int(value) for value in values if value >= 1})
        if not positive:
            raise Refusal(f"the file declares no {name}", where=where)
        return positive

    points = counts("points", header.points, *parameters.numbers("POINT:USED")[:1])
    channels = [int(c) for c in parameters.numbers("ANALOG:USED")[:1] if c >= 0]
    analog = sorted({header.analog, *(c * max(header.analog_per_channel, 1) for c in channels)})
    # Two parameters hold counts beyond the 16 bits of the header; below that they may be stale.
    long = [*parameters.numbers("POINT:LONG_FRAMES")[:1], _trial_frames(parameters)]
    frames = counts(
        "frames",
        header.last - header.first + 1,
        *parameters.numbers("POINT:FRAMES")[:1],
        *(n for n in long if n > _COUNTER_LIMIT),
    )
    for n in long:
        if 0 < n <= _COUNTER_LIMIT and n not in frames:
            notes.append(
                f"A parameter gives {n:g} frames where the header gives {frames[0]}; it is not used."
            )
    begin = header.parameters_at + max(header.parameter_blocks, 1) * _BLOCK
    blocks = counts("start of the data", header.data_block, *parameters.numbers("POINT:DATA_START")[:1])
    starts = [at for block in blocks if begin <= (at := (block - 1) * _BLOCK) <= size]
    if not starts:
        raise Refusal(
            "the data do not begin between the parameters and the end of the file",
            where=f"{where}, byte 16",
            expected=f"a block from {begin // _BLOCK + 1} to {size // _BLOCK + 1}",
            received=_either(blocks),
        )
    layouts = [_Layout(*choice, width) for choice in product(starts, points, analog, frames)]
    fitting = [layout for layout in layouts if layout.fills(size)]
    ends = sorted({layout.start + layout.needed for layout in layouts})
    declared = f"{_either(points)} points, {_either(analog)} analog samples a frame, {_either(frames)} frames"
    if len(layouts) == 1 and size >= ends[0] + _BLOCK:
        if header.last == _COUNTER_LIMIT:
            raise Refusal(
                "the frame counter of the header is full and nothing gives the true count",
                where=f"{where}, byte 8",
                expected="TRIAL:ACTUAL_END_FIELD or POINT:LONG_FRAMES",
            )
        notes.append(f"{size - ends[0]} bytes after the last frame are not read.")
        return layouts[0]
    if len(fitting) != 1:
        what = (
            "the file is truncated" if size < ends[0] else "the size does not settle what the file declares"
        )
        raise Refusal(
            f"{what}: {declared}", where=where, expected=f"{_either(ends)} bytes", received=f"{size}"
        )
    if len(layouts) > 1 and fitting[0].frames <= _COUNTER_LIMIT:
        notes.append(f"The header and the parameters disagree ({declared}); the file's size settles it.")
    return fitting[0]


def _either(counts: list[int]) -> str:
    return " or ".join(map(str, counts))


def _trial_frames(parameters: _Parameters) -> float:
    """Frames from TRIAL:ACTUAL_START_FIELD to ACTUAL_END_FIELD (low word, high word); 0 if not given."""
    ends = [parameters.numbers(f"TRIAL:ACTUAL_{end}_FIELD")[:2] for end in ("START", "END")]
    if not all(ends):
        return 0
    first, last = (sum(word * 65536**i for i, word in enumerate(words)) for words in ends)
    return max(last - first + 1, 0)


def _unit(parameters: _Parameters, given: str | None, where: str, notes: list[str]) -> tuple[float, str]:
    declared = (parameters.texts("POINT:UNITS") or [""])[0].lower()
    unit = declared if given is None else given
    if unit not in MILLIMETRES:
        raise Refusal(
            "the unit of length is unknown" if unit else "the file does not give its unit of length",
            where=f"{where}, POINT:UNITS" if given is None else f"{where}, option units",
            expected="one of "
            + ", ".join(MILLIMETRES)
            + ("; or set the option units" if given is None else ""),
            received=repr(unit) if unit else "",
        )
    if given is not None and declared and declared != given:
        notes.append(f"The file says its unit is {declared!r}; {given!r} was asked for and used.")
    return MILLIMETRES[unit], unit


def _rate(header: _Header, parameters: _Parameters, where: str, notes: list[str]) -> float:
    """Frames per second: POINT:RATE, which the header must not contradict by more than 1 %."""
    declared = [*parameters.numbers("POINT:RATE")[:1], header.rate]
    usable = [rate for rate in declared if math.isfinite(rate) and 1e-3 < rate < 1e6]
    if not usable or (len(usable) == 2 and not math.isclose(*usable, rel_tol=0.01)):
        raise Refusal(
            "the frame rate is unusable",
            where=f"{where}, POINT:RATE and byte 20",
            expected="twice the same positive number of hertz",
            received=" and ".join(f"{rate:g}" for rate in declared),
        )
    if len(usable) < len(declared) or usable[0] != usable[-1]:
        notes.append(f"POINT:RATE and the header disagree on the frame rate; {usable[0]:g} Hz is used.")
    return usable[0]


def _labels(parameters: _Parameters, points: int, notes: list[str]) -> tuple[str, ...]:
    """One name per point; LABELS holds 255 at most, LABELS2, LABELS3… continue it."""
    labels = parameters.texts("POINT:LABELS")
    block = 2
    while len(labels) < points and f"POINT:LABELS{block}" in parameters.entries:
        labels += parameters.texts(f"POINT:LABELS{block}")
        block += 1
    if len(labels) > points:
        notes.append(f"{len(labels) - points} labels beyond the {points} points are dropped.")
    labels = (labels + [""] * points)[:points]
    nameless = labels.count("")
    if nameless:
        notes.append(f"{nameless} points have no label; they are called point_1, point_2… by their place.")
    names = tuple(label or f"point_{k}" for k, label in enumerate(labels, start=1))
    if len(set(names)) < points:
        notes.append(f"{points - len(set(names))} labels stand more than once.")
    return names
