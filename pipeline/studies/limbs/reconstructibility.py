"""Error of one limb against its reconstructibility, for still, moving and shaky cameras: park2011 section 4.

eta_a is computed from the truth; the mirror margin needs no truth.  Some trials are also refined by reprojection error
from other starts, to test if the choice among candidates is needed.
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
"""Initial trajectories of the refinement: the estimate, random mirror images in each frame, or a constant direction."""

ROUNDING = 1e-12
"""Tolerance for rounding errors in a matrix, relative to its largest element."""

SINGULAR = 1e-8
"""Ratio of the smallest to the largest eigenvalue below which a matrix counts as singular.

It is about the square root of machine precision.
"""


@dataclass(frozen=True)
class LimbReconstructibilities:
    """Error and reconstructibility of all trials from all cameras.

    Attributes
    ----------
    rows : DataFrame
        `LimbTrial.keys` and the results; ``reconstructibility`` is eta_a by the reading of the options.
    starts : DataFrame
        A row for each of `STARTS`, for the trials that are also refined.
    paths : (N, 3, F, 3)
        Relative trajectories of truth, impostor and estimate for each row, over the limb's length.
    """

    rows: pd.DataFrame
    starts: pd.DataFrame
    paths: np.ndarray


class ReconstructibilitySweep(LimbSweep):
    """Options of measuring the error of a limb and its reconstructibility [park2011 13]."""

    cameras: Distinct[Camera] = [Camera.still, Camera.moving, Camera.shaky]
    reading: Reading = Reading.vector
    noise_px: NonNegative = 0.0  # noise of the image
    adjust: Adjustment = Adjustment.per_frame
    refined: Count = 10  # number of trials of each camera that are also refined from other starts

    def measure(self, inputs: LimbInputs) -> LimbReconstructibilities:
        """Return the error and reconstructibility of all trials from all cameras."""
        basis = inputs.model_options.limb_basis()
        trials = self.every_trial(inputs)
        choices = map_processes(
            lambda trial: self.choose(trial, basis, adjust=self.adjust, noise_px=self.noise_px),
            trials,
            inputs.workers,
        )
        pairs = list(zip(trials, choices, strict=True))
        results = map_processes(lambda pair: _compared_with_truth(*pair), pairs, inputs.workers)
        starts = map_processes(
            lambda pair: _from_each_start(*pair, noise_px=self.noise_px, seed=inputs.seed),
            [(trial, choice) for trial, choice in pairs if trial.number < self.refined],
            inputs.workers,
        )
        paths = np.stack([row.pop("paths") for row in results])
        rows = pd.DataFrame([trial.keys | row for trial, row in zip(trials, results, strict=True)])
        rows.insert(4, "reconstructibility", rows[f"reconstructibility_{self.reading}"])
        # Random permutation of the errors among all trials.
        permutation = derive_generator(inputs.seed, "sweep:reconstructibility:shuffled").permutation(
            len(rows)
        )
        rows.insert(len(rows.columns) - 2, "limb_error_shuffled", rows["limb_error"].to_numpy()[permutation])
        return LimbReconstructibilities(
            rows, pd.DataFrame([row for rows_of_trial in starts for row in rows_of_trial]), paths
        )


def _compared_with_truth(trial: LimbTrial, choice: LimbChoice) -> dict[str, Any]:
    """Return the errors and reconstructibilities of one trial from its estimate and the truth; objectives in mm²."""
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
    off_diagonal = matrix[~np.eye(len(matrix), dtype=bool)]
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
        # True if most of the chosen candidates are the impostor's.
        "taken_impostor": bool((weight * solution.signs * signs[used]).sum() < 0),
        **baselines.limb_errors(trial),
        # An ill-conditioned basis amplifies rounding: six digits are the same on every processor.
        "basis_alone_error": float(f"{distance(alone, trial.relative[used]) / trial.length:.6g}"),
        # Matrix of the programme: off-diagonal elements, and ratio of smallest to largest eigenvalue.
        "positive_off_diagonal": (off_diagonal > ROUNDING * np.abs(matrix).max()).mean(),
        "numerically_singular": bool(spectrum[-1] <= 0 or spectrum[0] / spectrum[-1] < SINGULAR),
        "paths": np.stack([trial.relative, impostor, choice.relative]) / trial.length,
    }


def _from_each_start(
    trial: LimbTrial, choice: LimbChoice, *, noise_px: float, seed: int
) -> list[dict[str, Any]]:
    """Return the results of the refinement, with a row for each initial trajectory in `STARTS`."""
    generator = derive_generator(seed, f"sweep:starts:{trial.number}:{trial.camera}")
    frames = len(choice.used)
    tossed = np.where(generator.random(choice.used.sum()) < 0.5, -1, 1)
    # The mirror of a choice uses any signs in `mirror_signs`.
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
            "limb_error": distance(refinement.relative[:, 0], trial.relative) / trial.length,
            "reprojection_error_px": refinement.reprojection_error_px,
            "converged": refinement.converged,
        }
        for start, refinement in zip(STARTS, refined, strict=True)
    ]
