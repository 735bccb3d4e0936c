"""Tests of the fundamental frequency of a walk, and of the columns of its Fourier series [zhang2007 3.1]."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.core.fourier import frequency
from tests.core.walks import clip
from tests.strategies import walker


@pytest.mark.parametrize("cycles", [3.3, 8.6, 27.4, 63.7])
@pytest.mark.parametrize("second", [1.0, 5.0])
def test_the_frequency_is_found_in_noise(cycles: float, second: float) -> None:
    """The frequency of a noisy walk is found in short and in long clips, where the fit has side lobes."""
    for seed in range(4):
        generator = np.random.default_rng(seed)
        coefficients = walker(generator)
        coefficients[3:] *= second
        frequency_hz = generator.uniform(0.7, 1.3)
        positions = clip(coefficients, frequency_hz, 30.0, cycles, generator.uniform(-3, 3))
        positions += generator.standard_normal(positions.shape)
        result = frequency.fundamental_frequency(positions, 30.0)
        assert result == pytest.approx(frequency_hz, rel=1e-4 * max(1.0, (8.0 / cycles) ** 1.5))


@pytest.mark.parametrize("factor", [0.5, 2.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_wander_at_half_or_double_the_frequency_is_not_taken_for_the_walk(seed: int, factor: float) -> None:
    """A large body sway at half or double the stride frequency is not mistaken for the stride."""
    generator = np.random.default_rng(seed)
    positions = clip(walker(generator), 0.8, 60.0, 9.0)
    wander = np.zeros((3, 15, 3))
    wander[1, :, 0] = 300.0
    positions += clip(wander, factor * 0.8, 60.0, 9.0 * factor)[: len(positions)]
    frequency_hz = frequency.fundamental_frequency(positions, 60.0)
    assert frequency_hz == pytest.approx(0.8, rel=0.02)


def test_the_columns_are_printed_ones() -> None:
    """The columns of the Fourier series are those of [zhang2007 3.1], with sines before cosines."""
    t = np.array([0.1, 0.7])
    wt = 2 * np.pi * 0.8 * t
    printed = np.stack([np.ones(2), np.sin(wt), np.cos(wt), np.sin(2 * wt), np.cos(2 * wt)], axis=1)
    np.testing.assert_allclose(frequency.design(0.8, t, 2), printed, rtol=1e-15)


def test_one_sinusoid_explains_what_a_regression_says() -> None:
    generator = np.random.default_rng(3)
    times = np.arange(170) / 50.0
    signal = 5.0 + np.sin(2 * np.pi * 0.9 * times) + generator.standard_normal(170)
    result = frequency.single_frequency_power(np.array([0.5, 0.9]), times, signal)
    for frequency_hz, power in zip((0.5, 0.9), result, strict=True):
        columns = frequency.design(frequency_hz, times, 1)
        fitted = columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]
        assert power == pytest.approx(((fitted - signal.mean()) ** 2).sum(), rel=1e-9)


def test_waves_are_the_basis_of_a_cycle() -> None:
    phases = np.linspace(-7.0, 9.0, 50)
    np.testing.assert_allclose(frequency.waves(phases, 4).T, frequency.cycle_basis(phases, 9), atol=1e-12)
    step = frequency.cycle_basis(phases + 1e-6, 9) - frequency.cycle_basis(phases - 1e-6, 9)
    np.testing.assert_allclose(frequency.cycle_slope(phases, 9), step / 2e-6, atol=1e-8)
