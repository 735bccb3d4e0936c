"""Squared distances between the postures of all pairs of performances.

They give the variance between performances for any resample of people.

The variance between performances (divisor M - 1) is half the mean squared distance over pairs, so a replicate that
counts people differently needs no sequences, only these distances.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from pipeline.studies.actions.figures.alignments import Inputs
from pipeline.studies.actions.model import ALIGNMENTS
from pipeline.studies.actions.without_mistiming import WithoutMistiming
from pipeline.studies.figure_inputs import tidy

BASELINES = ("linear", "keyframe", "synchronized")


def squared_distances(performances: Sequence[np.ndarray]) -> np.ndarray:
    """Return the mean squared distance (M, M) of performances (F_i, b), up to the end of the shorter performance."""
    lengths = np.array([len(x) for x in performances])
    if (lengths == lengths[0]).all():
        flat = np.stack(performances).reshape(len(performances), -1)
        return np.stack([((flat - x) ** 2).sum(axis=1) for x in flat]) / lengths[0]
    result = np.zeros((len(performances), len(performances)))
    for n, first in enumerate(performances):
        for m, second in enumerate(performances[:n]):
            both = min(len(first), len(second))
            result[n, m] = result[m, n] = ((first[:both] - second[:both]) ** 2).sum() / both
    return result


def pairs_table(inputs: Inputs, baseline: WithoutMistiming, components: slice = slice(None)) -> pd.DataFrame:
    """Return ``table_pairs``: squared distances between pairs of performances in each alignment, with baselines."""
    sequences = {alignment: inputs.model.sequences(alignment) for alignment in ALIGNMENTS}
    sequences |= {f"baseline_{name}": list(getattr(baseline, name)) for name in BASELINES}
    person, names = inputs.dataset.person, np.array(inputs.samples)
    n, m = np.nonzero(~np.eye(len(names), dtype=bool))
    columns = {"performance": names[n], "person": person[n], "other": names[m], "other_person": person[m]}
    for name, each in sequences.items():
        columns[name] = squared_distances([x[:, components] for x in each])[n, m]
    return tidy(columns, by=["performance", "other"])
