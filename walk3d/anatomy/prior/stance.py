"""The foot on the belt moves with the belt: a linear constraint on walkers, folded into their prior.

Symbols
-------
``R``  rows (2 K', 45 B): dy/dpsi of an ankle at a phase of its stance, less the mean of the rows of both feet
``D``  diagonal: variance of the rows over training walks, and 5² mm² on it

The new prior is that of ``C^-1 + share R^T D^-1 R``.  The mean stays: that of the rows is theirs already.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import ANKLES
from walk3d.anatomy.prior.prior import JOINTS, PHASES, Prior, by_joint, conditioned_on_rows

STANCE_PHASES = 8
"""Phases of `PHASES` at which an ankle moves backwards fastest: 40 % of the cycle."""
_LEAST_VARIANCE = 25.0
"""(mm per rad)²."""


def stance_rows(mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear functionals of a walker that are about zero because the feet stand on one ground, and its speed.

    Parameters
    ----------
    mean : (15, 3, 1 + 2H)
        The average walker, which says when a foot stands.

    Returns
    -------
    rows : (16, 45 B)
        R.
    belt : (45 B,)
        Minus the mean of dy/dpsi over the stance of both feet: the speed of the ground, mm per radian of phase.
    """
    blocks = mean.shape[-1]
    slope = fourier.cycle_slope(fourier.equal_phases(PHASES), blocks)
    rows = np.zeros((2, STANCE_PHASES, JOINTS, 3, blocks))
    for foot, ankle in enumerate(ANKLES):
        order = np.argsort(np.round(slope @ mean[ankle, 1], 6), kind="stable")  # ties do not go by rounding
        rows[foot, :, ankle, 1] = slope[np.sort(order[:STANCE_PHASES])]
    flat = rows.reshape(2 * STANCE_PHASES, -1)
    return flat - flat.mean(axis=0), -flat.mean(axis=0)


def with_stance(prior: Prior, coefficients: np.ndarray, weights: np.ndarray, *, share: float) -> Prior:
    """Return a prior that knows the stance of its training walks (R, 1 + 2H, 15, 3)."""
    rows, _ = stance_rows(prior.mean)
    values = by_joint(coefficients).reshape(len(coefficients), -1) @ rows.T
    spread = weights @ (values - weights @ values) ** 2 + _LEAST_VARIANCE
    return conditioned_on_rows(prior, rows, spread / share)
