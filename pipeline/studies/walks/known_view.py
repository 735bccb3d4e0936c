"""Experiment 1: every walker reconstructed from every known view by the model that has not seen it.

Folds, view angles and sigma² are axes of arrays here.  Folds are spread over threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core import errors, reconstruction
from pipeline.storage.store import Artefact
from pipeline.studies.options import KnownViewSweep
from pipeline.studies.walks.phase_sources import PHASES, Motion3d, Observed2d, fold
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput


def measure(
    options: KnownViewSweep, ingest: Artefact, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What approach I and II reconstruct from every view, and how far it is off."""
    reconstruction.check_noise_variance(options.noise_variance_mm2)
    if options.truth not in ("motion", "fourier"):
        raise InvalidInput(
            "the truth is unknown", where="sweep.truth", expected="motion or fourier", received=options.truth
        )
    view_deg = options.view_angle_deg.values("sweep.view_angle_deg")
    view = np.radians(view_deg)
    sigma2 = options.sigma2_mm2.values("sweep.sigma2_mm2")
    if not options.demonstration_views_deg:
        raise InvalidInput(
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

    folds = map_threads(one, range(len(samples)), workers)

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
