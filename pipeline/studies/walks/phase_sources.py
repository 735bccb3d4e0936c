"""One walker seen from known views, under either source of phase and frequency (`sweep.phase_source`).

Both sources answer the same questions, so that the sweep asks them alike: the missing dimension reconstructed,
how far it is off, and the error for every sigma²; `given` asks them of another model.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Self

import numpy as np

from pipeline.clips.walks import Walks
from pipeline.core import errors, fourier, observation, reconstruction
from pipeline.core.linear_model import LinearModel
from pipeline.studies.walks.dataset import FourierSamples

PHASES = ("phase_rad", "phase_error_rad")
"""What only the observed source finds, beside the reconstruction."""


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

    def given(self, fold: LinearModel) -> Self:
        """Return the same views with another model."""
        other = copy.copy(self)
        other.fold = fold
        return other


class Motion3d(Views):
    """One walker from A known views, phase and frequency known from the 3D motion: the papers' way."""

    def __init__(self, fold: LinearModel, sample: np.ndarray, residual: np.ndarray, view: np.ndarray) -> None:
        self.fold, self._sample, self._residual, self._view = fold, sample, residual, view
        self.residual_power = errors.along_missing(residual, view)

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension: of the motion, or of its Fourier part."""
        covariance = temporal if of_motion else temporal - self._residual
        return errors.missing_variance(covariance, average, self._view, kind=kind)

    def reconstruct(self, noise_variance: float | None) -> Reconstruction:
        """Return the missing dimension, and how far it is off."""
        views = reconstruction.from_known_views(
            self.fold, self._sample, self._view, noise_variance=noise_variance
        )
        return Reconstruction(views.delta, views.missing, views.coefficients, {})

    def error_path(self, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², residual left out."""
        return reconstruction.error_path(self.fold, self._sample, self._view, noise_variances)


class Observed2d(Views):
    """One walker from A views, phase and frequency from each view alone: what a 2D input allows."""

    def __init__(
        self, fold: LinearModel, clips: Walks, data: FourierSamples, r: int, view: np.ndarray
    ) -> None:
        walk = int(data.walk[r])
        motion = clips.motion(walk)
        rate = float(clips.frame_rate_hz[walk])
        self.fold = fold
        self.clip = observation.observe(
            data.scale[r] * (motion - data.origin_mm[r]),
            rate,
            view,
            harmonics=data.coefficients.shape[1] // 2,
        )
        self.residual_power = self.clip.residual_power
        # Series of slightly different frequencies agree in the middle of the clip, not at its first frame.
        to_middle_s = (len(motion) - 1) / (2 * rate)
        drift = 2 * np.pi * (data.frequency_hz[r] - self.clip.frequency_hz) * to_middle_s
        self._phase = data.phase_rad[r] + drift

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,) of the missing dimension: of the motion, or of its Fourier part."""
        variance = errors.missing_variance(temporal, average, self.clip.view_angle_rad, kind=kind)
        return variance if of_motion else variance - errors.walker_error(self.residual_power)

    def found(self, phase_rad: np.ndarray) -> dict[str, np.ndarray]:
        """Phases (A,) of a fit and how far they are from the 3D motion's."""
        off = np.mod(phase_rad - self._phase + np.pi, 2 * np.pi) - np.pi
        return {"phase_rad": phase_rad, "phase_error_rad": off}

    def reconstruct(self, noise_variance: float | None) -> Reconstruction:
        """Return the missing dimension, and how far it is off."""
        views = reconstruction.from_known_views_unknown_phase(
            self.fold,
            self.clip.image,
            self.clip.view_angle_rad,
            noise_variance=noise_variance,
            frequency_hz=self.clip.frequency_hz,
        )
        missing = fourier.shift(views.missing[..., None], self._phase)[..., 0]
        delta = self.clip.missing - views.missing
        return Reconstruction(delta, missing, views.coefficients, self.found(views.phase_rad))

    def error_path(self, noise_variances: np.ndarray) -> np.ndarray:
        """E_a of MAP for every view and sigma², each with the phase that it finds, residual left out."""
        return reconstruction.error_path_unknown_phase(self.fold, self.clip, noise_variances)
