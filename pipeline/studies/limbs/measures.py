"""Measures for the tables of the study of limbs, park2011."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipeline.studies.rows import (
    ALL,
    Expression,
    Number,
    Rows,
    Table,
    as_number,
    require_columns,
    rows_of,
    values,
    whole,
)

PAPERS_ADJUSTMENT = "refined"
"""Name of the paper's method to adjust the radius of a limb to its rays.

If a ray misses the sphere, the radius is increased in all frames; then it is refined.
"""


def dividing_reconstructibility(table: Table, found: float, error: str = "limb_error") -> Number:
    """Reconstructibility that best separates limbs with an error below a threshold from all other limbs.

    It puts the fewest limbs on the wrong side.  It is the geometric mean of two neighbours, and the middle one of
    several equally good values.  NaN if the error is below `found` for all limbs or for none.
    """
    rows = rows_of(table)
    eta, off = values(rows.frame, "reconstructibility"), values(rows.frame, error)
    order = np.argsort(eta, kind="stable")
    eta, right = eta[order], (off < found)[order]
    if not ((eta > 0) & np.isfinite(off)).all():
        return rows.no_number
    times = rows.weights[:, rows.cluster[order]]
    return rows.number(np.array([_dividing(eta[n > 0], right[n > 0], n[n > 0]) for n in times]))


def _dividing(eta: np.ndarray, right: np.ndarray, times: np.ndarray) -> float:
    """Reconstructibility at which a threshold misclassifies the fewest limbs; `times` are the weights of the limbs."""
    if right.all() or not right.any():
        return np.nan
    # Wrong for a division at the k-th limb: successes below it, failures from it on.
    below, above = np.cumsum(right * times), np.cumsum((~right * times)[::-1])[::-1]
    wrong = np.append(0, below) + np.append(above, 0)
    between = np.flatnonzero(np.append(np.diff(eta) > 0, False)) + 1
    if not between.size:
        return np.nan
    best = between[wrong[between] == wrong[between].min()]
    k = best[len(best) // 2]
    return np.sqrt(eta[k - 1] * eta[k]) if np.isfinite(eta[k]) else eta[k - 1]


def rank_correlation_of(table: Table, column: str, by: str, where: Expression = ALL) -> Number:
    """Spearman's rank correlation between two columns; equal values share a mean rank.

    The correlation is 0 if one of the columns is constant.
    """
    rows = rows_of(table, where)
    pair = [values(rows.frame, name) for name in (column, by)]
    if not len(rows.frame) or any(np.isnan(numbers).any() for numbers in pair):
        return rows.no_number
    times = rows.weights[:, rows.cluster].astype(float)
    many = times.sum(axis=1, keepdims=True)
    ranks = []
    for numbers in pair:
        _, group = np.unique(numbers, return_inverse=True)
        count = np.zeros((len(times), group.max() + 1))
        for n, index in enumerate(group):
            count[:, index] += times[:, n]
        # Equal values share the mean of their ranks.
        ranks.append((np.cumsum(count, axis=1) - 0.5 * count)[:, group] - 0.5 * many)
    products = [(times * ranks[a] * ranks[b]).sum(axis=1) for a, b in ((0, 1), (0, 0), (1, 1))]
    size = np.sqrt(products[1] * products[2])
    correlation = np.where(size > 0, products[0] / np.where(size > 0, size, 1.0), 0.0)
    return rows.number(np.where(many[:, 0] > 0, correlation, np.nan))


def rank_correlation_within(table: Table, column: str, by: str, within: str) -> Number:
    """Largest rank correlation between two columns among groups of rows; the column `within` names the group.

    Each replicate ignores the groups without rows.
    """
    rows = rows_of(table)
    if any(np.isnan(values(rows.frame, name)).any() for name in (column, by)):
        return rows.no_number
    entries = sorted(set(map(str, rows.frame[within])))
    correlations = [
        rank_correlation_of(table, column, by, Expression(f"{within} == '{entry}'")) for entry in entries
    ]
    return as_number(np.fmax.reduce(np.asarray(correlations), axis=0)) if correlations else rows.no_number


def _curve(
    table: Table, at: str, column: str, where: str, over: Callable[[Rows, np.ndarray], np.ndarray]
) -> tuple[Rows, np.ndarray, np.ndarray]:
    """Selected rows, distinct values (V,) of one column, and a statistic (B, V) of another column at each value.

    The arrays are empty if an entry of one of the columns is not finite.
    """
    rows = rows_of(table, where)
    abscissa, numbers = values(rows.frame, at), values(rows.frame, column)
    if not (whole(abscissa) and whole(numbers)):
        return rows, np.empty(0), np.empty((len(rows.weights), 0))
    every = np.unique(abscissa)
    curve = [over(rows.where(abscissa == value), numbers[abscissa == value]) for value in every]
    return rows, every, np.stack(curve, axis=1)


def mean_deviation(table: Table, column: str, by: str, where: Expression = ALL) -> Number:
    """Standard deviation of a column over rows with the same value of the column `by`, averaged over values.

    The divisor of the variance is n - 1.
    """
    rows, abscissa, curve = _curve(table, by, column, where, Rows.deviation)
    return rows.number(curve.mean(axis=1)) if abscissa.size else rows.no_number


def _root_errors(table: Table, camera: str, error: str) -> tuple[Rows, np.ndarray, np.ndarray]:
    return _curve(table, "root_error_ratio", error, f"camera == {camera!r}", Rows.median)


def reliable_root_error(table: Table, camera: str, high: float, error: str = "child_error_ratio") -> Number:
    """Largest error of the root up to which the median error of the limb's end does not exceed a bound.

    The value is 0 if the smallest error of the root already exceeds the bound.
    """
    rows, abscissa, curve = _root_errors(table, camera, error)
    if not abscissa.size:
        return rows.no_number
    reliable = np.logical_and.accumulate(curve <= high, axis=1)
    largest = np.max(np.where(reliable, abscissa, 0.0), axis=1)
    return rows.number(np.where(np.isnan(curve).any(axis=1), np.nan, largest))


def least_unreliable_root_error(
    table: Table, camera: str, high: float, error: str = "child_error_ratio"
) -> Number:
    """Smallest error of the root at which the median error of the limb's end exceeds a bound; NaN if it never does."""
    rows, abscissa, curve = _root_errors(table, camera, error)
    if not abscissa.size:
        return rows.no_number
    smallest = np.min(np.where(curve > high, abscissa, np.inf), axis=1)
    return rows.number(np.where(np.isfinite(smallest), smallest, np.nan))


