"""Walkers reconstructed by a model that has seen people of other sources only: children from adults, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core import errors, linear_model
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import Method
from pipeline.studies.walks.seen_walker import SeenWalker

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
) -> np.ndarray | None:
    """Return errors (M + 1, R) in mm², mean over views, of each method and of the average walker; None for one source.

    The truth is the motion, whatever the sweep's options.
    """
    samples, how = options.training(data)
    sources = np.unique(data.source)
    others = {source: data.source != source for source in sources}
    if len(sources) < 2 or any(kept.sum() < LEAST_WALKERS for kept in others.values()):
        return None
    mirrors = how.pop("mirrors")
    models = {
        source: linear_model.fit(
            samples[kept] if mirrors is None else np.concatenate([samples[kept], mirrors[kept]]),
            options.components,
            **how,
        )
        for source, kept in others.items()
    }

    def one(r: int) -> list[float]:
        model = models[data.source[r]]
        views = SeenWalker(model, samples[r], data, r, view_angles_rad)
        found = [
            third.reconstruct(r, view_angles_rad, model, without_source=True)
            if method is Method.anatomical and third
            else views.reconstruct(method.noise_variance(noise_variance_mm2))
            for method in methods
        ]
        return [
            float(errors.walker_error(errors.absolute_error(each.delta, views.residual_power)).mean())
            for each in (*found, views.average_walker())
        ]

    return np.array(map_processes(one, range(len(samples)), workers)).T
