"""Confidence intervals of a mean, or of a difference between methods, from resampled people."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from pipeline.core import bootstrap
from pipeline.seeding import derive_generator


class PeopleResampled:
    """Bootstrap samples of P people, which all quantities share, so that differences between methods are paired.

    Results are columns: the name, and with ``_low`` and ``_high`` the ends of its 95 % interval.

    Parameters
    ----------
    people, seed : int
        Number of people, and seed of the resamples.
    """

    def __init__(self, people: int, seed: int) -> None:
        self._weights = bootstrap.resampling_weights(people, derive_generator(seed, "people")) / people

    def mean(self, values: np.ndarray | pd.Series, name: str) -> dict[str, float]:
        """Return the mean over people of one value per person (P,), with its 95 % interval."""
        return _columns(name, np.mean(values), self._weights @ np.asarray(values))

    def reduction_percent(self, of: np.ndarray, than: np.ndarray, name: str) -> dict[str, float]:
        """Return the reduction, %, of a method's mean error relative to another method's, with its 95 % interval.

        Each method has one value per person, (P,).
        """
        resampled = 100.0 * (1.0 - (self._weights @ of) / (self._weights @ than))
        return _columns(name, 100.0 * (1.0 - of.mean() / than.mean()), resampled)

    def means(
        self, rows: pd.DataFrame, by: Sequence[str], banded: str, further: Sequence[str] = ()
    ) -> pd.DataFrame:
        """Return a table with means for each group of rows, and with the 95 % interval of one of the means.

        `rows` has one row for each person and group.
        """
        return pd.DataFrame(
            {
                **dict(zip(by, keys, strict=True)),
                **self.mean(group[banded], banded),
                **{name: group[name].mean() for name in further},
            }
            for keys, group in rows.groupby(list(by))
        )


def _columns(name: str, value: float, resampled: np.ndarray) -> dict[str, float]:
    low, high = bootstrap.percentile_interval(resampled)
    return {name: value, f"{name}_low": float(low), f"{name}_high": float(high)}
