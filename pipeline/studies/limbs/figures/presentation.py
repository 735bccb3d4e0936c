"""How figures of limbs name and draw what is swept, and limbs as paths on their sphere."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core.articulation.hits import ROBUST_QUANTILE
from pipeline.core.reconstructibility import confidence_of_mirror_margin

ADJUST_NAMES = {
    "refined": "refined with the trajectory",
    "global": "one radius for all frames",
    "robust": f"one for {100.0 * ROBUST_QUANTILE:g} % of the frames",
    "per_frame": "longer where a ray misses",
}
ADJUST_COLOURS = {"refined": "black", "global": "blue", "robust": "green", "per_frame": "orange"}

BASELINE_LABELS = ("hangs straight down", "mean pose")
"""Of baselines."""

LEAST = 1e-3
"""On logarithmic axes, errors are drawn as at least so much."""

RADIUS_MM = 1000.0
"""Of the sphere in a recording, whatever the length of the limb."""

EYE_MM = (2100.0, 1500.0, 1000.0)
"""From where the sphere is looked at."""

OUTSIDE = 1.03
"""Estimates are drawn a little outside of the sphere, or they would hide what they agree with."""


def sphere() -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Return the points (1, J, 3), mm, of a sphere of wire, and the pairs of them that are joined."""
    meridians, parallels, steps = 8, 5, 48  # circles through the poles, around them, and points to a circle
    turn = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    circles = []
    for azimuth in np.linspace(0.0, np.pi, meridians, endpoint=False):
        flat = np.sin(turn)
        circles.append(np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(turn)]))
    for height in np.linspace(-1.0, 1.0, parallels + 2)[1:-1]:
        wide = np.sqrt(1.0 - height**2)
        circles.append(np.column_stack([wide * np.cos(turn), wide * np.sin(turn), np.full(steps, height)]))
    joined = [(c * steps + i, c * steps + (i + 1) % steps) for c in range(len(circles)) for i in range(steps)]
    return RADIUS_MM * np.concatenate(circles)[None], joined


def path_bones(frames: int) -> list[tuple[int, int]]:
    """Return the pairs of successive frames of a path."""
    return [(f, f + 1) for f in range(frames - 1)]


def quartile_columns(name: str, column: str) -> dict[str, Any]:
    """Return how a table is aggregated: columns with median, lower and upper quartile of another.

    Parameters
    ----------
    name : str
        Of the columns, before ``_median``, ``_low`` and ``_high``.
    column : str
        What is aggregated.
    """
    quartiles = {"low": 0.25, "high": 0.75}
    return {
        f"{name}_median": (column, "median"),
        **{f"{name}_{end}": (column, partial(pd.Series.quantile, q=q)) for end, q in quartiles.items()},
    }


def increasing(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return whole numbers that increase, and the places of the values next to them, the first of equal ones."""
    order = np.argsort(values, kind="stable")
    whole, first = np.unique(np.rint(values[order]).astype(int), return_index=True)
    return whole, order[first]


def confidences(margins: np.ndarray) -> np.ndarray:
    """Return green, amber or red for each mirror margin, of any shape."""
    flat = [confidence_of_mirror_margin(margin) for margin in np.ravel(margins)]
    return np.array(flat).reshape(np.shape(margins))
