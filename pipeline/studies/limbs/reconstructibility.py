"""Error of one limb against its reconstructibility, before still, moving and shaky cameras: park2011 section 4.

The truth gives eta_a; the mirror margin, which needs no truth, is measured beside it.  Some of the trials are refined
by reprojection error from other starts as well, to see whether the choice among candidates is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import LimbChoice
from pipeline.core.articulation import Adjustment
from pipeline.core.reconstructibility import Reading, confidence_of_mirror_margin, outside, reconstructibility
from pipeline.core.refinement import refine
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import nulls
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.scores import distance, limb_score, true_signs
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial, stacked
from pipeline.validation import require_range

STARTS = ("programme", "random_signs", "mean_direction")
"""Of the refinement: the chosen candidates, candidates by the toss of a coin, one direction for all frames."""

ROUNDING = 1e-12
"""Part of a matrix's largest element that may be rounding."""


@dataclass(frozen=True)
class LimbReconstructibilities:
    """Error and reconstructibility of T trials before each of C cameras, R of them refined.

    Attributes
    ----------
    cameras : (C,) text
    stretch, limb : (T,) int
        Of the trial, indices into the data set and ``WALKER14.limbs``.
    reconstructibility_vector, reconstructibility_angle, mirror_margin : (C, T)
        eta_a by both readings, and J(-s) / J(s).
    limb_error, relative_error, error_up_to_mirror, proved, objective, lower_bound : (C, T)
        As `scores.LimbScore`.
    hanging_error, mean_pose_error : (C, T)
        As `nulls.limb_errors`.
    limb_error_shuffled : (C, T)
        `limb_error`, dealt out among all trials at random.
    truth_objective, impostor_objective : (C, T)
        Square millimetres.
    confidence : (C, T) text
        Green, amber or red by the mirror margin.
    taken_impostor : (C, T) bool
        Whether most of the chosen candidates are the impostor's.
    eigenvalue_ratio : (C, T)
        Smallest to largest eigenvalue of the programme's matrix.
    positive_off_diagonal : (C, T)
        Share of its elements beside the diagonal that are positive.
    paths : (C, T, 3, F, 3)
        Relative trajectories of truth, impostor and estimate over the limb's length.
    refined_error, refined_px : (C, R, 3)
        From each of `STARTS`: error as `limb_error`, and reprojection error, px.
    refined_converged : (C, R, 3) bool
    """

    cameras: np.ndarray
    stretch: np.ndarray
    limb: np.ndarray
    reconstructibility_vector: np.ndarray
    reconstructibility_angle: np.ndarray
    mirror_margin: np.ndarray
    limb_error: np.ndarray
    relative_error: np.ndarray
    error_up_to_mirror: np.ndarray
    proved: np.ndarray
    objective: np.ndarray
    lower_bound: np.ndarray
    hanging_error: np.ndarray
    mean_pose_error: np.ndarray
    limb_error_shuffled: np.ndarray
    truth_objective: np.ndarray
    impostor_objective: np.ndarray
    confidence: np.ndarray
    taken_impostor: np.ndarray
    eigenvalue_ratio: np.ndarray
    positive_off_diagonal: np.ndarray
    paths: np.ndarray
    refined_error: np.ndarray
    refined_px: np.ndarray
    refined_converged: np.ndarray

    def by(self, reading: Reading) -> np.ndarray:
        """Return eta_a (C, T) by one reading."""
        return {
            Reading.vector: self.reconstructibility_vector,
            Reading.angle: self.reconstructibility_angle,
        }[reading]


