"""Anatomical reconstruction as an additional method of the sweeps that compare reconstruction methods.

It is added with ``sweep.methods=[…,anatomical]``.

It uses the data set's harmonics and walks, and the model's default settings for all people.  The ladder
(`sweeps.structure`) instead selects the settings of each person on the other people.
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
"""Number of views that are computed together, so that their arrays fit into a processor's cache."""
MAX_LOG_RATIO = 100.0
"""Upper limit of the logarithm of a likelihood ratio."""


class AnatomicalApproach:
    """Reconstruction of every walk by a prior that is trained on all other people."""

    def __init__(self, data: FourierSamples) -> None:
        options = AnatomicalModel()
        self._data = data
        self._people = People(data, options.population(data))
        self._setting = anatomical_setting(options, self._people.harmonics)

    def fold(self, walk: int) -> Fold:
        """Return the models that are trained on everyone except the person of this walk."""
        people = self._people.model.people
        return self._people.fold(np.flatnonzero(people == self._data.person[walk])[0])

    def prior(self, walk: int) -> Prior:
        """Return the prior that is trained on everyone except the person of this walk."""
        return self.fold(walk).prior(self._setting)

    def missing(self, fold: Fold, walk: int, view_rad: np.ndarray) -> np.ndarray:
        """Return the reconstructed missing dimension (A, 1 + 2H, 15) of one walk from each of A views, mm.

        The prior is symmetric, so a left view equals the right view of the mirror image.  A symmetric grid therefore
        needs only half of its conditionals.  Joints that were not measured are hidden.
        """
        walker, hidden = self._data.coefficients[walk], self._data.unmeasured[walk]
        if hidden.any() or not mirrored_grid(view_rad):
            return self._fitted(fold, walker[None], view_rad, hidden)[:, 0]
        sides = np.stack([walker, fourier.mirrored(walker)])
        both = self._fitted(fold, sides, view_rad[len(view_rad) // 2 :], hidden)
        left = -fourier.mirrored(both[:0:-1, 1][..., None])[..., 0]  # mirroring changes the sign, as for x
        return np.concatenate([left, both[:, 0]])

    def _fitted(
        self, fold: Fold, walkers: np.ndarray, view_rad: np.ndarray, hidden: np.ndarray
    ) -> np.ndarray:
        """Return the reconstructed missing dimension (A, M, 1 + 2H, 15) of M walks from each of A views, mm."""
        parts = []
        for part in np.array_split(view_rad, max(len(view_rad) // VIEWS_AT_A_TIME, 1)):
            (estimate,) = fold.reconstruct([self._setting], walkers, part, hidden=hidden)
            coefficients = np.zeros((*estimate.estimated.shape[:2], len(estimate.unknown)))
            coefficients[..., estimate.unknown] = estimate.estimated
            parts.append(coefficients.reshape(*coefficients.shape[:2], anatomical.JOINTS, 3, -1)[..., 2, :])
        return np.swapaxes(np.concatenate(parts), -1, -2)

    def reconstruct(self, fold: HeldOut, walk: Walk, view_rad: np.ndarray) -> Reconstruction:
        """Return the reconstruction of one walk from each of A views, with its eigenwalker coefficients."""
        walker = self._data.coefficients[walk.number]
        missing = self.missing(self.fold(walk.number), walk.number, view_rad)
        turned = view_rad[:, None, None]
        full = camera.combine(camera.project(walker, turned), missing, turned)
        coefficients = linear_model.coefficients(
            fold.model, linear_model.flatten(full), measured=walk.measured
        )
        return Reconstruction(missing, camera.missing_dimension(walker, turned) - missing, coefficients)

    def estimate(self, walk: int, view_rad: np.ndarray) -> ViewEstimate:
        """Return the estimated view angle of a walk in each of A views, which has the highest posterior probability.

        The costs are 1 and the likelihood ratio of this mode to the next one.
        """
        if self._data.unmeasured[walk].any():
            raise InvalidInput(
                "the anatomical method estimates the view angle only of walks in which every joint was measured",
                str(self._data.clip[walk]),
                "a data.pattern that does not match this clip",
                code="joints_not_measured",
            )
        walker = anatomical.by_joint(self._data.coefficients[walk])
        images = np.einsum("aij,kjb->akib", anatomical.image_axes(view_rad)[:, :2], walker)
        costs = anatomical.view_costs(self.prior(walk), images, CANDIDATES, noise=self._setting.noise)
        posterior = anatomical.posterior_of(costs)
        ratio = np.exp(np.minimum(posterior.other_cost / 2.0, MAX_LOG_RATIO))
        ones = np.ones(len(view_rad))
        return ViewEstimate(
            angle_rad=posterior.angle_rad,
            coefficients=np.empty((len(view_rad), 0)),
            cost=ones,
            runner_up_cost=ratio,
            converged=ones > 0,
            n_iterations=np.zeros(len(ones), int),
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
