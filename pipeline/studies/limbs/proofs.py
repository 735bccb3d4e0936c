"""Which programmes are proved to be solved, and what it costs, by frames, components and noise; ours."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Annotated, Any

import pandas as pd

from pipeline.core.articulated_trajectory import TrajectoryBasis
from pipeline.core.articulation import Adjustment
from pipeline.core.binary_quadratic import compile_kernels
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.scores import certificate, distance
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep
from pipeline.validation import (
    Count,
    Distinct,
    Increasing,
    InvalidInput,
    NonNegative,
    Positive,
    Share,
    bounded,
    require_range,
)

LONG = 100
"""Frames above which a programme may take its whole limit, so that fewer are tried."""


@dataclass(frozen=True)
class Proofs:
    """Proofs of all programmes: a row to each."""

    rows: pd.DataFrame


class ProofSweep(LimbSweep):
    """Share of programmes that are proved, by frames and components."""

    cameras: Distinct[Camera] = [Camera.still, Camera.moving, Camera.shaky]  # in turn
    frames: Increasing[Annotated[int, bounded(at_least=3)]] = [25, 50, 100, 200]  # of each limb
    components: Increasing[Count] = [10, 20]  # of the trajectory basis
    noises_px: Increasing[NonNegative] = [0.0, 1.0]  # of the image
    adjust: Adjustment = Adjustment.per_frame
    long_share: Share = 0.2  # of the trials for over 100 frames, which may take the limit each
    time_limit_s: Positive = 2.0  # nominal, of each search

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        if not self.programmes():
            raise InvalidInput(
                "no programme is left",
                "sweep.components",
                "fewer than the frames, and a trial at least",
                ", ".join(map(str, self.components)),
            )

    def programmes(self) -> list[tuple[int, int, float, int]]:
        """Return frames, components, noise in px and number of the trial of every programme."""
        # A basis of as many cosines as frames leaves nothing to be measured.
        return [
            (frames, components, noise, number)
            for frames in self.frames
            for components in self.components
            if components < frames
            for noise in self.noises_px
            for number in range(self.trials if frames <= LONG else int(self.long_share * self.trials))
        ]

    def require_frames(self, frames: int) -> None:
        """Raise InvalidInput if stretches of so many frames are shorter than the longest programmes."""
        require_range("dataset.frames", frames, at_least=max(self.frames))

    def measure(self, inputs: LimbInputs) -> Proofs:
        """Return the proofs of the programmes of limbs that are cut to so many frames.

        Of the model the kind of basis is used; its components are swept.
        """
        cutoff = inputs.model_options.cutoff
        longest = inputs.dataset.positions.shape[1]
        self.require_frames(longest)

        def one(item: tuple[int, int, float, int]) -> dict[str, Any]:
            frames, components, noise, number = item
            camera = self.cameras[number % len(self.cameras)]
            whole = self.trial(inputs.dataset, number, camera, inputs.seed)
            place = derive_generator(inputs.seed, f"sweep:part:{number}").random()
            trial = whole.part(int(place * (longest - frames + 1)), frames)
            seconds, solutions = [], []
            for limit in (0.0, self.time_limit_s):
                started = perf_counter()
                choice = self.choose(
                    trial,
                    TrajectoryBasis(components, cutoff),
                    adjust=self.adjust,
                    noise_px=noise,
                    time_limit_s=limit,
                )
                seconds.append(perf_counter() - started)
                solutions.append(choice.solution)
            first, last = solutions
            return {
                "frames": frames,
                "components": components,
                "noise_px": noise,
                **trial.keys,
                **certificate(choice),
                # Between bound and objective, relative.
                "gap": 0.0 if last.proved else 1.0 - max(last.lower_bound, 0.0) / last.objective,
                "first_objective": first.objective,  # of the signs that are found at once
                "limb_error": distance(choice.relative, trial.relative) / trial.length,
                "boxes": last.boxes,  # nodes of the two searches
                "steps": last.steps,
                "first_seconds": seconds[0],
                "seconds": seconds[1],
            }

        compile_kernels()  # or the first programmes would seem slow
        return Proofs(pd.DataFrame(map_processes(one, self.programmes(), inputs.workers)))
