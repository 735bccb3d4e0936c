"""Curvature of a performance over time, which shows where movements begin and end (mozerov2006 section 4).

The paper takes key-frames "following a maximum curvature subjective criterion", from plots of the aSpace over time as
in its figure 3.  So the curve here is (t / T, x / r) with T the duration and r the root mean square deviation of the
performance from its mean posture: free of the units of time and of the aSpace.  It bends most where a movement begins
or ends, and not at all where nothing moves.  (The path in the aSpace alone has no curvature at rest, only noise.)
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from pipeline.validation import InvalidInput, require_range, require_shape

SMOOTHING = 0.03
"""Standard deviation of the Gaussian smoothing before differentiation, as a fraction of the performance's duration."""


def curvature(sequence: np.ndarray, *, where: str = "the performance") -> np.ndarray:
    """Return the curvature (F,) of a performance in the aSpace over time.

    Parameters
    ----------
    sequence : (F, b)
    where : str
        What an error calls the performance.

    Raises
    ------
    InvalidInput
        Fewer than three frames, numbers that are not finite, or no movement at all.
    """
    x = checked(sequence, where)
    r = np.sqrt(x.var(axis=0).sum())
    if not r > 1e-12 * np.abs(x).max():
        raise InvalidInput(
            "the performance contains no movement, so it has no curvature", where, code="no_motion"
        )
    duration = len(x) - 1
    smooth = gaussian_filter1d(x / r, SMOOTHING * duration, axis=0, mode="nearest")
    # Differences: the derivatives of a sampled Gaussian do not sum to zero, so they would see where x is.
    first = np.gradient(smooth, axis=0) * duration
    second = np.gradient(first, axis=0) * duration
    # Of the curve (t / T, x / r): its first derivative is (1, first), its second (0, second).
    speed = 1.0 + (first**2).sum(axis=1)
    across = speed * (second**2).sum(axis=1) - (first * second).sum(axis=1) ** 2
    return np.sqrt(np.maximum(across, 0.0)) / speed**1.5


def checked(sequence: np.ndarray, where: str) -> np.ndarray:
    """Return a performance (F, b), after checking that it has at least three frames and finite values.

    Parameters
    ----------
    sequence : (F, b)
    where : str
        What an error calls the performance.

    Raises
    ------
    InvalidInput
        If it is not.
    """
    x = np.asarray(sequence, float)
    require_range(f"frames of {where}", len(require_shape(where, x, ("F", "b"))), at_least=3)
    wrong = ~np.isfinite(x).all(axis=1)
    if wrong.any():
        raise InvalidInput(
            "a posture has a number that is not finite", f"{where}, frame {wrong.argmax()}", code="not_finite"
        )
    return x
