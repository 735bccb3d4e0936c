"""Where in a C3D file the frames stand, and how many there are.

Counts stand twice, in the header and among the parameters.  Where the two disagree, the size of the file decides:
exactly one of the declared layouts must fill it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from pipeline.formats.c3d.header import BLOCK, Header
from pipeline.formats.c3d.parameters import Parameters
from pipeline.formats.contract import damaged

_COUNTER_LIMIT = 65535
"""Largest count that the 16-bit words of the header and of POINT:FRAMES can hold."""


@dataclass(frozen=True)
class Layout:
    """One way to divide the data section into frames."""

    start: int
    """First byte of the data section."""
    points: int
    analog: int
    frames: int
    width: int
    """Bytes of one number: 4 for reals, 2 for integers."""

    @property
    def stride(self) -> int:
        """Bytes of one frame, analog samples included."""
        return self.width * (4 * self.points + self.analog)

    @property
    def needed(self) -> int:
        """Bytes of all frames."""
        return self.frames * self.stride


def find_layout(
    header: Header, parameters: Parameters, width: int, size: int, where: str, notes: list[str]
) -> Layout:
    """Find the one declared layout of the data section that fits the file's `size` in bytes.

    Parameters
    ----------
    header : Header
    parameters : Parameters
    width : int
        Bytes of one number.
    size : int
        Bytes of the file.
    where : str
        Name of the file.
    notes : list of str
        Contradictions between header and parameters are added.

    Raises
    ------
    InvalidInput
        If the counts are not declared, or no layout or more than one fills the file.
    """

    def counts(name: str, *values: float) -> list[int]:
        positive = sorted({int(value) for value in values if value >= 1})
        if not positive:
            raise damaged(f"the file declares no {name}", where, code="not_declared", name=name)
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
            notes.append(f"A parameter gives {n:g} frames, the header {frames[0]}; the former is not used.")
    begin = header.parameters_at + max(header.parameter_blocks, 1) * BLOCK
    blocks = counts("start of the data", header.data_block, *parameters.numbers("POINT:DATA_START")[:1])
    starts = [at for block in blocks if begin <= (at := (block - 1) * BLOCK) <= size]
    if not starts:
        raise damaged(
            "the data do not begin between the parameters and the end of the file",
            f"{where}, byte 16",
            f"a block from {begin // BLOCK + 1} to {size // BLOCK + 1}",
            _either(blocks),
            code="misplaced_data",
        )
    layouts = [Layout(*choice, width) for choice in product(starts, points, analog, frames)]
    # Frames end within the last block of the file.
    fitting = [layout for layout in layouts if 0 <= size - layout.start - layout.needed < BLOCK]
    ends = sorted({layout.start + layout.needed for layout in layouts})
    declared = f"{_either(points)} points, {_either(analog)} analog samples a frame, {_either(frames)} frames"
    if len(layouts) == 1 and size >= ends[0] + BLOCK:
        if header.last == _COUNTER_LIMIT:
            raise damaged(
                "the frame counter of the header is full and nothing gives the true count",
                f"{where}, byte 8",
                "TRIAL:ACTUAL_END_FIELD or POINT:LONG_FRAMES",
                code="full_counter",
            )
        notes.append(f"{size - ends[0]} bytes after the last frame are not read.")
        return layouts[0]
    if len(fitting) != 1:
        what = (
            "the file is truncated" if size < ends[0] else "the file's size fits no or several declarations"
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
        notes.append(f"The header and the parameters disagree ({declared}); the file's size decides.")
    return fitting[0]


def _either(counts: list[int]) -> str:
    return " or ".join(map(str, counts))


def _trial_frames(parameters: Parameters) -> float:
    """Frames from TRIAL:ACTUAL_START_FIELD to ACTUAL_END_FIELD (low word, high word); 0 if not given."""
    ends = [parameters.numbers(f"TRIAL:ACTUAL_{end}_FIELD")[:2] for end in ("START", "END")]
    if not all(ends):
        return 0
    first, last = (sum(word * 65536**i for i, word in enumerate(words)) for words in ends)
    return max(last - first + 1, 0)
