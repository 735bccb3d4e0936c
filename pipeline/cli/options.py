"""Options of a command as a dataclass, read from ``option=value`` arguments without Hydra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import is_dataclass
from enum import Enum
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from pipeline.validation import InvalidInput, require_bounds, require_choice, required

Options = TypeVar("Options")


def filled(kind: type[Options], overrides: Sequence[str]) -> Options:
    """Return the options of a command with the values from overrides.

    Parameters
    ----------
    kind : dataclass
        Class of the options.  Every field has a default; nested options are named as in ``input.path``.
    overrides : sequence of str
        Arguments of the form ``option=value``.

    Raises
    ------
    InvalidInput
        If an argument is not an override, the option is unknown, or the value has the wrong type or is out of bounds.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Film:
    ...     width: int = 0
    >>> filled(Film, ["width=640"])
    Film(width=640)
    """
    options = kind()
    for item in overrides:
        key, equals, text = item.partition("=")
        if not equals:
            raise InvalidInput(
                "this argument is not an override",
                expected="option=value",
                received=repr(item),
                code="not_an_override",
                typed=True,
            )
        *groups, name = key.split(".")
        owner: Any = options
        for group in groups:
            owner = getattr(owner, _known(owner, group, key))
        hint = get_type_hints(type(owner))[_known(owner, name, key)]
        if is_dataclass(hint):
            raise InvalidInput(
                "this is a group of options: set one of its options",
                key,
                f"{key}.{_names(hint)[0]}=…",
                code="several_options",
            )
        setattr(owner, name, _value(key, hint, text))
    require_bounds("", options)
    return options


def _names(kind: Any) -> list[str]:
    return list(kind.__dataclass_fields__) if is_dataclass(kind) else []


def _known(owner: Any, name: str, key: str) -> str:
    names = _names(owner)
    if name not in names:
        within = [f"{group}.{name}" for group in names if name in _names(getattr(owner, group))]
        expected = " or ".join(within) or "one of " + ", ".join(names)
        raise InvalidInput("this option does not exist", key, expected, code="unknown_option")
    return name


def _value(key: str, kind: Any, text: str) -> Any:
    """Return the value of an option, converted from text to the type of its field."""
    kind = required(kind)
    if get_origin(kind) is list:
        if text[:1] + text[-1:] != "[]":
            raise InvalidInput("must be a list in square brackets", key, "[a,b]", text, code="not_a_list")
        (item_type,) = get_args(kind)
        return [_value(key, item_type, part.strip()) for part in text[1:-1].split(",") if part.strip()]
    if kind is bool:
        return require_choice(key, text.lower(), ("true", "false")) == "true"
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind[require_choice(key, text, list(kind.__members__))]
    if kind is str:
        return text[1:-1] if text[:1] in ("'", '"') and text[:1] == text[-1:] and len(text) > 1 else text
    try:
        return kind(text)
    except ValueError:
        whole = "a whole number" if kind is int else "a number"
        raise InvalidInput(f"must be {whole}", key, received=text, code="not_a_number") from None
