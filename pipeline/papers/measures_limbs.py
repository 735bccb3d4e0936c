"""Numbers out of the figures' tables: the measures that the claims of park2011 rest on.

As in `papers_measures`: a measure takes a table's columns and returns one float, and NaN if it finds no rows or a
value that is not a number among them.

The paper names no limits for "low", "high" and "reliable"; these are the same for every claim.
"""

from __future__ import annotations

import numpy as np

from pipeline.papers.measures import Columns, labels, larger, mean, numbers, ratio, smaller

SUCCESS = 0.1
"""A limb is found if it is on average nearer to the truth than a tenth of its length: six degrees."""

FAR = 2.0
"""Much above one is twice as much, much below one half: what holds from there on holds farther out."""

HIGH_ERROR = 0.3
"""In radii: a root trajectory that is wrong by more makes the child's error high, says the paper, and bounds it."""

SMALL_RATIO, LARGE_RATIO = 0.2, 0.3
"""Root errors, in radii, below and above which the paper calls them small and high."""

STILL, SHAKY = "still", "shaky"
"""Cameras, as the tables name them; the paper's stands still in every experiment with numbers."""

PAPERS_ADJUSTMENT = "global"
"""How the paper makes a radius longer where a ray misses the sphere: in all frames."""

PROGRAMME, OTHER_STARTS = "programme", ("random_signs", "mean_direction")
"""Where a refinement starts, as the tables name it."""

RANDOM, BLOCK = "random", "block"
"""Patterns of missing points, as the tables name them."""


def middle(values: np.ndarray) -> float:
    """Median of all values; NaN if there are none or one is not finite."""
    return float(np.median(values)) if values.size and np.isfinite(values).all() else np.nan


def where(columns: Columns, name: str, **wanted: str) -> np.ndarray:
    """A numeric column's rows that carry a label in each of other columns."""
    rows = np.ones(numbers(columns, name).shape, dtype=bool)
    for column, label in wanted.items():
        rows &= labels(columns, column) == label
    return numbers(columns, name)[rows]


def percent_found(errors: np.ndarray) -> float:
    """Limbs that are found, in per cent of all."""
    return 100.0 * mean((errors < SUCCESS).astype(float)) if np.isfinite(errors).all() else np.nan


# --- against reconstructibility ---------------------------------------------------------------------------


def median_error_above(columns: Columns, least: float) -> float:
    """Median error, in lengths of the limb, of the trials whose reconstructibility is over a number."""
    return middle(numbers(columns, "limb_error")[numbers(columns, "reconstructibility") > least])


def impostors_percent_below(columns: Columns, most: float) -> float:
    """Trials that took the impostor rather than the truth, in per cent of those under a reconstructibility."""
    return 100.0 * mean(numbers(columns, "taken_impostor")[numbers(columns, "reconstructibility") < most])


def percent_above(columns: Columns, name: str, level: float, **wanted: str) -> float:
    """Rows whose entry is over a number, in per cent of those that carry the labels."""
    values = where(columns, name, **wanted)
    return 100.0 * mean((values > level).astype(float)) if not np.isnan(values).any() else np.nan


