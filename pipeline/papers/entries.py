"""Strict reader for YAML files, which rejects repeated keys, unknown keys and values of the wrong type.

A mapping becomes a dataclass; the annotation of a field determines the reader of its value.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields
from enum import StrEnum
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import yaml

from pipeline.validation import InvalidInput, require_choice

Made = TypeVar("Made")


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Safe YAML loader that rejects repeated keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        keys = [key.value for key, _ in node.value]
        for key, times in Counter(keys).items():
            if times > 1:
                line = node.start_mark.line + 1
                raise InvalidInput(
                    f"the key {key!r} occurs twice",
                    f"the mapping on line {line}",
                    code="duplicate_key",
                    key=key,
                )
        return super().construct_mapping(node, deep=deep)


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the content of a YAML file.

    Raises InvalidInput if it is unreadable or repeats a key.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(f"the file cannot be read: {error}", path.name, code="unreadable") from error
    return parsed_mapping(text, path.name)


def parsed_mapping(text: str, where: str) -> dict[str, Any]:
    """Return the content of a YAML text.

    Raises InvalidInput if it is not a mapping or repeats a key.
    """
    try:
        content = yaml.load(text, Loader=_Loader)
    except InvalidInput as error:
        raise InvalidInput(error.what, f"{where}, {error.where}", code=error.code, **error.values) from error
    except yaml.YAMLError as error:
        raise InvalidInput(f"the text is not valid YAML: {error}", where, code="unreadable") from error
    if not isinstance(content, dict):
        raise InvalidInput("the file must contain a YAML mapping", where, code="not_a_mapping")
    return content


def mapping(value: Any, where: str) -> dict[str, Any]:
    """Return a YAML mapping with its keys as strings; the key ``null``, which YAML reads as None, becomes "null"."""
    if not isinstance(value, Mapping):
        raise InvalidInput(
            "the value must be a YAML mapping", where, received=repr(value), code="not_a_mapping"
        )
    return {"null" if key is None else str(key): item for key, item in value.items()}


def record(
    kind: type[Made],
    content: Any,
    where: str,
    *,
    needed: Iterable[str] = (),
    readers: Mapping[str, Callable[[Any, str], Any]] | None = None,
    parts: Iterable[str] = (),
    **known: Any,
) -> Made:
    """Return an instance of a dataclass whose fields are read from a YAML mapping.

    Parameters
    ----------
    kind : type
        The dataclass.
    content : mapping
    where : str
        File and entry, for messages.
    needed : iterable of str
        Fields that are required although they have a default.
    readers : mapping of str to callable, optional
        Functions of value and location by field, for fields whose annotation has no reader.
    parts : iterable of str
        Fields that are dataclasses, whose fields are keys of the same mapping.
    **known
        Values of fields that are not in the file.

    Raises
    ------
    InvalidInput
        If a field is missing, a key is unknown, or a value cannot be read.
    """
    entries, hints = mapping(content, where), get_type_hints(kind)
    owners = {name: hints.pop(name) for name in parts}
    of_file = {f.name: f for f in fields(kind) if f.name not in {*known, *owners}}  # type: ignore[arg-type]
    for part in owners.values():
        hints |= get_type_hints(part)
        of_file |= {f.name: f for f in fields(part) if f.name not in known}
    for name, field in of_file.items():
        default = field.default is not MISSING or field.default_factory is not MISSING
        if name not in entries and (not default or name in needed):
            raise InvalidInput(f"the key {name!r} is missing", where, code="missing_key", key=name)
    if unknown := [name for name in entries if name not in of_file]:
        expected = "one of " + ", ".join(sorted(of_file))
        raise InvalidInput(f"unknown key {unknown[0]!r}", where, expected, code="unknown_key", key=unknown[0])
    for name, value in entries.items():
        read = (readers or {}).get(name) or _READERS.get(hints[name]) or choice(hints[name])
        known[name] = read(value, f"{where}, {name}")
    for name, part in owners.items():
        known[name] = part(**{f.name: known.pop(f.name) for f in fields(part) if f.name in known})
    return kind(**known)


def text(value: Any, where: str) -> str:
    """Read a text from a YAML value; the texts of a list are joined by semicolons."""
    return "; ".join(
        " ".join(part.split()) for part in names(value if isinstance(value, list) else [value], where)
    )


def names(value: Any, where: str) -> tuple[str, ...]:
    """Read a YAML list of texts, and return it as a tuple."""
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise InvalidInput("the value must be text", where, "", repr(value), code="wrong_type")
    return tuple(value)


def number(value: Any, where: str) -> float:
    """Read a number from a YAML value; texts such as ``1/3`` or ``1e-6`` are accepted."""
    try:
        if isinstance(value, bool):
            raise ValueError
        return float(Fraction(value)) if isinstance(value, str) and "/" in value else float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        raise InvalidInput(
            "the value must be a number", where, received=repr(value), code="not_a_number"
        ) from None


def whole(value: Any, where: str) -> int:
    """Read a whole number from a YAML value."""
    if not isinstance(value, int) or isinstance(value, bool):
        raise InvalidInput("the value must be a whole number", where, "", repr(value), code="wrong_type")
    return value


def choice(kind: type[StrEnum]) -> Callable[[Any, str], StrEnum]:
    """Return a reader that accepts only the members of an enumeration."""
    return lambda value, where: kind(require_choice(where, value, list(kind)))


_READERS: Mapping[Any, Callable[[Any, str], Any]] = {
    str: text,
    int: whole,
    float | None: lambda value, where: None if value is None else number(value, where),
    tuple[str, ...]: names,
    Mapping[str, str]: lambda value, where: {key: str(item) for key, item in mapping(value, where).items()},
    Mapping[str, Any]: mapping,
}
"""Readers for YAML values, by the type annotation of a dataclass field."""
