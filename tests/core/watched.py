"""Walkers as one view shows them, at a phase and a frequency that nobody tells."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from pipeline.core import fourier, observation
from pipeline.core.linear_model import LinearModel, unflatten
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


def watched(fold: Fold, frequency_hz: float = 0.93) -> observation.ViewedClip:
    """A walker whom the model has not seen, at a drawn phase, 2.7 cycles with 3 mm of noise."""
    motion = played(unflatten(fold.sample), frequency_hz, fold.generator.uniform(-np.pi, np.pi), 2.9)
    return observation.observe(motion + 3.0 * fold.generator.standard_normal(motion.shape), RATE_HZ, VIEWS)


def inside(model: LinearModel, generator: np.random.Generator) -> np.ndarray:
    """A sample within the span of the model; a trailing frequency is in rad/s, as samples have it."""
    k = np.sqrt(model.eigenvalues) * generator.standard_normal(len(model.eigenvalues))
    sample = model.mean + k @ model.components
    sample[225:] /= model.last_scale
    return sample
