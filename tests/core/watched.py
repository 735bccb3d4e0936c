"""Walkers as one view shows them, at a phase and a frequency that nobody tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from pipeline.core import camera, fourier
from pipeline.core.linear_model import LinearModel, unflatten
from pipeline.core.reconstruction import PhasedView, from_known_view_unknown_phase
from pipeline.skeleton import WALKER15
from tests.strategies import Fold

RATE_HZ = 100.0
VIEWS = np.radians([-90.0, -50.0, 0.0, 30.0, 90.0])
noises = st.sampled_from([None, 1.0, 70.0, 1e4])


def wrapped(angle: np.ndarray) -> np.ndarray:
    return np.mod(angle + np.pi, 2 * np.pi) - np.pi


def played(
    w: np.ndarray, frequency_hz: float, phase_rad: float, seconds: float, *, rate_hz: float = RATE_HZ
) -> np.ndarray:
    """Positions (T, J, 3) of a walker whose phase at the first frame is given."""
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    return fourier.synthesise(fourier.shift(w, -phase_rad), frequency_hz, times)


@dataclass(frozen=True)
class Watched:
    """A clip in one view: the frequency that the view alone gives, and its Fourier coefficients (1 + 2H, 15, 3)."""

    view_rad: float
    frequency_hz: float
    coefficients: np.ndarray

    @property
    def image(self) -> np.ndarray:
        return camera.project(self.coefficients, self.view_rad)

    @property
    def missing(self) -> np.ndarray:
        return camera.missing_dimension(self.coefficients, self.view_rad)


def seen(motion: np.ndarray, view_rad: float, *, rate_hz: float = RATE_HZ, harmonics: int = 2) -> Watched:
    """What a view shows of a motion (T, 15, 3)."""
    image = camera.project(motion, view_rad)
    apart = (image - image[:, list(WALKER15.mirror)]).reshape(len(image), -1)
    hertz = fourier.fundamental_frequency(image, rate_hz, harmonics=harmonics, apart=apart)
    matrix = fourier.design(hertz, np.arange(len(motion)) / rate_hz, harmonics)
    series = np.linalg.lstsq(matrix, motion.reshape(len(motion), -1), rcond=None)[0]
    return Watched(view_rad, hertz, series.reshape(-1, *motion.shape[1:]))


def watched(fold: Fold, view_rad: float, frequency_hz: float = 0.93) -> Watched:
    """A walker whom the model has not seen, at a drawn phase, 2.7 cycles with 3 mm of noise."""
    motion = played(unflatten(fold.sample), frequency_hz, fold.generator.uniform(-np.pi, np.pi), 2.9)
    return seen(motion + 3.0 * fold.generator.standard_normal(motion.shape), view_rad)


def found_in(model: LinearModel, clip: Watched, noise: float | None) -> PhasedView:
    return from_known_view_unknown_phase(
        model, clip.image, clip.view_rad, noise_variance=noise, frequency_hz=clip.frequency_hz
    )


def inside(model: LinearModel, generator: np.random.Generator) -> np.ndarray:
    """A sample within the span of the model; a trailing frequency is in rad/s, as samples have it."""
    k = np.sqrt(model.eigenvalues) * generator.standard_normal(len(model.eigenvalues))
    sample = model.mean + k @ model.components
    sample[225:] /= model.last_scale
    return sample
