"""Numbers out of the figures' tables: the measures that the claims of zhang2004 and zhang2007 rest on.

Every measure takes a table's columns and returns one float.  A measure that finds no rows, or a value that is
not a number among them, returns NaN: rows are never dropped to make a mean.

Bands of the view angle, in degrees either side of the frontal view, the same for every claim: frontal within
10 of 0, oblique from 30 to 60, profile from 80 to 90.  The papers name these views without limits.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

Columns = Mapping[str, np.ndarray]

FRONTAL_DEG = (0.0, 10.0)
OBLIQUE_DEG = (30.0, 60.0)
PROFILE_DEG = (80.0, 90.0)
LEAST_SQUARES = "least_squares"
MAP = "map"
BOTH = (LEAST_SQUARES, MAP)


def _number(value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return np.nan


def numbers(columns: Columns, name: str) -> np.ndarray:
    """A column as float64, NaN where an entry is not a number."""
    return np.array([_number(value) for value in np.asarray(columns[name]).tolist()], dtype=float)


def labels(columns: Columns, name: str) -> np.ndarray:
    """A column as text, so that walkers may be numbers or names."""
    return np.array([str(value) for value in np.asarray(columns[name]).tolist()], dtype=object)


def mean(values: np.ndarray) -> float:
    """Mean of all values; NaN if there are none or one is not finite."""
    return float(values.mean()) if values.size and np.isfinite(values).all() else np.nan


def ratio(numerator: float, denominator: float) -> float:
    """Quotient; NaN if the denominator is zero."""
    return numerator / denominator if denominator else np.nan


def distinct(columns: Columns, *names: str) -> float:
    """How many different entries a column, or combinations of entries several columns, have."""
    return float(len(set(zip(*(labels(columns, name) for name in names), strict=True))))


def mean_step(columns: Columns, name: str) -> float:
    """Range of a column over the number of steps between its different values."""
    values = np.unique(numbers(columns, name))
    return ratio(float(np.ptp(values)), values.size - 1.0) if values.size else np.nan


def of_method(columns: Columns, name: str, method: str) -> np.ndarray:
    """A numeric column's rows of one method."""
    return numbers(columns, name)[labels(columns, "method") == method]


def curve(columns: Columns, name: str, method: str) -> dict[float, float]:
    """A column of one method by view angle in degrees; NaN where an angle stands twice."""
    angles = of_method(columns, "view_angle_deg", method).tolist()
    found: dict[float, float] = {}
    for angle, value in zip(angles, of_method(columns, name, method).tolist(), strict=True):
        found[angle] = np.nan if angle in found else value
    return found


def harmonic_share(columns: Columns, name: str, harmonic: int) -> float:
    """Mean over walkers of a fraction on the rows of one harmonic, in per cent."""
    return 100.0 * mean(numbers(columns, name)[numbers(columns, "harmonic") == harmonic])


def cumulative_share(columns: Columns, component: int) -> float:
    """Cumulative fraction of the variance up to a component, in per cent."""
    return 100.0 * mean(numbers(columns, "cumulative_fraction")[numbers(columns, "component") == component])


def components_needed(columns: Columns, share_percent: float) -> float:
    """Smallest number of components whose cumulative fraction reaches a share."""
    reached = numbers(columns, "component")[100.0 * numbers(columns, "cumulative_fraction") >= share_percent]
    return float(reached.min()) if reached.size else np.nan


def representation_length(postures: Columns, harmonics: Columns, coordinates: int) -> float:
    """Joints × coordinates × (1 + 2 harmonics), from the joints and the harmonics that the tables name."""
    return distinct(postures, "joint") * coordinates * (1.0 + 2.0 * distinct(harmonics, "harmonic"))


def best_variance(columns: Columns) -> float:
    """The σ² at which the mean error is smallest, in mm²; the first on ties."""
    errors, variances = numbers(columns, "absolute_error_mm2"), numbers(columns, "sigma2_mm2")
    usable = errors.size and np.isfinite(errors).all()
    return float(variances[np.argmin(errors)]) if usable else np.nan


def median(columns: Columns, name: str) -> float:
    """Median of a column; NaN if it is empty or holds a value that is not finite."""
    values = numbers(columns, name)
    return float(np.median(values)) if values.size and np.isfinite(values).all() else np.nan


