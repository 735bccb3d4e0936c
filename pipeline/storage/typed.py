"""Conversion of dataclasses to arrays and notes for the store, and back.

The result of a stage is a frozen dataclass.  Its arrays, and the columns of its tables, become the arrays of an
artefact, named by the path to the field (``space.mean``).  All other values become the notes.  A column of texts is
stored as an array of codes, and the notes list the distinct texts.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from pipeline.reading import fault_of
from pipeline.validation import InvalidInput, fits, required

_SHAPES = re.compile(r"^(\w+(?:, \w+)*) : (\(.*)$", re.MULTILINE)
"""Pattern of a docstring line that states the shapes of fields: ``mean, scale : (D,), (R, D)``."""


def result_type(method: Callable[..., Any]) -> type:
    """Return the dataclass that is the return annotation of a function."""
    return typing.get_type_hints(method)["return"]


def pack(value: Any) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return the arrays of a dataclass by dotted path, and the other values as nested mappings.

    Parameters
    ----------
    value : dataclass
        Dataclass with fields that are arrays, tables, dataclasses, `None`, mappings from text to arrays or dataclasses,
        or plain values (numbers, text, lists and mappings of these).

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
                    codes, texts_found = part[name].factorize(use_na_sentinel=False)
                    column, texts = codes.astype(np.min_scalar_type(len(texts_found))), texts_found.tolist()
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
    """Return True if a value or type is a DataFrame, judged by its attributes: the store does not import pandas."""
    return hasattr(part, "iloc")


def _parts(part: Any) -> dict[str, Any] | None:
    """Return the fields of a dataclass, or the items of a mapping with arrays or dataclasses; None for other values."""
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        return {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    if isinstance(part, Mapping) and any(
        isinstance(item, np.ndarray) or dataclasses.is_dataclass(item) for item in part.values()
    ):
        return dict(part)
    return None


@cache
def _axes(kind: type) -> dict[str, tuple[list[str], bool]]:
    """Return, for each array of a dataclass, the documented axes, and True if the array contains text."""
    axes_by_name: dict[str, tuple[list[str], bool]] = {}
    for base in reversed(kind.__mro__):
        for field, words in _SHAPES.findall(inspect.cleandoc(vars(base).get("__doc__") or "")):
            names, shapes = field.split(", "), re.findall(r"\(([^()]*)\)", words)
            for name, shape in zip(names, shapes * len(names) if len(shapes) == 1 else shapes, strict=False):
                if len(shapes) in (1, len(names)):
                    axes = [axis.strip() for axis in shape.split(",") if axis.strip()]
                    axes_by_name[name] = axes, "text" in words.split()
    return axes_by_name


def _require_axes(name: str, array: np.ndarray, axes: list[str], text: bool, sizes: dict[str, int]) -> None:
    """Raise InvalidInput if the axes or the type (text, numbers) of an array differ from the documentation.

    Arrays of nested dataclasses may have an additional first axis.  Axes named by a letter, ``N`` or ``N + 1``, have
    the same size in all arrays of a dataclass; the function adds new letters to `sizes`.
    """
    more = array.ndim - len(axes)
    fit = more in ((0, 1) if "." in name else (0,)) and array.dtype.kind in ("US" if text else "biuf")
    for size, axis in zip(array.shape[max(more, 0) :], axes, strict=False):
        if axis.isdigit():
            fit = fit and size == int(axis)
        elif sum_of := re.fullmatch(r"(?:(\d+) \+ )?([A-Z])(?: \+ (\d+))?", axis):
            letter_size = size - int(sum_of[1] or sum_of[3] or 0)
            fit = fit and (not array.size or sizes.setdefault(sum_of[2], letter_size) == letter_size)
    if array.size and not fit:
        expected = f"({', '.join(axes)}{',' * (len(axes) == 1)}) of {'text' if text else 'numbers'}"
        raise InvalidInput(
            "the array has another shape than documented",
            name,
            expected,
            f"{array.shape} of {array.dtype}",
            code="wrong_shape",
            axes=axes,
            text=text,
        )


def unpack(kind: Any, arrays: Mapping[str, np.ndarray], notes: Any) -> Any:
    """Return the dataclass that `pack` converted to arrays and notes.

    Parameters
    ----------
    kind : type
        Dataclass, or a generic alias of one.
    arrays, notes : mapping
        Arrays and notes from `pack`, possibly after a round trip through files.

    Raises
    ------
    InvalidInput
        If a part is missing or has another type, or an array has another shape than its field's docstring states.
        Integers are sizes, and a letter stands for one size.
    """
    try:
        return _unpacked(kind, arrays, notes, "")
    except (KeyError, TypeError, AttributeError, IndexError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            f"the data do not fit {kind.__name__}: {fault_of(error)}", code="does_not_fit", type=kind.__name__
        ) from error


def _unpacked(kind: Any, arrays: Mapping[str, np.ndarray], notes: Any, path: str) -> Any:
    """Return the value at a path inside a dataclass, rebuilt from stored arrays and notes."""
    optional, kind = type(None) in typing.get_args(kind), required(kind)
    origin: Any = typing.get_origin(kind) or kind
    stacked = origin in (float, int, bool) and path in arrays and arrays[path].dtype.kind in "biuf"
    if stacked or (path in arrays and origin in (np.ndarray, Any)):
        return arrays[path]
    prefix = f"{path}." if path else ""
    if _is_table(origin) and notes is not None:
        columns = {name: arrays[prefix + name] for name, _ in notes}
        columns |= {
            name: np.array(texts, object)[columns[name]] for name, texts in notes if texts is not None
        }
        return origin(columns, copy=False)
    if optional and notes is None and not any(name.startswith(prefix) for name in arrays):
        return None
    if dataclasses.is_dataclass(origin):
        build: Any = origin
        hints, axes, values = typing.get_type_hints(origin), _axes(build), {}
        sizes: dict[str, int] = {}
        for name in (field.name for field in dataclasses.fields(origin)):
            value = _unpacked(hints[name], arrays, (notes or {}).get(name), prefix + name)
            if isinstance(value, np.ndarray) and name in axes:
                _require_axes(prefix + name, value, *axes[name], sizes)
            values[name] = value
        return build(**values)
    if origin in (dict, Mapping) and path:
        below = {name[len(prefix) :] for name in arrays if name.startswith(prefix)}
        inner = typing.get_args(kind)[1] if typing.get_args(kind) else Any
        if dataclasses.is_dataclass(typing.get_origin(inner) or inner):
            names = list(dict.fromkeys([*(notes or {}), *(name.split(".")[0] for name in sorted(below))]))
            return {name: _unpacked(inner, arrays, (notes or {}).get(name), prefix + name) for name in names}
        if below:
            return {name[len(prefix) :]: arrays[name] for name in arrays if name.startswith(prefix)}
    if not fits(notes, kind):
        raise InvalidInput(
            "a stored value is missing or has an unexpected type", path, kind, code="wrong_type"
        )
    return tuple(notes) if origin is tuple else notes
