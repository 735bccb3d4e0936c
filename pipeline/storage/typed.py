"""Conversion of dataclasses to arrays and notes for the store, and back.

What a stage hands to the next is a frozen dataclass.  Its arrays become the arrays of an artefact, named by the path to
the field (``space.mean``), as do the columns of its tables; everything else becomes its notes.  Of a column of texts
the array says which one stands in each row, and the notes list each once.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipeline.validation import required


def result_type(method: Callable[..., Any]) -> type:
    """Return the dataclass that a function is annotated to return."""
    return typing.get_type_hints(method)["return"]


def pack(value: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the arrays of a dataclass by path, and everything else in it as a tree of plain values.

    Parameters
    ----------
    value : dataclass
        Its fields are arrays, tables, dataclasses, `None`, mappings from text to arrays or dataclasses, or plain
        values (numbers, text, lists and mappings of such).

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Walks:
    ...     frequency_hz: np.ndarray
    ...     source: str
    >>> pack(Walks(np.array([1.0]), "cmu"))
    ({'frequency_hz': array([1.])}, {'source': 'cmu'})
    """
    arrays: dict[str, np.ndarray] = {}

    def without_arrays(part: Any, path: str) -> Any:
        if _is_table(part):
            columns: list[tuple[str, list[str] | None]] = []
            for name in part:
                column, texts = part[name].to_numpy(), None
                if part[name].dtype == "str":
                    codes, found = part[name].factorize(use_na_sentinel=False)
                    column, texts = codes.astype(np.min_scalar_type(len(found))), found.tolist()
                elif column.dtype.kind == "O":
                    column = np.array(column.tolist())
                arrays[f"{path}{name}"] = column
                columns.append((name, texts))
            return columns
        inner = _parts(part)
        if inner is None:
            return part
        arrays.update({path + name: item for name, item in inner.items() if isinstance(item, np.ndarray)})
        return {
            name: without_arrays(item, f"{path}{name}.")
            for name, item in inner.items()
            if not isinstance(item, np.ndarray)
        }

    notes = without_arrays(value, "")
    return arrays, notes


def _is_table(part: Any) -> bool:
    """Return whether a value or type is a DataFrame, told by what it has: the store does not import pandas."""
    return hasattr(part, "iloc")


def _parts(part: Any) -> dict[str, Any] | None:
    """Return the fields of a dataclass, or the items of a mapping with arrays or dataclasses; else None."""
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        return {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    if isinstance(part, Mapping) and any(
        isinstance(item, np.ndarray) or dataclasses.is_dataclass(item) for item in part.values()
    ):
        return dict(part)
    return None


def unpack(kind: Any, arrays: Mapping[str, np.ndarray], notes: Any, path: str = "") -> Any:
    """Return the dataclass whose arrays and notes `pack` returned.

    Parameters
    ----------
    kind : type
        The dataclass, or a generic alias of one.
    arrays, notes : mapping
        As `pack` returned them, also after a round trip through files.
    path : str
        Of a part of it.
    """
    kind = required(kind)
    if path in arrays:
        return arrays[path]
    prefix = f"{path}." if path else ""
    origin: Any = typing.get_origin(kind) or kind
    if _is_table(origin) and notes is not None:
        columns = {name: arrays[prefix + name] for name, _ in notes}
        columns |= {
            name: np.array(texts, object)[columns[name]] for name, texts in notes if texts is not None
        }
        return origin(columns, copy=False)
    if notes is None and not any(name.startswith(prefix) for name in arrays if path):
        return None
    if dataclasses.is_dataclass(origin):
        hints = typing.get_type_hints(origin)
        found = notes or {}
        build: Any = origin
        return build(
            **{
                field.name: unpack(hints[field.name], arrays, found.get(field.name), prefix + field.name)
                for field in dataclasses.fields(origin)
            }
        )
    if origin in (dict, Mapping) and path:
        below = {name[len(prefix) :] for name in arrays if name.startswith(prefix)}
        inner = typing.get_args(kind)[1] if typing.get_args(kind) else Any
        if dataclasses.is_dataclass(typing.get_origin(inner) or inner):
            names = list(dict.fromkeys([*(notes or {}), *(name.split(".")[0] for name in sorted(below))]))
            return {name: unpack(inner, arrays, (notes or {}).get(name), prefix + name) for name in names}
        if below:
            return {name[len(prefix) :]: arrays[name] for name in arrays if name.startswith(prefix)}
        return dict(notes)
    if origin is tuple and isinstance(notes, list):
        return tuple(notes)
    return notes
