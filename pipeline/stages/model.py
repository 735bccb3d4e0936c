"""Model: eigenwalkers of the whole population and without each walker; an action with its synchronization."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from pipeline.core import action_model, fourier, limb_chain, linear_model, trajectory_basis
from pipeline.core.action_model import learning as learnt_action
from pipeline.storage.store import Artefact, Store
from pipeline.studies.actions.learning import learn_action, postures_of
from pipeline.studies.limbs.trials import smoothness
from pipeline.studies.options import ActionSpaceModel, EigenwalkersModel, Model, TrajectoryBasisModel
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput


def run(options: Model, dataset: Artefact, workers: int, store: Store) -> Artefact:
    """Artefact with the models, and in its notes what they are in words.

    Eigenwalkers: ``samples`` (R, D); ``mean`` (D,), ``components`` (K, D), ``eigenvalues`` (K,) of the whole
    population with every component it has; ``fold_mean`` (R, D), ``fold_components`` (R, N, D),
    ``fold_eigenvalues`` (R, N), ``fold_total_variance``, ``fold_last_scale`` (R,) of the models without each
    walker.
    Action: ``mean_posture`` (37,), ``components`` (b, 37), ``eigenvalues`` (K,) of the aSpace; ``raw`` (sum of F, b)
    and ``first``; ``linear``, ``keyframe``, ``synchronized`` (M, P, b); ``keyframe_warp`` (M, P) and
    ``keyframe_samples``; ``distances`` (M, M); ``disparity`` (M, P) onto the median sequence; ``mean``,
    ``standard_deviation``, ``floored`` (P, b) of the action model; ``accepted_<stage>`` (M, P) by the model learnt
    without the performance, ``accepted_person_<stage>`` without its person where there are several.  Its notes hold
    the ``options``, so that an experiment can learn in the same way from fewer performances.
    Trajectory basis: ``basis`` (F, K) and ``energy_beyond`` (N, L, F), root mean square of what each number of
    cosines leaves of a limb, as part of its length.  Its notes hold the ``options``.
    """
    match options:
        case EigenwalkersModel():
            return store.artefact(
                "model", options, [dataset], lambda: _eigenwalkers(options, dataset, workers)
            )
        case ActionSpaceModel():
            return store.artefact("model", options, [dataset], lambda: _action(options, dataset))
        case TrajectoryBasisModel():
            return store.artefact("model", options, [dataset], lambda: _trajectory_basis(options, dataset))
        case _:
            raise TypeError(f"no model for {type(options).__name__}")


def _eigenwalkers(
    options: EigenwalkersModel, dataset: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    frequency = dataset.notes["frequency"]
    coefficients = dataset.arrays["coefficients"]
    rate = dataset.arrays["frequency_hz"] if frequency else None
    samples = linear_model.flatten(coefficients, rate)
    mirrors = linear_model.flatten(fourier.mirrored(coefficients), rate) if options.mirror else None
    people = dataset.arrays["person"]
    if len(np.unique(people)) < 3:
        raise InvalidInput(
            "leave-one-out needs at least three walkers",
            expected="3 or more",
            received=str(len(np.unique(people))),
        )
    scale_last = options.omega_scale_mm if frequency else 1.0
    if scale_last is not None and scale_last <= 0:
        raise InvalidInput(
            "the scale of the frequency is not positive",
            where="model.omega_scale_mm",
            expected="mm per hertz > 0, or null",
            received=f"{scale_last:g}",
        )
    common: dict[str, Any] = {"divisor": options.divisor, "scale_last": scale_last}
    population = samples if mirrors is None else np.concatenate([samples, mirrors])
    whole = linear_model.fit(population, len(population), **common)
    folds = map_threads(
        lambda fold: fold[0],
        linear_model.leave_one_out(samples, options.components, groups=people, mirrors=mirrors, **common),
        workers,
    )
    kept = min(len(fold.eigenvalues) for fold in folds)
    fewer = kept < options.components
    remark = (
        f"{kept} eigenwalkers instead of {options.components}: leave-one-out has only"
        f" {len(np.unique(people)) - 1} people to learn from"
    )
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
        "words": f"{kept} eigenwalkers" + (f" (of {options.components} asked for)" if fewer else ""),
        "remarks": [remark] if fewer else [],
    }


def _action(options: ActionSpaceModel, dataset: Artefact) -> tuple[dict[str, Any], dict[str, Any]]:
    learnt = learn_action(options, postures_of(dataset))
    keyed = learnt_action.by_key_frames(learnt.raw, samples=options.samples, count=options.key_frames)
    stages = {"linear": learnt.linear, "keyframe": keyed.sequences, "synchronized": learnt.synchronized}
    people = dataset.arrays["person"]
    accepted = {}
    for name, performances in stages.items():
        accepted[f"accepted_{name}"] = action_model.acceptance_left_out(performances, bound=options.bound)
        if min(len(people) - np.count_nonzero(people == who) for who in np.unique(people)) >= 2:
            accepted[f"accepted_person_{name}"] = action_model.acceptance_left_out(
                performances, groups=people, bound=options.bound
            )
    space = learnt.space
    return {
        "mean_posture": space.mean,
        "components": space.components,
        "eigenvalues": space.eigenvalues,
        "raw": np.concatenate(learnt.raw),
        "first": dataset.arrays["first"],
        **stages,
        "keyframe_warp": keyed.warp,
        "keyframe_samples": keyed.samples,
        "distances": learnt.distances,
        "disparity": learnt.disparity,
        "mean": learnt.model.mean,
        "standard_deviation": learnt.model.standard_deviation,
        "floored": learnt.model.floored,
        **accepted,
    }, {
        "dimensions": space.dimensions,
        "variance_held": space.variance_held,
        "total_variance": space.total_variance,
        "median": learnt.median,
        "smoothness": learnt.smoothness,
        "options": asdict(options),
        "words": f"aSpace of {space.dimensions} dimensions holding {100 * space.variance_held:.1f} % of the variance",
    }


def _trajectory_basis(
    options: TrajectoryBasisModel, dataset: Artefact
) -> tuple[dict[str, Any], dict[str, Any]]:
    positions = dataset.arrays["positions"]
    frames = positions.shape[1]
    smooth = smoothness(options)
    relative = np.stack([limb_chain.relative_trajectories(limb_chain.WALKER14, p) for p in positions])
    whole = trajectory_basis.cosine_basis(frames, frames)
    energy = np.square(np.einsum("fk,nfld->nkld", whole, relative)).sum(axis=-1)  # (N, F, L)
    beyond = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1] - energy
    size = np.square(dataset.arrays["lengths_mm"])[:, None] * frames
    rms = np.sqrt(np.maximum(beyond, 0.0) / np.maximum(size, 1e-12))
    kind = "hard" if smooth.cutoff is None else f"soft, k0 = {smooth.cutoff:g}"
    components = np.full((len(relative), relative.shape[2]), options.components)
    if not options.components:
        chosen = [[trajectory_basis.choose_components(limb) for limb in r.swapaxes(0, 1)] for r in relative]
        components = np.array([[limb.components for limb in body] for body in chosen])
    basis = trajectory_basis.cosine_basis(frames, int(components.max()))
    at_k = np.take_along_axis(rms, components[:, None] - 1, axis=1)
    many = (
        f"{options.components} cosines"
        if options.components
        else (
            f"each limb's own number of cosines, at the median {np.median(components):g} for the true ones,"
        )
    )
    return {"basis": basis, "energy_beyond": rms.transpose(0, 2, 1)}, {
        "beyond_median": float(np.median(at_k)),
        "options": asdict(options),
        "words": f"{many} ({kind}) that leave {100 * float(np.median(at_k)):.1f} % of a limb's length",
    }
