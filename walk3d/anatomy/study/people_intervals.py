"""Intervals by resampling people: how far a mean, or a difference between methods, depends on who was recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from pipeline.core import bootstrap
from pipeline.seeding import derive_generator


class PeopleResampled:
    """Resamples of P people, the same for every quantity, so that differences are paired.

    Numbers are returned as columns: the name, and with ``_low`` and ``_high`` the ends of its 95 % interval.

    Parameters
    ----------
    people, seed : int
    """

    def __init__(self, people: int, seed: int) -> None:
        self._weights = bootstrap.resampling_weights(people, derive_generator(seed, "people")) / people

    def mean(self, values: np.ndarray | pd.Series, name: str) -> dict[str, float]:
        """Mean over people of values (P,)."""
        return _columns(name, np.mean(values), self._weights @ np.asarray(values))

    def reduction_percent(self, of: np.ndarray, than: np.ndarray, name: str) -> dict[str, float]:
        """By how many per cent the mean of one method (P,) is below that of another."""
        resampled = 100.0 * (1.0 - (self._weights @ of) / (self._weights @ than))
        return _columns(name, 100.0 * (1.0 - of.mean() / than.mean()), resampled)

    def means(
        self, rows: pd.DataFrame, by: Sequence[str], banded: str, further: Sequence[str] = ()
    ) -> pd.DataFrame:
        """Mean of a column with its interval, and means of further ones, of rows with one to each person and group."""
        return pd.DataFrame(
            {
                **dict(zip(by, keys, strict=True)),
                **self.mean(of[banded], banded),
                **{name: of[name].mean() for name in further},
            }
            for keys, of in rows.groupby(list(by))
        )


def _columns(name: str, value: float, resampled: np.ndarray) -> dict[str, float]:
    low, high = bootstrap.percentile_interval(resampled)
    return {name: value, f"{name}_low": float(low), f"{name}_high": float(high)}
