"""Circular statistics of angles in degrees, and rank correlation.

Directions near ±180 are near each other, so means and spreads of angles go through unit vectors.  Reconstructibility
is to tell which limbs will err more, not by how much; that is what a correlation of ranks says (park2011 section 4).
"""

from __future__ import annotations

import numpy as np

from pipeline.validation import InvalidInput, require_shape


def angle_difference_deg(estimated: np.ndarray | float, true: np.ndarray | float) -> np.ndarray:
    """Return the signed difference (estimated minus true) of angles, in [-180, 180) degrees.

    Examples
    --------
    >>> float(angle_difference_deg(179.0, -179.0))
    -2.0
    """
    return np.mod(np.asarray(estimated) - np.asarray(true) + 180.0, 360.0) - 180.0


def circular_mean_deg(angles_deg: np.ndarray) -> np.ndarray:
    """Return the circular mean along the last axis, in (-180, 180] degrees."""
    return 180.0 - np.mod(180.0 - np.degrees(np.angle(_mean_vector(angles_deg))), 360.0)


def circular_sd_deg(angles_deg: np.ndarray) -> np.ndarray:
    """Return the circular standard deviation sqrt(-2 ln |mean vector|), degrees.

    It is close to the ordinary standard deviation for small spreads.
    """
    return circular_sd_of_length_deg(np.abs(_mean_vector(angles_deg)))


def circular_sd_of_length_deg(length: np.ndarray) -> np.ndarray:
    """Return the circular standard deviation, degrees, of angles whose mean vector has a given length (0 to 1)."""
    return np.degrees(np.sqrt(-2.0 * np.log(np.clip(length, np.finfo(float).tiny, 1.0))))


def _mean_vector(angles_deg: np.ndarray) -> np.ndarray:
    return np.exp(1j * np.radians(angles_deg)).mean(axis=-1)


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Return Spearman's rank correlation of two series; 0 if one of them is constant.

    Equal values share their mean rank.

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
    x = require_shape("the first series to be ranked", np.asarray(a, float), ("N",))
    y = require_shape("the second series to be ranked", np.asarray(b, float), x.shape)
    if not x.size or np.isnan(x).any() or np.isnan(y).any():
        raise InvalidInput(
            "a series for rank correlation is empty or contains NaN",
            expected="finite or infinite numbers",
            code="empty_or_nan",
        )
    if (x == x[0]).all() or (y == y[0]).all():
        return 0.0
    # A seventh of the time to start the program, and only figures of limbs rank anything.
    from scipy.stats import spearmanr

    return float(spearmanr(x, y).statistic)
