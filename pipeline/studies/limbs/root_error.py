"""Error of one limb against the error of its parent's trajectory: park2011 figure 3b."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import TrajectoryBasis
from pipeline.core.articulation import Adjustment
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.scores import certificate, distance, limb_errors, reconstructibility_of
from pipeline.studies.limbs.swept_errors import SweptErrors, measured
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial, wrong_trajectory
from pipeline.validation import Increasing, NonNegative


class RootErrorSweep(LimbSweep):
    """Error against error of the parent trajectory, in radii."""

    ratios: Increasing[NonNegative] = [  # root mean square error of the root, relative to the length of the limb
        0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5,
    ]  # fmt: skip
    smooth: bool = True  # the error is in the trajectory basis; else it is white
    noise_px: NonNegative = 0.0  # of the image
    adjust: Adjustment = Adjustment.per_frame

    def measure(self, inputs: LimbInputs) -> SweptErrors:
        """Return the errors of every trial for every error of its parent, whose course is the same at all sizes."""
        basis = inputs.model_options.limb_basis()

        def errors_of(trial: LimbTrial) -> list[dict[str, Any]]:
            return [self._errors(trial, basis, ratio, inputs.seed) for ratio in self.ratios]

        return measured(self, inputs, errors_of)

    def _errors(self, trial: LimbTrial, basis: TrajectoryBasis, ratio: float, seed: int) -> dict[str, Any]:
        generator = derive_generator(seed, f"sweep:root_error:{trial.number}")
        components = basis.components if self.smooth else None
        wrong = wrong_trajectory(generator, len(trial.parent), ratio * trial.length, components=components)
        parent = trial.parent + wrong
        choice = self.choose(trial, basis, adjust=self.adjust, noise_px=self.noise_px, parent=parent)
        return {
            "root_error_ratio": ratio,
            **limb_errors(trial, choice, parent=parent),
            "child_error_ratio": distance(parent + choice.relative, trial.child) / trial.length,
            "parent_error_ratio": distance(parent, trial.parent) / trial.length,
            "reconstructibility": reconstructibility_of(
                choice, trial.child - parent
            ).ratio,  # about the wrong parent
            **certificate(choice),
            **baselines.limb_errors(trial, moved=wrong),
            "paths": np.stack([trial.relative, parent + choice.relative - trial.parent]) / trial.length,
        }
