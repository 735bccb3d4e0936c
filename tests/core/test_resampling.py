"""Tests of interpolation: linear between samples, exact at samples, and limited to the sequence."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.resampling import frames_at_rate, interpolate
from tests.rejects import rejects
from tests.strategies import seeds

shapes = st.sampled_from([(), (1,), (3,), (15, 3)])
lengths = st.integers(1, 9)


def drawn(seed: int, samples: int, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return a random sequence, and positions within it that include both ends and a whole number."""
    generator = np.random.default_rng(seed)
    last = samples - 1
    inside = np.concatenate([[0, last, last // 2], generator.uniform(0, last, 7)])
    return generator.standard_normal((samples, *shape)), generator.permutation(inside)


@given(seeds, lengths, shapes)
def test_every_coordinate_is_what_numpy_interpolates(seed: int, samples: int, shape: tuple[int, ...]) -> None:
    values, at = drawn(seed, samples, shape)
    interpolated = interpolate(values, at)
    assert interpolated.shape == (len(at), *shape)
    courses = values.reshape(samples, -1).T
    for first, course in zip(interpolated.reshape(len(at), -1).T, courses, strict=True):
        np.testing.assert_allclose(first, np.interp(at, np.arange(samples), course), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("frames", "rate_hz", "wanted_hz", "positions"),
    [
        (7, 100.0, 40.0, [0, 3, 6]),
        (7, 100.0, 50.0, [0, 2, 4, 6]),
        (3, 30.0, 60.0, [0, 1, 2]),
        (3, 30.0, 0.0, [0, 1, 2]),
    ],
)
def test_another_rate_keeps_both_ends_and_is_never_faster(
    frames: int, rate_hz: float, wanted_hz: float, positions: list[float]
) -> None:
    assert frames_at_rate(frames, rate_hz, wanted_hz).tolist() == positions


@given(seeds, lengths, shapes)
def test_whole_positions_give_the_samples_back(seed: int, samples: int, shape: tuple[int, ...]) -> None:
    values, _ = drawn(seed, samples, shape)
    order = np.random.default_rng(seed).permutation(samples)
    np.testing.assert_array_equal(interpolate(values, order.astype(float)), values[order])
    np.testing.assert_array_equal(interpolate(values, order), values[order])  # counted in integers


@given(seeds, st.integers(2, 9), st.floats(-5, 5), st.floats(-5, 5))
def test_constant_rates_are_kept(seed: int, samples: int, rate: float, start: float) -> None:
    _, at = drawn(seed, samples, ())
    np.testing.assert_allclose(
        interpolate(start + rate * np.arange(samples), at), start + rate * at, atol=1e-12
    )


@given(seeds, lengths, st.integers(2, 5))
def test_a_finer_reading_holds_the_coarse_one(seed: int, samples: int, finer: int) -> None:
    values, at = drawn(seed, samples, (3,))
    fine = interpolate(values, np.arange((samples - 1) * finer + 1) / finer)
    np.testing.assert_allclose(fine[::finer], values, atol=1e-12)
    np.testing.assert_allclose(interpolate(fine, finer * at), interpolate(values, at), atol=1e-11)


def test_arguments_stay_as_they_were() -> None:
    values, at = drawn(3, 6, (2,))
    before = values.copy(), at.copy()
    interpolate(values, at)[:] = 0.0
    np.testing.assert_array_equal(values, before[0])
    np.testing.assert_array_equal(at, before[1])


def test_a_missing_sample_is_missing_on_both_of_its_sides() -> None:
    values = np.array([0.0, 1.0, np.nan, 3.0, 4.0])
    interpolated = interpolate(values, np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0]))
    np.testing.assert_array_equal(np.isnan(interpolated), [False, True, True, True, True, False])


def test_sums_of_steps_may_end_a_rounding_beyond() -> None:
    at = np.add.accumulate(np.full(10, 0.7))  # 7 and some of the last digits
    assert at[-1] != 7.0
    values = np.arange(8.0) ** 2
    np.testing.assert_allclose(interpolate(values, at)[-1], 49.0, atol=1e-12)
    np.testing.assert_allclose(interpolate(values, np.array([-1e-15, 7.0 + 1e-14])), [0.0, 49.0], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "at", "rejection"),
    [
        (np.zeros((0, 3)), [0.0], rejects("no_samples")),
        (np.zeros(4), [1.0, -0.1], rejects("beyond_samples", "position 1", position=-0.1)),
        (np.zeros((4, 2)), [3.1], rejects("beyond_samples", "position 0", position=3.1)),
        (np.zeros(4), [0.0, 1.0, np.nan], rejects("beyond_samples", "position 2")),
        (np.zeros(1), [0.5], rejects("beyond_samples", "position 0", position=0.5)),
    ],
)
def test_positions_beyond_the_samples_are_refused(
    values: np.ndarray, at: list[float], rejection: AbstractContextManager
) -> None:
    with rejection:
        interpolate(values, np.array(at))


def test_no_positions_give_no_values() -> None:
    assert interpolate(np.zeros((4, 2)), np.zeros(0)).shape == (0, 2)
