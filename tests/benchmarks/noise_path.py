"""Time to compute the errors of approach II for 625 values of sigma² at 181 views of every walker."""

from __future__ import annotations

import numpy as np

from pipeline.core import linear_model, reconstruction
from tests.benchmarks import naive
from tests.benchmarks.inputs import COMPONENTS, VIEWS_RAD, samples
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import in_turns, relative_difference

SIGMA2_MM2 = np.arange(1.0, 626.0)
FEW_FOLDS, EVERY_VIEW, EVERY_SIGMA2 = 2, 20, 13
"""Part of the problem that the plain implementation computes: two walkers, every 20th view, every 13th sigma²."""


def run() -> list[Row]:
    """Compare the errors with a plain implementation on a part of the problem, and return one row with the times."""
    rows = samples()
    few_views, few_sigma2 = VIEWS_RAD[::EVERY_VIEW], SIGMA2_MM2[::EVERY_SIGMA2]

    models = [model for model, _ in linear_model.leave_one_out(rows, COMPONENTS)]
    peers = list(naive.leave_one_out(rows, COMPONENTS, range(FEW_FOLDS)))

    def ours(folds: int = len(rows)) -> np.ndarray:
        return np.array(
            [
                reconstruction.NoisePath(model, VIEWS_RAD, SIGMA2_MM2).error(walker)
                for model, walker in zip(models[:folds], rows[:folds], strict=True)
            ]
        )

    def theirs() -> np.ndarray:
        return np.array(
            [
                [[naive.error(model, walker, angle, s) for s in few_sigma2] for angle in few_views]
                for model, walker in zip(peers, rows[:FEW_FOLDS], strict=True)
            ]
        )

    whole = len(rows) * len(VIEWS_RAD) * len(SIGMA2_MM2)
    share = FEW_FOLDS * len(few_views) * len(few_sigma2)
    answer = ours(FEW_FOLDS)[:, ::EVERY_VIEW, ::EVERY_SIGMA2]
    return [
        in_turns(
            f"{len(rows)} folds × {len(VIEWS_RAD)} views × {len(SIGMA2_MM2)} sigma²",
            "plain loop",
            ours,
            theirs,
            rounds=3,
            scaled=whole / share,
            agreement=relative_difference(answer, theirs(), at_most=1e-8),
            note=f"peer: {share} of {whole} fits, time × {whole / share:.0f}",
        )
    ]
