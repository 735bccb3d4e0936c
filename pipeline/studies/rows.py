"""Selection of table rows by an expression over the columns, also in bootstrap replicates.

``where: camera == 'still' and reconstructibility > 1`` selects rows: comparisons and arithmetic of columns, numbers and
texts.  A mean drops no rows: a table without rows or with a value that is not finite gives NaN.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import NewType, TypeAlias

import numpy as np
import pandas as pd
from scipy.sparse import csr_array

from pipeline.core import bootstrap
from pipeline.studies.replicated import Replicated
from pipeline.validation import InvalidInput

Table: TypeAlias = pd.DataFrame
"""Published table, whose name for messages is ``attrs["name"]``."""

Number: TypeAlias = float | np.ndarray
"""Float, or an array (B,) with the value in each bootstrap replicate."""

Expression = NewType("Expression", str)
"""Condition on the columns of a table that selects rows, such as ``camera == 'still'``; empty selects all rows."""

_MAX_DENSE = 4_000_000
"""Largest size of a dense array of clusters times groups; larger problems use sparse arrays."""

ALL = Expression("")
"""Condition that selects all rows of a table."""

_ALLOWED = (
    ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.Compare, ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.UnaryOp, ast.USub, ast.Name, ast.Load, ast.Constant, ast.Call,
)  # fmt: skip
"""Python syntax that is allowed in a condition on table columns; the only function is `abs`."""


def values(table: Table, column: str, where: str = "") -> np.ndarray:
    """Return the entries of a column as floats, from the rows where a condition is true.

    Entries that are not numbers become NaN.

    Raises
    ------
    InvalidInput
        If the table lacks the column or a column of the expression.
    """
    require_columns(table, column)
    numbers = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=float)
    return numbers[holds(table, where)]


def holds(table: Table, expression: str) -> np.ndarray:
    """Return a mask (n,) of the rows where a condition on the columns is true; an empty condition is always true.

    A comparison with NaN does not hold.

    Raises
    ------
    InvalidInput
        If the expression is invalid, names a column that the table lacks, or compares texts with numbers.
    """
    if not expression:
        return np.ones(len(table), bool)
    require_columns(table, *columns_of(expression))
    if table.empty:
        return np.zeros(0, bool)
    _require_alike(table, expression)
    with np.errstate(all="ignore"):
        return np.asarray(table.eval(expression, engine="python"), bool)


def _require_alike(table: Table, expression: str) -> None:
    """Raise InvalidInput if a condition on table columns compares strings with numbers."""

    def is_text(node: ast.expr) -> bool | None:
        if isinstance(node, ast.Constant):
            return isinstance(node.value, str)
        if isinstance(node, ast.Name):
            entries = table[node.id]
            if entries.dtype == object:
                entries = entries.dropna().infer_objects()
            return None if entries.isna().all() else not pd.api.types.is_numeric_dtype(entries)
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
        f"the condition {expression!r} compares texts with numbers",
        f"table {table.attrs.get('name', '')}".rstrip(),
        received=", ".join(f"{name}: {table[name].dtype}" for name in columns_of(expression)),
        code="mixed_types",
    )


def columns_of(expression: str) -> list[str]:
    """Return the names of the table columns that a condition uses.

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
        raise InvalidInput(
            f"the condition {expression!r} is not a valid expression",
            received=error,
            code="invalid_expression",
        ) from error
    functions = [node.func for node in nodes if isinstance(node, ast.Call)]
    if not all(isinstance(node, _ALLOWED) for node in nodes) or any(
        not (isinstance(function, ast.Name) and function.id == "abs") for function in functions
    ):
        raise InvalidInput(
            f"the condition {expression!r} contains an operation that is not allowed",
            expected="comparisons and arithmetic of columns, numbers and texts",
            code="forbidden_expression",
        )
    names = [node.id for node in nodes if isinstance(node, ast.Name) and node not in functions]
    return list(dict.fromkeys(names))


