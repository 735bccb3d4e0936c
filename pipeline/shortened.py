"""Frozen dataclasses for results: the representation shows arrays by shape, and only identical objects are equal."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, TypeVar, dataclass_transform

Kind = TypeVar("Kind")

_MAX_SHOWN = 60
"""Maximum number of characters of a value in the representation of a dataclass."""


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def shortened(kind: type[Kind]) -> type[Kind]:
    """Return a class as a frozen dataclass; its representation shows arrays by shape and long values by length.

    Examples
    --------
    >>> import numpy as np
    >>> @shortened
    ... class Walk:
    ...     positions_mm: np.ndarray
    ...     frame_rate_hz: float
    >>> Walk(np.zeros((200, 15, 3)), np.float64(100.0))
    Walk(positions_mm: (200, 15, 3), frame_rate_hz=100.0)
    """
    kind.__repr__ = _short  # type: ignore[method-assign]
    # No field-wise equality: arrays compare element by element, so `walk in walks` would raise numpy's ValueError.
    return dataclass(frozen=True, eq=False)(kind)


def _short(thing: Any) -> str:
    parts = (_part(field.name, getattr(thing, field.name)) for field in fields(thing) if field.repr)
    return f"{type(thing).__name__}({', '.join(parts)})"


def _part(name: str, value: Any) -> str:
    if shape := getattr(value, "shape", None):
        return f"{name}: {tuple(shape)}"
    if is_dataclass(value):
        return f"{name}: {type(value).__name__}"
    text = repr(value if shape is None else value.item())
    if len(text) > _MAX_SHOWN and hasattr(value, "__len__"):
        return f"{name}: {len(value)} {'characters' if isinstance(value, str) else 'items'}"
    return f"{name}={text}"
