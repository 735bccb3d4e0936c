"""Measures for the tables of the study of walks, zhang2004 and zhang2007."""

from __future__ import annotations

import numpy as np

from pipeline.core import statistics
from pipeline.studies.measures import Count, distinct, mean, ratio_percent
from pipeline.studies.rows import Expression, Number, Rows, Table, require_columns, rows_of, values, whole

BANDS_DEG = {"frontal": (0.0, 10.0), "oblique": (30.0, 60.0), "profile": (80.0, 90.0)}
"""Range of absolute view angles, degrees, that each named view covers; the papers state no limits."""


def representation_length(
    joints_table: Table, harmonics_table: Table, coordinates: int, frequency: bool = False
) -> Count:
    """Length of a Fourier representation, from the numbers of joints, coordinates and harmonics in tables.

    With `frequency` the length is one more if the table of harmonics has a column ``frequency_hz``.
    """
    blocks = 1.0 + 2.0 * distinct(harmonics_table, ["harmonic"])
    return Count(
        distinct(joints_table, ["joint"]) * coordinates * blocks
        + float(frequency and "frequency_hz" in harmonics_table.columns)
    )


def mean_in_band(table: Table, column: str, method: str, band: str) -> Number:
    """Mean of a column over the views of a named range, on both sides of the frontal view."""
    low, high = BANDS_DEG[band]
    rows = f"method == {method!r} and abs(view_angle_deg) >= {low} and abs(view_angle_deg) <= {high}"
    return mean(table, column, Expression(rows))


def lowest_mean(table: Table, column: str, by: str, where: Expression) -> Number:
    """Smallest of the means of a column in groups of rows; the column `by` names the group of a row."""
    rows = rows_of(table, where)
    require_columns(rows.frame, by)
    numbers = values(rows.frame, column)
    if not whole(numbers):
        return rows.no_number
    labels, group = np.unique(rows.frame[by].astype(str).to_numpy(), return_inverse=True)
    means, _ = rows.group_means(numbers, group, len(labels))
    return rows.number(means.min(axis=1))


def asymmetry_percent(table: Table, column: str, method: str) -> Number:
    """Asymmetry of a curve f over view angle α, in per cent: mean |f(−α) − f(α)| over mean f.

    Means are over the oblique pairs of views, 0 < α < 90 degrees.
    """
    rows = rows_of(table, f"method == {method!r}")
    numbers = values(rows.frame, column)
    views, group = np.unique(values(rows.frame, "view_angle_deg"), return_inverse=True)
    curve, times = rows.group_means(numbers, group, len(views))
    if rows.plain and (times > 1).any():
        return rows.no_number  # an angle occurs twice
    index = {view: number for number, view in enumerate(views)}
    pairs = [(index[-view], index[view]) for view in views if 0.0 < view < 90.0 and -view in index]
    if not pairs:
        return rows.no_number
    left, right = (curve[:, list(side)] for side in zip(*pairs, strict=True))
    difference, level = np.abs(left - right).mean(axis=1), 0.5 * (left + right).mean(axis=1)
    return rows.number(np.asarray(ratio_percent(difference, level)))


def _mean_vectors(table: Table, method: str) -> tuple[Rows, np.ndarray]:
    """Return the rows of a method, and the mean (B, V) over walkers of exp(i error) at each of V views."""
    rows = rows_of(table, f"method == {method!r}")
    angle = np.radians(values(rows.frame, "error_deg"))
    views, group = np.unique(values(rows.frame, "view_angle_deg"), return_inverse=True)
    parts = [rows.group_means(part, group, len(views))[0] for part in (np.cos(angle), np.sin(angle))]
    return rows, parts[0] + 1j * parts[1]


def angle_bias_deg(table: Table, method: str) -> Number:
    """Absolute circular mean, degrees, of the view-angle error over walkers, averaged over views."""
    rows, vectors = _mean_vectors(table, method)
    return rows.number(np.abs(np.degrees(np.angle(vectors))).mean(axis=1)) if vectors.size else rows.no_number


def angle_spread_deg(table: Table, method: str) -> Number:
    """Circular standard deviation, degrees, of the view-angle error over walkers, averaged over views."""
    rows, vectors = _mean_vectors(table, method)
    if not vectors.size:
        return rows.no_number
    return rows.number(statistics.circular_sd_of_length_deg(np.abs(vectors)).mean(axis=1))


def angle_error_median_deg(table: Table, method: str) -> Number:
    """Median absolute view-angle error over walkers, degrees, averaged over views."""
    rows = rows_of(table, f"method == {method!r}")
    off, views = np.abs(values(rows.frame, "error_deg")), values(rows.frame, "view_angle_deg")
    if not (whole(off) and whole(views)):
        return rows.no_number
    medians = [rows.where(views == view).median(off[views == view]) for view in np.unique(views)]
    return rows.number(np.mean(medians, axis=0))
