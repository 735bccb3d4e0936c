"""Experiment 2: the view angle of every walker estimated from every view by the model that has not seen it."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core import camera, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.core.viewpoint import unknown_phase as observed_viewpoint
from pipeline.storage.store import Artefact
from pipeline.studies.options import UnknownViewSweep
from pipeline.studies.walks.phase_sources import PHASES, Observed2d, fold
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput


def measure(
    options: UnknownViewSweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The view angles that both approaches find, and the costs behind them."""
    if len(options.angle_range_deg) != 2:
        raise InvalidInput(
            "the range of candidates needs two ends",
            where="sweep.angle_range_deg",
            expected="[low, high]",
            received=str(options.angle_range_deg),
        )
    view_deg = options.view_angle_deg.values("sweep.view_angle_deg")
    view = np.radians(view_deg)
    low, high = np.radians(options.angle_range_deg)
    samples = model.arrays["samples"]
    names = ("angle_rad", "cost", "runner_up_cost", "converged", "n_iterations")
    observed2d = options.phase_source == "observed2d"
    if observed2d and options.solver != "global":
        raise InvalidInput(
            "only the global solver finds a phase",
            where="sweep.solver",
            expected="global with sweep.phase_source=observed2d",
            received=options.solver,
        )

    def from_2d(r: int) -> dict[str, np.ndarray]:
        seen = Observed2d(fold(model, r), ingest, dataset, r, view)
        estimates = [
            observed_viewpoint.estimate(
                seen.fold,
                seen.clip.image,
                noise_variance=options.noise_variance_mm2 if method == "map" else None,
                frequency_hz=seen.clip.frequency_hz,
                angle_range_rad=(float(low), float(high)),
            )
            for method in options.methods
        ]
        phases = [seen.found(e.phase_rad) for e in estimates]
        return {
            **{name: np.stack([getattr(e, name) for e in estimates]) for name in names},
            **{name: np.stack([phase[name] for phase in phases]) for name in PHASES},
            "frequency_hz": seen.clip.frequency_hz,
        }

    def one(r: int) -> dict[str, np.ndarray]:
        if observed2d:
            return from_2d(r)
        walker = unflatten(samples[r])
        across = camera.horizontal(walker, view[:, None, None])
        up = np.broadcast_to(camera.vertical(walker), across.shape)
        observed = np.stack([across, up], axis=-1).reshape(len(view), -1)
        trailing = samples.shape[1] - walker.size
        if trailing:
            observed = np.column_stack([observed, np.full(len(view), samples[r, -1])])
        estimates = [
            viewpoint.estimate(
                fold(model, r),
                observed,
                method=method,
                noise_variance=options.noise_variance_mm2 if method == "map" else None,
                solver=options.solver,
                angle_range_rad=(float(low), float(high)),
                start_rad=float(np.radians(options.start_deg)),
            )
            for method in options.methods
        ]
        return {name: np.stack([getattr(e, name) for e in estimates]) for name in names}

    folds = map_threads(one, range(len(samples)), workers)
    arrays = {
        name: np.stack([found[name] for found in folds], axis=1)
        for name in (*names, *(PHASES if observed2d else ()))
    }
    if observed2d:
        arrays["frequency_hz"] = np.stack([found["frequency_hz"] for found in folds])
    arrays["angle_deg"] = np.degrees(arrays.pop("angle_rad"))
    unconverged = int((~arrays["converged"]).sum())
    return {
        **arrays,
        "methods": np.array(options.methods),
        "view_angle_deg": view_deg,
    }, {"noise_variance_mm2": options.noise_variance_mm2, "not_converged": unconverged}
