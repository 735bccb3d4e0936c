"""Error of one limb when its parent or its radius is wrong: park2011 section 5.1, figures 3b and 3c.

`RootErrorSweep` sweeps the error of the parent's trajectory, `RadiusScaleSweep` the scale of the assumed
radius.  In the paper the scale is that of the start: the radius is adjusted to the rays, then refined with the
trajectory [park2011 5].  Results of the programme alone are tabulated too, for each adjustment of the radius.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core.articulated_trajectory import LimbChoice, TrajectoryBasis
from pipeline.core.articulation import Adjustment, cast_rays, on_sphere
from pipeline.core.articulation.hits import ROBUST_QUANTILE
from pipeline.core.refinement import RefinementOptions, refine
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.palette import Style
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.scores import certificate, distance, limb_errors, reconstructibility_of
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial, wrong_trajectory
from pipeline.validation import Distinct, Increasing, NonNegative, Positive


@dataclass(frozen=True)
class SweptErrors:
    """Errors of all trials from all cameras for each value of the varied quantity, and one trial for display.

    Attributes
    ----------
    rows : DataFrame
        `LimbTrial.keys`, the point of the sweep, and the errors.
    shown : int
        Trial of the first camera with errors nearest to the medians over all points.
    paths : (V, 2, F, 3)
        True and estimated child of that trial at every value, relative to the true parent, over the limb's length.
    """

    rows: pd.DataFrame
    shown: int
    paths: np.ndarray


def measured(
    sweep: LimbSweep,
    inputs: LimbInputs,
    errors_of: Callable[[LimbTrial], list[dict[str, Any]]],
    *,
    every: int = 1,
) -> SweptErrors:
    """Return the errors of all trials for each value of the varied quantity.

    Parameters
    ----------
    sweep : LimbSweep
    inputs : LimbInputs
    errors_of : callable
        Returns the results of one trial at every point, with `paths` (2, F, 3).
    every : int
        Number of points for each value; paths are stored at the first of them.
    """
    trials = sweep.every_trial(inputs)
    results = map_processes(errors_of, trials, inputs.workers)
    paths = [[row.pop("paths") for row in of_trial] for of_trial in results]
    rows = [trial.keys | row for trial, of_trial in zip(trials, results, strict=True) for row in of_trial]
    first = [[row["limb_error"] for row in of_trial] for of_trial in results[: sweep.trials]]
    errors = np.log(np.maximum(first, 1e-3))
    displayed = int(np.argmin(np.abs(errors - np.median(errors, axis=0)).sum(axis=1)))
    return SweptErrors(pd.DataFrame(rows), displayed, np.stack(paths[displayed])[::every])


class RootErrorSweep(LimbSweep):
    """Options of the sweep over the error of the parent's trajectory, relative to the length of the limb."""

    ratios: Increasing[NonNegative] = [  # root mean square error of the root, relative to the length of the limb
        0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5,
    ]  # fmt: skip
    smooth: bool = True  # error in the trajectory basis; otherwise white noise
    noise_px: NonNegative = 0.0  # noise of the image
    adjust: Adjustment = Adjustment.per_frame

    def measure(self, inputs: LimbInputs) -> SweptErrors:
        """Return the errors of all trials for each size of the parent's error, whose shape is fixed in each trial."""
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


REFINED = "refined"
"""Name of the paper's procedure: adjust the radius in all frames, then refine it with the trajectory.

Certificates describe the start of the refinement.
"""

MAX_STEPS = 100
"""Largest number of iterations of the refinement of a limb.

With a shaky camera most refinements end after 50 steps.  With a still camera many would take hundreds of steps, with
hardly any change of the image.
"""

_ADJUSTED = partial(Style, line="dashed", banded=False)
STYLES = {
    REFINED: Style("refined with the trajectory", "black"),
    "global": _ADJUSTED("one radius for all frames", "blue"),
    "robust": _ADJUSTED(f"one for {100.0 * ROBUST_QUANTILE:g} % of the frames", "green"),
    "per_frame": _ADJUSTED("longer where a ray misses", "orange"),
}
"""Chart styles of the procedures that estimate the radius, by name."""

ANY_FACTOR = 100.0
"""Largest factor by which the refinement may change the radius of a limb."""