def require_columns(table: Table, *columns: str) -> None:
    """Raise InvalidInput if a table lacks one of the required columns."""
    for column in columns:
        if column not in table.columns:
            raise InvalidInput(
                f"no column {column!r}",
                f"table {table.attrs.get('name', '')}".rstrip(),
                received=", ".join(map(str, table.columns)) or "no columns",
                code="no_column",
                column=column,
            )


def whole(numbers: np.ndarray) -> bool:
    """Return True if an array is not empty and all its values are finite."""
    return bool(numbers.size and np.isfinite(numbers).all())


@dataclass(frozen=True)
class Rows:
    """Selected rows of a table with weights in B bootstrap replicates; B is 1 without replicates.

    Attributes
    ----------
    frame : DataFrame
    cluster : (n,) int
    weights : (B, C)
    plain : bool
        True for a plain table, whose results are floats.
    """

    frame: pd.DataFrame
    cluster: np.ndarray
    weights: np.ndarray
    plain: bool

    def number(self, result: np.ndarray) -> Number:
        """Return the results (B,) of all replicates, or a float if the table has no replicates."""
        return float(result[0]) if self.plain else result

    @property
    def no_number(self) -> Number:
        """NaN for every replicate, or a single NaN if the table has no replicates."""
        return self.number(np.full(len(self.weights), np.nan))

    def where(self, mask: np.ndarray) -> Rows:
        """Return the rows of this selection for which a mask (n,) is true."""
        return Rows(self.frame[mask], self.cluster[mask], self.weights, self.plain)

    def mean(self, numbers: np.ndarray) -> np.ndarray:
        """Weighted mean (B, …) of values (n, …) in each of B bootstrap replicates."""
        return bootstrap.weighted_means(numbers, self.cluster, self.weights)

    def median(self, numbers: np.ndarray) -> np.ndarray:
        """Weighted median (B,) of values (n,) in each of B bootstrap replicates."""
        return bootstrap.weighted_medians(numbers, self.cluster, self.weights)

    def deviation(self, numbers: np.ndarray) -> np.ndarray:
        """Standard deviation (B,), divisor n - 1, of values (n,) in each replicate; NaN for a single value."""
        count = self.weights @ np.bincount(self.cluster, minlength=self.weights.shape[1])
        deviations = numbers - numbers.mean()  # against cancellation
        square = np.maximum(self.mean(deviations**2) - self.mean(deviations) ** 2, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(square * count / np.where(count > 1, count - 1.0, np.nan))

    def largest(self, numbers: np.ndarray) -> np.ndarray:
        """Largest of the values (n,) in each of B bootstrap replicates."""
        top = np.full(self.weights.shape[1], -np.inf)
        np.maximum.at(top, self.cluster, numbers)
        result = np.where(self.weights > 0, top, -np.inf).max(axis=1)
        return np.where(np.isfinite(result), result, np.nan)

    def group_means(
        self, numbers: np.ndarray, group: np.ndarray, groups: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean of the values (n,) in each group of rows and replicate, and number of rows, both (B, groups)."""
        shape, at = (self.weights.shape[1], groups), (self.cluster, group)
        if shape[0] * groups > _MAX_DENSE:  # very many people, each a group
            total, rows = (
                self.weights @ csr_array((part, at), shape) for part in (numbers, np.ones(len(numbers)))
            )
        else:
            sums, count = np.zeros(shape), np.zeros(shape)
            np.add.at(sums, at, numbers)
            np.add.at(count, at, 1.0)
            total, rows = self.weights @ sums, self.weights @ count
        with np.errstate(invalid="ignore", divide="ignore"):
            return total / rows, rows


def rows_of(table: Table | Replicated, where: str = "") -> Rows:
    """Return those rows of a table, with or without replicates, for which a condition is true."""
    if isinstance(table, Replicated):
        mask = holds(table.frame, where) if where else slice(None)  # no copy of all rows
        return Rows(table.frame[mask], table.cluster[mask], table.weights, plain=False)
    frame = table[holds(table, where)] if where else table
    return Rows(frame, np.zeros(len(frame), int), np.ones((1, 1), int), plain=True)


def as_number(result: np.ndarray) -> Number:
    """Return a scalar as a float; return an array of replicates as an array."""
    return float(result) if np.ndim(result) == 0 else np.asarray(result)
