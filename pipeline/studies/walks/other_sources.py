"""Walkers reconstructed by a model that has seen people of other sources only: children from adults, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from pipeline.core import errors, linear_model
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import Method, Null
from pipeline.studies.walks.seen_walker import Reconstruction, SeenWalker

LEAST_WALKERS = 3
"""Walkers of other sources that a model needs at least."""


def other_source_errors(
    data: FourierSamples,
    options: EigenwalkersModel,
    methods: Sequence[Method],
    noise_variance_mm2: float,
    view_angles_rad: np.ndarray,
    third: AnatomicalApproach | None,
    workers: int,
) -> pd.DataFrame:
    """Return rows of each walker, method and the average walker: errors, mean over views; no rows for one source.

    The truth is the motion, whatever the sweep's options.
    """
    samples, how = options.training(data)
    sources = np.unique(data.source)
    others = {source: data.source != source for source in sources}
    if len(sources) < 2 or any(kept.sum() < LEAST_WALKERS for kept in others.values()):
        return pd.DataFrame()
    mirrors = how.pop("mirrors")
    models = {
        source: linear_model.fit(
            samples[kept] if mirrors is None else np.concatenate([samples[kept], mirrors[kept]]),
            options.components,
            **how,
        )
        for source, kept in others.items()
    }

    def one(r: int) -> dict[str, float]:
        model = models[data.source[r]]
        views = SeenWalker(model, samples[r], data, r, view_angles_rad)
        found: dict[Method | Null, Reconstruction] = {
            method: third.reconstruct(r, view_angles_rad, model, without_source=True)
            if method is Method.anatomical and third
            else views.reconstruct(method.noise_variance(noise_variance_mm2))
            for method in methods
        }
        found[Null.average_walker] = views.average_walker()
        return {
            str(method): float(
                errors.walker_error(errors.absolute_error(each.delta, views.residual_power)).mean()
            )
            for method, each in found.items()
        }

    walkers = map_processes(one, range(len(samples)), workers)
    return pd.DataFrame(
        {"person": who, "source": source, "method": method, "absolute_error_mm2": error}
        for who, source, errors_of in zip(data.person, data.source, walkers, strict=True)
        for method, error in errors_of.items()
    )
