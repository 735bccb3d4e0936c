"""Time to train 80 models and to reconstruct from 181 known views, by least squares and by MAP with one sigma²."""

from __future__ import annotations

from itertools import islice

import numpy as np

from pipeline.core import errors, linear_model, reconstruction
from tests.benchmarks import naive
from tests.benchmarks.inputs import COMPONENTS, NOISE_VARIANCE_MM2, VIEWS_RAD, samples
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import in_turns, relative_difference

FEW = 4
METHODS = (None, NOISE_VARIANCE_MM2)


def run() -> list[Row]:
    """Compare the errors of a few folds with a plain implementation, and return one row with the times."""
    rows = samples()

    def ours(folds: int = len(rows)) -> np.ndarray:
        return np.array(
            [
                [
                    errors.walker_error(
                        errors.absolute_error(
                            reconstruction.from_known_views(
                                model, rows[r], VIEWS_RAD, noise_variance=sigma2
                            ).delta
                        )
                    )
                    for sigma2 in METHODS
                ]
                for model, r in islice(linear_model.leave_one_out(rows, COMPONENTS), folds)
            ]
        )

    def theirs() -> np.ndarray:
        models = naive.leave_one_out(rows, COMPONENTS, range(FEW))
        return np.array(
            [
                [[naive.error(model, rows[r], angle, sigma2) for angle in VIEWS_RAD] for sigma2 in METHODS]
                for r, model in enumerate(models)
            ]
        )

    return [
        in_turns(
            f"{len(rows)} folds × {len(VIEWS_RAD)} views × 2 methods",
            "scikit-learn PCA + plain loop",
            ours,
            theirs,
            rounds=5,
            scaled=len(rows) / FEW,
            agreement=relative_difference(ours(FEW), theirs(), at_most=1e-8),
            note=f"peer: {FEW} folds, time × {len(rows) // FEW}",
        )
    ]
