"""Registry of measures, and evaluation of a measure on tables or on their bootstrap replicates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from inspect import getmembers, isfunction, signature
from types import ModuleType
from typing import Any, TypeAlias, get_type_hints

import numpy as np

from pipeline.papers import Measure
from pipeline.studies.measures import Count
from pipeline.studies.replicated import Replicated
from pipeline.studies.rows import Expression, Number, Table, as_number, columns_of
from pipeline.validation import InvalidInput

Registry: TypeAlias = Mapping[str, Callable[..., Number]]
"""Functions that compute a measure, by the name of the measure."""


def registry(*modules: ModuleType) -> Registry:
    """Return all measures of some modules by name; each public function that returns a number is a measure.

    Raises
    ------
    InvalidInput
        If two measures have the same name.
    """
    by_name: dict[str, Callable[..., Number]] = {}
    for module in modules:
        for name, function in getmembers(module, isfunction):
            if function.__module__ != module.__name__ or name.startswith("_"):
                continue
            if get_type_hints(function).get("return") not in (float, Number, Count):
                continue
            if name in by_name:
                raise InvalidInput(
                    f"two measures have the name {name!r}", module.__name__, code="duplicate_name"
                )
            by_name[name] = function
    return by_name


def check(measure: Measure, registry: Registry, where: str) -> None:
    """Validate the name and the arguments of a measure.

    Raises
    ------
    InvalidInput
        If a name is unknown, or the arguments are not those of the function, in number, name or type.
    """
    for part in measure.parts:
        if part.name not in registry:
            raise InvalidInput(
                f"unknown measure {part.name!r}",
                where,
                f"one of {', '.join(registry)}",
                code="unknown_measure",
                name=part.name,
            )
        function = registry[part.name]
        try:
            arguments = signature(function).bind(**part.arguments).arguments
        except TypeError as error:
            raise InvalidInput(
                f"the measure {part.name} has wrong arguments: {error}", where, code="wrong_arguments"
            ) from error
        types = get_type_hints(function)
        for name, value in arguments.items():
            if not _fits(value, types[name]):
                raise InvalidInput(
                    f"the measure {part.name} has a wrong value of the argument {name!r}",
                    where,
                    getattr(types[name], "__name__", str(types[name])),
                    value,
                    code="wrong_type",
                    argument=name,
                )
            if types[name] is Expression and value:
                columns_of(value)


def _fits(value: object, annotation: Any) -> bool:
    if annotation in (float, Number):
        return isinstance(value, int | float | Measure) and not isinstance(value, bool)
    if annotation in (list[float], list[Number]):
        return isinstance(value, tuple) and all(_fits(item, float) for item in value)
    if annotation == list[str]:
        return isinstance(value, tuple) and all(isinstance(item, str) for item in value)
    return isinstance(value, str if annotation in (str, Table, Expression) else annotation)


def evaluate(
    measure: Measure, registry: Registry, tables: Mapping[str, Table | Replicated], replicates: int = 0
) -> Number:
    """Return the value of a measure; NaN if a table that it reads is missing.

    Parameters
    ----------
    measure : Measure
    registry : Registry
    tables : mapping
        Plain tables, or some of them in replicates.
    replicates : int
        B; 0 if the tables are plain.

    Raises
    ------
    InvalidInput
        If the measure is unknown, or a table lacks a column that it reads.
    """
    if any(name not in tables for name in measure.tables):
        return np.nan
    function = registry[measure.name]
    types = get_type_hints(function)

    def resolved(value: object, annotation: Any) -> Any:
        if isinstance(value, Measure):
            return evaluate(value, registry, tables, replicates)
        if isinstance(value, tuple):
            return [resolved(item, None) for item in value]
        return tables[str(value)] if annotation is Table else value

    arguments = {name: resolved(value, types[name]) for name, value in measure.arguments.items()}
    with np.errstate(all="ignore"):
        if types["return"] == Number or not replicates:
            return as_number(np.asarray(function(**arguments), float))
        if types["return"] is Count:
            return float(function(**{name: _published(value) for name, value in arguments.items()}))
        if not any(isinstance(item, Replicated | np.ndarray) for item in _flat(arguments.values())):
            return float(function(**arguments))
        return np.array(
            [
                function(**{name: _drawn(value, b) for name, value in arguments.items()})
                for b in range(replicates)
            ],
            float,
        )


def _flat(arguments: Iterable[Any]) -> Iterator[Any]:
    for value in arguments:
        yield from value if isinstance(value, list) else [value]


def _published(value: Any) -> Any:
    return value.published if isinstance(value, Replicated) else value


def _drawn(value: Any, replicate: int) -> Any:
    """Return the value of one argument of a measure in one bootstrap replicate."""
    if isinstance(value, list):
        return [_drawn(item, replicate) for item in value]
    if isinstance(value, Replicated):
        return value.drawn(replicate)
    return float(value[replicate]) if isinstance(value, np.ndarray) else value
