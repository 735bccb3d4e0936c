"""Tests of the aSpace: eigenvectors of an action's postures, their number, projection and inverse projection."""

from __future__ import annotations

from fractions import Fraction
from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core import aspace
from pipeline.core.aspace import smallest_dimensions
from tests.rejects import rejects
from tests.strategies import seeds

spectra = st.lists(st.integers(0, 10**6), min_size=1, max_size=37).map(lambda e: sorted(e, reverse=True))
"""Random integer eigenvalues, whose sums and ratios are known exactly."""


def performances(seed: int, count: int = 4, numbers: int = 37, rank: int = 37) -> list[np.ndarray]:
    """Return random performances of different lengths whose postures vary in `rank` directions."""
    generator = np.random.default_rng(seed)
    directions = generator.standard_normal((rank, numbers)) * (0.7 ** np.arange(rank))[:, None]
    lengths = generator.integers(20, 40, count)
    return [
        0.3 + np.cumsum(generator.standard_normal((frames, rank)), axis=0) @ directions for frames in lengths
    ]


# --- the smallest b ---------------------------------------------------------------------------------------


@given(spectra.filter(any), st.fractions(0, 1, max_denominator=10**4).filter(bool))
def test_the_smallest_b_is_the_first_of_all_that_are_enough(spectrum: list[int], share: Fraction) -> None:
    enough = [b for b in range(1, len(spectrum) + 1) if sum(spectrum[:b]) >= share * sum(spectrum)]
    dimensions = smallest_dimensions(np.array(spectrum, dtype=float), float(sum(spectrum)), float(share))
    assert dimensions == enough[0]


@given(spectra.filter(any), st.data())
def test_a_share_that_b_eigenvalues_hold_exactly_asks_for_no_more(
    spectrum: list[int], data: st.DataObject
) -> None:
    """If b eigenvalues contain a share of the variance exactly, rounding errors do not add an eigenvector."""
    fixed = [Fraction(e, sum(spectrum)) for e in accumulate(spectrum)]
    share = fixed[data.draw(st.integers(0, len(fixed) - 1))]
    dimensions = smallest_dimensions(np.array(spectrum) * 0.1, sum(spectrum) * 0.1, float(share))
    assert dimensions == fixed.index(share) + 1


def test_b_worked_out_in_the_head() -> None:
    eigenvalues = np.array([4.0, 4.0, 1.0, 1.0, 0.0])
    shares = (0.1, 0.4, 0.41, 0.8, 0.9, 0.95, 1.0)
    assert [smallest_dimensions(eigenvalues, 10.0, share) for share in shares] == [1, 1, 2, 2, 3, 4, 4]


def test_what_the_eigenvalues_at_hand_cannot_hold_takes_all_of_them() -> None:
    assert smallest_dimensions(np.array([4.0, 1.0]), 10.0, 0.95) == 2


@pytest.mark.parametrize("share", [0.0, -0.5, 1.01, np.nan, np.inf])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with rejects("out_of_range", "the share of the variance"):
        smallest_dimensions(np.array([1.0]), 1.0, share)
    with rejects("out_of_range", "the share of the variance"):
        aspace.learn(performances(1), variance=share)


# --- the space --------------------------------------------------------------------------------------------


@given(seeds)
def test_it_is_the_eigendecomposition_of_the_covariance_of_all_postures(seed: int) -> None:
    given_ = performances(seed)
    space = aspace.learn(given_, variance=0.95)
    together = np.concatenate(given_)
    covariance = np.cov(together.T)
    values = np.linalg.eigvalsh(covariance)[::-1]
    np.testing.assert_allclose(space.mean, together.mean(axis=0), atol=1e-12 * np.abs(together).max())
    np.testing.assert_allclose(space.eigenvalues, values, atol=1e-10 * values[0])
    assert space.total_variance == pytest.approx(np.trace(covariance), rel=1e-10)
    left = covariance @ space.components.T - space.components.T * space.eigenvalues[: space.dimensions]
    assert np.abs(left).max() < 1e-9 * values[0]
    np.testing.assert_allclose(
        space.components @ space.components.T, np.eye(space.dimensions), rtol=0, atol=1e-10
    )
    largest = np.abs(space.components).argmax(axis=1)
    assert (space.components[np.arange(space.dimensions), largest] > 0).all()
    # The smallest number of dimensions: one less would not do.
    fixed = np.cumsum(values) / values.sum()
    assert fixed[space.dimensions - 1] >= 0.95
    assert space.dimensions == 1 or fixed[space.dimensions - 2] < 0.95
    assert space.variance_held == pytest.approx(fixed[space.dimensions - 1], rel=1e-10)


def test_long_performances_count_by_their_postures() -> None:
    """The mean posture is averaged over all postures of the action, so long performances have more weight."""
    short, long = np.zeros((1, 2)), np.full((3, 2), 4.0)
    np.testing.assert_allclose(aspace.learn([short, long]).mean, 3.0)


