"""Statistics of angles, in degrees: what the view-angle tables are made of.

Directions near ±180 are near each other, so means and spreads go through unit vectors.
"""

from __future__ import annotations

import numpy as np


def difference_deg(estimated: np.ndarray | float, true: np.ndarray | float) -> np.ndarray:
    """Signed difference in [-180, 180).

    Examples
    --------
    >>> float(difference_deg(179.0, -179.0))
    -2.0
    """
    return np.mod(np.asarray(estimated) - np.asarray(true) + 180.0, 360.0) - 180.0


def _resultant(angles_deg: np.ndarray, axis: int) -> np.ndarray:
    return np.exp(1j * np.radians(angles_deg)).mean(axis=axis)


def mean_deg(angles_deg: np.ndarray, axis: int) -> np.ndarray:
    """Circular mean, in (-180, 180]."""
    return 180.0 - np.mod(180.0 - np.degrees(np.angle(_resultant(angles_deg, axis))), 360.0)


def sd_deg(angles_deg: np.ndarray, axis: int) -> np.ndarray:
    """Circular standard deviation, sqrt(-2 ln |mean vector|); equals the ordinary one for small spreads."""
    length = np.clip(np.abs(_resultant(angles_deg, axis)), np.finfo(float).tiny, 1.0)
    return np.degrees(np.sqrt(-2.0 * np.log(length)))
