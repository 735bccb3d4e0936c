"""Measures, which are functions that compute a number from published tables.

A measure takes tables, texts and numbers, and returns a number.  It returns NaN if there are no rows or a value is not
finite; `pipeline.studies.rows` selects rows by expressions over the columns.

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

from collections.abc import Callable
from typing import NewType

import numpy as np

from pipeline.studies.rows import (
    ALL,
    Expression,
    Number,
    Rows,
    Table,
    as_number,
    columns_of,
    holds,
    require_columns,
    rows_of,
    values,
    whole,
)

Count = NewType("Count", float)
"""Number that is the same in all bootstrap replicates, such as a count."""


# --- one column -------------------------------------------------------------------------------------------


def _statistic(
    table: Table, column: str, where: Expression, of: Callable[[Rows, np.ndarray], np.ndarray]
) -> Number:
    rows = rows_of(table, where)
    entries = values(rows.frame, column)
    return rows.number(of(rows, entries)) if whole(entries) else rows.no_number


def mean(table: Table, column: str, where: Expression = ALL) -> Number:
    """Mean of a column."""
    return _statistic(table, column, where, Rows.mean)


def mean_percent(table: Table, column: str, where: Expression = ALL) -> Number:
    """Mean of a column of fractions, in per cent."""
    return 100.0 * mean(table, column, where)


def mean_root(table: Table, column: str, where: Expression = ALL) -> Number:
    """Mean of the square roots of a column."""
    return _statistic(table, column, where, lambda rows, entries: rows.mean(np.sqrt(entries)))


def median(table: Table, column: str, where: Expression = ALL) -> Number:
    """Median of a column."""
    return _statistic(table, column, where, Rows.median)


def largest(table: Table, column: str, where: Expression = ALL) -> Number:
    """Largest entry of a column."""
    return _statistic(table, column, where, Rows.largest)


def smallest(table: Table, column: str, where: Expression = ALL) -> Number:
    """Smallest entry of a column."""
    return _statistic(table, column, where, lambda rows, found: -rows.largest(-found))


def only(table: Table, column: str, where: Expression = ALL) -> float:
    """Entry of a column that has exactly one entry; NaN otherwise."""
    entries = values(table, column, where)
    return float(entries[0]) if entries.size == 1 else np.nan


def at_smallest(table: Table, column: str, of: str) -> Number:
    """Value of one column at which the mean of another column is smallest; the first such value on ties."""
    rows = rows_of(table)
    entries, at = values(rows.frame, of), values(rows.frame, column)
    if not (whole(entries) and whole(at)):
        return rows.no_number
    places, first, group = np.unique(at, return_index=True, return_inverse=True)
    order = np.argsort(first)
    curve = rows.group_means(entries, group, len(places))[0][:, order]
    chosen = np.where(np.isnan(curve), np.inf, curve).argmin(axis=1)
    return rows.number(places[order][chosen])


def mean_step(table: Table, column: str) -> Count:
    """Mean step between successive distinct values of a column."""
    entries = np.unique(values(table, column))
    return Count(float(np.ptp(entries) / (entries.size - 1.0)) if entries.size > 1 else np.nan)


def variation_percent(table: Table, column: str) -> Number:
    """Standard deviation of a column (divisor n - 1) in per cent of its mean."""
    rows = rows_of(table)
    entries = values(rows.frame, column)
    if not whole(entries) or entries.size < 2:
        return rows.no_number
    middle = entries.mean()
    level = middle + rows.mean(entries - middle)
    return rows.number(np.asarray(ratio_percent(rows.deviation(entries), level)))


def distinct(table: Table, columns: list[str]) -> Count:
    """Number of distinct combinations of entries in the given columns."""
    require_columns(table, *columns)
    return Count(float(len(table[list(columns)].drop_duplicates())))


# --- rows -------------------------------------------------------------------------------------------------


def percent(table: Table, of: Expression, where: Expression = ALL) -> Number:
    """Percentage of the selected rows for which an expression is true; NaN if an entry is missing."""
    rows = rows_of(table, where)
    true_rows = holds(rows.frame, of)
    if not len(rows.frame) or rows.frame[columns_of(of)].isna().any(axis=None):
        return rows.no_number
    return rows.number(100.0 * rows.mean(true_rows.astype(float)))


def percent_below(table: Table, column: str, by: str, of: str, than: str) -> Number:
    """Percentage of groups of rows in which one method has a smaller mean than another method.

    NaN if a group lacks either method, has one twice for the same person, or an entry is not finite.
    """
    rows = rows_of(table)
    require_columns(rows.frame, column, by, "method")
    chosen = rows.frame["method"].isin([of, than]).to_numpy()
    keys = [name for name in ("walker", "person", "population") if name in rows.frame.columns]
    read = list(
        dict.fromkeys([column, by, "method", *keys])
    )  # of millions of rows no further column is copied
    rows = Rows(rows.frame[read], rows.cluster, rows.weights, rows.plain).where(chosen)
    frame, entries = rows.frame, values(rows.frame, column)
    group, labels = frame[by].factorize(use_na_sentinel=False)
    first = (frame["method"] == of).to_numpy()
    present = [np.bincount(group[mine], minlength=len(labels)) > 0 for mine in (first, ~first)]
    if not whole(entries) or frame.duplicated([by, "method", *keys]).any() or not np.all(present):
        return rows.no_number
    means = []
    for mine in (first, ~first):
        mean_of_part, times = rows.where(mine).group_means(entries[mine], group[mine], len(labels))
        means.append(mean_of_part)
    with np.errstate(invalid="ignore"):
        below = np.where(times > 0, means[0] < means[1], 0.0)
        return rows.number(100.0 * (times * below).sum(axis=1) / times.sum(axis=1))


# --- numbers ----------------------------------------------------------------------------------------------


def ratio(of: Number, to: Number) -> Number:
    """Quotient of two numbers; NaN if the divisor is zero."""
    to = np.asarray(to, float)
    return as_number(of / np.where(to == 0, np.nan, to))


def ratio_percent(of: Number, to: Number) -> Number:
    """Quotient of two numbers in per cent."""
    return 100.0 * ratio(of, to)


def percent_less(of: Number, than: Number) -> Number:
    """Reduction from the second number to the first, in per cent of the second; negative for an increase."""
    return 100.0 * (1.0 - ratio(of, than))


def difference(of: Number, less: Number) -> Number:
    """Difference of two numbers, the first minus the second."""
    return as_number(np.subtract(of, less))


def scaled(of: Number, by: Number) -> Number:
    """Product of a number and a constant factor."""
    return as_number(np.multiply(of, by))


def root(of: Number) -> Number:
    """Square root of a number, such as a mean square or a ratio of mean squares."""
    return as_number(np.sqrt(of))


def total(of: list[Number]) -> Number:
    """Sum of numbers."""
    return as_number(np.sum(np.broadcast_arrays(*of), axis=0))


def larger(of: list[Number]) -> Number:
    """Largest of several numbers; NaN if any of them is NaN."""
    return as_number(np.max(np.broadcast_arrays(*of), axis=0))


def smaller(of: list[Number]) -> Number:
    """Smallest of several numbers; NaN if any of them is NaN."""
    return as_number(np.min(np.broadcast_arrays(*of), axis=0))