def dividing_reconstructibility(columns: Columns) -> float:
    """The reconstructibility that divides limbs that are found from others, with the fewest on the wrong side.

    Between two neighbours in geometric mean; the middle one of several that divide equally well.  NaN if all are found
    or none is.
    """
    eta, error = numbers(columns, "reconstructibility"), numbers(columns, "limb_error")
    usable = (eta > 0) & np.isfinite(error)
    found = error < SUCCESS
    if not usable.all() or found.all() or not found.any():
        return np.nan
    order = np.argsort(eta, kind="stable")
    eta, found = eta[order], found[order]
    # Below the k-th: found ones are wrong; from it on: those that are not.
    wrong = np.concatenate([[0], np.cumsum(found)]) + np.concatenate([np.cumsum(~found[::-1])[::-1], [0]])
    between = np.flatnonzero(np.append(np.diff(eta) > 0, False)) + 1
    if not between.size:
        return np.nan
    best = between[wrong[between] == wrong[between].min()]
    k = int(best[len(best) // 2])
    return float(np.sqrt(eta[k - 1] * eta[k])) if np.isfinite(eta[k]) else float(eta[k - 1])


def direct_to_programme(columns: Columns) -> float:
    """Error after refinement from the better of the other starts, relative to that from the programme's."""
    by_coin, from_mean = (mean(where(columns, "limb_error_median", start=start)) for start in OTHER_STARTS)
    return ratio(smaller(by_coin, from_mean), mean(where(columns, "limb_error_median", start=PROGRAMME)))


# --- against error of the parent and of the radius --------------------------------------------------------


def _curve(columns: Columns, swept: str, name: str, **wanted: str) -> dict[float, float]:
    """A column by what is swept, rising, on the rows that carry the labels; NaN where a value stands twice."""
    at, values = where(columns, swept, **wanted), where(columns, name, **wanted)
    places = {float(x): values[at == x] for x in np.unique(at[np.isfinite(at)])}
    return {x: float(found[0]) if found.size == 1 else np.nan for x, found in places.items()}


def reliable_root_error(columns: Columns, camera: str) -> float:
    """Largest error of the root up to which the child's median error stays at most `HIGH_ERROR`; 0 if none does."""
    medians = _curve(columns, "root_error_ratio", "child_error_median", camera=camera)
    if not medians or not np.isfinite(list(medians.values())).all():
        return np.nan
    reliable = 0.0
    for root_error, error in medians.items():
        if error > HIGH_ERROR:
            break
        reliable = root_error
    return reliable


def unreliable_root_error(columns: Columns, camera: str) -> float:
    """Smallest error of the root at which the child's median error is over `HIGH_ERROR`; NaN if none is."""
    medians = _curve(columns, "root_error_ratio", "child_error_median", camera=camera)
    return min((root_error for root_error, error in medians.items() if error > HIGH_ERROR), default=np.nan)


def spread_small_to_large(columns: Columns, camera: str) -> float:
    """Spread of the child's error over trials at small errors of the root, relative to that at large ones."""
    spreads = _curve(columns, "root_error_ratio", "child_error_sd", camera=camera)
    small = mean(np.array([spread for root_error, spread in spreads.items() if root_error < SMALL_RATIO]))
    large = mean(np.array([spread for root_error, spread in spreads.items() if root_error > LARGE_RATIO]))
    return ratio(small, large)


def above_parent_percent(columns: Columns) -> float:
    """Trials whose child is at least as wrong as its parent, in per cent of those whose parent is wrong."""
    wrong = numbers(columns, "root_error_ratio") > 0.0
    child, parent = (numbers(columns, name)[wrong] for name in ("child_error_ratio", "parent_error_ratio"))
    if not (np.isfinite(child) & np.isfinite(parent)).all():
        return np.nan
    return 100.0 * mean((child >= parent).astype(float))


def _reliable_scales(columns: Columns, camera: str) -> dict[float, bool]:
    """By scale of the radius, rising: whether the median error is at most `SUCCESS` over that at the true radius."""
    wanted = {"camera": camera, "adjust": PAPERS_ADJUSTMENT}
    medians = _curve(columns, "radius_scale", "limb_error_median", **wanted)
    if 1.0 not in medians or not np.isfinite(list(medians.values())).all():
        return {}
    return {scale: error <= medians[1.0] + SUCCESS for scale, error in medians.items()}


def least_reliable_scale(columns: Columns, camera: str) -> float:
    """Smallest scale of the radius from which up to the true one all are reliable."""
    least = np.nan
    for scale, reliable in reversed(_reliable_scales(columns, camera).items()):
        if scale <= 1.0:
            if not reliable:
                break
            least = scale
    return least


def largest_reliable_scale(columns: Columns, camera: str) -> float:
    """Largest scale of the radius that is reliable."""
    return max((s for s, reliable in _reliable_scales(columns, camera).items() if reliable), default=np.nan)


# --- whole skeletons --------------------------------------------------------------------------------------


def at_missing(columns: Columns, name: str, fraction: float, pattern: str) -> np.ndarray:
    """A column's rows at a fraction of missing points, of one pattern."""
    near = np.abs(where(columns, "missing_fraction", pattern=pattern) - fraction) < 1e-9
    return where(columns, name, pattern=pattern)[near]


def imputed_to_seen(columns: Columns, pattern: str) -> float:
    """Mean error of imputed points relative to that of points that were seen, over all trials that miss some."""
    some = where(columns, "missing_fraction", pattern=pattern) > 0.0
    imputed, seen = (
        mean(where(columns, name, pattern=pattern)[some]) for name in ("imputed_error_mm", "seen_error_mm")
    )
    return ratio(imputed, seen)


def of_walking(columns: Columns, name: str, camera: str) -> float:
    """Mean of a column over the clips of walking from one kind of camera."""
    walking = np.array(["walk" in action.lower() for action in labels(columns, "action")], dtype=bool)
    return mean(numbers(columns, name)[walking & (labels(columns, "camera") == camera)])


def worst_camera(columns: Columns, name: str) -> float:
    """The larger of a column's means over clips from a still and from any other camera; NaN if either has none."""
    still = labels(columns, "camera") == STILL
    values = numbers(columns, name)
    return larger(mean(values[still]), mean(values[~still]))
