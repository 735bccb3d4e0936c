"""Sweep: what is measured on every fold; the experiments themselves are in `pipeline.experiments`.

Phase and frequency of a walk come from the 3D motion, as in the papers, or from each view alone (`phase_source`).
With the latter, truth and error are those of the clip in its own phase and at the frequency of the view.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pipeline.storage.store import Artefact, Store
from pipeline.studies.actions import posture_samples, smoothness, synchronization_time, tracking
from pipeline.studies.options import (
    FaceOffSweep,
    KnownViewSweep,
    MissingDataSweep,
    MotionsSweep,
    NoSweep,
    PostureSamplesSweep,
    ProofSweep,
    RadiusScaleSweep,
    ReconstructibilitySweep,
    RootErrorSweep,
    SmoothnessSweep,
    Sweep,
    TimingSweep,
    TrackingSweep,
    TrajectoryBasisModel,
    UnknownViewSweep,
)
from pipeline.studies.walks import known_view, unknown_view
from pipeline.validation import InvalidInput

METHODS = ("least_squares", "map")
PHASE_SOURCES = ("motion3d", "observed2d")

Measured = tuple[dict[str, Any], dict[str, Any]]
"""Arrays and notes of an experiment."""


def run(
    options: Sweep,
    ingest: Artefact,
    dataset: Artefact,
    model: Artefact,
    workers: int,
    store: Store,
    *,
    seed: int,
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
    Posture samples, tracking, smoothness, timing: what `pipeline.experiments.posture_samples`, `tracking`,
    `smoothness` and `synchronization_time` say.  Limbs: what `reconstructibility`, `limb_errors`, `missing_data`,
    `proofs`, `motions` and `face_off` say.
    """

    def seeded(inputs: list[Artefact], measure: Callable[[], Measured]) -> Artefact:
        """What an experiment measured that draws random numbers: another seed is another artefact."""
        return store.artefact("sweep", {"sweep": options, "seed": seed}, inputs, measure)

    def limbs(measure: Callable[..., Measured]) -> Artefact:
        """What an experiment on limbs measured, with the basis that the model names."""
        basis = TrajectoryBasisModel(**model.notes["options"])
        return seeded([dataset, model], lambda: measure(options, dataset, basis, workers, seed))

    match options:
        case NoSweep():
            return store.artefact("sweep", options, [], lambda: ({}, {}))
        case KnownViewSweep():
            inputs = [dataset, model, *_clips(options, ingest)]
            return store.artefact(
                "sweep", options, inputs, lambda: known_view.measure(options, ingest, dataset, model, workers)
            )
        case UnknownViewSweep():
            inputs = [dataset, model, *_clips(options, ingest)]
            return store.artefact(
                "sweep",
                options,
                inputs,
                lambda: unknown_view.measure(options, ingest, dataset, model, workers),
            )
        case PostureSamplesSweep():
            return seeded(
                [dataset, model], lambda: posture_samples.measure(options, dataset, model, workers, seed)
            )
        case TrackingSweep():
            return seeded([dataset, model], lambda: tracking.measure(options, dataset, model, workers, seed))
        case SmoothnessSweep():
            return store.artefact(
                "sweep",
                options,
                [dataset, model],
                lambda: smoothness.measure(options, dataset, model, workers),
            )
        case TimingSweep():
            return store.artefact(
                "sweep", options, [dataset, model], lambda: synchronization_time.measure(options, model)
            )
        # Those of park2011 are imported where they are used: numba, which compiles their kernels, loads slowly.
        case ReconstructibilitySweep():
            from pipeline.studies.limbs import reconstructibility

            return limbs(reconstructibility.measure)
        case RootErrorSweep():
            from pipeline.studies.limbs import limb_errors

            return limbs(limb_errors.measure_root_error)
        case RadiusScaleSweep():
            from pipeline.studies.limbs import limb_errors

            return limbs(limb_errors.measure_radius_scale)
        case MissingDataSweep():
            from pipeline.studies.limbs import missing_data

            return limbs(missing_data.measure)
        case ProofSweep():
            from pipeline.studies.limbs import proofs

            return limbs(proofs.measure)
        case MotionsSweep():
            from pipeline.studies.limbs import motions

            return limbs(motions.measure)
        case FaceOffSweep():
            from pipeline.studies.face_off import comparison as face_off

            return seeded(
                [ingest, dataset, model],
                lambda: face_off.measure(options, ingest, dataset, model, workers, seed),
            )
        case _:
            raise TypeError(f"no sweep for {type(options).__name__}")


def _clips(options: KnownViewSweep | UnknownViewSweep, ingest: Artefact) -> list[Artefact]:
    """The clips, where they are needed; a InvalidInput if the methods or the source of phase are unknown."""
    _check_methods(options.methods)
    if options.phase_source not in PHASE_SOURCES:
        raise InvalidInput(
            "the source of the phase is unknown",
            where="sweep.phase_source",
            expected=" or ".join(PHASE_SOURCES),
            received=options.phase_source,
        )
    return [ingest] if options.phase_source == "observed2d" else []


def _check_methods(methods: list[str]) -> None:
    if not methods or len(set(methods)) < len(methods) or not set(methods) <= set(METHODS):
        raise InvalidInput(
            "the methods are unknown or stand twice",
            where="sweep.methods",
            expected=" or ".join(METHODS) + ", or both",
            received=", ".join(methods) or "none",
        )
