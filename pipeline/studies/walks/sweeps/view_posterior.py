"""The view angle with its posterior: how far off, how sure, and whether front and back are told apart."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pipeline.core import anatomical
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.sweeps.held_out import People
from pipeline.studies.walks.sweeps.setting import PLAIN, anatomical_setting, approach_two
from pipeline.validation import InvalidInput, Positive, bounded

METHODS = ("two_harmonics", "anatomical")
"""The plain covariance of two harmonics with sigma² = 70 and mirror images, and the anatomical prior."""


@dataclass(frozen=True)
class ViewPosteriors:
    """View angles and their posteriors.

    Attributes
    ----------
    methods : (M,) text
    view_angle_deg : (A,)
    angle_deg, sd_deg, other_angle_deg, other_share : (M, P, A)
        Highest mode; standard deviation about it; next mode; probability more than a right angle away.
    candidate_deg : (F,)
    density : (A, F)
        Of the anatomical prior, about the true angle, mean over people; per degree.
    """

    methods: np.ndarray
    view_angle_deg: np.ndarray
    angle_deg: np.ndarray
    sd_deg: np.ndarray
    other_angle_deg: np.ndarray
    other_share: np.ndarray
    candidate_deg: np.ndarray
    density: np.ndarray


@dataclass(kw_only=True)
class ViewAngleBars(Sweep):
    """Posterior of the view angle."""

    seen_from_deg: Swept = scaled(start=-90, stop=90, step="structure_step_deg")
    candidates: Annotated[int, bounded(at_least=24, at_most=3600)] = 72  # angles on the circle
    noise_variance_mm2: Positive = 70.0  # of the plain covariance

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        if self.candidates % 2:
            raise InvalidInput("must be even", where="sweep.candidates", received=str(self.candidates))

    def measure(self, inputs: SweepInputs[object, FourierSamples, AnatomicalWalkers]) -> ViewPosteriors:
        """Return the view angles and their posteriors."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        options: AnatomicalModel = inputs.model_options
        if not options.mirror:
            raise InvalidInput(
                "half of the circle stands for all of it", where="model.mirror", expected="true"
            )
        plain = replace(
            approach_two(self.noise_variance_mm2), shrinkage=replace(PLAIN, mirror=True), all_walks=True
        )
        settings = (plain, anatomical_setting(options, people.harmonics))

        def one(person: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            fold = people.fold(person)
            rows = []
            for setting in settings:
                shown = people.in_image_axes(person, view)[:, :, :2, : 1 + 2 * setting.harmonics]
                costs = anatomical.view_costs(
                    fold.prior(setting), shown, self.candidates, noise=setting.noise
                )
                found = anatomical.posterior_of(costs)
                rows.append(
                    [
                        np.degrees(found.angle_rad),
                        np.degrees(found.sd_rad),
                        np.degrees(found.other_angle_rad),
                        np.clip(found.other_share, 0.0, 1.0),
                    ]
                )
            return np.array(rows), np.radians(found.density), np.degrees(found.angles_rad)

        folds = map_processes(one, range(people.count), inputs.workers)
        angle, sd, other, share = np.moveaxis(np.stack([fold[0] for fold in folds]), (2, 1, 0), (0, 1, 2))
        return ViewPosteriors(
            methods=np.array(METHODS),
            view_angle_deg=view_deg,
            angle_deg=angle,
            sd_deg=sd,
            other_angle_deg=other,
            other_share=share,
            candidate_deg=folds[0][2],
            density=np.mean([fold[1] for fold in folds], axis=0),
        )
