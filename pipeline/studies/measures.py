"""Measures: named functions of published tables, used by the papers' claims, explanations and the README.

A measure takes tables (`pandas.DataFrame`), texts and numbers, and returns one float.  It returns NaN if there are no
rows or a value is not finite: rows are never dropped to make a mean.  Rows are selected by an expression over the
columns, ``where: camera == 'still' and reconstructibility > 1``.

Measures that only one study uses are in its own `measures` module.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from inspect import getmembers, isfunction, signature
from types import ModuleType
from typing import Any, NewType, TypeAlias, get_type_hints

import numpy as np
import pandas as pd

from pipeline.papers import Measure
from pipeline.validation import InvalidInput

Table: TypeAlias = pd.DataFrame
"""A table, with its name in ``attrs["name"]`` for messages."""

Expression = NewType("Expression", str)
"""Condition on the columns that selects rows; empty for all rows."""

Registry = Mapping[str, Callable[..., float]]
"""Measures by name."""

_ALLOWED = (
    ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.Compare, ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.UnaryOp, ast.USub, ast.Name, ast.Load, ast.Constant, ast.Call,
)  # fmt: skip
"""Syntax that an expression over columns may have; the only function is `abs`."""


# --- reading tables ---------------------------------------------------------------------------------------


def values(table: Table, column: str, where: str = "") -> np.ndarray:
    """Return a column as float64, of the rows where an expression holds; NaN where an entry is not a number.

    Raises
    ------
    InvalidInput
        If the table lacks the column or a column of the expression.
    """
    require_columns(table, column)
    found = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=float)
    return found[holds(table, where)]


def holds(table: Table, expression: str) -> np.ndarray:
    """Return for each row whether an expression over the columns holds; an empty expression holds for all rows.

    A comparison with NaN, or of a text with a number, does not hold.

    Raises
    ------
    InvalidInput
        If the expression is invalid or names a column that the table lacks.
    """
    if not expression:
        return np.ones(len(table), dtype=bool)
    require_columns(table, *columns_of(expression))
    if table.empty:
        return np.zeros(0, dtype=bool)
    try:
        with np.errstate(all="ignore"):
            return np.asarray(table.eval(expression, engine="python"), dtype=bool)
    except (TypeError, ValueError, NotImplementedError):  # as pandas and arrow say that types do not compare
        return np.zeros(len(table), dtype=bool)


def columns_of(expression: str) -> list[str]:
    """Return the names of the columns in an expression.

    Raises
    ------
    InvalidInput
        If it contains anything but comparisons and arithmetic of columns, numbers, texts and `abs`.

    Examples
    --------
    >>> columns_of("camera == 'still' and abs(view_angle_deg) <= 10")
    ['camera', 'view_angle_deg']
    """
    try:
        nodes = list(ast.walk(ast.parse(expression, mode="eval")))
    except SyntaxError as error:
        raise InvalidInput(f"{expression!r} is no expression", received=str(error)) from error
    functions = [node.func for node in nodes if isinstance(node, ast.Call)]
    if not all(isinstance(node, _ALLOWED) for node in nodes) or any(
        not (isinstance(function, ast.Name) and function.id == "abs") for function in functions
    ):
        raise InvalidInput(
            f"{expression!r} is not allowed",
            expected="comparisons and arithmetic of columns, numbers and texts",
        )
    names = [node.id for node in nodes if isinstance(node, ast.Name) and node not in functions]
    return list(dict.fromkeys(names))


def require_columns(table: Table, *columns: str) -> None:
    """Require these columns of a table."""
    for column in columns:
        if column not in table.columns:
            raise InvalidInput(
                f"no column {column!r}",
                where=f"table {table.attrs.get('name', '')}".rstrip(),
                received=", ".join(map(str, table.columns)) or "no columns",
            )


def _whole(found: np.ndarray) -> bool:
    return bool(found.size and np.isfinite(found).all())


# --- one column -------------------------------------------------------------------------------------------


def mean(table: Table, column: str, where: Expression = Expression("")) -> float:
    """Mean of a column."""
    found = values(table, column, where)
    return float(found.mean()) if _whole(found) else np.nan


def mean_percent(table: Table, column: str, where: Expression = Expression("")) -> float:
    """Mean of a fraction, in per cent."""
    return 100.0 * mean(table, column, where)


def median(table: Table, column: str, where: Expression = Expression("")) -> float:
    """Median of a column."""
    found = values(table, column, where)
    return float(np.median(found)) if _whole(found) else np.nan


def largest(table: Table, column: str, where: Expression = Expression("")) -> float:
    """Largest entry of a column."""
    found = values(table, column, where)
    return float(found.max()) if _whole(found) else np.nan


def smallest(table: Table, column: str, where: Expression = Expression("")) -> float:
    """Smallest entry of a column."""
    found = values(table, column, where)
    return float(found.min()) if _whole(found) else np.nan


def only(table: Table, column: str, where: Expression = Expression("")) -> float:
    """The single entry of a column; NaN if there are none or several."""
    found = values(table, column, where)
    return float(found[0]) if found.size == 1 else np.nan


def at_smallest(table: Table, column: str, of: str) -> float:
    """The entry of a column on the row where another is smallest; the first on ties."""
    found = values(table, of)
    return float(values(table, column)[np.argmin(found)]) if _whole(found) else np.nan


def mean_step(table: Table, column: str) -> float:
    """Range of a column over the number of steps between its different values."""
    found = np.unique(values(table, column))
    return float(np.ptp(found) / (found.size - 1.0)) if found.size > 1 else np.nan


def variation_percent(table: Table, column: str) -> float:
    """Standard deviation of a column (divisor n - 1) in per cent of its mean."""
    found = values(table, column)
    return ratio_percent(float(found.std(ddof=1)), float(found.mean())) if found.size > 1 else np.nan


def distinct(table: Table, columns: list[str]) -> float:
    """Number of different combinations of entries of columns."""
    require_columns(table, *columns)
    return float(len(table[list(columns)].drop_duplicates()))


# --- rows -------------------------------------------------------------------------------------------------


def percent(table: Table, of: Expression, where: Expression = Expression("")) -> float:
    """Rows for which an expression holds, in per cent of those chosen; NaN if one of them lacks a number."""
    rows = holds(table, where)
    held = holds(table, of)
    lacking = table[columns_of(of)].isna().any(axis="columns").to_numpy()
    return 100.0 * float(held[rows].mean()) if rows.any() and not lacking[rows].any() else np.nan


def percent_below(table: Table, column: str, by: str, of: str, than: str) -> float:
    """Groups of rows for which one method's entry is below another's, in per cent of all.

    NaN if a group lacks either method, has one twice, or an entry is not finite.
    """
    require_columns(table, column, by, "method")
    rows = table.assign(_value=values(table, column))[table["method"].isin([of, than])]
    if rows.empty or rows.duplicated([by, "method"]).any():
        return np.nan
    wide = rows.pivot(index=by, columns="method", values="_value").reindex(columns=[of, than])
    return 100.0 * float((wide[of] < wide[than]).mean()) if _whole(wide.to_numpy()) else np.nan


# --- numbers ----------------------------------------------------------------------------------------------


def ratio(of: float, to: float) -> float:
    """Quotient; NaN if the divisor is zero."""
    return of / to if to else np.nan


def ratio_percent(of: float, to: float) -> float:
    """Quotient in per cent."""
    return 100.0 * ratio(of, to)


def percent_less(of: float, than: float) -> float:
    """By how many per cent of the second number the first is smaller; negative if it is not."""
    return 100.0 * (1.0 - ratio(of, than))


def difference(of: float, less: float) -> float:
    """The first number less the second."""
    return of - less


def scaled(of: float, by: float) -> float:
    """Product of a number and a factor."""
    return by * of


def total(of: list[float]) -> float:
    """Sum of numbers."""
    return float(np.sum(of))


def larger(of: list[float]) -> float:
    """The largest of numbers; NaN if one is."""
    return float(np.max(of))


def smaller(of: list[float]) -> float:
    """The smallest of numbers; NaN if one is."""
    return float(np.min(of))


# --- by name ----------------------------------------------------------------------------------------------


def registry(*modules: ModuleType) -> Registry:
    """Return the measures of modules, by name: their public functions that return a float.

    Raises
    ------
    InvalidInput
        If two have the same name.
    """
    found: dict[str, Callable[..., float]] = {}
    for module in modules:
        for name, function in getmembers(module, isfunction):
            if function.__module__ != module.__name__ or get_type_hints(function).get("return") is not float:
                continue
            if name in found:
                raise InvalidInput(f"two measures are called {name!r}", where=module.__name__)
            found[name] = function
    return found


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
                f"no measure {part.name!r}", where=where, expected=f"one of {', '.join(registry)}"
            )
        function = registry[part.name]
        try:
            given = signature(function).bind(**part.arguments).arguments
        except TypeError as error:
            raise InvalidInput(f"wrong arguments of {part.name}: {error}", where=where) from error
        types = get_type_hints(function)
        for name, value in given.items():
            if not _fits(value, types[name]):
                raise InvalidInput(
                    f"wrong argument {name!r} of {part.name}",
                    where=where,
                    expected=getattr(types[name], "__name__", str(types[name])),
                    received=str(value),
                )
            if types[name] is Expression and value:
                columns_of(value)


def _fits(value: object, wanted: Any) -> bool:
    if wanted is float:
        return isinstance(value, int | float | Measure) and not isinstance(value, bool)
    if wanted == list[float]:
        return isinstance(value, tuple) and all(_fits(item, float) for item in value)
    if wanted == list[str]:
        return isinstance(value, tuple) and all(isinstance(item, str) for item in value)
    return isinstance(value, str if wanted in (str, Table, Expression) else wanted)


def evaluate(measure: Measure, registry: Registry, tables: Mapping[str, Table]) -> float:
    """Return the value of a measure, NaN if one of its tables is missing.

    Raises
    ------
    InvalidInput
        If the measure is unknown, or a table lacks a column that it reads.
    """
    if any(name not in tables for name in measure.tables):
        return np.nan
    function = registry[measure.name]
    types = get_type_hints(function)

    def given(value: object, wanted: Any) -> Any:
        if isinstance(value, Measure):
            return evaluate(value, registry, tables)
        if isinstance(value, tuple):
            return [given(item, None) for item in value]
        return tables[str(value)] if wanted is Table else value

    with np.errstate(all="ignore"):
        return float(function(**{name: given(v, types[name]) for name, v in measure.arguments.items()}))
