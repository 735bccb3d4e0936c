"""Model: the linear model of the whole population, and one without each walker."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.config import EigenwalkerModel, Model
from pipeline.core import fourier, linear_model
from pipeline.refusal import Refusal
from pipeline.store import Artefact, Store
from pipeline.threads import spread


def run(options: Model, dataset: Artefact, frequency: bool, workers: int, store: Store) -> Artefact:
    """Artefact with the models.

    Arrays: ``samples`` (R, D); ``mean`` (D,), ``components`` (K, D), ``eigenvalues`` (K,) of the whole
    population with every component it has; ``fold_mean`` (R, D), ``fold_components`` (R, N, D),
    ``fold_eigenvalues`` (R, N), ``fold_total_variance``, ``fold_last_scale`` (R,) of the models without each
    walker.
    """
    match options:
        case EigenwalkerModel():
            made_from = {"model": options, "frequency": frequency}
            return store.artefact(
                "model", made_from, [dataset], lambda: _eigenwalkers(options, dataset, frequency, workers)
            )
        case _:
            raise TypeError(f"no model for {type(options).__name__}")


def _eigenwalkers(
    options: EigenwalkerModel, dataset: Artefact, frequency: bool, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    coefficients = dataset.arrays["coefficients"]
    rate = dataset.arrays["frequency_hz"] if frequency else None
    samples = linear_model.flatten(coefficients, rate)
    mirrors = linear_model.flatten(fourier.mirrored(coefficients), rate) if options.mirror else None
    people = dataset.arrays["person"]
    if len(np.unique(people)) < 3:
        raise Refusal(
            "leave-one-out needs at least three walkers",
            expected="3 or more",
            received=str(len(np.unique(people))),
        )
    scale_last = options.omega_scale_mm if frequency else 1.0
    if scale_last is not None and scale_last <= 0:
        raise Refusal(
            "the scale of the frequency is not positive",
            where="model.omega_scale_mm",
            expected="mm per hertz > 0, or null",
            received=f"{scale_last:g}",
        )
    common: dict[str, Any] = {"divisor": options.divisor, "scale_last": scale_last}
    population = samples if mirrors is None else np.concatenate([samples, mirrors])
    whole = linear_model.fit(population, len(population), **common)
    folds = spread(
        lambda fold: fold[0],
        linear_model.leave_one_out(samples, options.components, groups=people, mirrors=mirrors, **common),
        workers,
    )
    kept = min(len(fold.eigenvalues) for fold in folds)
    return {
        "samples": samples,
        "mean": whole.mean,
        "components": whole.components,
        "eigenvalues": whole.eigenvalues,
        "fold_mean": np.stack([f.mean for f in folds]),
        "fold_components": np.stack([f.components[:kept] for f in folds]),
        "fold_eigenvalues": np.stack([f.eigenvalues[:kept] for f in folds]),
        "fold_total_variance": np.array([f.total_variance for f in folds]),
        "fold_last_scale": np.array([f.last_scale for f in folds]),
    }, {
        "components_asked": options.components,
        "components": kept,
        "total_variance": whole.total_variance,
        "last_scale": whole.last_scale,
    }