def reduction_percent(smaller: float, larger: float) -> float:
    """By how many per cent of the larger the smaller is smaller; negative if it is not."""
    return 100.0 * (1.0 - ratio(smaller, larger))


def map_gain(columns: Columns, name: str) -> float:
    """By how many per cent MAP's mean over the views is below that of least squares."""
    return reduction_percent(
        mean(of_method(columns, name, MAP)), mean(of_method(columns, name, LEAST_SQUARES))
    )


def views_won_by_map(columns: Columns, name: str) -> float:
    """Views at which MAP is strictly below least squares, in per cent of all."""
    ours, theirs = curve(columns, name, MAP), curve(columns, name, LEAST_SQUARES)
    if ours.keys() != theirs.keys() or not np.isfinite([*ours.values(), *theirs.values()]).all():
        return np.nan
    return 100.0 * mean(np.array([float(ours[angle] < theirs[angle]) for angle in ours]))


def walkers_won_by_map(columns: Columns, name: str) -> float:
    """Walkers for whom MAP is strictly below least squares, in per cent of all."""
    walkers, methods, values = labels(columns, "walker"), labels(columns, "method"), numbers(columns, name)
    ours = dict(zip(walkers[methods == MAP], values[methods == MAP], strict=True))
    theirs = dict(zip(walkers[methods == LEAST_SQUARES], values[methods == LEAST_SQUARES], strict=True))
    if ours.keys() != theirs.keys() or not np.isfinite(values).all():
        return np.nan
    return 100.0 * mean(np.array([float(ours[walker] < theirs[walker]) for walker in ours]))


def asymmetry_percent(columns: Columns, name: str, method: str) -> float:
    """Mean |f(−α) − f(α)| over the oblique pairs (0 < α < 90), in per cent of the mean of f over them."""
    f = curve(columns, name, method)
    pairs = [(f[-angle], f[angle]) for angle in f if 0.0 < angle < 90.0 and -angle in f]
    left, right = np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])
    return 100.0 * ratio(mean(np.abs(left - right)), 0.5 * (mean(left) + mean(right)))


def in_band(columns: Columns, name: str, method: str, band_deg: tuple[float, float]) -> float:
    """Mean of a column over the views of one band, left and right alike."""
    away = np.abs(of_method(columns, "view_angle_deg", method))
    return mean(of_method(columns, name, method)[(away >= band_deg[0]) & (away <= band_deg[1])])


def band_ratio(
    columns: Columns, name: str, method: str, over: tuple[float, float], under: tuple[float, float]
) -> float:
    """Mean of a column over one band of views, relative to its mean over another."""
    return ratio(in_band(columns, name, method, over), in_band(columns, name, method, under))


def profile_to_all(columns: Columns, name: str, method: str) -> float:
    """Mean of a column over the profile views, relative to its mean over all views."""
    return ratio(in_band(columns, name, method, PROFILE_DEG), mean(of_method(columns, name, method)))


def mean_of_method(columns: Columns, name: str, method: str) -> float:
    """Mean over the views of a column of one method."""
    return mean(of_method(columns, name, method))


def angle_bias_deg(columns: Columns, method: str) -> float:
    """Mean over the views of |mean estimated angle − true angle|, the short way round the circle."""
    estimated = of_method(columns, "estimated_mean_deg", method)
    off = estimated - of_method(columns, "view_angle_deg", method)
    return mean(np.abs((off + 180.0) % 360.0 - 180.0))


def failures_percent(columns: Columns, method: str, walkers: float) -> float:
    """Estimates more than 30° off, in per cent of all (views × walkers)."""
    return 100.0 * ratio(mean(of_method(columns, "failures", method)), walkers)


def largest(columns: Columns, name: str) -> float:
    """Largest entry of a column; NaN if it is empty or holds a value that is not finite."""
    values = numbers(columns, name)
    return float(values.max()) if values.size and np.isfinite(values).all() else np.nan


def larger(first: float, second: float) -> float:
    """The larger of two; NaN if either is (Python's own `max` would depend on their order)."""
    return float(np.maximum(first, second))


def smaller(first: float, second: float) -> float:
    """The smaller of two; NaN if either is."""
    return float(np.minimum(first, second))
