"""Rows of a tidy table, one group to each series: what pictures and recordings draw lines from.

A table is anything with ``table[column]``: a `pandas.DataFrame` or a dict of equally long arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from pipeline.validation import InvalidInput


class Table(Protocol):
    """Columns by name."""

    def __getitem__(self, column: str, /) -> Any: ...

    def __contains__(self, column: object, /) -> bool: ...


Where = Mapping[str, Any]
"""Column → the value, or several values, that rows must have there."""


def column(table: Table, name: str) -> np.ndarray:
    """Return a column as an array (N,).

    Raises
    ------
    InvalidInput
        If the table has no such column.
    """
    if name not in table:
        raise InvalidInput("the table has no such column", name, code="no_column")
    return np.asarray(table[name])


def rows_where(table: Table, where: Where, length: int) -> np.ndarray:
    """Return which of the `length` rows have the values asked for, (N,) bool.

    Examples
    --------
    >>> rows_where({"method": ["map", "map", "baseline"], "fold": [1, 2, 1]}, {"method": "map", "fold": [1, 3]}, 3)
    array([ True, False, False])
    """
    chosen = np.ones(length, bool)
    for name, wanted in where.items():
        several = not isinstance(wanted, str) and isinstance(wanted, Iterable)
        chosen &= np.isin(column(table, name), list(wanted) if several else [wanted])
    return chosen


def groups(
    table: Table,
    columns: Sequence[str],
    *,
    by: str = "",
    where: Where | None = None,
    keys: Iterable[str] = (),
) -> dict[str, dict[str, np.ndarray]]:
    """Return the rows of each series, in ascending order of the first column.

    Parameters
    ----------
    table : mapping of str to (N,) array
    columns : sequence of str
        What to take; the first is the abscissa.
    by : str
        Column whose values name the series; empty for one series of all rows, named ``""``.
    where : mapping, optional
        Only rows with these values: column → value, or several values.
    keys : iterable of str
        Order of the series, and the only ones that are taken; empty for any, as they come.

    Returns
    -------
    dict
        Series → column → (n,) array; a key without a row is left out.

    Raises
    ------
    InvalidInput
        If a column is missing, lengths differ, or no row is left.

    Examples
    --------
    >>> table = {"x": [2, 1, 1], "error": [0.2, 0.1, 0.5], "method": ["map", "map", "baseline"]}
    >>> {name: rows["error"].tolist() for name, rows in groups(table, ["x", "error"], by="method").items()}
    {'map': [0.1, 0.2], 'baseline': [0.5]}
    """
    taken = {name: column(table, name) for name in columns}
    keys = list(keys)
    labels = column(table, by).astype(str) if by else np.full(len(taken[columns[0]]), "")
    if by and keys and column(table, by).dtype.kind == "i" and set(labels).isdisjoint(keys):
        labels = column(table, by).astype(float).astype(str)  # a file writes 30 for 30.0
    lengths = {len(values) for values in (*taken.values(), labels)}
    if len(lengths) > 1:
        raise InvalidInput("columns of different lengths", ", ".join(columns), code="other_length")
    chosen = rows_where(table, where or {}, len(labels))
    order = (keys if by else []) or list(dict.fromkeys(labels[chosen].tolist()))
    chosen &= np.isin(labels, order)
    if not chosen.any():
        raise InvalidInput(
            "no row of the table is left", columns[-1], received=dict(where or {}), code="no_rows"
        )
    result = {}
    for key in order:
        rows = np.flatnonzero(chosen & (labels == key))
        if rows.size:
            rows = rows[np.argsort(taken[columns[0]][rows], kind="stable")]
            result[key] = {name: values[rows] for name, values in taken.items()}
    return result
