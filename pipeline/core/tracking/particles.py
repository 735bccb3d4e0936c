"""Weights of particles: normalisation, effective sample size and systematic resampling.

Weights are kept as natural logarithms, so that a sharp likelihood leaves the best particle a weight of one where
its plain weight would be zero to double precision.
"""

from __future__ import annotations

import numpy as np


def normalise(log_weights: np.ndarray) -> tuple[np.ndarray, float]:
    """Return normalised log-weights (S,), and the logarithm of the sum of the original weights.

    Examples
    --------
    >>> log_weights, total = normalise(np.log([1.0, 3.0]))
    >>> np.exp(log_weights).round(12).tolist(), round(float(np.exp(total)), 12)
    ([0.25, 0.75], 4.0)
    """
    most = np.max(log_weights)
    total = most + np.log(np.exp(log_weights - most).sum())
    return log_weights - total, total


def effective_sample_size(log_weights: np.ndarray) -> float:
    """Return the effective sample size, the inverse of the sum of squared weights.

    It lies between 1 and S (equal weights) for normalised log-weights (S,).

    Examples
    --------
    >>> effective_sample_size(np.log([0.5, 0.5, 1e-300]))
    2.0
    """
    return float(1.0 / np.exp(2.0 * log_weights).sum())


def resample_systematically(log_weights: np.ndarray, offset: float) -> np.ndarray:
    """Return the indices (S,) of the particles that systematic resampling selects, in ascending order.

    Particle i occurs S w_i times, rounded up or down.

    Parameters
    ----------
    log_weights : (S,)
        Normalised.
    offset : float
        One uniform number of [0, 1).

    Notes
    -----
    S equidistant points, shifted together by `offset`, are laid on the cumulative weights.  Each count is the
    floor or the ceiling of S w_i and its mean over the offset is S w_i, so nothing is biased, in whatever order
    the particles stand, and the variance is lower than that of independent draws.

    Examples
    --------
    >>> resample_systematically(np.log([0.125, 0.625, 0.125, 0.125]), 0.9)
    array([1, 1, 1, 3])
    """
    count = len(log_weights)
    cumulative = np.cumsum(np.exp(log_weights))
    # The last sum is one but for rounding; beyond the last particle with any weight there is none to take.
    cumulative[cumulative >= cumulative[-1]] = np.inf
    return np.searchsorted(cumulative, (np.arange(count) + offset) / count, side="right")
