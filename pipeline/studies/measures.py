"""Measures: named functions of published tables, used by the papers' claims, explanations and the README.

A measure takes tables, texts and numbers, and returns a number.  It returns NaN if there are no rows or a value is not
finite: rows are never dropped to make a mean.  Rows are selected by an expression over the columns,
``where: camera == 'still' and reconstructibility > 1``.

In replicates (people drawn again, or several populations) the annotation of its result says how it is computed:

`Number`
    all replicates at once: tables may be `Replicated`, numbers may be arrays (B,);
``float``
    one replicate after the other, each from a plain table: right for any measure, some milliseconds to a replicate;
`Count`
    once, from the published table: a count of what was done, which no replicate changes.

Measures that only one study uses are in its own `measures` module.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from inspect import getmembers, isfunction, signature
from types import ModuleType
from typing import Any, NewType, TypeAlias, get_type_hints

import numpy as np
import pandas as pd

from pipeline.core import bootstrap
from pipeline.papers import Measure
from pipeline.studies.replicated import Replicated
from pipeline.validation import InvalidInput

Table: TypeAlias = pd.DataFrame
"""A table, with its name in ``attrs["name"]`` for messages; in replicates a `Replicated`."""

Number: TypeAlias = float | np.ndarray
"""A number, or an array (B,) of its replicates."""

Count = NewType("Count", float)
"""A number that replicates do not change."""

Expression = NewType("Expression", str)
"""Condition on the columns that selects rows; empty for all rows."""

Registry = Mapping[str, Callable[..., Number]]
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

    A comparison with NaN does not hold.

    Raises
    ------
    InvalidInput
        If the expression is invalid, names a column that the table lacks, or compares texts with numbers.
    """
    if not expression:
        return np.ones(len(table), dtype=bool)
    require_columns(table, *columns_of(expression))
    if table.empty:
        return np.zeros(0, dtype=bool)
    _require_alike(table, expression)
    with np.errstate(all="ignore"):
        return np.asarray(table.eval(expression, engine="python"), dtype=bool)


def _require_alike(table: Table, expression: str) -> None:
    """Require both sides of every comparison to be numbers, or both texts; a column without an entry is either."""

    def is_text(node: ast.expr) -> bool | None:
        if isinstance(node, ast.Constant):
            return isinstance(node.value, str)
        if isinstance(node, ast.Name):
            entries = table[node.id].dropna()
            return None if entries.empty else not pd.api.types.is_numeric_dtype(entries.infer_objects())
        parts = node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
        if True in {is_text(part) for part in parts if isinstance(part, ast.expr)}:
            raise _not_alike(table, expression)
        return False

    for node in ast.walk(ast.parse(expression, mode="eval")):
        if isinstance(node, ast.Compare):
            sides = {is_text(side) for side in (node.left, *node.comparators)} - {None}
            if len(sides) > 1:
                raise _not_alike(table, expression)


def _not_alike(table: Table, expression: str) -> InvalidInput:
    return InvalidInput(
        f"{expression!r} compares texts with numbers",
        where=f"table {table.attrs.get('name', '')}".rstrip(),
        received=", ".join(f"{name}: {table[name].dtype}" for name in columns_of(expression)),
    )


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


