"""Errors of one walker seen from known views, phase and frequency known from the 3D motion: the papers' way.

Joints that were not measured are neither observed nor compared: their power is NaN, and so are errors that contain it.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import errors, linear_model, reconstruction
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.methods import Fold, Walk


class SeenWalker:
    """Walk of a data set from A known views, whose reconstructions are compared with it.

    Parameters
    ----------
    data : FourierSamples
    walk : Walk
    view : (A,)
        rad.
    """

    def __init__(self, data: FourierSamples, walk: Walk, view: np.ndarray) -> None:
        self._walk, self._view, self._residual = walk, view, data.residual_covariance[walk.number]
        along = errors.along_missing(self._residual, view)
        self.residual_power = np.where(walk.measured, along, np.nan)

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension of measured joints: of the motion, or of its Fourier part."""
        covariance, seen = temporal if of_motion else temporal - self._residual, self._walk.measured
        return errors.missing_variance(covariance[seen], average[seen], self._view, kind=kind)

    def error_path(self, fold: Fold, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², residual left out; mean over the joints that were measured."""
        measured = self._walk.measured
        model = linear_model.of_measured(fold.model, measured)
        path = reconstruction.NoisePath(model, self._view, noise_variances).error(self._walk.sample)
        return path * (len(measured) / measured.sum())
