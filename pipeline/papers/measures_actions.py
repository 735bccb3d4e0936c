"""Numbers out of the figures' tables: the measures that the claims of mozerov2006 rest on.

As in `papers_measures`: a measure takes a table's columns and returns one float, and NaN if it finds no rows, a row
twice, or a value that is not a number among them.
"""

from __future__ import annotations

import numpy as np

from pipeline.papers.measures import Columns, labels, mean, numbers, ratio

RAW, LINEAR, KEY_FRAMES, SYNCHRONIZED = "raw", "linear", "keyframe", "synchronized"
"""Stages of a performance, as the tables name them."""

ACCEPTED, OUTSIDE, TRAINING = "accepted", "outside", "training"
"""Kinds of postures in figure 4's table: drawn within the bounds, drawn outside of them, those learnt from."""


def where(columns: Columns, name: str, column: str, label: str) -> np.ndarray:
    """A numeric column's rows that carry a label in another column."""
    return numbers(columns, name)[labels(columns, column) == label]


def only(values: np.ndarray) -> float:
    """The single value; NaN if there are none or several."""
    return float(values[0]) if values.size == 1 else np.nan


def of_stage(columns: Columns, name: str, stage: str) -> float:
    """A column's entry on the one row of a stage."""
    return only(where(columns, name, "stage", stage))


def stage_ratio(columns: Columns, name: str, over: str, under: str) -> float:
    """A column's entry of one stage, relative to that of another."""
    return ratio(of_stage(columns, name, over), of_stage(columns, name, under))


def free_numbers(columns: Columns, count: str, unit_error: str) -> float:
    """How many numbers are used, less the one that the others determine where all are unit vectors to a millionth."""
    return only(numbers(columns, count)) - float(only(numbers(columns, unit_error)) < 1e-6)


def timing(columns: Columns, what: str) -> float:
    """Seconds that one job took."""
    return only(where(columns, "seconds", "what", what))


def timing_each(columns: Columns, what: str) -> float:
    """Seconds that one job took for each of its performances."""
    return ratio(timing(columns, what), only(where(columns, "performances", "what", what)))


def share_above_percent(columns: Columns, name: str, level: float) -> float:
    """Rows whose entry is over a level, in per cent of all."""
    values = numbers(columns, name)
    return 100.0 * mean((values > level).astype(float)) if np.isfinite(values).all() else np.nan


def share_halved_percent(columns: Columns, name: str, before: str) -> float:
    """Rows whose entry is at most half of another column's, in per cent of those where the other is over zero."""
    after, whole = numbers(columns, name), numbers(columns, before)
    if not (np.isfinite(after) & np.isfinite(whole)).all():
        return np.nan
    return 100.0 * mean((after <= 0.5 * whole)[whole > 0.0].astype(float))


def variation_percent(columns: Columns, name: str) -> float:
    """Standard deviation of a column (divisor n - 1) in per cent of its mean."""
    values = numbers(columns, name)
    usable = values.size > 1 and np.isfinite(values).all()
    return 100.0 * ratio(float(values.std(ddof=1)), float(values.mean())) if usable else np.nan


def median_to_others(columns: Columns, name: str) -> float:
    """A column's entry of the median sequence, relative to the mean of all others."""
    is_median, values = numbers(columns, "is_median") == 1.0, numbers(columns, name)
    return ratio(only(values[is_median]), mean(values[~is_median]))


def performances(columns: Columns, stage: str) -> list[np.ndarray]:
    """Performances (samples, components) of one stage, in order of their names; none if a number is missing."""
    chosen = labels(columns, "stage") == stage
    names = labels(columns, "performance")[chosen]
    samples, components, values = (
        numbers(columns, name)[chosen] for name in ("sample", "component", "value")
    )
    if not (np.isfinite(samples) & np.isfinite(components) & np.isfinite(values)).all():
        return []
    found = []
    for name in sorted(set(names)):
        of = names == name
        shape = np.unique(samples[of]).size, np.unique(components[of]).size
        places = set(zip(samples[of].tolist(), components[of].tolist(), strict=True))
        if not shape[0] * shape[1] == len(places) == of.sum():
            return []
        order = np.lexsort((components[of], samples[of]))
        found.append(values[of][order].reshape(shape))
    return found


def variance_between(columns: Columns, stage: str) -> float:
    """Variance between performances (divisor M - 1), mean over samples and components."""
    found = performances(columns, stage)
    if len(found) < 2 or len({x.shape for x in found}) > 1:
        return np.nan
    return float(np.var(found, axis=0, ddof=1).mean())


def broken_time_constraints(columns: Columns) -> float:
    """How often a rate-to-rate function breaks its constraints: each end that is not kept, each step back."""
    samples, times = numbers(columns, "sample"), numbers(columns, "rate_to_rate")
    if not samples.size or not (np.isfinite(samples) & np.isfinite(times)).all():
        return np.nan
    times = times[np.argsort(samples, kind="stable")]
    ends = int(times[0] != samples.min()) + int(times[-1] != samples.max())
    return float(ends + np.count_nonzero(np.diff(times) < 0))


def worst_of_kind(columns: Columns, name: str, kind: str) -> float:
    """Largest entry of a column among the postures of one kind; NaN if there is none or one is not finite."""
    values = where(columns, name, "kind", kind)
    return float(values.max()) if values.size and np.isfinite(values).all() else np.nan


def kind_ratio(columns: Columns, name: str, over: str, under: str) -> float:
    """Mean over the frames of a column's entries of one kind, relative to that of another."""
    return ratio(
        mean(where(columns, name, "kind", over)),
        mean(where(columns, name, "kind", under)),
    )
