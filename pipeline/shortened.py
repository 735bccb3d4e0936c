"""Results as frozen dataclasses, represented in short: arrays by their shape; a result equals itself alone."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, TypeVar, dataclass_transform

Kind = TypeVar("Kind")

_LONGEST = 60
"""Characters of a value that are shown."""


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def shortened(kind: type[Kind]) -> type[Kind]:
    """Return a class as a frozen dataclass, represented by its numbers and words, arrays and lists by shape and length.

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
    # Arrays are equal place by place, so that `walk in walks` would end in numpy's ValueError.
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
    if len(text) > _LONGEST and hasattr(value, "__len__"):
        return f"{name}: {len(value)} {'characters' if isinstance(value, str) else 'items'}"
    return f"{name}={text}"
