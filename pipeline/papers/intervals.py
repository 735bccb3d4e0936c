"""Intervals of numbers: bounds of claims, and confidence intervals of estimates."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """Interval of numbers, in which each end is included unless it is declared open.

    Examples
    --------
    >>> 94.0 in Interval(88.9, 94.9), 95.0 in Interval(88.9, 94.9), 1.0 in Interval(1.0, math.inf, low_open=True)
    (True, False, False)
    >>> print(Interval(88.9, 94.9), "|", Interval(high=2.0), "|", Interval(80.0, 80.0))
    88.9 to 94.9 | at most 2 | exactly 80
    """

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: float) -> bool:
        over = value > self.low if self.low_open else value >= self.low
        under = value < self.high if self.high_open else value <= self.high
        return over and under

    def covers(self, other: Estimate) -> bool:
        """Return True if the whole confidence interval of an estimate lies within this interval."""
        return other.low in self and other.high in self

    def meets(self, other: Estimate) -> bool:
        """Return True if the confidence interval of an estimate overlaps this interval."""
        below = other.high < self.low or (self.low_open and other.high == self.low)
        above = other.low > self.high or (self.high_open and other.low == self.high)
        return not (below or above)

    def side(self, value: float) -> int:
        """Return 1 if this interval lies above a value, -1 if it lies below, and 0 if it contains the value."""
        return int(value <= self.low) - int(value >= self.high)

    def __str__(self) -> str:
        if self.low == self.high:
            return f"exactly {self.low:g}"
        if math.isfinite(self.low) and math.isfinite(self.high) and not (self.low_open or self.high_open):
            return f"{self.low:g} to {self.high:g}"
        ends = []
        if math.isfinite(self.low):
            ends.append(f"{'over' if self.low_open else 'at least'} {self.low:g}")
        if math.isfinite(self.high):
            ends.append(f"{'under' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(ends)


@dataclass(frozen=True)
class Estimate:
    """Estimated value with its confidence interval over people or over synthetic populations.

    Attributes
    ----------
    value : float
    low, high : float
        Ends of the 95 % interval; NaN without an interval.

    Examples
    --------
    >>> print(Estimate(30.0, 22.0, 35.0), "|", Estimate(0.5))
    30 [22, 35] | 0.5
    """

    value: float
    low: float = math.nan
    high: float = math.nan

    @property
    def known(self) -> bool:
        """True if the value has a confidence interval."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def __str__(self) -> str:
        return f"{self.value:.4g}" + (f" [{self.low:.4g}, {self.high:.4g}]" if self.known else "")
