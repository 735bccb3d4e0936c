"""Cluster bootstrap: confidence intervals of statistics over people; all clips of a person are drawn together.

A replicate is a row of weights, how often it counts each cluster.  Means, paired differences and ratios of means
are then products of one matrix of weights with sums by cluster, and share the replicates because they share the
matrix.

Symbols
-------
``B`` replicates, ``C`` clusters (people), ``w`` weights (B, C)
"""

from __future__ import annotations

import numpy as np
from scipy import special

from pipeline.validation import InvalidInput

RESAMPLES = 2000
"""Number of bootstrap replicates for the intervals in our results."""

LEVEL = 0.95
"""Nominal coverage of the intervals in our results."""


def resampling_weights(
    clusters: int, generator: np.random.Generator, *, resamples: int = RESAMPLES
) -> np.ndarray:
    """Draw bootstrap replicates: return the number of times that each cluster occurs in each replicate, (B, C) int.

    Each replicate draws C clusters with replacement, so that rows sum to C.

    Examples
    --------
    >>> resampling_weights(3, np.random.default_rng(1), resamples=2).sum(axis=1).tolist()
    [3, 3]
    """
    return generator.multinomial(clusters, np.full(clusters, 1.0 / clusters), size=resamples)


def sums_by_cluster(values: np.ndarray, cluster: np.ndarray, clusters: int) -> np.ndarray:
    """Return the sum of the rows (n, …) in each cluster, (C, …), from the cluster index (n,) of each row."""
    total = np.zeros((clusters, *values.shape[1:]))
    np.add.at(total, cluster, values)
    return total


def weighted_means(values: np.ndarray, cluster: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the weighted mean of rows (n, …) in every bootstrap replicate, (B, …); NaN if a replicate contains no row.

    Parameters
    ----------
    values : (n, …)
        In any unit.
    cluster : (n,) int
        Cluster of each row, 0 to C - 1.
    weights : (B, C)

    Examples
    --------
    >>> weighted_means(np.array([1.0, 3.0, 8.0]), np.array([0, 0, 1]), np.array([[1, 1], [0, 2]])).tolist()
    [4.0, 8.0]
    """
    clusters = weights.shape[1]
    total = sums_by_cluster(values, cluster, clusters)
    count = np.bincount(cluster, minlength=clusters)
    with np.errstate(invalid="ignore", divide="ignore"):
        total_weight = (weights @ count).reshape(-1, *[1] * (total.ndim - 1))
        return np.tensordot(weights, total, axes=1) / np.where(total_weight > 0, total_weight, np.nan)


def weighted_medians(values: np.ndarray, cluster: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the median of rows (n, …) in every bootstrap replicate, (B, …); NaN if a replicate contains no row.

    With an even number of rows it is the mean of the two middle values.
    """
    values = np.asarray(values, float)
    if not values.size:
        return np.full((len(weights), *values.shape[1:]), np.nan)
    # Of each column, (n, K), in the order of its values, how many rows of a replicate have been passed, (B, n).
    columns = values.reshape(len(values), -1)
    middles = np.empty((len(weights), columns.shape[1]))
    of_rows = weights[:, cluster]
    count = of_rows.sum(axis=1)[:, None]
    for k, order in enumerate(np.argsort(columns, axis=0, kind="stable").T):
        ranked, reached = columns[order, k], np.cumsum(of_rows[:, order], axis=1)
        lower, upper = ((reached <= rank).sum(axis=1) for rank in ((count - 1) // 2, count // 2))
        middles[:, k] = 0.5 * sum(ranked[np.minimum(at, len(ranked) - 1)] for at in (lower, upper))
    return np.where(count > 0, middles, np.nan).reshape(-1, *values.shape[1:])


def percentile_interval(replicates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper end (…) of the 95 % percentile interval of bootstrap replicates (B, …).

    Raises
    ------
    InvalidInput
        If there are no replicates.

    Examples
    --------
    >>> low, high = percentile_interval(np.arange(101.0))
    >>> round(float(low), 6), round(float(high), 6)
    (2.5, 97.5)
    """
    if not len(replicates):
        raise InvalidInput(
            "there are no bootstrap replicates", expected="one or more", received="0", code="no_replicates"
        )
    low, high = np.percentile(replicates, [50.0 * (1.0 - LEVEL), 50.0 * (1.0 + LEVEL)], axis=0)
    return low, high


FEWEST_CORRECTED = 10
"""Smallest number of clusters for a bias-corrected (BCa) interval; Student's interval is used for fewer clusters."""


def cluster_interval(
    value: float, replicates: np.ndarray, left_out: np.ndarray, clusters: int
) -> tuple[float, float]:
    """Return the confidence interval of a statistic over clusters, corrected for a small number of clusters.

    Of ten clusters and more, bias-corrected and accelerated percentiles, their levels expanded by Student's quantile
    and ``sqrt(C / (C - 1))``, which the percentiles of few clusters lack; of fewer, Student's interval with the
    bootstrap's standard error.

    Parameters
    ----------
    value : float
        Of all clusters.
    replicates : (B,)
        Of clusters drawn again.
    left_out : (C,) or (0,)
        Without each cluster, for the acceleration; none: not accelerated.
    clusters : int

    Notes
    -----
    Efron, J. Am. Stat. Assoc. 82 (1987), 171; Hesterberg, Am. Stat. 69 (2015), 371 (expansion).  Coverage at 5, 12, 33
    and 80 people is simulated by ``make bench ARGS=coverage_of_intervals``.
    """
    expansion = np.sqrt(clusters / (clusters - 1))
    tail = special.stdtrit(clusters - 1, 0.5 * (1.0 + LEVEL)) * expansion
    if clusters < FEWEST_CORRECTED:
        reach = tail * replicates.std()
        return float(value - reach), float(value + reach)
    below = np.mean(replicates < value) + 0.5 * np.mean(replicates == value)
    bias = special.ndtri(np.clip(below, 0.5 / len(replicates), 1.0 - 0.5 / len(replicates)))
    away = np.mean(left_out) - left_out if len(left_out) else np.zeros(1)
    scale = np.sum(away**2)
    skew = np.sum(away**3) / (6.0 * scale**1.5) if scale > 0 else 0.0
    reached = bias + np.array([-tail, tail])
    # Beyond its pole the correction has no value, and the interval ends at the last replicate.
    shares = special.ndtr(bias + reached / np.maximum(1.0 - skew * reached, 1e-9))
    low, high = np.quantile(replicates, shares)
    return float(low), float(high)


def mean_interval(draws: np.ndarray, *, more: float = 0.0) -> tuple[float, float]:
    """Return Student's confidence interval of a mean from draws (B,), or the interval for one further draw if
    ``more=1``.
    """
    width = np.sqrt(more + 1.0 / len(draws)) * draws.std(ddof=1)
    reach = special.stdtrit(len(draws) - 1, 0.5 * (1.0 + LEVEL)) * width
    return float(draws.mean() - reach), float(draws.mean() + reach)
