"""How well one measure predicts the order of another: park2011 section 4 read as a claim about ranks.

Reconstructibility is to tell which limbs will err more, not by how much; that is what a correlation of ranks says.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import spearmanr

from pipeline.validation import InvalidInput


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's rank correlation of two series, equal values sharing their ranks; 0 where one of them is constant.

    Parameters
    ----------
    a, b : (N,)

    Raises
    ------
    InvalidInput
        If they are not of one length, or hold NaN.

    Examples
    --------
    >>> rank_correlation([1.0, 2.0, 30.0], [0.1, 0.2, 0.3])
    1.0
    """
    x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or not x.size:
        raise InvalidInput(
            "two series cannot be ranked together",
            expected="shapes (N,) and (N,)",
            received=f"{x.shape} and {y.shape}",
        )
    if np.isnan(x).any() or np.isnan(y).any():
        raise InvalidInput("a series to be ranked holds NaN", expected="numbers; infinity is the largest")
    if (x == x[0]).all() or (y == y[0]).all():
        return 0.0
    return float(spearmanr(x, y).statistic)
