"""Tests of the disturbances of walks in the benchmark of the number of components: their sizes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from pipeline.skeleton import LEFT_LEG
from tests.benchmarks import components, over_range

RATE_HZ = components.RATE_HZ


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """Return forty strides (T, 15, 3), mm, of one second each, in which only the left ankle moves."""
    positions = np.zeros((round(40 * RATE_HZ), 15, 3))
    positions[:, LEFT_LEG[2], 1] = 300.0 * np.sin(2.0 * np.pi * np.arange(len(positions)) / RATE_HZ)
    return positions


def test_soft_tissue_moves_by_its_size_and_repeats_with_the_stride(walk: np.ndarray) -> None:
    rng = np.random.default_rng(3)
    moves = np.stack([components.tissue(walk, 5.0, rng) - walk for _ in range(20)])
    assert np.sqrt((moves**2).mean()) == pytest.approx(5.0, rel=0.05)
    moved = moves[0]
    middle, stride = slice(600, 1200), round(RATE_HZ)
    np.testing.assert_allclose(moved[middle], np.roll(moved, stride, axis=0)[middle], atol=0.05)


def test_strides_last_and_reach_as_varied_as_said_and_not_at_all_without(walk: np.ndarray) -> None:
    same = components.strides(walk, 0.0, np.random.default_rng(1))
    np.testing.assert_allclose(same, walk[: len(same)], atol=1e-9)
    varied = components.strides(walk, 10.0, np.random.default_rng(1))[:, LEFT_LEG[2], 1]
    upward = np.flatnonzero((varied[:-1] < 0) & (varied[1:] >= 0))
    assert np.std(np.diff(upward) / RATE_HZ) == pytest.approx(0.10, rel=0.35)
    highest = [varied[a:b].max() / 300.0 for a, b in pairwise(upward)]
    assert np.std(highest) == pytest.approx(0.09, rel=0.35)


def test_a_walk_along_a_path_moves_at_the_speed_of_the_belt(walk: np.ndarray) -> None:
    along = components.disturbed((1200.0, walk), "overground", 2.5, np.random.default_rng(1))
    assert along.shape == (300, 15, 3)
    np.testing.assert_allclose(along[-1, 0], [0.0, 1200.0 * 299 / RATE_HZ, 0.0])


def test_as_many_components_are_needed_as_bring_the_rest_to_the_share() -> None:
    left = np.array([1.0, 0.3, 0.05, 0.046, 0.0])
    assert [components.needed(left, share) for share in (0.5, 0.95, 0.954, 0.955)] == [1, 2, 3, 4]


def test_coefficients_are_beyond_the_range_above_the_highest_and_below_the_lowest() -> None:
    training = np.array([[0.0, -1.0], [2.0, 1.0], [1.0, 0.0]])
    coefficients = np.array([[2.0, -1.0], [2.1, 0.0], [1.0, -1.1], [-0.1, 1.1]])
    assert over_range.over_range(coefficients, training) == pytest.approx(50.0)
