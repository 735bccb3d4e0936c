"""Error of one limb against its reconstructibility, before still, moving and shaky cameras: park2011 section 4.

The truth gives eta_a; the mirror margin, which needs no truth, is measured beside it.  Some of the trials are refined
by reprojection error from other starts as well, to see whether the choice among candidates is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pipeline.core import refinement
from pipeline.core.articulated_trajectory.limb_choice import LimbChoice, Smoothness, SmoothnessByRule, taken
from pipeline.core.reconstructibility import light_of_mirror_margin, outside, reconstructibility
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.limbs.scores import distance, limb_score, true_signs
from pipeline.studies.limbs.trials import LimbTrial, choose, limb_trial, smoothness
from pipeline.studies.options import ReconstructibilitySweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import check_sweep
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

READINGS: tuple[Literal["vector", "angle"], ...] = ("vector", "angle")


def measure(
    options: ReconstructibilitySweep,
    dataset: Artefact,
    model_options: TrajectoryBasisModel,
    workers: int,
    seed: int,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Error and reconstructibility of every trial before every camera.

    Parameters
    ----------
    options : ReconstructibilitySweep
    dataset : Artefact
    model_options : TrajectoryBasisModel
    workers : int
    seed : int

    Returns
    -------
    arrays : dict
        ``cameras`` (C,), ``stretch``, ``limb`` (T,); all others (C, T): ``reconstructibility_vector``, ``…_angle``,
        ``mirror_margin``, ``limb_error``, ``relative_error``, ``error_up_to_mirror``, ``proved``, ``objective``,
        ``lower_bound``, ``truth_objective``, ``impostor_objective`` mm², ``light``, ``taken_impostor``,
        ``eigenvalue_ratio`` smallest to largest of the programme's matrix; ``paths`` (C, T, 3, F, 3) relative
        trajectories of truth, impostor and estimate over the limb's length; of the trials that are refined
        ``refined_error``, ``refined_px``, ``refined_converged`` (C, R, 3) by `limb_trials.STARTS`.
    notes : dict
        ``unproved``, the share of programmes whose time ran out.

    Raises
    ------
    InvalidInput
        Options that cannot be.
    """
    check_sweep(options, adjusts=[options.adjust])
    if options.reading not in READINGS:
        raise InvalidInput(
            "the reading is unknown",
            where="sweep.reading",
            expected=" or ".join(READINGS),
            received=options.reading,
        )
    if options.refined < 1:
        raise InvalidInput(
            "no trial is refined", where="sweep.refined", expected="1 or more", received=f"{options.refined}"
        )
    smooth = smoothness(model_options)
    items = [(camera, number) for camera in options.cameras for number in range(options.trials)]

    def one(item: tuple[str, int]) -> Tried:
        return _tried(options, limb_trial(options, dataset, item[1], item[0], seed), smooth, seed)

    tried = map_threads(one, items, workers)
    shape = (len(options.cameras), options.trials)
    refined = min(options.refined, options.trials)
    numbers = {name: np.array([t.numbers[name] for t in tried]).reshape(shape) for name in tried[0].numbers}
    starts = np.stack([t.starts for t in tried if t.starts is not None]).reshape(shape[0], refined, 3, 3)
    return {
        "cameras": np.array(options.cameras),
        "stretch": np.array([t.trial.stretch for t in tried[: shape[1]]]),
        "limb": np.array([t.trial.limb for t in tried[: shape[1]]]),
        **numbers,
        "paths": np.stack([t.paths for t in tried]).reshape(*shape, *tried[0].paths.shape),
        "refined_error": starts[..., 0],
        "refined_px": starts[..., 1],
        "refined_converged": starts[..., 2] > 0,
    }, {"unproved": float(1.0 - numbers["proved"].mean())}


@dataclass(frozen=True)
class Tried:
    """What came of one trial.

    Attributes
    ----------
    trial : LimbTrial
    numbers : dict
        By the names of the arrays.
    paths : (3, F, 3)
        Truth, impostor and estimate over the limb's length.
    starts : (3, 3) or None
        Error, reprojection error in px and whether it converged, of the refinement from each of `limb_trials.STARTS`.
    """

    trial: LimbTrial
    numbers: dict[str, Any]
    paths: np.ndarray
    starts: np.ndarray | None


