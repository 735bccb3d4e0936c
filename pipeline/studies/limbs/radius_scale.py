"""Error of one limb against the scale of the radius that is assumed: park2011 figure 3c."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import TrajectoryBasis, TrajectoryBasisByRule
from pipeline.core.articulation import Adjustment, ray_sphere
from pipeline.studies.limbs.scores import limb_score
from pipeline.studies.limbs.swept_errors import ErrorSweep, SweptErrors, measured
from pipeline.studies.limbs.trials import LimbInputs, LimbTrial
from pipeline.validation import require_distinct, require_increasing, require_range


@dataclass(frozen=True, kw_only=True)
class RadiusErrors(SweptErrors):
    """Errors (C, V, A, T), the values those of the scale, for A ways of adjusting the radius.

    Attributes
    ----------
    adjusts : (A,) text
    adjusted_share : (C, V, A, T)
        Share of frames whose ray misses the sphere.
    radius_ratio : (C, V, A, T)
        Radius after adjustment over the true one.
    """

    adjusts: np.ndarray
    adjusted_share: np.ndarray
    radius_ratio: np.ndarray


@dataclass(kw_only=True)
class RadiusScaleSweep(ErrorSweep):
    """Error against scale of the radius that is assumed."""

    scales: list[float] = field(
        default_factory=lambda: (
            [0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 2.0, 3.0, 10.0, 30.0, 100.0]
        )
    )
    adjusts: list[Adjustment] = field(  # first as in the paper
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
            known: dict[
                float, dict[str, Any]
            ] = {}  # by the radius after adjustment, which is all that matters
            return [
                self._errors(trial, basis, scale, adjust, known)
                for scale in self.scales
                for adjust in self.adjusts
            ]

        found = measured(self, inputs, [len(self.scales), len(self.adjusts)], errors_of)
        return RadiusErrors(values=np.array(self.scales), adjusts=np.array(self.adjusts), **found)

    def _errors(
        self,
        trial: LimbTrial,
        basis: TrajectoryBasis | TrajectoryBasisByRule,
        scale: float,
        adjust: Adjustment,
        known: dict[float, dict[str, Any]],
    ) -> dict[str, Any]:
        pixels = trial.images + self.noise_px * trial.noise
        hits = ray_sphere(trial.view.matrix, pixels, trial.parent, scale * trial.length, adjust=adjust)
        if hits.radius not in known:
            ratio = hits.radius / trial.length
            choice = self.choose(trial, basis, noise_px=self.noise_px, scale=ratio)
            known[hits.radius] = {
                **vars(limb_score(trial, choice)),
                "radius_ratio": ratio,
                "paths": np.stack([trial.relative, choice.relative]) / trial.length,
            }
        return {**known[hits.radius], "adjusted_share": float(hits.adjusted.mean())}