@dataclass(kw_only=True)
class ReconstructibilitySweep(LimbSweep):
    """Error against reconstructibility [park2011 13]."""

    cameras: list[Camera] = field(default_factory=lambda: [Camera.still, Camera.moving, Camera.shaky])
    reading: Reading = Reading.vector
    noise_px: float = 0.0
    adjust: Adjustment = Adjustment.per_frame
    refined: int = 10  # trials of each camera whose reprojection error is refined from other starts as well

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("sweep.noise_px", self.noise_px, at_least=0)
        require_range("sweep.refined", self.refined, at_least=1)

    def measure(self, inputs: LimbInputs) -> LimbReconstructibilities:
        """Return error and reconstructibility of every trial before every camera."""
        basis = inputs.model_options.limb_basis()
        trials = self.every_trial(inputs)
        choices = map_processes(
            lambda trial: self.choose(trial, basis, adjust=self.adjust, noise_px=self.noise_px),
            trials,
            inputs.workers,
        )
        pairs = list(zip(trials, choices, strict=True))
        found = map_processes(lambda pair: _compared_with_truth(*pair), pairs, inputs.workers)
        refined = map_processes(
            lambda pair: _from_each_start(*pair, noise_px=self.noise_px, seed=inputs.seed),
            [(trial, choice) for trial, choice in pairs if trial.number < self.refined],
            inputs.workers,
        )
        first = trials[: self.trials]
        columns = stacked(found, (len(self.cameras), self.trials))
        error = columns["limb_error"]
        dealt = derive_generator(inputs.seed, "sweep:reconstructibility:shuffled").permutation(error.size)
        return LimbReconstructibilities(
            cameras=np.array(self.cameras),
            stretch=np.array([trial.stretch for trial in first]),
            limb=np.array([trial.limb for trial in first]),
            **columns,
            limb_error_shuffled=error.ravel()[dealt].reshape(error.shape),
            **stacked(refined, (len(self.cameras), min(self.refined, self.trials))),
        )


def _compared_with_truth(trial: LimbTrial, choice: LimbChoice) -> dict[str, Any]:
    """What `LimbReconstructibilities` holds of one trial."""
    hits, used, solution = choice.hits, choice.used, choice.solution
    signs = true_signs(choice, trial.relative)
    rows = choice.basis.rows(len(used), used)
    middle, half = hits.middle[used], hits.half_chord[used]
    axis = (trial.parent - trial.view.centre)[used]
    truth, impostor = (hits.middle + sign * signs[:, None] * hits.half_chord for sign in (1, -1))
    weight = (half**2).sum(axis=1)
    matrix = (np.eye(len(rows)) - rows @ rows.T) * (half @ half.T)
    spectrum = np.linalg.eigvalsh(matrix)
    beside = matrix[~np.eye(len(matrix), dtype=bool)]
    return {
        "reconstructibility_vector": reconstructibility(rows, middle, half, signs[used]).ratio,
        "reconstructibility_angle": reconstructibility(
            rows, middle, half, signs[used], reading=Reading.angle, axis=axis
        ).ratio,
        "mirror_margin": solution.margin,
        **vars(limb_score(trial, choice)),
        **nulls.limb_errors(trial),
        "truth_objective": outside(rows, truth[used]) ** 2,
        "impostor_objective": outside(rows, impostor[used]) ** 2,
        "confidence": confidence_of_mirror_margin(solution.margin),
        "taken_impostor": bool((weight * solution.signs * signs[used]).sum() < 0),
        "eigenvalue_ratio": spectrum[0] / spectrum[-1] if spectrum[-1] > 0 else 0.0,
        "positive_off_diagonal": float((beside > ROUNDING * np.abs(matrix).max()).mean()),
        "paths": np.stack([trial.relative, impostor, choice.relative]) / trial.length,
    }


def _from_each_start(trial: LimbTrial, choice: LimbChoice, *, noise_px: float, seed: int) -> dict[str, Any]:
    """Error, px and convergence (3,) of the refinement from each of `STARTS`."""
    generator = derive_generator(seed, f"sweep:starts:{trial.number}:{trial.camera}")
    frames = len(choice.used)
    tossed = np.where(generator.random(int(choice.used.sum())) < 0.5, -1, 1)
    # The mirror of a solution is whatever signs it says.
    by_coin = replace(choice, solution=replace(choice.solution, mirror_signs=tossed), mirrored=False).mirror()
    mean = choice.hits.middle[choice.used].mean(axis=0)
    towards = mean if np.linalg.norm(mean) > 0 else choice.hits.half_chord[choice.used][0]
    images = np.full((frames, 2, 2), np.nan)
    images[:, 1] = trial.images + noise_px * trial.noise
    refined = [
        refine(
            images,
            trial.view,
            trial.parent,
            [-1, 0],
            directions[:, None],
            np.array([choice.hits.radius]),
            basis=cosine_basis(frames, choice.basis.components),
            cutoff=choice.basis.cutoff,
        )
        for directions in (choice.directions, by_coin.directions, np.broadcast_to(towards, (frames, 3)))
    ]
    return {
        "refined_error": [distance(r.relative[:, 0], trial.relative) / trial.length for r in refined],
        "refined_px": [r.reprojection_error_px for r in refined],
        "refined_converged": [r.converged for r in refined],
    }
