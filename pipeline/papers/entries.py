"""Mappings in YAML files, read strictly: repeated and unknown keys and values of the wrong type are refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import yaml

from pipeline.validation import InvalidInput


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """A safe loader that refuses repeated keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        keys = [key.value for key, _ in node.value]
        for key, times in Counter(keys).items():
            if times > 1:
                line = node.start_mark.line + 1
                raise InvalidInput(f"the key {key!r} is there twice", where=f"the mapping on line {line}")
        return super().construct_mapping(node, deep=deep)


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file.  Raises InvalidInput if it cannot be read or repeats a key."""
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except InvalidInput as error:
        raise InvalidInput(error.what, where=f"{path.name}, {error.where}") from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InvalidInput(f"cannot be read: {error}", where=path.name) from error
    if not isinstance(content, dict):
        raise InvalidInput("is not a mapping", where=path.name)
    return content


class Entry:
    """A mapping in a file, whose keys must all be asked for."""

    def __init__(self, where: str, content: Any) -> None:
        if not isinstance(content, Mapping):
            raise InvalidInput("is not a mapping", where=where, received=repr(content))
        # YAML reads the word null as None.
        self.content = {"null" if key is None else key: value for key, value in content.items()}
        self.where = where
        self.asked: set[str] = set()

    def take(
        self, key: str, kinds: type | tuple[type, ...], default: Any = None, *, needed: bool = True
    ) -> Any:
        """Return the value of a key, of one of these types."""
        self.asked.add(key)
        if key not in self.content:
            if needed:
                raise InvalidInput(f"no {key!r}", where=self.where)
            return default
        value = self.content[key]
        if not isinstance(value, kinds) or isinstance(value, bool):
            wanted = kinds if isinstance(kinds, tuple) else (kinds,)
            raise InvalidInput(
                f"{key!r} is of the wrong type",
                where=self.where,
                expected=" or ".join(kind.__name__ for kind in wanted),
                received=repr(value),
            )
        return value

    def text(self, key: str, *, needed: bool = True) -> str:
        """Return a text; the parts of a list are joined by semicolons."""
        value = self.take(key, (str, list), "", needed=needed)
        return joined(value, f"{self.where}, {key}")

    def mapping(self, key: str) -> dict[str, Any]:
        """Return a mapping, empty if the key is missing."""
        return self.take(key, dict, {}, needed=False)

    def names(self, key: str, *, needed: bool = True) -> tuple[str, ...]:
        """Return a list of texts."""
        value = self.take(key, list, [], needed=needed)
        if not all(isinstance(name, str) for name in value):
            raise InvalidInput(f"{key!r} is not a list of names", where=self.where, received=repr(value))
        return tuple(value)

    def done(self) -> None:
        """Refuse keys that were not asked for."""
        if unknown := [str(key) for key in self.content if key not in self.asked]:
            raise InvalidInput(
                f"unknown key {unknown[0]!r}",
                where=self.where,
                expected="one of " + ", ".join(sorted(self.asked)),
            )


def joined(value: Any, where: str) -> str:
    """Return a text, or the texts of a list joined by semicolons."""
    parts = value if isinstance(value, list) else [value]
    if not all(isinstance(part, str) for part in parts):
        raise InvalidInput("is not a text", where=where, received=repr(value))
    return "; ".join(" ".join(part.split()) for part in parts)


def number(value: Any, where: str) -> float:
    """Return a number, also from a text such as ``1/3`` or ``1e-6``."""
    try:
        if isinstance(value, bool):
            raise ValueError
        return float(Fraction(value)) if isinstance(value, str) and "/" in value else float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        raise InvalidInput("is not a number", where=where, received=repr(value)) from None
