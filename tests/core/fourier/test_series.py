"""Tests of the Fourier representation of a walk [zhang2007 3.1, 3.2] [zhang2004 1, 2]."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import fourier
from pipeline.core.fourier import frequency
from pipeline.skeleton import WALKER15
from tests.core.walks import clip
from tests.rejects import rejects
from tests.strategies import seeds, walker

LEFT, RIGHT = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")
frequencies = st.floats(min_value=0.6, max_value=1.4)


@given(
    seed=seeds,
    frequency_hz=frequencies,
    rate_hz=st.sampled_from([15.0, 29.97, 60.0, 120.0]),
    cycles=st.floats(min_value=1.2, max_value=8.0),
    phase_rad=st.floats(min_value=-3.1, max_value=3.1),
    harmonics=st.integers(min_value=1, max_value=3),
)
@settings(max_examples=40, deadline=None)
def test_analysis_undoes_synthesis(
    seed: int, frequency_hz: float, rate_hz: float, cycles: float, phase_rad: float, harmonics: int
) -> None:
    generator = np.random.default_rng(seed)
    coefficients = walker(generator)
    if harmonics == 1:
        coefficients = coefficients[:3]
    elif harmonics == 3:
        coefficients = np.concatenate([coefficients, 3.0 * generator.standard_normal((2, 15, 3))])
    representation = fourier.represent(
        clip(coefficients, frequency_hz, rate_hz, cycles, phase_rad), rate_hz, harmonics=harmonics
    )
    assert representation.frequency_hz == pytest.approx(frequency_hz, rel=1e-7)
    assert representation.phase_rad == pytest.approx(phase_rad, abs=1e-6)
    np.testing.assert_allclose(representation.coefficients, coefficients, rtol=0, atol=1e-4)
    assert representation.residual_fraction < 1e-10
    assert representation.residual_covariance.shape == (15, 3, 3)


@given(seed=seeds, phase_rad=st.floats(min_value=-10, max_value=10), frequency_hz=frequencies)
@settings(max_examples=40, deadline=None)
def test_a_shift_in_time_turns_each_harmonic_by_its_number(
    seed: int, phase_rad: float, frequency_hz: float
) -> None:
    coefficients = np.random.default_rng(seed).standard_normal((7, 4, 2))
    times = np.linspace(0.0, 3.0, 50)
    shifted = fourier.synthesise(fourier.shift(coefficients, phase_rad), frequency_hz, times)
    later = times - phase_rad / (2 * np.pi * frequency_hz)
    np.testing.assert_allclose(
        shifted, fourier.synthesise(coefficients, frequency_hz, later), rtol=0, atol=1e-9
    )
    turned = fourier.shift(coefficients, phase_rad)
    for h in (1, 2, 3):
        as_complex = coefficients[2 * h - 1] + 1j * coefficients[2 * h]
        expected = as_complex * np.exp(-1j * h * phase_rad)
        np.testing.assert_allclose(turned[2 * h - 1] + 1j * turned[2 * h], expected, rtol=0, atol=1e-12)


def test_a_shift_broadcasts_over_leading_axes() -> None:
    coefficients = np.random.default_rng(0).standard_normal((4, 5, 2, 3))
    phases = np.array([0.0, 0.3, -1.0, 2.0])
    each = np.stack([fourier.shift(w, p) for w, p in zip(coefficients, phases, strict=True)])
    np.testing.assert_array_equal(fourier.shift(coefficients, phases), each)


@given(seed=seeds, phase_rad=st.floats(min_value=-3.1, max_value=3.1), noise_mm=st.sampled_from([0.0, 3.0]))
@settings(max_examples=30, deadline=None)
def test_phase_zero_is_where_the_left_ankle_passes_the_right_going_forwards(
    seed: int, phase_rad: float, noise_mm: float
) -> None:
    generator = np.random.default_rng(seed)
    positions = clip(walker(generator), 0.9, 60.0, 3.7, phase_rad)
    positions += noise_mm * generator.standard_normal(positions.shape)
    w = fourier.represent(positions, 60.0).coefficients
    difference = w[:, LEFT, 1] - w[:, RIGHT, 1]
    assert difference[1] > 0
    assert difference[2] == pytest.approx(0.0, abs=1e-9 * difference[1])


@given(seed=seeds, frequency_hz=st.floats(min_value=0.5, max_value=1.5))
@settings(max_examples=25, deadline=None)
def test_neither_half_nor_double_the_frequency_is_taken(seed: int, frequency_hz: float) -> None:
    """The stride frequency is correct even if the second harmonic contains most of the variance."""
    generator = np.random.default_rng(seed)
    coefficients = walker(generator)
    feet = [LEFT, RIGHT]
    others = [j for j in range(15) if j not in feet]
    coefficients[3:, others] += 150.0 * generator.standard_normal((2, 13, 3))
    representation = fourier.represent(clip(coefficients, frequency_hz, 60.0, 5.5), 60.0)
    assert representation.variance_fractions[1] > representation.variance_fractions[0]
    assert representation.frequency_hz == pytest.approx(frequency_hz, rel=1e-6)
    symmetric = walker(generator)
    symmetric[1:3] *= 1e-3  # only what repeats with every step is left, but the ankles
    symmetric[1, LEFT, 1], symmetric[1, RIGHT, 1] = 250.0, -250.0
    representation = fourier.represent(clip(symmetric, frequency_hz, 60.0, 5.5), 60.0)
    assert representation.frequency_hz == pytest.approx(frequency_hz, rel=1e-6)


@given(seed=seeds, cycles=st.floats(min_value=1.3, max_value=6.0), harmonics=st.integers(1, 4))
@settings(max_examples=25, deadline=None)
def test_fractions_and_residual_sum_to_one(seed: int, cycles: float, harmonics: int) -> None:
    generator = np.random.default_rng(seed)
    positions = clip(walker(generator), 0.9, 60.0, cycles)
    positions += 30.0 * generator.standard_normal(positions.shape)
    representation = fourier.represent(positions, 60.0, harmonics=harmonics)
    assert representation.variance_fractions.shape == (harmonics,)
    assert (representation.variance_fractions > 0).all()
    assert representation.variance_fractions.sum() + representation.residual_fraction == pytest.approx(
        1.0, abs=1e-12
    )
    centred = positions - positions.mean(axis=0)
    covariance = np.einsum("tja,tjb->jab", centred, centred) / len(positions)
    np.testing.assert_allclose(
        representation.temporal_covariance, covariance, rtol=0, atol=1e-12 * np.abs(covariance).max()
    )
    shares = np.trace(representation.residual_covariance, axis1=1, axis2=2).sum()
    assert representation.residual_fraction == pytest.approx(
        shares / np.trace(covariance, axis1=1, axis2=2).sum()
    )


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_the_residual_is_orthogonal_to_every_column_of_the_series(seed: int) -> None:
    generator = np.random.default_rng(seed)
    positions = clip(walker(generator), 1.0, 50.0, 2.6, 1.0)
    positions += 10.0 * generator.standard_normal(positions.shape)
    representation = fourier.represent(positions, 50.0)
    times = np.arange(len(positions)) / 50.0
    reference = fourier.synthesise(
        representation.coefficients,
        representation.frequency_hz,
        times + representation.phase_rad / (2 * np.pi * representation.frequency_hz),
    )
    residual = (positions - reference).reshape(len(positions), -1)
    columns = frequency.design(representation.frequency_hz, times, 2)
    assert np.abs(columns.T @ residual).max() < 1e-7 * np.abs(positions).sum()
    residual = residual.reshape(positions.shape)
    covariance = np.einsum("tja,tjb->jab", residual, residual) / len(times)
    np.testing.assert_allclose(
        representation.residual_covariance, covariance, rtol=0, atol=1e-6 * np.abs(covariance).max()
    )


@given(seed=seeds)
@settings(max_examples=25, deadline=None)
def test_a_mirror_image_twice_is_the_walker(seed: int) -> None:
    people = np.random.default_rng(seed).standard_normal((3, 7, 15, 3))
    image = fourier.mirrored(people)
    np.testing.assert_array_equal(fourier.mirrored(image), people)
    assert not np.allclose(image, people)
    np.testing.assert_array_equal(image[1], fourier.mirrored(people[1]))


@given(seed=seeds)
@settings(max_examples=15, deadline=None)
def test_the_mirror_image_is_the_representation_of_the_mirrored_motion(seed: int) -> None:
    coefficients = walker(np.random.default_rng(seed))
    positions = clip(coefficients, 0.9, 60.0, 3.3)
    image = positions[:, list(WALKER15.mirror)] * np.array([-1.0, 1.0, 1.0])
    representation = fourier.represent(image, 60.0)
    np.testing.assert_allclose(representation.coefficients, fourier.mirrored(coefficients), rtol=0, atol=1e-4)
    # Half a cycle lies between the walker's phase zero and the image's.
    assert abs(representation.phase_rad) == pytest.approx(np.pi, abs=1e-6)


def test_a_known_frequency_is_kept() -> None:
    positions = clip(walker(np.random.default_rng(1)), 0.9, 60.0, 4.0)
    representation = fourier.represent(positions, 60.0, frequency_hz=0.91)
    assert representation.frequency_hz == 0.91
    assert representation.residual_fraction > 1e-6


def test_somebody_who_does_not_move_has_no_variance_to_share() -> None:
    representation = fourier.represent(np.ones((90, 15, 3)), 60.0)
    assert representation.variance_fractions.tolist() == [0.0, 0.0]
    assert representation.residual_fraction == 0.0
    np.testing.assert_allclose(representation.coefficients[0], 1.0, rtol=1e-9)


GOOD = np.zeros((100, 15, 3))
HOLED = GOOD.copy()
HOLED[7, 3, 1] = np.nan


@pytest.mark.parametrize(
    ("positions", "rate_hz", "options", "rejection"),
    [
        (GOOD[:, 0], 60.0, {}, rejects("wrong_shape", "positions", shape=(100, 3))),
        (GOOD, 0.0, {}, rejects("out_of_range", "the frame rate", value=0.0)),
        (GOOD, -60.0, {}, rejects("out_of_range", "the frame rate", value=-60.0)),
        (GOOD, np.nan, {}, rejects("out_of_range", "the frame rate")),
        (GOOD, np.inf, {}, rejects("out_of_range", "the frame rate")),
        (GOOD, 60.0, {"harmonics": 0}, rejects("out_of_range", "harmonics", value=0)),
        (GOOD, 60.0, {"frequency_hz": 0.0}, rejects("out_of_range", "the frequency", value=0.0)),
        (GOOD, 60.0, {"frequency_hz": np.nan}, rejects("out_of_range", "the frequency")),
        (GOOD[:5], 60.0, {}, rejects("too_short", frames=5)),
        (GOOD[:30], 60.0, {}, rejects("too_short", duration_s=0.5)),
        (GOOD, 3.0, {"frequency_hz": 0.8}, rejects("rate_too_low", frame_rate_hz=3.0)),
        (GOOD, 1.5, {}, rejects("rate_too_low", frame_rate_hz=1.5)),
        (HOLED, 60.0, {}, rejects("not_finite", index=(7, 3))),
    ],
)
def test_what_cannot_be_represented_is_refused(
    positions: np.ndarray, rate_hz: float, options: dict, rejection: AbstractContextManager
) -> None:
    with rejection:
        fourier.represent(positions, rate_hz, **options)


def test_slope_of_the_basis_of_a_cycle() -> None:
    phase, step = np.linspace(0, 6, 7), 1e-6
    numeric = (fourier.cycle_basis(phase + step, 9) - fourier.cycle_basis(phase - step, 9)) / (2 * step)
    np.testing.assert_allclose(fourier.cycle_slope(phase, 9), numeric, atol=1e-8)
