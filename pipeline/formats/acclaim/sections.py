"""The words of Acclaim files: without comments, and by section where the file is a skeleton (ASF)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pipeline.formats.contract import damaged
from pipeline.formats.text import read_text

_COMMENT = re.compile(r"#(?<!\S#)[^\n]*")  # not inside a word: `-1.#IND` is a broken number
_KEYS = ["name", "direction", "length", "axis", "dof", "order", "position", "orientation", "angle"]


@dataclass(frozen=True)
class Sections:
    """The words of an ASF file by section; a line's first word is its key."""

    units: dict[str, list[str]]
    root: dict[str, list[str]]
    bones: list[dict[str, list[str]]]
    hierarchy: list[list[str]]


def read_sections(path: Path) -> Sections:
    """Read the words of an ASF file by section.

    Raises
    ------
    InvalidInput
        If the file cannot be read, its ``begin`` and ``end`` do not match, or it has no bones or no hierarchy.
    """
    where, (text, _) = path.name, text_without_comments(path)
    found = Sections({}, {}, [], [])
    section, is_open = "", False
    # Commas and brackets count as blanks in this format.
    for number, line in enumerate(text.translate(str.maketrans(",()", "   ")).split("\n"), start=1):
        words = line.split()
        if not words:
            continue
        key, place = words[0].lower(), f"{where}, line {number}"
        if key.startswith(":"):
            if is_open:
                raise damaged("a `begin` has no `end`", place, received=key)
            section = key
        elif section in (":bonedata", ":hierarchy") and key in ("begin", "end"):
            if is_open == (key == "begin"):
                raise damaged("`begin` and `end` do not alternate", place)
            is_open = key == "begin"
            if is_open and section == ":bonedata":
                found.bones.append({})
        elif section == ":hierarchy" and is_open:
            found.hierarchy.append(words)
        elif section in (":units", ":root", ":bonedata"):
            if section == ":bonedata" and not is_open:
                raise damaged("a line stands outside `begin` and `end`", place)
            entries = found.bones[-1] if section == ":bonedata" else getattr(found, section[1:])
            if key in entries and key in _KEYS:
                raise damaged(f"`{key}` stands twice", f"{place}, {section}")
            entries[key] = words[1:]
    if is_open:
        raise damaged("the file is cut short: a `begin` has no `end`", where)
    if not found.bones or not found.hierarchy:
        raise damaged("no bones or no hierarchy", where, ":bonedata and :hierarchy")
    return found


def text_without_comments(path: Path) -> tuple[str, list[str]]:
    """Read the text of an ASF or AMC file without its comments, and notes, as `read_text` does."""
    text, notes = read_text(path)
    return _COMMENT.sub("", text) if "#" in text else text, notes
