"""The anatomical reconstruction next to the papers' approaches, on their data set: ``sweep.methods=[…,anatomical]``.

Harmonics and walks are the data set's, and the settings are the model's defaults, the same for everybody: the ladder
(`sweeps.structure`) chooses them for each person on the others instead.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import camera, fourier, linear_model
from pipeline.core.viewpoint.view_estimate import ViewEstimate
from pipeline.palette import Style
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.methods import Fold as HeldOut
from pipeline.studies.walks.methods import Method, Reconstruction, Walk
from pipeline.validation import InvalidInput
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Prior
from walk3d.anatomy.study.model import AnatomicalModel
from walk3d.anatomy.study.sweeps.held_out import CANDIDATES, Fold, People, mirrored_grid
from walk3d.anatomy.study.sweeps.setting import anatomical_setting

VIEWS_AT_A_TIME = 12
"""So many fit into the caches of a processor."""
MOST_LIKELIER = 100.0
"""Largest logarithm of a likelihood ratio that is told."""


class AnatomicalApproach:
    """Reconstruction of every walk by priors that have not seen its person."""

    def __init__(self, data: FourierSamples) -> None:
        options = AnatomicalModel()
        self._data = data
        self._people = People(data, options.population(data))
        self._setting = anatomical_setting(options, self._people.harmonics)

    def fold(self, walk: int) -> Fold:
        """What is learnt without the person of a walk."""
        people = self._people.model.people
        return self._people.fold(np.flatnonzero(people == self._data.person[walk])[0])

    def prior(self, walk: int) -> Prior:
        """What is learnt without the person of a walk."""
        return self.fold(walk).prior(self._setting)

    def missing(self, fold: Fold, walk: int, view_rad: np.ndarray) -> np.ndarray:
        """Missing dimension (A, 1 + 2H, 15) of a walk from A views, mm.

        Left views are those from the right of the mirror image, for the prior knows no side: half of the conditionals
        of a symmetric grid serve all of it.  Joints that were not measured are hidden.
        """
        walker, hidden = self._data.coefficients[walk], self._data.unmeasured[walk]
        if hidden.any() or not mirrored_grid(view_rad):
            return self._fitted(fold, walker[None], view_rad, hidden)[:, 0]
        sides = np.stack([walker, fourier.mirrored(walker)])
        both = self._fitted(fold, sides, view_rad[len(view_rad) // 2 :], hidden)
        left = -fourier.mirrored(both[:0:-1, 1][..., None])[..., 0]  # which turns its sign, as that of x
        return np.concatenate([left, both[:, 0]])

    def _fitted(
        self, fold: Fold, walkers: np.ndarray, view_rad: np.ndarray, hidden: np.ndarray
    ) -> np.ndarray:
        """Missing dimension (A, M, 1 + 2H, 15) of M walkers."""
        parts = []
        for part in np.array_split(view_rad, max(len(view_rad) // VIEWS_AT_A_TIME, 1)):
            (found,) = fold.reconstruct([self._setting], walkers, part, hidden=hidden)
            whole = np.zeros((*found.estimated.shape[:2], len(found.unknown)))
            whole[..., found.unknown] = found.estimated
            parts.append(whole.reshape(*whole.shape[:2], anatomical.JOINTS, 3, -1)[..., 2, :])
        return np.swapaxes(np.concatenate(parts), -1, -2)

    def reconstruct(self, fold: HeldOut, walk: Walk, view_rad: np.ndarray) -> Reconstruction:
        """Return a walk from A views, and the coefficients of the eigenwalkers that its reconstruction has."""
        walker = self._data.coefficients[walk.number]
        missing = self.missing(self.fold(walk.number), walk.number, view_rad)
        turned = view_rad[:, None, None]
        full = camera.combine(camera.project(walker, turned), missing, turned)
        coefficients = linear_model.coefficients(
            fold.model, linear_model.flatten(full), measured=walk.measured
        )
        return Reconstruction(missing, camera.missing_dimension(walker, turned) - missing, coefficients)

    def estimate(self, walk: int, view_rad: np.ndarray) -> ViewEstimate:
        """The view angle of a walk from A views: the highest mode of its posterior.

        The costs are 1 and by how much it is likelier than the next mode.
        """
        if self._data.unmeasured[walk].any():
            raise InvalidInput(
                "the anatomical method needs every joint to find the view",
                str(self._data.clip[walk]),
                "data.pattern= that leaves it out",
                code="joints_not_measured",
            )
        walker = anatomical.by_joint(self._data.coefficients[walk])
        shown = np.einsum("aij,kjb->akib", anatomical.image_axes(view_rad)[:, :2], walker)
        costs = anatomical.view_costs(self.prior(walk), shown, CANDIDATES, noise=self._setting.noise)
        found = anatomical.posterior_of(costs)
        likelier = np.exp(np.minimum(found.other_cost / 2.0, MOST_LIKELIER))
        one = np.ones(len(view_rad))
        return ViewEstimate(
            angle_rad=found.angle_rad,
            coefficients=np.empty((len(view_rad), 0)),
            cost=one,
            runner_up_cost=likelier,
            converged=one > 0,
            n_iterations=np.zeros(len(one), int),
        )


METHODS = (
    Method(
        "anatomical",
        Style("anatomical", "green"),
        lambda fold, walk, views: fold.prepared.reconstruct(fold, walk, views),
        lambda fold, walk, views: fold.prepared.estimate(walk.number, views),
        title="Anatomical",
        prepare=AnatomicalApproach,
    ),
)
