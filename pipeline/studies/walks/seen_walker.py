"""One walker seen from known views, phase and frequency known from the 3D motion: the papers' way.

Joints that nobody measured are neither observed nor compared: their power is NaN, and the errors made of it.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Self

import numpy as np

from pipeline.core import camera, errors, linear_model, reconstruction
from pipeline.core.linear_model import LinearModel
from pipeline.studies.eigenwalkers.samples import FourierSamples


@dataclass(frozen=True)
class Reconstruction:
    """One walker reconstructed from A views.

    Attributes
    ----------
    delta : (A, 5, 15)
        True less reconstructed missing dimension, mm.
    missing : (A, 5, 15)
        Reconstructed, at phase zero, mm.
    coefficients : (A, N)
        Of the eigenwalkers, mm.
    """

    delta: np.ndarray
    missing: np.ndarray
    coefficients: np.ndarray


class SeenWalker:
    """Walker r of a data set from A known views, to be reconstructed with a model.

    Parameters
    ----------
    fold : LinearModel
    sample : (D,)
    data : FourierSamples
    r : int
    view : (A,)
        rad.
    """

    def __init__(
        self, fold: LinearModel, sample: np.ndarray, data: FourierSamples, r: int, view: np.ndarray
    ) -> None:
        self.fold, self.measured, self._residual = fold, ~data.unmeasured[r], data.residual_covariance[r]
        self._view, self._sample = view, linear_model.without_joints(sample, self.measured)
        self.residual_power = np.where(self.measured, errors.along_missing(self._residual, view), np.nan)

    @property
    def _seen_fold(self) -> LinearModel:
        """The model without the joints that were not measured."""
        return linear_model.of_measured(self.fold, self.measured)

    def given(self, fold: LinearModel) -> Self:
        """Return the same views with another model."""
        other = copy.copy(self)
        other.fold = fold
        return other

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension of measured joints: of the motion, or of its Fourier part."""
        covariance, seen = temporal if of_motion else temporal - self._residual, self.measured
        return errors.missing_variance(covariance[seen], average[seen], self._view, kind=kind)

    def reconstruct(self, noise_variance: float | None) -> Reconstruction:
        """Return the missing dimension, with what the eigenwalkers expect of joints not measured, and its error."""
        views = reconstruction.from_known_views(
            self._seen_fold, self._sample, self._view, noise_variance=noise_variance
        )
        missing = views.missing
        if not self.measured.all():
            walkers = linear_model.unflatten(self.fold.mean + views.coefficients @ self.fold.components)
            expected = camera.missing_dimension(walkers, self._view[:, None, None])
            missing = np.where(self.measured, missing, expected)
        return Reconstruction(views.delta, missing, views.coefficients)

    def average_walker(self) -> Reconstruction:
        """Return the depth of the average walker: of the mean alone, without an estimator."""
        view = self._view[:, None, None]
        off = linear_model.unflatten(self._sample - self._seen_fold.mean)
        missing = camera.missing_dimension(linear_model.unflatten(self.fold.mean), view)
        return Reconstruction(camera.missing_dimension(off, view), missing, np.empty((len(self._view), 0)))

    def error_path(self, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², residual left out; mean over the joints that were measured."""
        path = reconstruction.NoisePath(self._seen_fold, self._view, noise_variances).error(self._sample)
        return path * (len(self.measured) / self.measured.sum())
