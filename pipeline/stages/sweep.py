"""Sweep: every walker reconstructed from every view by the model that has not seen it.

Folds, view angles and sigma² are axes of arrays here.  Folds are spread over threads.

Phase and frequency come from the 3D motion, as in the papers, or from each view alone (`phase_source`).  With
the latter, truth and error are those of the clip in its own phase and at the frequency of the view.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.config import KnownViewSweep, NoSweep, Sweep, UnknownViewSweep
from pipeline.core import camera, errors, observed_viewpoint, reconstruction, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.phase_sources import PHASES, Motion3d, Observed2d, fold
from pipeline.refusal import Refusal
from pipeline.store import Artefact, Store
from pipeline.threads import spread

METHODS = ("least_squares", "map")
PHASE_SOURCES = ("motion3d", "observed2d")


def run(
    options: Sweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int, store: Store
) -> Artefact:
    """Artefact with what the experiment measured.

    Known view: ``absolute_error_mm2``, ``relative_error`` (M, R, A, 15); ``missing_variance_mm2`` (R, A);
    ``path_walker_mm2`` (R, S) mean over views and ``path_view_mm2`` (A, S) mean over walkers, MAP error for
    every sigma²; ``missing`` (M, R, V, 5, 15) and ``demonstration_error_mm2`` (M, R, V, 15) the
    reconstructions at the demonstration views.
    Unknown view: ``angle_deg``, ``cost``, ``runner_up_cost``, ``converged`` (M, R, A).
    With `phase_source: observed2d` also ``frequency_hz`` (R, A) as each view gives it, ``phase_rad`` (M, R, A)
    as the fit finds it for the first frame, and ``phase_error_rad`` (M, R, A), how far that is from the 3D
    motion's; ``missing`` is then turned to phase zero by the latter, to be seen beside the original.
    """
    match options:
        case NoSweep():
            return store.artefact("sweep", options, [], lambda: ({}, {}))
        case KnownViewSweep():
            inputs = [dataset, model, *_clips(options, ingest)]
            return store.artefact(
                "sweep", options, inputs, lambda: _known(options, ingest, dataset, model, workers)
            )
        case UnknownViewSweep():
            inputs = [dataset, model, *_clips(options, ingest)]
            return store.artefact(
                "sweep", options, inputs, lambda: _unknown(options, ingest, dataset, model, workers)
            )
        case _:
            raise TypeError(f"no sweep for {type(options).__name__}")


def _clips(options: KnownViewSweep | UnknownViewSweep, ingest: Artefact) -> list[Artefact]:
    """The clips, where they are needed; a Refusal if the methods or the source of phase are unknown."""
    _check_methods(options.methods)
    if options.phase_source not in PHASE_SOURCES:
        raise Refusal(
            "the source of the phase is unknown",
            where="sweep.phase_source",
            expected=" or ".join(PHASE_SOURCES),
            received=options.phase_source,
        )
    return [ingest] if options.phase_source == "observed2d" else []


def _check_methods(methods: list[str]) -> None:
    if not methods or len(set(methods)) < len(methods) or not set(methods) <= set(METHODS):
        raise Refusal(
            "the methods are unknown or stand twice",
            where="sweep.methods",
            expected=" or ".join(METHODS) + ", or both",
            received=", ".join(methods) or "none",
        )


def _known(
    options: KnownViewSweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    reconstruction.check_noise_variance(options.noise_variance_mm2)
    if options.truth not in ("motion", "fourier"):
        raise Refusal(
            "the truth is unknown", where="sweep.truth", expected="motion or fourier", received=options.truth
        )
    view_deg = options.view_angle_deg.values("sweep.view_angle_deg")
    view = np.radians(view_deg)
    sigma2 = options.sigma2_mm2.values("sweep.sigma2_mm2")
    if not options.demonstration_views_deg:
        raise Refusal(
            "no view to demonstrate",
            where="sweep.demonstration_views_deg",
            expected="one or more, e.g. [0,30,90]",
            received="none",
        )
    shown = np.radians(options.demonstration_views_deg)
    samples, data = model.arrays["samples"], dataset.arrays
    of_motion = options.truth == "motion"
    observed = options.phase_source == "observed2d"

    def source(r: int, angles: np.ndarray) -> Motion3d | Observed2d:
        if observed:
            return Observed2d(fold(model, r), ingest, dataset, r, angles)
        return Motion3d(fold(model, r), samples[r], data["residual_covariance"][r], angles)

    def one(r: int) -> dict[str, np.ndarray]:
        everywhere, demonstration = source(r, view), source(r, shown)
        variance = everywhere.missing_variance(
            data["temporal_covariance"][r], data["coefficients"][r, 0], options.missing_variance, of_motion
        )
        power, shown_power = (s.residual_power * of_motion for s in (everywhere, demonstration))
        absolute, demonstrated, missing, extras = [], [], [], []
        for method in options.methods:
            noise = options.noise_variance_mm2 if method == "map" else None
            delta, _, extra = everywhere.reconstruct(noise)
            absolute.append(errors.absolute_error(delta, power))
            extras.append(extra)
            delta, seen, _ = demonstration.reconstruct(noise)
            demonstrated.append(errors.absolute_error(delta, shown_power))
            missing.append(seen)
        found = {
            "absolute_error_mm2": np.stack(absolute),
            "demonstration_error_mm2": np.stack(demonstrated),
            "missing": np.stack(missing),
            "missing_variance_mm2": variance,
            **{name: np.stack([extra[name] for extra in extras]) for name in extras[0]},
        }
        if isinstance(everywhere, Observed2d):
            found["frequency_hz"] = everywhere.clip.frequency_hz
        if "map" in options.methods:
            path = everywhere.error_path(sigma2)
            found["path"] = path + errors.walker_error(power)[:, None]
        return found

    folds = spread(one, range(len(samples)), workers)

    def stack(name: str, axis: int = 0) -> np.ndarray:
        return np.stack([found[name] for found in folds], axis=axis)

    absolute = stack("absolute_error_mm2", axis=1)
    variance = stack("missing_variance_mm2")
    arrays: dict[str, Any] = {
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
    if observed:
        arrays |= {name: stack(name, axis=1) for name in PHASES}
        arrays["frequency_hz"] = stack("frequency_hz")
    if "map" in options.methods:
        arrays["path_walker_mm2"] = np.stack([found["path"].mean(axis=0) for found in folds])
        arrays["path_view_mm2"] = sum(found["path"] for found in folds) / len(folds)
    return arrays, {"noise_variance_mm2": options.noise_variance_mm2}


def _unknown(
    options: UnknownViewSweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int
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
    observed2d = options.phase_source == "observed2d"
    if observed2d and options.solver != "global":
        raise Refusal(
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

    folds = spread(one, range(len(samples)), workers)
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
