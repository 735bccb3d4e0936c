"""Tests of reconstruction errors [zhang2007 4.1-4.4] [zhang2004 11, 12, 13]."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera, errors, fourier
from tests.rejects import rejects
from tests.strategies import angles, seeds, walker


def whole_cycles(count: int, rate_hz: float = 40.0, frequency_hz: float = 0.8) -> np.ndarray:
    """Return the sample times of a number of whole cycles."""
    return np.arange(round(count * rate_hz / frequency_hz)) / rate_hz


@given(seed=seeds, cycles=st.integers(1, 4), harmonics=st.integers(1, 3))
@settings(max_examples=40, deadline=None)
def test_the_error_of_coefficients_is_the_mean_over_time(seed: int, cycles: int, harmonics: int) -> None:
    """The error computed from Fourier coefficients equals the printed mean over time (Parseval's theorem)."""
    generator = np.random.default_rng(seed)
    original, reconstructed = generator.standard_normal((2, 1 + 2 * harmonics, 15, 1))
    times = whole_cycles(cycles)
    over_time = errors.absolute_error_over_time(
        *(fourier.synthesise(w, 0.8, times)[..., 0] for w in (original, reconstructed))
    )
    error = errors.absolute_error((original - reconstructed)[..., 0])
    assert error.shape == (15,)
    np.testing.assert_allclose(error, over_time, rtol=1e-10)


@given(seed=seeds, angle=angles, cycles=st.integers(2, 4))
@settings(max_examples=30, deadline=None)
def test_what_the_motion_has_beyond_its_series_adds_to_the_error(
    seed: int, angle: float, cycles: int
) -> None:
    """With `truth: motion`, the error includes a third harmonic and noise that the Fourier series does not describe."""
    generator = np.random.default_rng(seed)
    times = whole_cycles(cycles)
    motion = fourier.synthesise(walker(generator), 0.8, times)
    motion += fourier.synthesise(5.0 * generator.standard_normal((7, 15, 3)), 0.8, times)
    motion += 3.0 * generator.standard_normal(motion.shape)
    series = fourier.represent(motion, 40.0, frequency_hz=0.8)
    assert series.residual_fraction > 1e-4
    wrong = series.coefficients + 10.0 * generator.standard_normal((5, 15, 3))
    begun = times + series.phase_rad / (2 * np.pi * 0.8)
    printed = errors.absolute_error_over_time(
        camera.missing_dimension(motion, angle),
        camera.missing_dimension(fourier.synthesise(wrong, 0.8, begun), angle),
    )
    delta = camera.missing_dimension(series.coefficients - wrong, angle)
    power = errors.along_missing(series.residual_covariance, np.array([angle]))[0]
    np.testing.assert_allclose(errors.absolute_error(delta, power), printed, rtol=1e-9)


def test_errors_of_many_views_at_once() -> None:
    delta = np.random.default_rng(0).standard_normal((4, 6, 5, 15))
    error = errors.absolute_error(delta)
    assert error.shape == (4, 6, 15)
    np.testing.assert_allclose(error[2, 3], errors.absolute_error(delta[2, 3]), rtol=1e-13)


def test_an_error_worked_out_in_the_head() -> None:
    delta = np.zeros((5, 2))
    delta[:, 0] = [3.0, 2.0, 0.0, 0.0, 4.0]  # 9 + 4/2 + 16/2
    np.testing.assert_allclose(errors.absolute_error(delta), [19.0, 0.0])
    np.testing.assert_allclose(errors.absolute_error(delta, np.array([1.0, 2.0])), [20.0, 2.0])
    assert errors.walker_error(np.array([19.0, 0.0])) == 9.5
    assert errors.walker_error(np.array([19.0, np.nan, 1.0])) == 10.0  # of the joints that have one
    assert errors.parseval_weights(5).tolist() == [1.0, 0.5, 0.5, 0.5, 0.5]


@given(seed=seeds, view=st.lists(angles, min_size=1, max_size=5))
@settings(max_examples=30, deadline=None)
def test_variance_along_the_missing_dimension_is_that_of_the_projected_series(
    seed: int, view: list[float]
) -> None:
    generator = np.random.default_rng(seed)
    mixing = generator.standard_normal((15, 3, 3))
    motion = np.einsum("tja,jab->tjb", generator.standard_normal((60, 15, 3)), mixing)
    centred = motion - motion.mean(axis=0)
    covariance = np.einsum("tja,tjb->jab", centred, centred) / len(motion)
    variance = errors.along_missing(covariance, np.array(view))
    assert variance.shape == (len(view), 15)
    direct = np.stack([camera.missing_dimension(motion, angle).var(axis=0) for angle in view])
    np.testing.assert_allclose(variance, direct, rtol=1e-9, atol=1e-9)
    first = errors.along_missing(covariance[0], np.array(view))
    np.testing.assert_allclose(first, direct[:, 0], rtol=1e-9, atol=1e-9)


@given(seed=seeds, view=st.lists(angles, min_size=1, max_size=5))
@settings(max_examples=30, deadline=None)
def test_both_readings_of_the_missing_variance(seed: int, view: list[float]) -> None:
    """The variance of the missing dimension, per joint or over all joints, equals that of projected motion."""
    generator = np.random.default_rng(seed)
    motion = fourier.synthesise(walker(generator), 0.8, whole_cycles(2))
    motion += generator.standard_normal(motion.shape)
    representation = fourier.represent(motion, 40.0, frequency_hz=0.8)
    projected = [camera.missing_dimension(motion, angle) for angle in view]
    temporal = errors.missing_variance(
        representation.temporal_covariance, representation.coefficients[0], np.array(view)
    )
    np.testing.assert_allclose(temporal, [p.var(axis=0).mean() for p in projected], rtol=1e-9)
    overall = errors.missing_variance(
        representation.temporal_covariance, representation.coefficients[0], np.array(view), kind="overall"
    )
    np.testing.assert_allclose(overall, [p.var() for p in projected], rtol=1e-9)
    assert (overall >= temporal).all()
    single = errors.missing_variance(
        representation.temporal_covariance, representation.coefficients[0], np.array(view[0])
    )
    np.testing.assert_array_equal(single, temporal[:1])


def test_a_relative_error_divides_by_the_variance_of_the_missing_dimension() -> None:
    """The relative error of every joint is its absolute error divided by one common variance [zhang2007 4.3, 4.4]."""
    absolute = np.array([[2.0, 4.0], [9.0, 3.0]])
    relative = errors.relative_error(absolute, np.array([[2.0], [3.0]]))
    assert relative.tolist() == [[1.0, 2.0], [3.0, 1.0]]
    np.testing.assert_allclose(
        errors.walker_error(relative), errors.walker_error(absolute) / np.array([2.0, 3.0])
    )
    # To predict each joint's mean and nothing else is an error of one, where all joints vary alike.
    still = np.zeros((5, 15))
    still[1] = 7.0
    assert errors.relative_error(errors.absolute_error(still), 7.0**2 / 2).tolist() == [1.0] * 15


def test_an_unknown_kind_of_variance_is_refused() -> None:
    with rejects("unknown_choice", "the kind of variance", value="spatial"):
        errors.missing_variance(np.zeros((15, 3, 3)), np.zeros((15, 3)), np.zeros(1), kind="spatial")
