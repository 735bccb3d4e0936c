"""Linear constraint on the prior: a foot in stance moves backwards with the treadmill's belt.

Symbols
-------
``R``  rows (2 K', 45 B): dy/dpsi of an ankle at a phase of its stance, less the mean of the rows of both feet
``D``  diagonal matrix: variance of the rows over training walks, plus 5² (mm per radian)²

The new prior has the precision ``C^-1 + share R^T D^-1 R``.  The mean does not change.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import ANKLES
from walk3d.anatomy.prior.prior import JOINTS, PHASES, Prior, by_joint, conditioned_on_rows

STANCE_PHASES = 8
"""Number of phases of the cycle that count as stance of one foot, 40 % of the cycle.

They are the phases in which the ankle moves backwards fastest.
"""
_MIN_VARIANCE = 25.0
"""Minimum variance that the stance constraint allows an ankle's velocity, (mm per radian of phase)²."""


def stance_rows(mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return linear functions that are zero if feet in stance move with the ground, and one for the ground's speed.

    Parameters
    ----------
    mean : (15, 3, 1 + 2H)
        The average walker, which determines when a foot stands.

    Returns
    -------
    rows : (16, 45 B)
        Functionals R.
    belt : (45 B,)
        Functional of the ground's speed, mm per radian of phase: minus the mean of dy/dpsi over the stance of both
        feet.
    """
    blocks = mean.shape[-1]
    slope = fourier.cycle_slope(fourier.equal_phases(PHASES), blocks)
    rows = np.zeros((2, STANCE_PHASES, JOINTS, 3, blocks))
    for foot, ankle in enumerate(ANKLES):
        order = np.argsort(
            np.round(slope @ mean[ankle, 1], 6), kind="stable"
        )  # so that rounding does not decide ties
        rows[foot, :, ankle, 1] = slope[np.sort(order[:STANCE_PHASES])]
    flat = rows.reshape(2 * STANCE_PHASES, -1)
    return flat - flat.mean(axis=0), -flat.mean(axis=0)


def with_stance(prior: Prior, coefficients: np.ndarray, weights: np.ndarray, *, share: float) -> Prior:
    """Return the prior with the stance constraint, whose variance is estimated from R walks (R, 1 + 2H, 15, 3)."""
    rows, _ = stance_rows(prior.mean)
    values = by_joint(coefficients).reshape(len(coefficients), -1) @ rows.T
    spread = weights @ (values - weights @ values) ** 2 + _MIN_VARIANCE
    return conditioned_on_rows(prior, rows, spread / share)
