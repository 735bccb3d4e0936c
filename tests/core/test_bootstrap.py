"""Tests of the cluster bootstrap: equality with resampled people, and coverage of the intervals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from pipeline.core import bootstrap
from tests.benchmarks.coverage_of_intervals import coverage
from tests.rejects import rejects


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return random values in rows, the cluster of each row, and bootstrap weights of the clusters."""
    rng = np.random.default_rng(seed)
    cluster = np.concatenate([np.arange(6), rng.integers(0, 6, size=9)])
    return rng.normal(size=(15, 2)), cluster, bootstrap.resampling_weights(6, rng, resamples=40)


@given(st.integers(0, 2**32 - 1))
def test_weights_are_as_drawing_the_rows_of_each_person_again(seed: int) -> None:
    values, cluster, weights = drawn(seed)
    means = bootstrap.weighted_means(values, cluster, weights)
    medians = bootstrap.weighted_medians(values[:, 0], cluster, weights)
    for replicate, times in enumerate(weights):
        rows = [r for c, n in enumerate(times) for _ in range(n) for r in np.flatnonzero(cluster == c)]
        np.testing.assert_allclose(means[replicate], values[rows].mean(axis=0), rtol=1e-9, atol=1e-12)
        assert medians[replicate] == pytest.approx(np.median(values[rows, 0]), rel=1e-12)


def test_paired_quantities_share_the_replicates() -> None:
    values, cluster, weights = drawn(3)
    both = bootstrap.weighted_means(values, cluster, weights)
    difference = bootstrap.weighted_means(values[:, 0] - values[:, 1], cluster, weights)
    np.testing.assert_allclose(both[:, 0] - both[:, 1], difference, atol=1e-12)
    low, high = bootstrap.percentile_interval(both[:, 0] / both[:, 0])
    assert low == high == 1.0


def test_an_interval_over_people_covers_the_truth_as_often_as_it_promises() -> None:
    """Intervals from resampled people cover the true mean in 90 to 98 % of trials; intervals from resampled clips in
    under 70 %.
    """
    rng = np.random.default_rng(20)
    people, clips, trials = 30, 8, 400
    person = np.repeat(np.arange(people), clips)
    weights = bootstrap.resampling_weights(people, rng, resamples=500)
    of_clips = bootstrap.resampling_weights(people * clips, rng, resamples=500)
    level = rng.normal(5.0, 1.0, size=(people, trials))
    values = level[person] + rng.normal(0.0, 0.3, size=(people * clips, trials))
    covered = []
    for cluster, w in ((person, weights), (np.arange(people * clips), of_clips)):
        low, high = bootstrap.percentile_interval(bootstrap.weighted_means(values, cluster, w))
        covered.append(float(((low <= 5.0) & (high >= 5.0)).mean()))
    assert 0.90 <= covered[0] <= 0.98
    assert covered[1] < 0.70


def test_an_interval_leaves_out_as_many_replicates_below_as_above() -> None:
    assert bootstrap.percentile_interval(np.arange(101.0)[::-1]) == pytest.approx((2.5, 97.5))


def test_replicates_without_any_row_have_no_mean_and_wrong_inputs_are_refused() -> None:
    weights = np.array([[2, 0], [0, 2]])
    assert np.isnan(bootstrap.weighted_means(np.ones(1), np.zeros(1, dtype=int), weights)[1])
    assert np.isnan(bootstrap.weighted_medians(np.ones(1), np.zeros(1, dtype=int), weights)[1])
    assert np.isnan(bootstrap.weighted_medians(np.ones(0), np.zeros(0, dtype=int), weights)).all()
    with rejects("no_replicates"):
        bootstrap.percentile_interval(np.empty(0))


@pytest.mark.parametrize(("people", "shape"), [(5, None), (12, None), (12, 1.0), (33, 1.0)])
def test_an_interval_over_few_people_holds_the_mean_nearly_as_often_as_it_says(
    people: int, shape: float | None
) -> None:
    """Intervals over few people cover the true mean in 90 to 99 % of trials."""
    assert 90.0 <= coverage(people, shape, 400) <= 99.0


@pytest.mark.parametrize("people", [12, 33])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_interval_over_clusters_is_scipys_bca_at_the_expanded_level(people: int, sign: float) -> None:
    """The interval over clusters equals SciPy's BCa interval at a confidence level adjusted for few clusters."""
    values = sign * np.random.default_rng(people).exponential(size=people) ** 2
    tail = stats.t.ppf(0.975, people - 1) * np.sqrt(people / (people - 1))
    expected = stats.bootstrap(
        (values,), np.mean, method="BCa", n_resamples=2000, rng=np.random.default_rng(1),
        confidence_level=2.0 * stats.norm.cdf(tail) - 1.0,
    )  # fmt: skip
    left_out = np.array([np.delete(values, first).mean() for first in range(people)])
    interval = bootstrap.cluster_interval(values.mean(), expected.bootstrap_distribution, left_out, people)
    assert interval == pytest.approx(tuple(expected.confidence_interval), rel=1e-9)


def test_an_interval_over_few_clusters_is_students() -> None:
    values = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    replicates = np.array([5.2, 6.2, 7.2])  # their standard error is sqrt(2 / 3)
    low, high = bootstrap.cluster_interval(values.mean(), replicates, values, 5)
    reach = 2.7764451 * np.sqrt(5 / 4) * np.sqrt(2 / 3)
    assert (low, high) == pytest.approx((6.2 - reach, 6.2 + reach), rel=1e-7)


def test_an_interval_over_clusters_is_not_moved_to_hold_the_value() -> None:
    replicates = np.linspace(2.0, 3.0, 101)
    low, high = bootstrap.cluster_interval(9.0, replicates, np.zeros(0), 20)
    assert 2.0 <= low <= high <= 3.0


@given(st.lists(st.floats(-100, 100), min_size=3, max_size=12))
def test_the_interval_of_a_mean_of_populations_is_students(values: list[float]) -> None:
    draws = np.array(values)
    low, high = bootstrap.mean_interval(draws)
    expected = stats.ttest_1samp(draws, 0.0).confidence_interval() if np.ptp(draws) > 1e-6 else (low, high)
    assert (low, high) == pytest.approx(tuple(expected), rel=1e-6, abs=1e-9)
    below, above = bootstrap.mean_interval(draws, more=1.0)
    assert below <= low <= high <= above
    assert above - below == pytest.approx((high - low) * np.sqrt(len(draws) + 1.0), abs=1e-9)
