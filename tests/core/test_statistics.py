"""Tests of circular statistics and of Spearman's rank correlation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import statistics
from pipeline.core.statistics import rank_correlation
from tests.rejects import rejects
from tests.strategies import seeds

degrees = st.floats(min_value=-720, max_value=720)


@given(one=degrees, other=degrees)
@settings(max_examples=100, deadline=None)
def test_a_difference_is_the_short_way_round(one: float, other: float) -> None:
    result = float(statistics.angle_difference_deg(np.array(one), np.array(other)))
    assert -180.0 <= result < 180.0
    turns = (one - other - result) / 360.0
    assert turns == pytest.approx(round(turns), abs=1e-9)


@pytest.mark.parametrize(
    ("one", "other", "expected"), [(10, 350, 20), (-179, 179, 2), (0, 180, -180), (180, 0, -180), (90, 90, 0)]
)
def test_differences_worked_out_in_the_head(one: float, other: float, expected: float) -> None:
    assert float(statistics.angle_difference_deg(np.array(one), np.array(other))) == expected


@given(seed=seeds, centre=degrees, spread=st.floats(min_value=0.001, max_value=20))
@settings(max_examples=60, deadline=None)
def test_small_spreads_have_the_ordinary_mean_and_deviation(seed: int, centre: float, spread: float) -> None:
    offsets = spread * np.random.default_rng(seed).uniform(-1, 1, 50)
    angles = np.mod(centre + offsets, 360.0) - 180.0  # across the seam as often as not
    mean = float(statistics.circular_mean_deg(angles))
    assert -180.0 < mean <= 180.0
    expected = centre + offsets.mean() - 180.0
    assert abs(statistics.angle_difference_deg(mean, expected)) <= 1e-2 * spread
    assert float(statistics.circular_sd_deg(angles)) == pytest.approx(offsets.std(), rel=2e-2, abs=1e-6)


@given(seed=seeds, turn=degrees)
@settings(max_examples=40, deadline=None)
def test_turning_every_angle_turns_the_mean_and_not_the_spread(seed: int, turn: float) -> None:
    angles = np.random.default_rng(seed).uniform(-100, 100, (3, 12))
    mean, spread = statistics.circular_mean_deg(angles), statistics.circular_sd_deg(angles)
    turned = statistics.circular_mean_deg(angles + turn)
    np.testing.assert_allclose(statistics.angle_difference_deg(turned, mean + turn), 0.0, atol=1e-9)
    np.testing.assert_allclose(statistics.circular_sd_deg(angles + turn), spread, rtol=1e-9)


def test_the_seam_is_180_and_not_minus_180() -> None:
    assert float(statistics.circular_mean_deg(np.array([-180.0]))) == 180.0
    assert float(statistics.circular_mean_deg(np.array([170.0, -170.0]))) == pytest.approx(180.0)


def test_equal_angles_have_no_spread_and_opposite_ones_a_large_but_finite_one() -> None:
    assert float(statistics.circular_sd_deg(np.full(7, 33.0))) == pytest.approx(0.0, abs=1e-5)
    opposite = float(statistics.circular_sd_deg(np.array([0.0, 180.0])))
    assert np.isfinite(opposite)
    assert opposite > 180.0


def test_the_axis_is_the_one_asked_for() -> None:
    angles = np.array([[10.0, 20.0], [30.0, 40.0]])
    np.testing.assert_allclose(statistics.circular_mean_deg(angles.T), [20.0, 30.0])
    np.testing.assert_allclose(statistics.circular_mean_deg(angles), [15.0, 35.0])


# ranks

pairs = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=3, max_size=30)


@given(pairs)
def test_it_is_the_correlation_of_mean_ranks(pairs: list[tuple[int, int]]) -> None:
    series = np.array(pairs, dtype=float).T
    ranks = [
        [(values < value).sum() + 0.5 * ((values == value).sum() + 1) for value in values]
        for values in series
    ]
    if np.ptp(series[0]) == 0 or np.ptp(series[1]) == 0:
        assert rank_correlation(*series) == 0.0
    else:
        assert rank_correlation(*series) == pytest.approx(np.corrcoef(ranks)[0, 1], abs=1e-12)


@given(pairs)
def test_only_the_order_counts(pairs: list[tuple[int, int]]) -> None:
    a, b = np.array(pairs, dtype=float).T
    assert rank_correlation(np.exp(a), b**3) == pytest.approx(rank_correlation(a, b), abs=1e-12)
    assert rank_correlation(-a, b) == pytest.approx(-rank_correlation(a, b), abs=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "code"),
    [
        ([1.0, 2.0], [1.0], "wrong_shape"),
        ([], [], "empty_or_nan"),
        ([1.0, np.nan], [1.0, 2.0], "empty_or_nan"),
    ],
)
def test_what_cannot_be_ranked_is_refused(a: list[float], b: list[float], code: str) -> None:
    with rejects(code):
        rank_correlation(a, b)
