"""Selection of rows in tidy tables by series, from which pictures and recordings draw lines.

A table is an object with ``table[column]``: a `pandas.DataFrame` or a dict of equally long arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from pipeline.validation import InvalidInput


class Table(Protocol):
    """Table whose columns are available by name."""

    def __getitem__(self, column: str, /) -> Any: ...

    def __contains__(self, column: object, /) -> bool: ...


Where = Mapping[str, Any]
"""Filter of rows: the accepted value or values for each column."""


def column(table: Table, name: str) -> np.ndarray:
    """Return a column of a table as an array (N,).

    Raises
    ------
    InvalidInput
        If the table has no such column.
    """
    if name not in table:
        raise InvalidInput("the table has no column of this name", name, code="no_column")
    return np.asarray(table[name])


def rows_where(table: Table, where: Where, length: int) -> np.ndarray:
    """Return a mask (N,) of the rows with the accepted values, for a table of N = `length` rows.

    Examples
    --------
    >>> rows_where({"method": ["map", "map", "baseline"], "fold": [1, 2, 1]}, {"method": "map", "fold": [1, 3]}, 3)
    array([ True, False, False])
    """
    selected = np.ones(length, bool)
    for name, value in where.items():
        several = not isinstance(value, str) and isinstance(value, Iterable)
        selected &= np.isin(column(table, name), list(value) if several else [value])
    return selected


def groups(
    table: Table,
    columns: Sequence[str],
    *,
    by: str = "",
    where: Where | None = None,
    keys: Iterable[str] = (),
) -> dict[str, dict[str, np.ndarray]]:
    """Return the rows of each series, sorted by the first column in ascending order.

    Parameters
    ----------
    table : mapping of str to (N,) array
    columns : sequence of str
        Columns of the result; the first is the abscissa.
    by : str
        Column whose values name the series; empty for one series of all rows, named ``""``.
    where : mapping, optional
        Filter of rows: for each column, the accepted value or values.
    keys : iterable of str
        Series to return, in order; empty for all series in order of appearance.

    Returns
    -------
    dict
        Series → column → (n,) array; keys without rows are left out.

    Raises
    ------
    InvalidInput
        If a column is missing, lengths differ, or no row matches.

    Examples
    --------
    >>> table = {"x": [2, 1, 1], "error": [0.2, 0.1, 0.5], "method": ["map", "map", "baseline"]}
    >>> {name: rows["error"].tolist() for name, rows in groups(table, ["x", "error"], by="method").items()}
    {'map': [0.1, 0.2], 'baseline': [0.5]}
    """
    values_by_column = {name: column(table, name) for name in columns}
    keys = list(keys)
    labels = column(table, by).astype(str) if by else np.full(len(values_by_column[columns[0]]), "")
    if by and keys and column(table, by).dtype.kind == "i" and set(labels).isdisjoint(keys):
        labels = column(table, by).astype(float).astype(str)  # a file writes 30 for 30.0
    lengths = {len(values) for values in (*values_by_column.values(), labels)}
    if len(lengths) > 1:
        raise InvalidInput(
            "the columns of the table differ in length", ", ".join(columns), code="other_length"
        )
    selected = rows_where(table, where or {}, len(labels))
    order = (keys if by else []) or list(dict.fromkeys(labels[selected].tolist()))
    selected &= np.isin(labels, order)
    if not selected.any():
        raise InvalidInput(
            "no row of the table matches the filter", columns[-1], dict(where or {}) or "", code="no_rows"
        )
    result = {}
    for key in order:
        rows = np.flatnonzero(selected & (labels == key))
        if rows.size:
            rows = rows[np.argsort(values_by_column[columns[0]][rows], kind="stable")]
            result[key] = {name: values[rows] for name, values in values_by_column.items()}
    return result
