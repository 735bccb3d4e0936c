"""Reader of the parameter section of a C3D file."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pipeline.formats.c3d.header import BLOCK, MIPS, Header, floats, integers
from pipeline.formats.contract import damaged


@dataclass(frozen=True)
class Parameters:
    """Parameter section of a C3D file, and its named parameters.

    `at` is the first byte of the section in the file.  `entries` has type, dimensions and first byte of each
    ``GROUP:NAME``.
    """

    section: bytes
    at: int
    processor: int
    where: str
    entries: dict[str, tuple[int, tuple[int, ...], int]]

    def _content(self, key: str, width: int) -> bytes:
        _, dimensions, begin = self.entries[key]
        end = begin + math.prod(dimensions) * width
        if end > len(self.section):
            raise damaged(
                f"the parameter {key} runs past the end of its section",
                f"{self.where}, byte {self.at + begin}",
                f"{end - begin} bytes",
                len(self.section) - begin,
                code="parameter_overrun",
                parameter=key,
                needed=end - begin,
            )
        return self.section[begin:end]

    def numbers(self, key: str) -> list[float]:
        """Return the finite values of a numeric parameter, integers read as unsigned; empty for a missing parameter."""
        kind = self.entries[key][0] if key in self.entries else 0
        if kind not in (1, 2, 4):
            return []
        raw = self._content(key, kind)
        values = raw if kind == 1 else (integers if kind == 2 else floats)(raw, self.processor)
        return [float(value) for value in values if math.isfinite(value)]

    def texts(self, key: str) -> list[str]:
        """Return the strings of a text parameter without trailing blanks; empty if the parameter is absent."""
        if key not in self.entries or self.entries[key][0] != -1:
            return []
        length, *counts = self.entries[key][1] or (1,)
        if length == 0:  # strings without characters
            return []
        content = self._content(key, 1)
        pieces = [content[i * length : (i + 1) * length] for i in range(math.prod(counts))]
        return [_text(piece) for piece in pieces]


def _text(raw: bytes) -> str:
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return text.split("\0", 1)[0].strip()


def read_parameters(data: bytes, header: Header, where: str, notes: list[str]) -> Parameters:
    """Read the parameters of a C3D file, and add a note if a parameter is repeated.

    Raises
    ------
    InvalidInput
        If the section runs past the end of the file, or a record past the end of the section.
    """
    begin = header.parameters_at
    end = begin + header.parameter_blocks * BLOCK
    if end > len(data):
        raise damaged(
            "the parameter section runs past the end of the file",
            f"{where}, byte {begin + 2}",
            f"at least {end} bytes",
            len(data),
            code="section_overrun",
        )
    # The block count is one byte: a longer section ends where the data begin.
    section = data[begin : max(end, (header.data_block - 1) * BLOCK)]
    signed = memoryview(section).cast("b")
    groups: dict[int, str] = {}
    records: list[tuple[int, str, tuple[int, tuple[int, ...], int]]] = []
    at = 4
    while at + 2 <= len(section):
        name_length, group = signed[at : at + 2]
        if name_length == 0 or group == 0:
            break
        link = at + 2 + abs(name_length)  # position of the offset to the next record
        if link + 4 > len(section):
            raise damaged(
                "a record of the parameter section is truncated",
                f"{where}, byte {begin + at}",
                code="truncated",
                part="record",
            )
        name = _text(section[at + 2 : link]).upper()
        step = int.from_bytes(section[link : link + 2], "big" if header.processor == MIPS else "little")
        if group < 0:
            groups.setdefault(-group, name)
        else:
            content = link + 4 + section[link + 3]
            entry = (signed[link + 2], tuple(section[link + 4 : content]), content)
            records.append((group, name, entry))
        if step == 0:
            break
        if link + step > len(section):
            raise damaged(
                f"the record {name!r} points past the end of the parameters",
                f"{where}, byte {begin + link}",
                f"a step of at most {len(section) - link}",
                step,
                code="record_overrun",
            )
        at = max(link + step, link + 2)
    entries: dict[str, tuple[int, tuple[int, ...], int]] = {}
    for group, name, entry in records:
        key = f"{groups.get(group, group)}:{name}"
        if key in entries:
            notes.append(f"The parameter {key} is repeated; the first value is used.")
        entries.setdefault(key, entry)
    return Parameters(section=section, at=begin, processor=header.processor, where=where, entries=entries)
