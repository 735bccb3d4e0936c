"""Position and number of the frames in a C3D file.

The header and the parameters both declare the counts.  If they disagree, the file size decides: exactly one of the
declared layouts must fill the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from pipeline.formats.c3d.header import BLOCK, Header
from pipeline.formats.c3d.parameters import Parameters
from pipeline.formats.contract import damaged

_COUNTER_LIMIT = 65535
"""Largest count that the 16-bit words of the header and of POINT:FRAMES can store."""


@dataclass(frozen=True)
class Layout:
    """Division of the data section of a C3D file into frames."""

    start: int
    """Position of the first byte of the data section."""
    points: int
    analog: int
    frames: int
    width: int
    """Bytes per number: 4 for floats, 2 for integers."""

    @property
    def stride(self) -> int:
        """Bytes per frame, including the frame's analog samples."""
        return self.width * (4 * self.points + self.analog)

    @property
    def needed(self) -> int:
        """Total number of bytes of all frames."""
        return self.frames * self.stride


def find_layout(
    header: Header, parameters: Parameters, width: int, size: int, where: str, notes: list[str]
) -> Layout:
    """Find the declared layout of the data section that matches the file size.

    Parameters
    ----------
    header : Header
    parameters : Parameters
    width : int
        Bytes per number.
    size : int
        Size of the file in bytes.
    where : str
        Name of the file.
    notes : list of str
        Notes of the file; contradictions between header and parameters are added.

    Raises
    ------
    InvalidInput
        If the counts are not declared, or the number of layouts that fill the file is not one.
    """

    def counts(name: str, *values: float) -> list[int]:
        positive = sorted({int(value) for value in values if value >= 1})
        if not positive:
            raise damaged(f"the file does not declare the {name}", where, code="not_declared", name=name)
        return positive

    points = counts("points", header.points, *parameters.numbers("POINT:USED")[:1])
    channels = [int(c) for c in parameters.numbers("ANALOG:USED")[:1] if c >= 0]
    analog = sorted({header.analog, *(c * max(header.analog_per_channel, 1) for c in channels)})
    # Two parameters store counts beyond the 16 bits of the header; smaller counts in them may be stale.
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
                f"A parameter declares {n:g} frames, the header {frames[0]}; the parameter is not used."
            )
    begin = header.parameters_at + max(header.parameter_blocks, 1) * BLOCK
    blocks = counts("start of the data", header.data_block, *parameters.numbers("POINT:DATA_START")[:1])
    starts = [at for block in blocks if begin <= (at := (block - 1) * BLOCK) <= size]
    if not starts:
        raise damaged(
            "the declared start of the data is not between the parameters and the end of the file",
            f"{where}, byte 16",
            f"a block from {begin // BLOCK + 1} to {size // BLOCK + 1}",
            _either(blocks),
            code="misplaced_data",
        )
    layouts = [Layout(*choice, width) for choice in product(starts, points, analog, frames)]
    # Frames end within the last block of the file.
    fitting = [layout for layout in layouts if 0 <= size - layout.start - layout.needed < BLOCK]
    ends = sorted({layout.start + layout.needed for layout in layouts})
    declared = (
        f"{_either(points)} points, {_either(analog)} analog samples per frame, {_either(frames)} frames"
    )
    if len(layouts) == 1 and size >= ends[0] + BLOCK:
        if header.last == _COUNTER_LIMIT:
            raise damaged(
                "the frame counter of the header is at its limit, and no parameter gives the true count",
                f"{where}, byte 8",
                "TRIAL:ACTUAL_END_FIELD or POINT:LONG_FRAMES",
                code="full_counter",
            )
        notes.append(f"{size - ends[0]} bytes after the last frame are not read.")
        return layouts[0]
    if len(fitting) != 1:
        what = (
            "the file is truncated" if size < ends[0] else "the file size fits no declared layout, or several"
        )
        raise damaged(
            f"{what}: {declared}",
            where,
            f"{_either(ends)} bytes",
            size,
            code="truncated" if size < ends[0] else "contradiction",
            needed=ends,
            size=size,
            frames=frames,
        )
    if len(layouts) > 1 and fitting[0].frames <= _COUNTER_LIMIT:
        notes.append(f"The header and the parameters disagree ({declared}); the file size decides.")
    return fitting[0]


def _either(counts: list[int]) -> str:
    return " or ".join(map(str, counts))


def _trial_frames(parameters: Parameters) -> float:
    """Return the number of frames from TRIAL:ACTUAL_START_FIELD to ACTUAL_END_FIELD; 0 if a parameter is absent.

    Each of the two parameters is a low and a high 16-bit word.
    """
    ends = [parameters.numbers(f"TRIAL:ACTUAL_{end}_FIELD")[:2] for end in ("START", "END")]
    if not all(ends):
        return 0
    first, last = (sum(word * 65536**i for i, word in enumerate(words)) for words in ends)
    return max(last - first + 1, 0)