@given(seeds, st.floats(0.2, 1.0))
def test_projected_coordinates_are_uncorrelated_and_have_the_eigenvalues_as_variances(
    seed: int, variance: float
) -> None:
    given_ = performances(seed)
    space = aspace.learn(given_, variance=variance)
    coordinates = np.concatenate([space.project(p) for p in given_])
    assert coordinates.shape == (sum(map(len, given_)), space.dimensions)
    np.testing.assert_allclose(
        np.cov(coordinates.T).reshape(space.dimensions, -1),
        np.diag(space.eigenvalues[: space.dimensions]),
        rtol=0,
        atol=1e-9 * space.eigenvalues[0],
    )


@given(seeds)
def test_with_every_dimension_postures_come_back(seed: int) -> None:
    given_ = performances(seed)
    space = aspace.learn(given_, dimensions=37)
    assert space.variance_held == pytest.approx(1.0, rel=1e-12)
    for postures in given_:
        back = space.postures(space.project(postures))
        np.testing.assert_allclose(back, postures, rtol=0, atol=1e-10 * np.abs(postures).max())


@given(seeds, st.integers(1, 12))
def test_with_fewer_they_come_back_but_for_the_variance_that_is_not_held(seed: int, kept: int) -> None:
    given_ = performances(seed)
    space = aspace.learn(given_, dimensions=kept)
    together = np.concatenate(given_)
    lost = together - space.postures(space.project(together))
    assert (lost**2).sum() / (len(together) - 1) == pytest.approx(
        (1.0 - space.variance_held) * space.total_variance, rel=1e-6, abs=1e-9 * space.total_variance
    )


@given(seeds, st.integers(1, 20))
def test_points_of_the_space_come_back_whatever_their_shape(seed: int, kept: int) -> None:
    space = aspace.learn(performances(seed), dimensions=kept)
    points = np.random.default_rng(seed).standard_normal((2, 3, kept))
    moved = space.postures(points)
    assert moved.shape == (2, 3, 37)
    np.testing.assert_allclose(space.project(moved), points, rtol=0, atol=1e-10)
    np.testing.assert_allclose(space.project(moved[1, 2]), points[1, 2], rtol=0, atol=1e-10)


def test_postures_that_vary_in_three_ways_need_three_dimensions() -> None:
    space = aspace.learn(performances(3, rank=3), variance=1.0)
    assert space.dimensions == 3
    assert space.variance_held == pytest.approx(1.0, rel=1e-12)


def test_fewer_postures_than_numbers_span_one_dimension_less_than_they_are() -> None:
    space = aspace.learn([np.random.default_rng(1).standard_normal((4, 37))], variance=1.0)
    assert (space.dimensions, len(space.eigenvalues)) == (3, 3)


def test_dimensions_asked_for_override_the_share() -> None:
    given_ = performances(5)
    assert aspace.learn(given_, variance=0.95, dimensions=9).dimensions == 9
    first, all_ = aspace.learn(given_, dimensions=2), aspace.learn(given_, variance=1.0)
    np.testing.assert_array_equal(first.components, all_.components[:2])
    np.testing.assert_array_equal(first.eigenvalues, all_.eigenvalues)


def test_nothing_that_is_given_is_changed() -> None:
    given_ = performances(7)
    before = [p.copy() for p in given_]
    aspace.learn(given_).project(given_[0])
    for old, new in zip(before, given_, strict=True):
        np.testing.assert_array_equal(old, new)


# --- refusals ---------------------------------------------------------------------------------------------


def test_no_performances_are_refused() -> None:
    with rejects("no_performances"):
        aspace.learn([])


@pytest.mark.parametrize("postures", [0, 1])
def test_a_posture_alone_is_refused(postures: int) -> None:
    with rejects("too_few_postures", count=postures):
        aspace.learn([np.ones((postures, 37)), np.ones((0, 37))])


@pytest.mark.parametrize("value", [0.0, 0.1, 1e9 / 3])
def test_postures_that_are_all_the_same_are_refused_even_if_their_mean_is_rounded(value: float) -> None:
    with rejects("identical_postures", count=11):
        aspace.learn([np.full((4, 37), value), np.full((7, 37), value)])


@pytest.mark.parametrize("dimensions", [0, -1, 38])
def test_dimensions_that_do_not_exist_are_refused(dimensions: int) -> None:
    with rejects("out_of_range", "the number of dimensions", value=dimensions):
        aspace.learn(performances(1), dimensions=dimensions)


def test_more_dimensions_than_postures_span_are_refused() -> None:
    few = np.random.default_rng(1).standard_normal((4, 37))
    with rejects("out_of_range", "the number of dimensions", value=4):
        aspace.learn([few], dimensions=4)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_refused_by_performance_and_posture(wrong: float) -> None:
    given_ = performances(1)
    given_[2][5, 30] = wrong
    with rejects("not_finite", "performance 2", frame=5):
        aspace.learn(given_)


def test_performances_of_different_postures_are_refused() -> None:
    with rejects("wrong_shape", "performance 1", shape=(5, 36)):
        aspace.learn([np.zeros((4, 37)), np.zeros((5, 36))])
    with rejects("wrong_shape", "performance 0", shape=(37,)):
        aspace.learn([np.zeros(37)])
