"""Choices that do not depend on rounding: among nearly equal values, of evenly spaced indices, of a typical sample.

The last digits of a sum depend on the processor.  Where two candidates tie, the lower of the two computed values may
therefore be either; the rule here takes the first candidate that is not worse by more than a stated relative margin.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

MARGIN = 1e-10
"""Relative difference below which two costs count as equal, well above the rounding of long sums."""


def first_lowest(values: np.ndarray, *, axis: int = -1, margin: float = MARGIN) -> np.ndarray:
    """Index along an axis of the first value that is as low as the lowest, up to a relative margin.

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
    """Return `wanted` of `count` indices, evenly over all; all if none or more are wanted."""
    if not 0 < wanted < count:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, wanted)).astype(int))


def nearest_to_medians(errors_of: Mapping[str, np.ndarray]) -> int:
    """Return the number of the most typical sample: its errors (R,) are nearest to each method's median, by the ratio.

    Examples
    --------
    >>> nearest_to_medians({"map": np.array([1.0, 2.0, 9.0]), "least_squares": np.array([8.0, 5.0, 4.0])})
    1
    """
    off = sum(np.abs(np.log(error / np.median(error))) for error in errors_of.values())
    return int(np.argmin(off))
