"""Measures for the tables of the study of actions, mozerov2006."""

from __future__ import annotations

import numpy as np

from pipeline.studies.measures import only
from pipeline.studies.rows import Number, Table, require_columns, rows_of, values, whole


def variance_left(table: Table, column: str) -> Number:
    """Variance between performances, computed as half the mean squared distance between pairs of performances.

    This is the variance with divisor M - 1.

    The pairs are all ordered pairs of two performances.  A performance that is drawn twice has no distance from itself.
    """
    rows = rows_of(table)
    require_columns(rows.frame, "performance", "person", "other_person")
    entries = values(rows.frame, column)
    of_person = dict(zip(rows.frame["person"].astype(str), rows.cluster, strict=True))
    other = rows.frame["other_person"].astype(str).map(of_person)
    if not whole(entries) or other.isna().any():
        return rows.no_number
    size = rows.weights.shape[1]
    distances = np.zeros((size, size))
    np.add.at(distances, (rows.cluster, other.to_numpy(dtype=int)), entries)
    first = ~rows.frame["performance"].duplicated().to_numpy()
    count = rows.weights @ np.bincount(rows.cluster[first], minlength=size)
    drawn = ((rows.weights @ distances) * rows.weights).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return rows.number(0.5 * drawn / (count * (count - 1.0)))


def broken_time_constraints(table: Table) -> float:
    """Number of violated constraints of a time warp: ends that do not match, and steps back in time."""
    samples, times = values(table, "sample"), values(table, "rate_to_rate")
    if not samples.size or not (np.isfinite(samples) & np.isfinite(times)).all():
        return np.nan
    times = times[np.argsort(samples, kind="stable")]
    ends = int(times[0] != samples.min()) + int(times[-1] != samples.max())
    return float(ends + np.count_nonzero(np.diff(times) < 0))


def free_numbers(table: Table, count: str, unit_error: str) -> float:
    """Number of free coordinates of a vector: its length, or one less if its norm is always 1 within 1e-6."""
    return only(table, count) - float(only(table, unit_error) < 1e-6)
