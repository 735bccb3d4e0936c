"""The average synthetic walker, and the axis from women to men along which it can be moved."""

from __future__ import annotations

import functools

import numpy as np

from pipeline.core import fourier, walking
from pipeline.synthetic import walkers
from pipeline.validation import require_range

_RATE_HZ, _DURATION_S, _SEED = 60.0, 4.0, 2007


def synthetic_walker(gender: float = 0.0) -> tuple[np.ndarray, float]:
    """Return the Fourier representation (5, 15, 3), mm, of an average synthetic walker, and its stride frequency, Hz.

    Parameters
    ----------
    gender : float
        -1: the average of women, 1: of men, 0: halfway; beyond: exaggerated.

    Raises
    ------
    InvalidInput
        If the walker would be exaggerated more than sixfold.
    """
    require_range("gender", gender, at_least=-6, at_most=6)
    (women, women_hz), (men, men_hz) = _averages()
    coefficients = (women + men) / 2 + gender * (men - women) / 2
    return coefficients, float(np.sqrt(women_hz * men_hz) * (men_hz / women_hz) ** (gender / 2))


@functools.cache
def _averages() -> tuple[tuple[np.ndarray, float], tuple[np.ndarray, float]]:
    """Average walker and stride frequency of women and of men."""
    people = walkers.walking_population(
        np.random.default_rng(_SEED), duration_s=_DURATION_S, frame_rate_hz=_RATE_HZ, marker_noise_mm=0.0
    )
    series = []
    for positions in people.positions_mm:
        level = walking.treadmill_equivalent(positions, _RATE_HZ, locomotion="treadmill")
        series.append(fourier.represent(walking.set_origin(level, origin="pelvis_mean"), _RATE_HZ))
    coefficients = np.stack([s.coefficients for s in series])
    frequency = np.log([s.frequency_hz for s in series])
    women, men = ~people.male, people.male
    return (
        (coefficients[women].mean(axis=0), float(np.exp(frequency[women].mean()))),
        (coefficients[men].mean(axis=0), float(np.exp(frequency[men].mean()))),
    )
