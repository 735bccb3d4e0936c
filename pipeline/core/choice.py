"""Choice of a minimum, of evenly spaced indices and of a typical sample, independent of rounding errors.

The last digits of a sum depend on the processor.  Where two candidates tie, the lower of the two computed values may
therefore be either; the rule here takes the first candidate that is not worse by more than a stated relative margin.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

MARGIN = 1e-10
"""Relative difference below which two costs count as equal; it is well above the rounding error of long sums."""


def first_lowest(values: np.ndarray, *, axis: int = -1, margin: float = MARGIN) -> np.ndarray:
    """Return the index of the first value along an axis that equals the minimum within a relative margin.

    Parameters
    ----------
    values : (…, C)
        Infinities are allowed.
    axis : int
    margin : float

    Examples
    --------
    >>> int(first_lowest(np.array([2.0, 1.0 + 1e-13, 1.0])))
    1
    """
    lowest = values.min(axis=axis, keepdims=True)
    return (values <= lowest + margin * np.abs(lowest)).argmax(axis=axis)


def evenly(wanted: int, count: int) -> np.ndarray:
    """Return `wanted` evenly spaced indices out of `count`; all indices if `wanted` is 0 or at least `count`."""
    if not 0 < wanted < count:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, wanted)).astype(int))


def nearest_to_medians(errors_of: Mapping[str, np.ndarray]) -> int:
    """Return the index of the sample whose errors are nearest to the median error of each method.

    The distance is the sum of the absolute logarithms of the ratios of error and median.

    Examples
    --------
    >>> nearest_to_medians({"map": np.array([1.0, 2.0, 9.0]), "least_squares": np.array([8.0, 5.0, 4.0])})
    1
    """
    off = sum(np.abs(np.log(error / np.median(error))) for error in errors_of.values())
    return int(np.argmin(off))