class RadiusScaleSweep(LimbSweep):
    """Options of the sweep over the assumed radius of a limb, relative to the true radius."""

    scales: Increasing[Positive] = [  # assumed length of the limb relative to the true one
        0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0, 10.0, 30.0, 100.0,
    ]  # fmt: skip
    adjusts: Distinct[Adjustment] = [  # the first is that of the paper
        Adjustment["global"], Adjustment.per_frame, Adjustment.robust,
    ]  # fmt: skip
    noise_px: NonNegative = 0.0  # noise of the image

    def measure(self, inputs: LimbInputs) -> SweptErrors:
        """Return the errors of all trials for each relative radius and each procedure that estimates the radius."""
        basis = inputs.model_options.limb_basis()

        def errors_of(trial: LimbTrial) -> list[dict[str, Any]]:
            ways = _Ways(self, trial, basis)
            return [ways.errors(scale, name) for scale in self.scales for name in self.ways]

        return measured(self, inputs, errors_of, every=len(self.ways))

    @property
    def ways(self) -> list[str]:
        """Names of the procedures that estimate the radius: refinement, then each adjustment without refinement."""
        return [REFINED, *map(str, self.adjusts)]


Score = tuple[dict[str, float], float, np.ndarray]
"""Errors by name, estimated radius, mm, and estimated trajectory (F, 3) relative to the parent, mm."""


class _Ways:
    """Results for one limb, cached by the adjusted radius, because they depend only on this radius."""

    def __init__(self, sweep: RadiusScaleSweep, trial: LimbTrial, basis: TrajectoryBasis) -> None:
        self.sweep, self.trial, self.basis = sweep, trial, basis
        self.pixels = trial.images + sweep.noise_px * trial.noise
        self.rays = cast_rays(trial.view.matrix, self.pixels, trial.parent)
        self.choices: dict[float, LimbChoice] = {}
        self.scores: dict[tuple[float, bool], Score] = {}

    def errors(self, scale: float, way: str) -> dict[str, Any]:
        """Return the errors of one limb and of the baselines, for one value of the assumed relative radius."""
        sweep, trial, refined = self.sweep, self.trial, way == REFINED
        adjust = sweep.adjusts[0] if refined else Adjustment(way)
        hits = on_sphere(self.rays, scale * trial.length, adjust=adjust)
        key = hits.radius, refined
        if hits.radius not in self.choices:
            ratio = hits.radius / trial.length
            self.choices[hits.radius] = sweep.choose(trial, self.basis, noise_px=sweep.noise_px, scale=ratio)
        if key not in self.scores:
            choice = self.choices[hits.radius]
            self.scores[key] = self._refined(choice) if refined else self._chosen(choice)
        errors, radius_mm, relative = self.scores[key]
        return {
            "radius_scale": scale,
            "adjust": way,
            **errors,
            "adjusted_share": hits.adjusted.mean(),  # of frames whose ray misses the sphere
            "radius_ratio": radius_mm / trial.length,  # after adjustment, or refinement
            "reconstructibility": reconstructibility_of(self.choices[hits.radius], trial.relative).ratio,
            **certificate(self.choices[hits.radius]),
            **baselines.limb_errors(trial, scale=scale),
            "adjusted_hanging_error": baselines.limb_errors(trial, scale=hits.radius / trial.length)[
                "hanging_error"
            ],
            "paths": np.stack([trial.relative, relative]) / trial.length,
        }

    def _chosen(self, choice: LimbChoice) -> Score:
        return limb_errors(self.trial, choice), choice.hits.radius, choice.relative

    def _refined(self, choice: LimbChoice) -> Score:
        """Return the errors after a refinement of angles and radius by the reprojection error [park2011 5]."""
        trial, frames = self.trial, len(choice.used)
        images = np.full((frames, 2, 2), np.nan)
        images[:, 1] = self.pixels
        refinement = refine(
            images,
            trial.view,
            trial.parent,
            [-1, 0],
            choice.directions[:, None],
            np.array([choice.hits.radius]),
            basis=cosine_basis(frames, choice.basis.components),
            options=RefinementOptions(
                cutoff=choice.basis.cutoff,
                free_lengths=True,
                length_factor=ANY_FACTOR,
                max_iterations=MAX_STEPS,
            ),
        )
        relative = refinement.relative[:, 0]
        error = distance(relative, trial.relative) / trial.length
        off = np.linalg.norm(relative - trial.relative) / np.linalg.norm(trial.child)
        errors = {
            "limb_error": error,
            "relative_error": round(float(off), 12),
            "error_up_to_mirror": min(error, limb_errors(trial, choice)["error_up_to_mirror"]),
        }
        return errors, refinement.lengths[0], relative