def _tried(
    options: ReconstructibilitySweep, trial: LimbTrial, smooth: Smoothness | SmoothnessByRule, seed: int
) -> Tried:
    choice = choose(trial, smooth, options, adjust=options.adjust, noise_px=options.noise_px)
    hits, used, solution = choice.hits, choice.used, choice.solution
    signs = true_signs(choice, trial.relative)
    rows = choice.smoothness.rows(len(used), used)
    middle, half = hits.middle[used], hits.half_chord[used]
    score = limb_score(trial, choice)
    eta = {
        f"reconstructibility_{reading}": reconstructibility(
            rows, middle, half, signs[used], reading=reading, axis=_axis(choice, trial)[used]
        ).ratio
        for reading in READINGS
    }
    truth, impostor = (hits.middle + sign * signs[:, None] * hits.half_chord for sign in (1, -1))
    weight = (half**2).sum(axis=1)
    spectrum = np.linalg.eigvalsh((np.eye(len(rows)) - rows @ rows.T) * (half @ half.T))
    return Tried(
        trial=trial,
        numbers={
            **eta,
            "mirror_margin": solution.margin,
            "limb_error": score.limb_error,
            "relative_error": score.relative_error,
            "error_up_to_mirror": score.error_up_to_mirror,
            "proved": solution.proved,
            "objective": solution.objective,
            "lower_bound": solution.lower_bound,
            "truth_objective": outside(rows, truth[used]) ** 2,
            "impostor_objective": outside(rows, impostor[used]) ** 2,
            "light": light_of_mirror_margin(solution.margin),
            "taken_impostor": bool((weight * solution.signs * signs[used]).sum() < 0),
            "eigenvalue_ratio": spectrum[0] / spectrum[-1] if spectrum[-1] > 0 else 0.0,
        },
        paths=np.stack([trial.relative, impostor, choice.relative]) / trial.length,
        starts=_starts(options, trial, choice, seed) if trial.number < options.refined else None,
    )


def _axis(choice: LimbChoice, trial: LimbTrial) -> np.ndarray:
    """Direction (F, 3) from the camera to the parent."""
    return np.asarray(trial.parent - trial.view.centre)


def _starts(options: ReconstructibilitySweep, trial: LimbTrial, choice: LimbChoice, seed: int) -> np.ndarray:
    """Error, px and convergence (3, 3) of the refinement from each of `limb_trials.STARTS`."""
    generator = derive_generator(seed, f"sweep:starts:{trial.number}:{trial.camera}")
    frames = len(choice.used)
    tossed = np.where(generator.random(int(choice.used.sum())) < 0.5, -1, 1)
    solution = choice.solution
    by_coin = taken(
        choice.hits,
        # The mirror of a solution is whatever signs it says.
        type(solution)(**{**vars(solution), "mirror_signs": tossed}),
        choice.used,
        choice.smoothness,
        mirrored=True,
    )
    mean = choice.hits.middle[choice.used].mean(axis=0)
    towards = mean if np.linalg.norm(mean) > 0 else choice.hits.half_chord[choice.used][0]
    starts = (choice.directions, by_coin.directions, np.broadcast_to(towards, (frames, 3)))
    images = np.full((frames, 2, 2), np.nan)
    images[:, 1] = trial.images + options.noise_px * trial.noise
    found = []
    for directions in starts:
        refined = refinement.refine(
            images,
            trial.view,
            trial.parent,
            [-1, 0],
            directions[:, None],
            np.array([choice.hits.radius]),
            basis=cosine_basis(frames, choice.smoothness.components),
            cutoff=choice.smoothness.cutoff,
        )
        error = distance(refined.relative[:, 0], trial.relative) / trial.length
        found.append((error, refined.reprojection_error_px, float(refined.converged)))
    return np.array(found)
