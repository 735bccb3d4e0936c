"""Rows that are measured in parts, as one table: a DataFrame for each part would take longer than what is measured."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd


def stacked(parts: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return the rows of several parts, below each other; in each a column is an array, or one value for all rows.

    Examples
    --------
    >>> stacked([{"walker": "a", "view": [0, 90]}, {"walker": "b", "view": 45}])
      walker  view
    0      a     0
    1      a    90
    2      b    45
    """
    columns: dict[str, list[np.ndarray]] = defaultdict(list)
    for part in parts:
        # Texts as objects: a column of them then holds each once.
        whole = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(c, object) if isinstance(c, str) else c) for c in part.values())
        )
        for name, column in zip(part, whole, strict=True):
            columns[name].append(column)
    return pd.DataFrame({name: np.concatenate(column) for name, column in columns.items()})
