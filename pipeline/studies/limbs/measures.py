"""Measures that only the tables of limbs ask for: park2011."""

from __future__ import annotations

import numpy as np

from pipeline.studies.measures import Expression, Table, mean, require_columns, values

PAPERS_ADJUSTMENT = "global"
"""How the paper makes a radius longer where a ray misses the sphere: in all frames."""


def dividing_reconstructibility(table: Table, found: float) -> float:
    """The reconstructibility that best divides limbs whose error is under `found` from the others.

    Fewest limbs are on the wrong side of it.  It is the geometric mean of two neighbours; of several that divide
    equally well, the middle one.  NaN if all limbs are found or none is.
    """
    eta, error = values(table, "reconstructibility"), values(table, "limb_error")
    right = error < found
    if not ((eta > 0) & np.isfinite(error)).all() or right.all() or not right.any():
        return np.nan
    order = np.argsort(eta, kind="stable")
    eta, right = eta[order], right[order]
    # Below the k-th: found ones are wrong; from it on: those that are not.
    wrong = np.concatenate([[0], np.cumsum(right)]) + np.concatenate([np.cumsum(~right[::-1])[::-1], [0]])
    between = np.flatnonzero(np.append(np.diff(eta) > 0, False)) + 1
    if not between.size:
        return np.nan
    best = between[wrong[between] == wrong[between].min()]
    k = int(best[len(best) // 2])
    return float(np.sqrt(eta[k - 1] * eta[k])) if np.isfinite(eta[k]) else float(eta[k - 1])


def _curve(table: Table, at: str, column: str, where: str) -> dict[float, float]:
    """A column by another, rising; none if a place stands twice or a value is not finite."""
    places, found = values(table, at, where), values(table, column, where)
    curve = dict(sorted(zip(places, found, strict=True)))
    return curve if len(curve) == len(places) and np.isfinite([*curve.items()]).all() else {}


def reliable_root_error(table: Table, camera: str, high: float) -> float:
    """Largest error of the root up to which the child's median error is at most `high`; 0 if none is."""
    medians = _curve(table, "root_error_ratio", "child_error_median", f"camera == {camera!r}")
    if not medians:
        return np.nan
    unreliable = [at for at, error in medians.items() if error > high]
    return max((at for at in medians if at < min(unreliable, default=np.inf)), default=0.0)


def _reliable_scales(table: Table, camera: str, found: float) -> dict[float, bool]:
    """By scale of the radius, rising: whether the median error is at most `found` over that at the true radius."""
    chosen = f"camera == {camera!r} and adjust == {PAPERS_ADJUSTMENT!r}"
    medians = _curve(table, "radius_scale", "limb_error_median", chosen)
    return (
        {scale: error <= medians[1.0] + found for scale, error in medians.items()} if 1.0 in medians else {}
    )


def least_reliable_scale(table: Table, camera: str, found: float) -> float:
    """Smallest scale of the radius from which up to the true one all are reliable."""
    scales = {
        scale: reliable for scale, reliable in _reliable_scales(table, camera, found).items() if scale <= 1.0
    }
    unreliable = [scale for scale, reliable in scales.items() if not reliable]
    return min((scale for scale in scales if scale > max(unreliable, default=0.0)), default=np.nan)


def largest_reliable_scale(table: Table, camera: str, found: float) -> float:
    """Largest scale of the radius that is reliable."""
    return max(
        (s for s, reliable in _reliable_scales(table, camera, found).items() if reliable), default=np.nan
    )


def mean_of_walking(table: Table, column: str, camera: str) -> float:
    """Mean of a column over the clips of walking from one kind of camera."""
    require_columns(table, "action")
    walking = table["action"].astype(str).str.contains("walk", case=False)
    return float(mean(table[walking], column, Expression(f"camera == {camera!r}")))