@dataclass(frozen=True)
class Rows:
    """Rows of a table where an expression holds, in B replicates (one, if the table is a plain one).

    Attributes
    ----------
    frame : DataFrame
    cluster : (n,) int
    weights : (B, C)
    plain : bool
        Whether the table is a plain one: results are then floats.
    """

    frame: pd.DataFrame
    cluster: np.ndarray
    weights: np.ndarray
    plain: bool

    def number(self, result: np.ndarray) -> Number:
        """Return a result (B,), as a float if the table is a plain one."""
        return float(result[0]) if self.plain else result

    @property
    def no_number(self) -> Number:
        """NaN for every replicate."""
        return self.number(np.full(len(self.weights), np.nan))

    def mean(self, found: np.ndarray) -> np.ndarray:
        """Mean (B, …) of values (n, …)."""
        return bootstrap.weighted_means(found, self.cluster, self.weights)

    def median(self, found: np.ndarray) -> np.ndarray:
        """Median (B,) of values (n,)."""
        return bootstrap.weighted_medians(found, self.cluster, self.weights)

    def largest(self, found: np.ndarray) -> np.ndarray:
        """Largest (B,) of values (n,)."""
        top = np.full(self.weights.shape[1], -np.inf)
        np.maximum.at(top, self.cluster, found)
        result = np.where(self.weights > 0, top, -np.inf).max(axis=1)
        return np.where(np.isfinite(result), result, np.nan)

    def group_means(self, found: np.ndarray, group: np.ndarray, groups: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean of values (n,) in each group (n,) int, and how many rows it has, (B, groups) each."""
        size = self.weights.shape[1]
        total, count = np.zeros((size, groups)), np.zeros((size, groups))
        np.add.at(total, (self.cluster, group), found)
        np.add.at(count, (self.cluster, group), 1.0)
        rows = self.weights @ count
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.weights @ total / rows, rows


def rows_of(table: Table | Replicated, where: str = "") -> Rows:
    """Return the rows of a table, plain or in replicates, where an expression holds."""
    if isinstance(table, Replicated):
        kept = holds(table.frame, where)
        return Rows(table.frame[kept], table.cluster[kept], table.weights, plain=False)
    frame = table[holds(table, where)]
    return Rows(frame, np.zeros(len(frame), dtype=int), np.ones((1, 1), dtype=int), plain=True)


# --- one column -------------------------------------------------------------------------------------------


def mean(table: Table, column: str, where: Expression = Expression("")) -> Number:
    """Mean of a column."""
    rows = rows_of(table, where)
    found = values(rows.frame, column)
    return rows.number(rows.mean(found)) if _whole(found) else rows.no_number


def mean_percent(table: Table, column: str, where: Expression = Expression("")) -> Number:
    """Mean of a fraction, in per cent."""
    return 100.0 * mean(table, column, where)


def median(table: Table, column: str, where: Expression = Expression("")) -> Number:
    """Median of a column."""
    rows = rows_of(table, where)
    found = values(rows.frame, column)
    return rows.number(rows.median(found)) if _whole(found) else rows.no_number


def largest(table: Table, column: str, where: Expression = Expression("")) -> Number:
    """Largest entry of a column."""
    rows = rows_of(table, where)
    found = values(rows.frame, column)
    return rows.number(rows.largest(found)) if _whole(found) else rows.no_number


def smallest(table: Table, column: str, where: Expression = Expression("")) -> Number:
    """Smallest entry of a column."""
    rows = rows_of(table, where)
    found = values(rows.frame, column)
    return rows.number(-rows.largest(-found)) if _whole(found) else rows.no_number


def only(table: Table, column: str, where: Expression = Expression("")) -> float:
    """The single entry of a column; NaN if there are none or several."""
    found = values(table, column, where)
    return float(found[0]) if found.size == 1 else np.nan


def at_smallest(table: Table, column: str, of: str) -> Number:
    """The value of a column at which the mean of another is smallest; the first in the table on ties."""
    rows = rows_of(table)
    found, at = values(rows.frame, of), values(rows.frame, column)
    if not (_whole(found) and _whole(at)):
        return rows.no_number
    places, first, group = np.unique(at, return_index=True, return_inverse=True)
    order = np.argsort(first)
    curve = rows.group_means(found, group, len(places))[0][:, order]
    chosen = np.where(np.isnan(curve), np.inf, curve).argmin(axis=1)
    return rows.number(places[order][chosen])


def mean_step(table: Table, column: str) -> Count:
    """Range of a column over the number of steps between its different values."""
    found = np.unique(values(table, column))
    return Count(float(np.ptp(found) / (found.size - 1.0)) if found.size > 1 else np.nan)


def variation_percent(table: Table, column: str) -> Number:
    """Standard deviation of a column (divisor n - 1) in per cent of its mean."""
    rows = rows_of(table)
    found = values(rows.frame, column)
    if not _whole(found) or found.size < 2:
        return rows.no_number
    count = rows.weights @ np.bincount(rows.cluster, minlength=rows.weights.shape[1])
    middle = found.mean()  # against cancellation
    away = rows.mean(found - middle)
    spread = np.sqrt(np.maximum(rows.mean((found - middle) ** 2) - away**2, 0.0) * count / (count - 1.0))
    return rows.number(np.asarray(ratio_percent(spread, middle + away)))


def distinct(table: Table, columns: list[str]) -> Count:
    """Number of different combinations of entries of columns."""
    require_columns(table, *columns)
    return Count(float(len(table[list(columns)].drop_duplicates())))


# --- rows -------------------------------------------------------------------------------------------------


def percent(table: Table, of: Expression, where: Expression = Expression("")) -> Number:
    """Rows for which an expression holds, in per cent of those chosen; NaN if one of them lacks a number."""
    rows = rows_of(table, where)
    held = holds(rows.frame, of)
    if not len(rows.frame) or rows.frame[columns_of(of)].isna().any(axis=None):
        return rows.no_number
    return rows.number(100.0 * rows.mean(held.astype(float)))


def percent_below(table: Table, column: str, by: str, of: str, than: str) -> Number:
    """Groups of rows for which one method's mean entry is below another's, in per cent of all.

    NaN if a group lacks either method, has one twice for the same person, or an entry is not finite.
    """
    rows = rows_of(table)
    require_columns(rows.frame, column, by, "method")
    chosen = rows.frame["method"].isin([of, than]).to_numpy()
    frame, cluster = rows.frame[chosen], rows.cluster[chosen]
    found = values(frame, column)
    own = [name for name in ("walker", "person", "population") if name in frame.columns]
    labels, group = np.unique(frame[by].astype(str).to_numpy(), return_inverse=True)
    one = (frame["method"] == of).to_numpy()
    there = [np.bincount(group[mine], minlength=len(labels)) > 0 for mine in (one, ~one)]
    if not _whole(found) or frame.duplicated([by, "method", *own]).any() or not np.all(there):
        return rows.no_number
    means = []
    for mine in (one, ~one):
        part = Rows(frame[mine], cluster[mine], rows.weights, rows.plain)
        mean_of_part, times = part.group_means(found[mine], group[mine], len(labels))
        means.append(mean_of_part)
    with np.errstate(invalid="ignore"):
        below = np.where(times > 0, means[0] < means[1], 0.0)
        return rows.number(100.0 * (times * below).sum(axis=1) / times.sum(axis=1))


# --- numbers ----------------------------------------------------------------------------------------------


def ratio(of: Number, to: Number) -> Number:
    """Quotient; NaN if the divisor is zero."""
    to = np.asarray(to, dtype=float)
    return _number(of / np.where(to == 0, np.nan, to))


def ratio_percent(of: Number, to: Number) -> Number:
    """Quotient in per cent."""
    return 100.0 * ratio(of, to)


def percent_less(of: Number, than: Number) -> Number:
    """By how many per cent of the second number the first is smaller; negative if it is not."""
    return 100.0 * (1.0 - ratio(of, than))


def difference(of: Number, less: Number) -> Number:
    """The first number less the second."""
    return _number(np.subtract(of, less))


def scaled(of: Number, by: Number) -> Number:
    """Product of a number and a factor."""
    return _number(np.multiply(of, by))


def root(of: Number) -> Number:
    """Square root: of a mean square, or of a ratio of two."""
    return _number(np.sqrt(of))


def total(of: list[Number]) -> Number:
    """Sum of numbers."""
    return _number(np.sum(np.broadcast_arrays(*of), axis=0))


def larger(of: list[Number]) -> Number:
    """The largest of numbers; NaN if one is."""
    return _number(np.max(np.broadcast_arrays(*of), axis=0))


def smaller(of: list[Number]) -> Number:
    """The smallest of numbers; NaN if one is."""
    return _number(np.min(np.broadcast_arrays(*of), axis=0))


def _number(result: np.ndarray) -> Number:
    return float(result) if np.ndim(result) == 0 else np.asarray(result)


# --- by name ----------------------------------------------------------------------------------------------


def registry(*modules: ModuleType) -> Registry:
    """Return the measures of modules, by name: their public functions that return a number.

    Raises
    ------
    InvalidInput
        If two have the same name.
    """
    found: dict[str, Callable[..., Number]] = {}
    for module in modules:
        for name, function in getmembers(module, isfunction):
            if function.__module__ != module.__name__ or name.startswith("_"):
                continue
            if get_type_hints(function).get("return") not in (float, Number, Count):
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
    if wanted in (float, Number):
        return isinstance(value, int | float | Measure) and not isinstance(value, bool)
    if wanted in (list[float], list[Number]):
        return isinstance(value, tuple) and all(_fits(item, float) for item in value)
    if wanted == list[str]:
        return isinstance(value, tuple) and all(isinstance(item, str) for item in value)
    return isinstance(value, str if wanted in (str, Table, Expression) else wanted)


def evaluate(
    measure: Measure, registry: Registry, tables: Mapping[str, Table | Replicated], replicates: int = 0
) -> Number:
    """Return the value of a measure, NaN if one of its tables is missing.

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

    def given(value: object, wanted: Any) -> Any:
        if isinstance(value, Measure):
            return evaluate(value, registry, tables, replicates)
        if isinstance(value, tuple):
            return [given(item, None) for item in value]
        return tables[str(value)] if wanted is Table else value

    arguments = {name: given(value, types[name]) for name, value in measure.arguments.items()}
    with np.errstate(all="ignore"):
        if types["return"] == Number or not replicates:
            return _number(np.asarray(function(**arguments), dtype=float))
        if types["return"] is Count:
            return float(function(**{name: _published(value) for name, value in arguments.items()}))
        if not any(isinstance(item, Replicated | np.ndarray) for item in _flat(arguments.values())):
            return float(function(**arguments))
        return np.array(
            [
                function(**{name: _drawn(value, b) for name, value in arguments.items()})
                for b in range(replicates)
            ],
            dtype=float,
        )


def _flat(arguments: Iterable[Any]) -> Iterator[Any]:
    for value in arguments:
        yield from value if isinstance(value, list) else [value]


def _published(value: Any) -> Any:
    return value.published if isinstance(value, Replicated) else value


def _drawn(value: Any, replicate: int) -> Any:
    """Return one replicate of an argument."""
    if isinstance(value, list):
        return [_drawn(item, replicate) for item in value]
    if isinstance(value, Replicated):
        return value.drawn(replicate)
    return float(value[replicate]) if isinstance(value, np.ndarray) else value
