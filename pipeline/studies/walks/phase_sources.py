"""One walker seen from known views, under either source of phase and frequency (`sweep.phase_source`).

Both sources answer the same questions, so that the sweep asks them alike: the missing dimension reconstructed,
how far it is off, and the error for every sigma²; `given` asks them of another model.  Joints that nobody measured are
neither observed nor compared: their power is NaN, and the errors made of it.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Self

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import camera, errors, fourier, linear_model, observation, reconstruction
from pipeline.core.linear_model import LinearModel
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.methods import IMAGE_IGNORED_MM2

EVERY_JOINT = np.ones(len(WALKER15.joints), dtype=bool)

PHASES = ("phase_rad", "phase_error_rad")
"""What only the observed source finds, beside the reconstruction."""


@shortened
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
    phases : dict
        Phases (A,) that were found, by name.
    """

    delta: np.ndarray
    missing: np.ndarray
    coefficients: np.ndarray
    phases: dict[str, np.ndarray]


class Views:
    """One walker from A known views, to be reconstructed with a model."""

    fold: LinearModel
    measured: np.ndarray
    """(15,) bool."""

    @property
    def seen_fold(self) -> LinearModel:
        """The model without the joints that were not measured."""
        return linear_model.of_measured(self.fold, self.measured)

    def filled(self, missing: np.ndarray, coefficients: np.ndarray, view: np.ndarray) -> np.ndarray:
        """Return the missing dimension (A, 5, 15) with what the eigenwalkers expect of joints not measured."""
        if self.measured.all():
            return missing
        walkers = linear_model.unflatten(self.fold.mean + coefficients @ self.fold.components)
        expected = camera.missing_dimension(walkers, view[:, None, None])
        return np.where(self.measured, missing, expected)

    def over_measured(self, path: np.ndarray) -> np.ndarray:
        """Return a mean over fifteen joints, of which those not measured gave nothing, as one over the others."""
        return path * (len(self.measured) / self.measured.sum())

    def variance_of(
        self, covariance: np.ndarray, average: np.ndarray, view: np.ndarray, kind: str
    ) -> np.ndarray:
        """Return the variance (A,) of the missing dimension of the joints that were measured."""
        seen = self.measured
        return errors.missing_variance(covariance[seen], average[seen], view, kind=kind)

    def given(self, fold: LinearModel) -> Self:
        """Return the same views with another model."""
        other = copy.copy(self)
        other.fold = fold
        return other


class Motion3d(Views):
    """One walker from A known views, phase and frequency known from the 3D motion: the papers' way."""

    def __init__(
        self,
        fold: LinearModel,
        sample: np.ndarray,
        residual: np.ndarray,
        view: np.ndarray,
        *,
        measured: np.ndarray = EVERY_JOINT,
    ) -> None:
        self.fold, self.measured, self._residual, self._view = fold, measured, residual, view
        self._sample = linear_model.without_joints(sample, measured)
        self.residual_power = np.where(measured, errors.along_missing(residual, view), np.nan)

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension: of the motion, or of its Fourier part."""
        covariance = temporal if of_motion else temporal - self._residual
        return self.variance_of(covariance, average, self._view, kind)

    def reconstruct(self, noise_variance: float | None) -> Reconstruction:
        """Return the missing dimension, and how far it is off."""
        views = reconstruction.from_known_views(
            self.seen_fold, self._sample, self._view, noise_variance=noise_variance
        )
        missing = self.filled(views.missing, views.coefficients, self._view)
        return Reconstruction(views.delta, missing, views.coefficients, {})

    def average_walker(self) -> Reconstruction:
        """Return the depth of the average walker: of the mean alone, without an estimator."""
        view = self._view[:, None, None]
        off = linear_model.unflatten(self._sample - self.seen_fold.mean)
        missing = camera.missing_dimension(linear_model.unflatten(self.fold.mean), view)
        return Reconstruction(camera.missing_dimension(off, view), missing, np.empty((len(view), 0)), {})

    def error_path(self, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², residual left out."""
        path = reconstruction.error_path(self.seen_fold, self._sample, self._view, noise_variances)
        return self.over_measured(path)


class Observed2d(Views):
    """One walker from A views, phase and frequency from each view alone: what a 2D input allows."""

    def __init__(
        self, fold: LinearModel, clips: Walks, data: FourierSamples, r: int, view: np.ndarray
    ) -> None:
        walk = int(data.walk[r])
        motion = clips.motion(walk)
        rate = float(clips.frame_rate_hz[walk])
        self.fold, self.measured = fold, ~data.unmeasured[r]
        positions = data.scale[r] * (motion - data.origin_mm[r])
        self.clip = observation.observe(
            np.where(self.measured[:, None], positions, 0.0),
            rate,
            view,
            harmonics=data.coefficients.shape[1] // 2,
        )
        self.residual_power = np.where(self.measured, self.clip.residual_power, np.nan)
        # Series of slightly different frequencies agree in the middle of the clip, not at its first frame.
        to_middle_s = (len(motion) - 1) / (2 * rate)
        drift = 2 * np.pi * (data.frequency_hz[r] - self.clip.frequency_hz) * to_middle_s
        self._phase = data.phase_rad[r] + drift

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension: of the motion, or of its Fourier part."""
        variance = self.variance_of(temporal, average, self.clip.view_angle_rad, kind)
        return variance if of_motion else variance - errors.walker_error(self.residual_power)

    def found(self, phase_rad: np.ndarray) -> dict[str, np.ndarray]:
        """Phases (A,) of a fit and how far they are from the 3D motion's."""
        off = np.mod(phase_rad - self._phase + np.pi, 2 * np.pi) - np.pi
        return {"phase_rad": phase_rad, "phase_error_rad": off}

    def reconstruct(self, noise_variance: float | None) -> Reconstruction:
        """Return the missing dimension, and how far it is off."""
        views = reconstruction.from_known_views_unknown_phase(
            self.seen_fold,
            self.clip.image,
            self.clip.view_angle_rad,
            noise_variance=noise_variance,
            frequency_hz=self.clip.frequency_hz,
        )
        missing = fourier.shift(views.missing[..., None], self._phase)[..., 0]
        if not self.measured.all():
            at_zero = fourier.shift(missing[..., None], views.phase_rad - self._phase)[..., 0]
            expected = self.filled(at_zero, views.coefficients, self.clip.view_angle_rad)
            missing = fourier.shift(expected[..., None], self._phase - views.phase_rad)[..., 0]
        delta = self.clip.missing - views.missing
        return Reconstruction(delta, missing, views.coefficients, self.found(views.phase_rad))

    def average_walker(self) -> Reconstruction:
        """Return the depth of the average walker, whose phase is fitted to the image."""
        return self.given(linear_model.truncated(self.fold, 1)).reconstruct(IMAGE_IGNORED_MM2)

    def error_path(self, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², each with the phase that it finds, residual left out."""
        path = reconstruction.error_path_unknown_phase(self.seen_fold, self.clip, noise_variances)
        return self.over_measured(path)
