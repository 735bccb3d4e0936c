"""Time to train 80 linear models in 225 dimensions, each without one walker, compared with one full SVD per model."""

from __future__ import annotations

from functools import partial

import numpy as np

from pipeline.core import linear_model
from tests.benchmarks import naive
from tests.benchmarks.inputs import COMPONENTS, samples
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import in_turns, relative_difference


def _numpy_svd(rows: np.ndarray) -> list[np.ndarray]:
    """Return the eigenvalues of every leave-one-out model, computed by numpy."""
    result = []
    for r in range(len(rows)):
        training = np.delete(rows, r, axis=0)
        singular = np.linalg.svd(training - training.mean(axis=0), full_matrices=False)[1]
        result.append(singular[:COMPONENTS] ** 2 / (len(training) - 1))
    return result


def run() -> list[Row]:
    """Compare the eigenvalues, and return rows with the times of scikit-learn and numpy relative to ours."""
    rows = samples()

    def ours() -> list[np.ndarray]:
        return [model.eigenvalues for model, _ in linear_model.leave_one_out(rows, COMPONENTS)]

    def scikit_learn() -> list[np.ndarray]:
        return [model.eigenvalues for model in naive.leave_one_out(rows, COMPONENTS, range(len(rows)))]

    compare = partial(relative_difference, np.array(ours()), at_most=1e-10)
    job = f"leave-one-out, {rows.shape[0]} × {rows.shape[1]}"
    return [
        in_turns(
            job,
            'scikit-learn PCA(svd_solver="full")',
            ours,
            scikit_learn,
            rounds=7,
            agreement=compare(np.array(scikit_learn())),
            note="every fold",
        ),
        in_turns(
            job,
            "numpy svd",
            ours,
            partial(_numpy_svd, rows),
            rounds=7,
            agreement=compare(np.array(_numpy_svd(rows))),
            note="every fold; no checks, no signs",
        ),
    ]
