"""The foot on the belt moves with the belt: a linear constraint on walkers, folded into their prior.

Symbols
-------
``R``  rows (2 K', 45 B): dy/dpsi of an ankle at a phase of its stance, less the mean of the rows of both feet
``D``  diagonal: variance of the rows over training walks, and 5² mm² on it

The new prior is that of ``C^-1 + share R^T D^-1 R``.  The mean stays: that of the rows is theirs already.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.core.anatomical.prior import JOINTS, PHASES, Prior, by_joint, cycle
from pipeline.skeleton import WALKER15

STANCE_SHARE = 0.4
"""Of the cycle: the phases at which an ankle moves backwards fastest."""
_LEAST_VARIANCE = 25.0
"""(mm per rad)²."""


def stance_rows(mean: np.ndarray) -> np.ndarray:
    """R of a mean walker (15, 3, 1 + 2H)."""
    blocks = mean.shape[-1]
    harmonic = np.repeat(np.arange(1, blocks // 2 + 1), 2)
    basis = cycle(blocks, PHASES)
    slope = np.zeros_like(basis)
    slope[:, 1::2] = basis[:, 2::2] * harmonic[::2]
    slope[:, 2::2] = -basis[:, 1::2] * harmonic[::2]
    count = round(STANCE_SHARE * PHASES)
    rows = np.zeros((2, count, JOINTS, 3, blocks))
    for foot, name in enumerate(("left_ankle", "right_ankle")):
        joint = WALKER15.index(name)
        order = np.argsort(np.round(slope @ mean[joint, 1], 6), kind="stable")
        rows[foot, :, joint, 1] = slope[np.sort(order[:count])]
    flat = rows.reshape(2 * count, -1)
    return np.asarray(flat - flat.mean(axis=0))


def with_stance(prior: Prior, coefficients: np.ndarray, weights: np.ndarray, *, share: float) -> Prior:
    """Return a prior that knows the stance of its training walks (R, 1 + 2H, 15, 3)."""
    rows = stance_rows(prior.mean)
    values = by_joint(coefficients).reshape(len(coefficients), -1) @ rows.T
    spread = weights @ (values - weights @ values) ** 2 + _LEAST_VARIANCE
    C = prior.covariance.reshape(rows.shape[1], -1)
    seen = rows @ C
    inner = seen @ rows.T
    inner[np.diag_indices_from(inner)] += spread / share
    changed = C - seen.T @ np.linalg.solve(inner, seen)
    return replace(prior, covariance=changed.reshape(prior.covariance.shape))
