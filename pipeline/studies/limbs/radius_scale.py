"""Error of one limb against the scale of the radius that is assumed: park2011 figure 3c.

In the paper the scale is that of the radius at the start: adjusted to the rays, it is refined with the trajectory
[park2011 5].  What the programme alone makes of it stands beside, for each way of adjusting it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import LimbChoice, TrajectoryBasis, TrajectoryBasisByRule
from pipeline.core.articulation import Adjustment, cast_rays, on_sphere
from pipeline.core.refinement import refine
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.studies.limbs import nulls
from pipeline.studies.limbs.scores import distance, limb_score
from pipeline.studies.limbs.swept_errors import ErrorSweep, SweptErrors, measured
from pipeline.studies.limbs.trials import LimbInputs, LimbTrial
from pipeline.validation import require_distinct, require_increasing, require_range

REFINED = "refined"
"""Adjusted in all frames, then refined with the trajectory: as in the paper."""

MOST_STEPS = 100
"""Of a refinement: before a camera that shakes most end after 50; before a still one many would go on for hundreds, in
which the image hardly changes."""

ANY_FACTOR = 100.0
"""How far the radius may go from where it starts: from each scale to the truth."""


@dataclass(frozen=True, kw_only=True)
class RadiusErrors(SweptErrors):
    """Errors (C, V, A, T), the values those of the scale, for A ways of adjusting the radius.

    Attributes
    ----------
    adjusts : (A,) text
        `REFINED`, and the names of `Adjustment`.  Refined, signs, objectives and bounds are those of the start, and the
        mirror is not refined.
    adjusted_share : (C, V, A, T)
        Share of frames whose ray misses the sphere.
    radius_ratio : (C, V, A, T)
        Radius after adjustment, or refinement, over the true one.
    adjusted_hanging_error : (C, V, A, T)
        As `hanging_error`, of a limb as long as the radius after adjustment: what the rays alone tell of its length.
    """

    adjusts: np.ndarray
    adjusted_share: np.ndarray
    radius_ratio: np.ndarray
    adjusted_hanging_error: np.ndarray


@dataclass(kw_only=True)
class RadiusScaleSweep(ErrorSweep):
    """Error against scale of the radius that is assumed."""

    scales: list[float] = field(
        default_factory=lambda: (
            [0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0, 10.0, 30.0, 100.0]
        )
    )
    refine: bool = True  # the radius with the trajectory, from the first adjustment: as in the paper
    adjusts: list[Adjustment] = field(  # the first as in the paper
        default_factory=lambda: [Adjustment["global"], Adjustment.per_frame, Adjustment.robust]
    )
    noise_px: float = 0.0

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_increasing("sweep.scales", self.scales, above=0)
        require_distinct("sweep.adjusts", self.adjusts)
        require_range("sweep.noise_px", self.noise_px, at_least=0)

    def measure(self, inputs: LimbInputs) -> RadiusErrors:
        """Return the errors of every trial for every scale and every way of adjusting the radius to the rays."""
        basis = inputs.model_options.limb_basis()

        def errors_of(trial: LimbTrial) -> list[dict[str, Any]]:
            ways = _Ways(self, trial, basis)
            return [ways.errors(scale, name) for scale in self.scales for name in self.ways]

        found = measured(self, inputs, [len(self.scales), len(self.ways)], errors_of)
        return RadiusErrors(values=np.array(self.scales), adjusts=np.array(self.ways), **found)

    @property
    def ways(self) -> list[str]:
        """What is made of a radius: refined if asked for, then each adjustment alone."""
        return [*([REFINED] if self.refine else []), *map(str, self.adjusts)]


class _Ways:
    """One limb, whose choices are known by the radius after adjustment, which is all that matters."""

    def __init__(
        self, sweep: RadiusScaleSweep, trial: LimbTrial, basis: TrajectoryBasis | TrajectoryBasisByRule
    ) -> None:
        self.sweep, self.trial, self.basis = sweep, trial, basis
        self.pixels = trial.images + sweep.noise_px * trial.noise
        self.rays = cast_rays(trial.view.matrix, self.pixels, trial.parent)
        self.nothing: dict[float, dict[str, float]] = {}
        self.choices: dict[float, LimbChoice] = {}
        self.scores: dict[tuple[float, bool], dict[str, Any]] = {}

    def errors(self, scale: float, way: str) -> dict[str, Any]:
        """Return the errors at a scale of the assumed radius, and of limbs that do nothing with it."""
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
        adjusted = self._of_nothing(hits.radius / trial.length)
        return {
            **self.scores[key],
            **self._of_nothing(scale),
            "adjusted_hanging_error": adjusted["hanging_error"],
            "adjusted_share": float(hits.adjusted.mean()),
        }

    def _of_nothing(self, scale: float) -> dict[str, float]:
        """Return the errors of limbs that do nothing, computed once for each scale."""
        if scale not in self.nothing:
            self.nothing[scale] = nulls.limb_errors(self.trial, scale=scale)
        return self.nothing[scale]

    def _chosen(self, choice: LimbChoice) -> dict[str, Any]:
        return {
            **vars(limb_score(self.trial, choice)),
            "radius_ratio": choice.hits.radius / self.trial.length,
            "paths": np.stack([self.trial.relative, choice.relative]) / self.trial.length,
        }

    def _refined(self, choice: LimbChoice) -> dict[str, Any]:
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
        start = self._chosen(choice)
        return {
            **start,
            "limb_error": error,
            "relative_error": round(float(off), 12),
            "error_up_to_mirror": min(error, start["error_up_to_mirror"]),
            "radius_ratio": float(found.lengths[0]) / trial.length,
            "paths": np.stack([trial.relative, relative]) / trial.length,
        }
