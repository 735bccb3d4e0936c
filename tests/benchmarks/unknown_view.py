"""Time to estimate view angle and coefficients by global search, compared with SciPy's trust-region method."""

from __future__ import annotations

import numpy as np

from pipeline.core import camera, linear_model, viewpoint
from tests.benchmarks import naive
from tests.benchmarks.inputs import COMPONENTS, VIEWS_RAD, samples
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import in_turns

FEW_FOLDS, EVERY_VIEW = 2, 12
SAME_RAD = 1e-4
"""Difference of view angles, radians, below which two estimates count as the same minimum."""


def run() -> list[Row]:
    """Return one row; its note gives how often SciPy, with one initial value, found the same minimum."""
    rows = samples()
    few_views = VIEWS_RAD[::EVERY_VIEW]

    def seen(walker: np.ndarray) -> np.ndarray:
        shaped = linear_model.unflatten(walker)
        return np.stack([camera.project(shaped, angle).reshape(-1) for angle in VIEWS_RAD])

    models = [model for model, _ in linear_model.leave_one_out(rows, COMPONENTS)]
    peers = list(naive.leave_one_out(rows, COMPONENTS, range(FEW_FOLDS)))

    def ours(folds: int = len(rows)) -> list[viewpoint.ViewEstimate]:
        return [
            viewpoint.estimate(model, seen(walker), method="least_squares")
            for model, walker in zip(models[:folds], rows[:folds], strict=True)
        ]

    def theirs() -> np.ndarray:
        """Return SciPy's view angle and cost, (folds, views, 2)."""
        fits = [
            [naive.view_angle(model, walker, angle) for angle in few_views]
            for model, walker in zip(peers, rows[:FEW_FOLDS], strict=True)
        ]
        return np.array([[(fit.x[0], 2.0 * fit.cost) for fit in fold] for fold in fits])

    result = ours(FEW_FOLDS)
    angle = np.array([estimate.angle_rad[::EVERY_VIEW] for estimate in result])
    cost = np.array([estimate.cost[::EVERY_VIEW] for estimate in result])
    peer = theirs()
    differences = np.abs((angle - peer[..., 0] + np.pi) % (2 * np.pi) - np.pi)
    same = differences < SAME_RAD
    if (cost > peer[..., 1] * (1.0 + 1e-6)).any() or not same.any():
        raise SystemExit("SciPy found a lower minimum than the global search, or never the same minimum")
    whole = len(rows) * len(VIEWS_RAD)
    outcome = f"same minimum in {same.sum()}" + ("" if same.all() else f", a worse one in {(~same).sum()}")
    return [
        in_turns(
            f"{len(rows)} folds × {len(VIEWS_RAD)} views, least squares",
            "scipy least_squares",
            ours,
            theirs,
            rounds=3,
            scaled=whole / same.size,
            agreement=float(differences[same].max()),
            note=f"peer: {same.size} of {whole} views, time × {whole / same.size:.0f}; {outcome}",
        )
    ]
