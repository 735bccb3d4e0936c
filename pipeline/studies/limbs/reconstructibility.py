"""Error of one limb against its reconstructibility, before still, moving and shaky cameras: park2011 section 4.

The truth gives eta_a; the mirror margin, which needs no truth, is measured beside it.  Some of the trials are refined
by reprojection error from other starts as well, to see whether the choice among candidates is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core.articulated_trajectory import LimbChoice
from pipeline.core.articulation import Adjustment
from pipeline.core.reconstructibility import Reading, confidence_of_mirror_margin, outside, reconstructibility
from pipeline.core.refinement import RefinementOptions, refine
from pipeline.core.trajectory_basis import cosine_basis, on_rays
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.scores import (
    certificate,
    distance,
    limb_errors,
    reconstructibility_of,
    true_signs,
)
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial
from pipeline.validation import Count, Distinct, NonNegative

STARTS = ("programme", "random_signs", "mean_direction")
"""Of the refinement: the chosen candidates, candidates by the toss of a coin, one direction for all frames."""

ROUNDING = 1e-12
"""Part of a matrix's largest element that may be rounding."""

SINGULAR = 1e-8
"""Smallest to largest eigenvalue below which a matrix is singular: the root of the machine's precision, about."""


@dataclass(frozen=True)
class LimbReconstructibilities:
    """Error and reconstructibility of every trial before every camera.

    Attributes
    ----------
    rows : DataFrame
        `LimbTrial.keys` and what was found; ``reconstructibility`` is eta_a by the reading that was asked for.
    starts : DataFrame
        Of the trials that are refined as well, a row to each of `STARTS`.
    paths : (N, 3, F, 3)
        Of each row, relative trajectories of truth, impostor and estimate over the limb's length.
    """

    rows: pd.DataFrame
    starts: pd.DataFrame
    paths: np.ndarray


class ReconstructibilitySweep(LimbSweep):
    """Error against reconstructibility [park2011 13]."""

    cameras: Distinct[Camera] = [Camera.still, Camera.moving, Camera.shaky]
    reading: Reading = Reading.vector
    noise_px: NonNegative = 0.0  # of the image
    adjust: Adjustment = Adjustment.per_frame
    refined: Count = 10  # trials of each camera whose reprojection error is refined from other starts as well

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
        starts = map_processes(
            lambda pair: _from_each_start(*pair, noise_px=self.noise_px, seed=inputs.seed),
            [(trial, choice) for trial, choice in pairs if trial.number < self.refined],
            inputs.workers,
        )
        paths = np.stack([row.pop("paths") for row in found])
        rows = pd.DataFrame([trial.keys | row for trial, row in zip(trials, found, strict=True)])
        rows.insert(4, "reconstructibility", rows[f"reconstructibility_{self.reading}"])
        # The errors, dealt out among all trials at random.
        dealt = derive_generator(inputs.seed, "sweep:reconstructibility:shuffled").permutation(len(rows))
        rows.insert(len(rows.columns) - 2, "limb_error_shuffled", rows["limb_error"].to_numpy()[dealt])
        return LimbReconstructibilities(rows, pd.DataFrame([row for of in starts for row in of]), paths)


def _compared_with_truth(trial: LimbTrial, choice: LimbChoice) -> dict[str, Any]:
    """What a row holds of one trial; objectives in mm²."""
    hits, used, solution = choice.hits, choice.used, choice.solution
    signs = true_signs(choice, trial.relative)
    rows = choice.basis.rows(len(used), used)
    middle, half = hits.middle[used], hits.half_chord[used]
    axis = (trial.parent - trial.view.centre)[used]
    theta = cosine_basis(len(used), choice.basis.components)[used]
    alone = on_rays(theta, middle, hits.rays.direction[used])
    truth, impostor = (hits.middle + sign * signs[:, None] * hits.half_chord for sign in (1, -1))
    weight = (half**2).sum(axis=1)
    matrix = (np.eye(len(rows)) - rows @ rows.T) * (half @ half.T)
    spectrum = np.linalg.eigvalsh(matrix)
    beside = matrix[~np.eye(len(matrix), dtype=bool)]
    return {
        "reconstructibility_vector": reconstructibility_of(choice, trial.relative).ratio,
        "reconstructibility_angle": reconstructibility(
            rows, middle, half, signs[used], reading=Reading.angle, axis=axis
        ).ratio,
        "mirror_margin": solution.margin,
        **limb_errors(trial, choice),
        **certificate(choice),
        "truth_objective": outside(rows, truth[used]) ** 2,
        "impostor_objective": outside(rows, impostor[used]) ** 2,
        "confidence": confidence_of_mirror_margin(solution.margin),
        # Whether most of the chosen candidates are the impostor's.
        "taken_impostor": bool((weight * solution.signs * signs[used]).sum() < 0),
        **baselines.limb_errors(trial),
        # Where the basis alone says little, rounding is amplified: six digits are those of any processor.
        "basis_alone_error": float(f"{distance(alone, trial.relative[used]) / trial.length:.6g}"),
        # Of the programme's matrix: its elements beside the diagonal, and its smallest to largest eigenvalue.
        "positive_off_diagonal": (beside > ROUNDING * np.abs(matrix).max()).mean(),
        "numerically_singular": bool(spectrum[-1] <= 0 or spectrum[0] / spectrum[-1] < SINGULAR),
        "paths": np.stack([trial.relative, impostor, choice.relative]) / trial.length,
    }


def _from_each_start(
    trial: LimbTrial, choice: LimbChoice, *, noise_px: float, seed: int
) -> list[dict[str, Any]]:
    """Return a row to each of `STARTS` of the refinement."""
    generator = derive_generator(seed, f"sweep:starts:{trial.number}:{trial.camera}")
    frames = len(choice.used)
    tossed = np.where(generator.random(choice.used.sum()) < 0.5, -1, 1)
    # The mirror of a solution is whatever signs it says.
    by_coin = replace(choice, solution=replace(choice.solution, mirror_signs=tossed), mirrored=False).mirror
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
            options=RefinementOptions(cutoff=choice.basis.cutoff),
        )
        for directions in (choice.directions, by_coin.directions, np.broadcast_to(towards, (frames, 3)))
    ]
    return [
        {
            "start": start,
            "camera": trial.camera,
            "trial": trial.number,
            "clip": trial.clip,
            "limb_error": distance(found.relative[:, 0], trial.relative) / trial.length,
            "reprojection_error_px": found.reprojection_error_px,
            "converged": found.converged,
        }
        for start, found in zip(STARTS, refined, strict=True)
    ]
