"""Sweep: every walker reconstructed from every view by the model that has not seen it.

Folds, view angles and sigma² are axes of arrays here.  Folds are spread over threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.config import KnownViewSweep, NoSweep, Sweep, UnknownViewSweep
from pipeline.core import camera, errors, reconstruction, viewpoint
from pipeline.core.linear_model import LinearModel, unflatten
from pipeline.refusal import Refusal
from pipeline.store import Artefact, Store
from pipeline.threads import spread

METHODS = ("least_squares", "map")


def run(options: Sweep, dataset: Artefact, model: Artefact, workers: int, store: Store) -> Artefact:
    """Artefact with what the experiment measured.

    Known view: ``absolute_error_mm2``, ``relative_error`` (M, R, A, 15); ``missing_variance_mm2`` (R, A);
    ``path_walker_mm2`` (R, S) mean over views and ``path_view_mm2`` (A, S) mean over walkers, MAP error for
    every sigma²; ``missing`` (M, R, V, 5, 15) and ``demonstration_error_mm2`` (M, R, V, 15) the
    reconstructions at the demonstration views.
    Unknown view: ``angle_deg``, ``cost``, ``runner_up_cost``, ``converged`` (M, R, A).
    """
    match options:
        case NoSweep():
            return store.artefact("sweep", options, [], lambda: ({}, {}))
        case KnownViewSweep():
            _check_methods(options.methods)
            return store.artefact(
                "sweep", options, [dataset, model], lambda: _known(options, dataset, model, workers)
            )
        case UnknownViewSweep():
            _check_methods(options.methods)
            return store.artefact(
                "sweep", options, [dataset, model], lambda: _unknown(options, dataset, model, workers)
            )
        case _:
            raise TypeError(f"no sweep for {type(options).__name__}")


def _check_methods(methods: list[str]) -> None:
    unknown = [m for m in methods if m not in METHODS]
    if unknown or not methods:
        raise Refusal(
            "the method is unknown",
            where="sweep.methods",
            expected=" or ".join(METHODS),
            received=", ".join(unknown) or "none",
        )


def _fold(model: Artefact, r: int) -> LinearModel:
    arrays = model.arrays
    return LinearModel(
        mean=arrays["fold_mean"][r],
        components=arrays["fold_components"][r],
        eigenvalues=arrays["fold_eigenvalues"][r],
        total_variance=float(arrays["fold_total_variance"][r]),
        last_scale=float(arrays["fold_last_scale"][r]),
    )


def _known(
    options: KnownViewSweep, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    reconstruction.check_noise_variance(options.noise_variance_mm2)
    if options.truth not in ("motion", "fourier"):
        raise Refusal(
            "the truth is unknown", where="sweep.truth", expected="motion or fourier", received=options.truth
        )
    view_deg = options.view_angle_deg.values("sweep.view_angle_deg")
    view = np.radians(view_deg)
    sigma2 = options.sigma2_mm2.values("sweep.sigma2_mm2")
    shown = np.radians(options.demonstration_views_deg)
    samples, data = model.arrays["samples"], dataset.arrays
    of_motion = options.truth == "motion"

    def one(r: int) -> dict[str, np.ndarray]:
        fold = _fold(model, r)
        residual = data["residual_covariance"][r] if of_motion else np.zeros((15, 3, 3))
        power = errors.along_missing(residual, view)
        average = data["coefficients"][r, 0]
        covariance: np.ndarray = data["temporal_covariance"][r]
        if not of_motion:
            covariance = np.subtract(covariance, data["residual_covariance"][r])
        variance = errors.missing_variance(covariance, average, view, kind=options.missing_variance)
        shown_power = errors.along_missing(residual, shown)
        absolute, demonstrated, missing = [], [], []
        for method in options.methods:
            noise = options.noise_variance_mm2 if method == "map" else None
            views = reconstruction.from_known_views(fold, samples[r], view, noise_variance=noise)
            absolute.append(errors.absolute_error(views.delta, power))
            views = reconstruction.from_known_views(fold, samples[r], shown, noise_variance=noise)
            demonstrated.append(errors.absolute_error(views.delta, shown_power))
            missing.append(views.missing)
        found = {
            "absolute_error_mm2": np.stack(absolute),
            "demonstration_error_mm2": np.stack(demonstrated),
            "missing": np.stack(missing),
            "missing_variance_mm2": variance,
        }
        if "map" in options.methods:
            path = reconstruction.error_path(fold, samples[r], view, sigma2)
            found["path"] = path + errors.walker_error(power)[:, None]
        return found

    folds = spread(one, range(len(samples)), workers)

    def stack(name: str, axis: int = 0) -> np.ndarray:
        return np.stack([fold[name] for fold in folds], axis=axis)

    absolute = stack("absolute_error_mm2", axis=1)
    variance = stack("missing_variance_mm2")
    arrays = {
        "methods": np.array(options.methods),
        "view_angle_deg": view_deg,
        "sigma2_mm2": sigma2,
        "demonstration_view_deg": np.array(options.demonstration_views_deg),
        "demonstration_error_mm2": stack("demonstration_error_mm2", axis=1),
        "absolute_error_mm2": absolute,
        "relative_error": errors.relative_error(absolute, variance[None, :, :, None]),
        "missing_variance_mm2": variance,
        "missing": stack("missing", axis=1),
    }
    if "map" in options.methods:
        arrays["path_walker_mm2"] = np.stack([fold["path"].mean(axis=0) for fold in folds])
        arrays["path_view_mm2"] = sum(fold["path"] for fold in folds) / len(folds)
    return arrays, {"noise_variance_mm2": options.noise_variance_mm2}


def _unknown(
    options: UnknownViewSweep, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    if len(options.angle_range_deg) != 2:
        raise Refusal(
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

    def one(r: int) -> dict[str, np.ndarray]:
        walker = unflatten(samples[r])
        observed = np.stack([camera.project(walker, a).reshape(-1) for a in view])
        trailing = samples.shape[1] - walker.size
        if trailing:
            observed = np.column_stack([observed, np.full(len(view), samples[r, -1])])
        estimates = [
            viewpoint.estimate(
                _fold(model, r),
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

    folds = spread(one, range(len(samples)), workers)
    arrays = {name: np.stack([fold[name] for fold in folds], axis=1) for name in names}
    arrays["angle_deg"] = np.degrees(arrays.pop("angle_rad"))
    unconverged = int((~arrays["converged"]).sum())
    return {
        **arrays,
        "methods": np.array(options.methods),
        "view_angle_deg": view_deg,
    }, {"noise_variance_mm2": options.noise_variance_mm2, "not_converged": unconverged}
