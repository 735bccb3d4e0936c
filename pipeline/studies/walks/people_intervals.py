"""Intervals by resampling people: how far a mean, or a difference between methods, depends on who was recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import bootstrap


@dataclass(frozen=True)
class Interval:
    """A value with the ends of its interval, each (…,)."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def columns(self, name: str) -> dict[str, np.ndarray]:
        """The columns ``name``, ``name_low`` and ``name_high``, flat."""
        return {
            name: np.ravel(self.value),
            f"{name}_low": np.ravel(self.low),
            f"{name}_high": np.ravel(self.high),
        }


class PeopleResampled:
    """Resamples of P people, the same for every quantity, so that differences are paired.

    Parameters
    ----------
    people : int
    rng : Generator
    """

    def __init__(self, people: int, rng: np.random.Generator) -> None:
        self._weights = bootstrap.resampling_weights(people, rng) / people

    def mean(self, values: np.ndarray) -> Interval:
        """Mean over people of values (P, …)."""
        return self._interval(values.mean(axis=0), self._resampled(values))

    def reduction_percent(self, of: np.ndarray, than: np.ndarray) -> Interval:
        """By how many per cent the mean of one method (P, …) is below that of another."""
        value = 100.0 * (1.0 - of.mean(axis=0) / than.mean(axis=0))
        return self._interval(value, 100.0 * (1.0 - self._resampled(of) / self._resampled(than)))

    def _resampled(self, values: np.ndarray) -> np.ndarray:
        return np.tensordot(self._weights, values, axes=1)

    @staticmethod
    def _interval(value: np.ndarray, resampled: np.ndarray) -> Interval:
        return Interval(np.asarray(value), *bootstrap.percentile_interval(resampled))
