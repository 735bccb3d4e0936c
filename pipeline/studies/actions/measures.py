"""Measures that only the tables of performances ask for: mozerov2006."""

from __future__ import annotations

import numpy as np

from pipeline.studies.measures import Table, only, values


def variance_between(table: Table, stage: str) -> float:
    """Variance between performances (divisor M - 1), mean over samples and components.

    NaN if there are fewer than two, or one lacks a sample or has one twice.
    """
    chosen = f"stage == {stage!r}"
    rows = table.assign(value=values(table, "value"))[
        ["performance", "stage", "sample", "component", "value"]
    ]
    rows = rows[rows["stage"] == stage].drop(columns="stage")
    place = ["sample", "component"]
    if not values(table, "value", chosen).size or rows.duplicated(["performance", *place]).any():
        return np.nan
    wide = rows.pivot(index=place, columns="performance", values="value").to_numpy(dtype=float)
    return (
        float(np.var(wide, axis=1, ddof=1).mean())
        if wide.shape[1] > 1 and np.isfinite(wide).all()
        else np.nan
    )


def broken_time_constraints(table: Table) -> float:
    """How often a rate-to-rate function breaks its constraints: each end that is not kept, each step back."""
    samples, times = values(table, "sample"), values(table, "rate_to_rate")
    if not samples.size or not (np.isfinite(samples) & np.isfinite(times)).all():
        return np.nan
    times = times[np.argsort(samples, kind="stable")]
    ends = int(times[0] != samples.min()) + int(times[-1] != samples.max())
    return float(ends + np.count_nonzero(np.diff(times) < 0))


def free_numbers(table: Table, count: str, unit_error: str) -> float:
    """How many numbers are used, less the one that the others determine where all are unit vectors to a millionth."""
    return only(table, count) - float(only(table, unit_error) < 1e-6)
