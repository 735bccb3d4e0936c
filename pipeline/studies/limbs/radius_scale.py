"""Error of one limb against the scale of the radius that is assumed: park2011 figure 3c.

In the paper the scale is that of the radius at the start: adjusted to the rays, it is refined with the trajectory
[park2011 5].  What the programme alone makes of it stands beside, for each way of adjusting it.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import LimbChoice, TrajectoryBasis
from pipeline.core.articulation import Adjustment, cast_rays, on_sphere
from pipeline.core.articulation.hits import ROBUST_QUANTILE
from pipeline.core.refinement import refine
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.palette import Style
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.scores import certificate, distance, limb_errors, reconstructibility_of
from pipeline.studies.limbs.swept_errors import SweptErrors, measured
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial
from pipeline.validation import Distinct, Increasing, NonNegative, Positive

REFINED = "refined"
"""Adjusted in all frames, then refined with the trajectory: as in the paper; certificates are those of the start."""

MOST_STEPS = 100
"""Of a refinement: before a camera that shakes most end after 50; before a still one many would go on for hundreds, in
which the image hardly changes."""

_ADJUSTED = partial(Style, line="dashed", banded=False)
STYLES = {
    REFINED: Style("refined with the trajectory", "black"),
    "global": _ADJUSTED("one radius for all frames", "blue"),
    "robust": _ADJUSTED(f"one for {100.0 * ROBUST_QUANTILE:g} % of the frames", "green"),
    "per_frame": _ADJUSTED("longer where a ray misses", "orange"),
}
"""Looks of the ways of adjusting the radius, by name."""

ANY_FACTOR = 100.0
"""How far the radius may go from where it starts: from each scale to the truth."""


class RadiusScaleSweep(LimbSweep):
    """Error against scale of the radius that is assumed."""

    scales: Increasing[Positive] = [  # of the length of the limb that is assumed, relative to the true one
        0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0, 10.0, 30.0, 100.0,
    ]  # fmt: skip
    adjusts: Distinct[Adjustment] = [  # the first as in the paper
        Adjustment["global"], Adjustment.per_frame, Adjustment.robust,
    ]  # fmt: skip
    noise_px: NonNegative = 0.0  # of the image

    def measure(self, inputs: LimbInputs) -> SweptErrors:
        """Return the errors of every trial for every scale and every way of adjusting the radius to the rays."""
        basis = inputs.model_options.limb_basis()

        def errors_of(trial: LimbTrial) -> list[dict[str, Any]]:
            ways = _Ways(self, trial, basis)
            return [ways.errors(scale, name) for scale in self.scales for name in self.ways]

        return measured(self, inputs, errors_of, every=len(self.ways))

    @property
    def ways(self) -> list[str]:
        """What is made of a radius: refined, then each adjustment alone."""
        return [REFINED, *map(str, self.adjusts)]


Score = tuple[dict[str, float], float, np.ndarray]
"""Errors, the radius, mm, and the relative trajectory (F, 3), mm."""


class _Ways:
    """One limb, whose choices are known by the radius after adjustment, which is all that matters."""

    def __init__(self, sweep: RadiusScaleSweep, trial: LimbTrial, basis: TrajectoryBasis) -> None:
        self.sweep, self.trial, self.basis = sweep, trial, basis
        self.pixels = trial.images + sweep.noise_px * trial.noise
        self.rays = cast_rays(trial.view.matrix, self.pixels, trial.parent)
        self.choices: dict[float, LimbChoice] = {}
        self.scores: dict[tuple[float, bool], Score] = {}

    def errors(self, scale: float, way: str) -> dict[str, Any]:
        """Return the errors at a scale of the assumed radius, and of baselines with it."""
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
        """Return the same once angles and radius are refined together by reprojection error [park2011 5]."""
        trial, frames = self.trial, len(choice.used)
        images = np.full((frames, 2, 2), np.nan)
        images[:, 1] = self.pixels
        found = refine(
            images,
            trial.view,
            trial.parent,
            [-1, 0],
            choice.directions[:, None],
            np.array([choice.hits.radius]),
            basis=cosine_basis(frames, choice.basis.components),
            cutoff=choice.basis.cutoff,
            free_lengths=True,
            length_factor=ANY_FACTOR,
            max_iterations=MOST_STEPS,
        )
        relative = found.relative[:, 0]
        error = distance(relative, trial.relative) / trial.length
        off = np.linalg.norm(relative - trial.relative) / np.linalg.norm(trial.child)
        errors = {
            "limb_error": error,
            "relative_error": round(float(off), 12),
            "error_up_to_mirror": min(error, limb_errors(trial, choice)["error_up_to_mirror"]),
        }
        return errors, found.lengths[0], relative