def _reliable_scales(
    table: Table, camera: str, found: float, error: str
) -> tuple[Rows, np.ndarray, np.ndarray]:
    """Table rows, relative radii (V,), and a mask (B, V) of the radii with almost the error of the true radius.

    At a reliable scale, the median error is at most `found` larger than at scale 1.
    """
    where = f"camera == {camera!r} and adjust == {PAPERS_ADJUSTMENT!r}"
    rows, scales, curve = _curve(table, "radius_scale", error, where, Rows.median)
    if 1.0 not in scales:
        return rows, np.empty(0), np.empty((len(rows.weights), 0), bool)
    return rows, scales, curve <= curve[:, scales == 1.0] + found


def least_reliable_scale(table: Table, camera: str, found: float, error: str = "limb_error") -> Number:
    """Smallest relative radius such that all radii up to the true one give almost the error of the true one.

    A scale is reliable if its median error is at most `found` larger than at scale 1.
    """
    rows, scales, reliable = _reliable_scales(table, camera, found, error)
    if not scales.size:
        return rows.no_number
    up, below = reliable[:, scales <= 1.0], scales[scales <= 1.0]
    all_up = np.logical_and.accumulate(up[:, ::-1], axis=1)[:, ::-1]
    return rows.number(_finite(np.min(np.where(all_up, below, np.inf), axis=1)))


def largest_reliable_scale(table: Table, camera: str, found: float, error: str = "limb_error") -> Number:
    """Largest relative radius whose median error exceeds that at the true radius by at most a tolerance."""
    rows, scales, reliable = _reliable_scales(table, camera, found, error)
    if not scales.size:
        return rows.no_number
    return rows.number(_finite(np.max(np.where(reliable, scales, -np.inf), axis=1)))


def _finite(numbers: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(numbers), numbers, np.nan)


def mean_of_walking(table: Table, column: str, camera: str) -> Number:
    """Mean of a table column over the clips of walking, for one kind of camera."""
    rows = rows_of(table, f"camera == {camera!r}")
    require_columns(rows.frame, "action")
    walking = rows.frame["action"].astype(str).str.contains("walk", case=False).to_numpy(dtype=bool)
    numbers = values(rows.frame, column)[walking]
    return rows.number(rows.where(walking).mean(numbers)) if whole(numbers) else rows.no_number
