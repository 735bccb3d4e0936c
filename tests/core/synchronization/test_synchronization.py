"""Tests of synchronization: for two performances, for all pairs, and for the median sequence [mozerov2006 6-19]."""

from __future__ import annotations

import itertools
import tracemalloc
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core.synchronization import (
    all_pairs,
    allowed_disparities,
    disparity_space_image,
    distances,
    median_sequence,
    normalise,
    pair,
    rate_to_rate,
    synchronization_distance,
    synchronize,
    synchronize_all,
    warp,
)
from tests.rejects import rejects
from tests.strategies import seeds

penalties = st.sampled_from(["change", "as_printed"])
starts = st.sampled_from(["fixed", "free"])
step_sets = st.sampled_from([(-1, 0, 1), (-2, -1, 0, 1), (0, 1), (-1, 0), (0,), (-3, 0, 1)])


@st.composite
def switches(draw: st.DrawFn, widest: int = 8) -> dict[str, Any]:
    """Draw random options of `synchronize`, with an integer smoothness mu so that sums are exact."""
    return {
        "max_disparity": draw(st.integers(0, widest)),
        "smoothness": draw(st.integers(0, 4)),
        "penalty": draw(penalties),
        "start": draw(starts),
        "steps": draw(step_sets),
    }


def performance(generator: np.random.Generator, frames: int, dimension: int = 4) -> np.ndarray:
    """Return a smooth random performance (P, b)."""
    return np.cumsum(generator.standard_normal((frames, dimension)), axis=0)


# --- every path, the plain loop, dynamic time warping -----------------------------------------------------


def every_path(frames: int, switch: dict[str, Any]) -> list[tuple[int, ...]]:
    """Return all disparity functions that the options allow, enumerated from the definition."""
    result = []
    for ks in itertools.product(switch["steps"], repeat=frames - 1):
        # d(p - 1) = d(p) + k, back from d(P - 1) = 0
        path = [0]
        for k in ks:
            path.append(path[-1] + k)
        path.reverse()
        inside = all(0 <= p + d < frames and abs(d) <= switch["max_disparity"] for p, d in enumerate(path))
        if inside and (switch["start"] == "free" or path[0] == 0):
            result.append(tuple(path))
    return result


def cost_of(x_n: np.ndarray, x_m: np.ndarray, path: tuple[int, ...], switch: dict[str, Any]) -> float:
    """Return the cost of a disparity function by plain loops, as in [mozerov2006 12] or in the recurrence."""
    total = 0.0
    for p, d in enumerate(path):
        total += sum((a - b) ** 2 for a, b in zip(x_n[p], x_m[p + d], strict=True))
    for p in range(1, len(path)):
        before, change = path[p - 1], path[p - 1] - path[p]
        total += switch["smoothness"] * abs(change if switch["penalty"] == "change" else before)
    return float(total)


def preference(path: tuple[int, ...]) -> list[tuple[int, int]]:
    """Return the sort key of a disparity function by which ties are resolved: smaller steps first, negative before
    positive.
    """
    steps = [path[p - 1] - path[p] for p in range(len(path) - 1, 0, -1)]
    return [(abs(k), k) for k in steps]


@given(seeds, st.integers(1, 6), st.integers(1, 2), st.integers(1, 3), switches())
@settings(max_examples=150)
def test_no_path_of_all_is_cheaper_and_ties_go_to_the_straightest_from_the_end(
    seed: int, frames: int, dimension: int, levels: int, switch: dict[str, Any]
) -> None:
    # A few whole numbers: costs are exact and many paths are tied.
    sequences = np.random.default_rng(seed).integers(0, levels + 1, (2, frames, dimension)).astype(float)
    x_n, x_m = sequences
    paths = every_path(frames, switch)
    costs = [cost_of(x_n, x_m, path, switch) for path in paths]
    best = min(costs)
    tied = [path for path, cost in zip(paths, costs, strict=True) if cost == best]
    expected = min(tied, key=preference)
    synchronized = synchronize(x_n, x_m, **switch)
    assert synchronized.cost == best
    assert tuple(synchronized.disparity) == expected
    pairs = synchronize_all(sequences, **switch)
    assert pairs.cost[0, 1] == best
    assert tuple(pairs.disparity[0, 1]) == expected


def plain_loop(
    x_n: np.ndarray, x_m: np.ndarray, *, max_disparity: int, smoothness: float, penalty: str, start: str
) -> tuple[list[int], float]:
    """Return disparity function and cost by a direct implementation with dictionaries and loops
    [mozerov2006 14, 16, 17].
    """
    frames = len(x_n)
    disparities = range(-max_disparity, max_disparity + 1)
    S = {d: 0.0 if d == 0 or start == "free" else np.inf for d in disparities}
    K: list[dict[int, int]] = []
    for p in range(frames):
        arrived, used = {}, {}
        for d in disparities:
            E = float(((x_n[p] - x_m[p + d]) ** 2).sum()) if 0 <= p + d < frames else np.inf
            least, step = (S[d], 0) if p == 0 else (np.inf, 0)
            for k in (0, -1, 1) if p else ():
                weight = k if penalty == "change" else d + k
                arriving = S.get(d + k, np.inf) + smoothness * abs(weight)
                if arriving < least:
                    least, step = arriving, k
            arrived[d], used[d] = least + E, step
        S = arrived
        K.append(used)
    path = [0]
    for p in range(frames - 1, 0, -1):
        path.append(path[-1] + K[p][path[-1]])
    return path[::-1], S[0]


@given(seeds, st.integers(1, 30), st.integers(1, 6), st.integers(0, 40), penalties, starts)
@settings(max_examples=40)
def test_one_pair_and_all_pairs_equal_the_plain_double_loop(
    seed: int, frames: int, dimension: int, band: int, penalty: str, start: str
) -> None:
    generator = np.random.default_rng(seed)
    sequences = [performance(generator, frames, dimension) for _ in range(3)]
    switch: dict[str, Any] = {
        "max_disparity": band,
        "smoothness": generator.exponential(),
        "penalty": penalty,
        "start": start,
    }
    pairs = synchronize_all(sequences, **switch)
    for n, m in itertools.permutations(range(3), 2):
        path, cost = plain_loop(sequences[n], sequences[m], **switch)
        synchronized = synchronize(sequences[n], sequences[m], **switch)
        assert synchronized.cost == pytest.approx(cost, rel=1e-9)
        assert pairs.cost[n, m] == pytest.approx(cost, rel=1e-9)
        assert synchronized.disparity.tolist() == path
        assert pairs.disparity[n, m].tolist() == path


def asymmetric_warping(x_n: np.ndarray, x_m: np.ndarray, window: int) -> float:
    """Return the cost of dynamic time warping with steps of one sample in x_n, and of 0 to 2 samples in x_m."""
    frames = len(x_n)
    total = np.full((frames, frames), np.inf)
    for i in range(frames):
        for j in range(max(0, i - window), min(frames, i + window + 1)):
            start = float(((x_n[i] - x_m[j]) ** 2).sum())
            if i == 0:
                total[i, j] = start if j == 0 else np.inf
            else:
                total[i, j] = start + min(total[i - 1, j - step] for step in (0, 1, 2) if j >= step)
    return float(total[-1, -1])


@given(seeds, st.integers(2, 40), st.integers(0, 15))
@settings(max_examples=40)
def test_without_smoothness_it_is_dynamic_time_warping_with_the_asymmetric_step_pattern(
    seed: int, frames: int, window: int
) -> None:
    generator = np.random.default_rng(seed)
    x_n, x_m = performance(generator, frames), performance(generator, frames)
    expected = asymmetric_warping(x_n, x_m, window)
    assert synchronize(x_n, x_m, max_disparity=window, smoothness=0).cost == pytest.approx(
        expected, rel=1e-12
    )
    assert synchronize_all([x_n, x_m], max_disparity=window, smoothness=0).cost[0, 1] == pytest.approx(
        expected, rel=1e-9
    )


# --- warps whose truth is known ---------------------------------------------------------------------------


def movement(time: np.ndarray) -> np.ndarray:
    """Return six coordinates (…, 6) of a continuous bending movement at times from 0 to 1."""
    turns = 2 * np.pi * time[..., None] * np.array([0.5, 0.5, 1.0, 1.0, 1.5, 1.5])
    return np.array([3.0, 2.0, 1.5, 1.0, 0.7, 0.5]) * np.cos(turns + np.arange(6))


def smooth_warp(generator: np.random.Generator, frames: int, strength: float) -> np.ndarray:
    """Return a random increasing time function (P,) from 0 to 1."""
    t = np.linspace(0, 1, frames)
    amplitudes = strength * generator.uniform(-1, 1, 3) / np.array([1.0, 2.0, 3.0]) ** 2
    return t + (amplitudes * np.sin(np.pi * t[:, None] * np.array([1.0, 2.0, 3.0]))).sum(axis=1)


@pytest.mark.parametrize("start", ["fixed", "free"])
def test_known_warps_are_recovered_within_a_frame(start: str) -> None:
    generator = np.random.default_rng(11)
    frames = 100
    base = movement(np.linspace(0, 1, frames))
    mu = 0.01 * ((base - base.mean(axis=0)) ** 2).sum(axis=1).mean()
    moved, raw = [], []
    for _ in range(20):
        warped = smooth_warp(generator, frames, 0.12)
        # x_m(q) = base(warped(q)), so base(p) is found at q = warped⁻¹(p)
        truth = np.interp(np.linspace(0, 1, frames), warped, np.arange(frames))
        synchronized = synchronize(base, movement(warped), max_disparity=33, smoothness=mu, start=start)
        moved.append(np.abs(rate_to_rate(synchronized.disparity) - truth).mean())
        raw.append(np.abs(np.arange(frames) - truth).mean())
    assert np.mean(raw) > 3.0, "the warps would be too easy"
    assert max(moved) < 1.0


def test_synchronization_takes_away_the_variance_that_timing_makes() -> None:
    generator = np.random.default_rng(5)
    sequences = np.stack([movement(smooth_warp(generator, 80, 0.12)) for _ in range(8)])
    sequences += 0.02 * generator.standard_normal(sequences.shape)
    synchronized = synchronize_all(sequences, max_disparity=27, smoothness=0.05)
    n = median_sequence(synchronized.cost)
    together = warp(sequences, synchronized.disparity[n])
    assert together.var(axis=0).sum() < 0.1 * sequences.var(axis=0).sum()


# --- properties -------------------------------------------------------------------------------------------


@given(seeds, st.integers(1, 40), st.integers(1, 20), switches(widest=60))
@settings(max_examples=60)
def test_a_sequence_with_itself_has_no_disparity_and_no_cost(
    seed: int, frames: int, dimension: int, switch: dict[str, Any]
) -> None:
    generator = np.random.default_rng(seed)
    x = performance(generator, frames, dimension) * 10.0 ** generator.integers(-100, 100)
    x += 10.0 ** generator.integers(-100, 100)
    synchronized = synchronize(x, x.copy(), **switch)
    assert not synchronized.disparity.any()
    assert synchronized.cost == 0.0
    sequences = [x, performance(generator, frames, dimension), x]
    pairs = synchronize_all(sequences, **switch)
    assert np.array_equal(distances(sequences, **switch), pairs.cost)
    for n, m in ((0, 0), (1, 1), (0, 2), (2, 0)):
        assert not pairs.disparity[n, m].any()
        assert pairs.cost[n, m] == 0.0


@given(seeds, st.integers(2, 30), penalties, starts)
@settings(max_examples=30)
def test_constant_sequences_stay_where_they_are(seed: int, frames: int, penalty: str, start: str) -> None:
    postures = np.random.default_rng(seed).standard_normal((3, 1, 5))
    sequences = np.repeat(postures, frames, axis=1)
    for mu in (0.0, 0.3):
        synchronized = synchronize_all(
            sequences, max_disparity=frames, smoothness=mu, penalty=penalty, start=start
        )
        assert not synchronized.disparity.any()
        distance = ((postures - postures.transpose(1, 0, 2)) ** 2).sum(axis=2)
        assert np.allclose(synchronized.cost, frames * distance, rtol=1e-12, atol=1e-12)
        first = synchronize(sequences[0], sequences[1], max_disparity=frames, smoothness=mu, penalty=penalty)
        assert not first.disparity.any()


def test_one_frame_is_matched_with_the_other() -> None:
    for start in ("fixed", "free"):
        synchronized = synchronize(
            np.array([[1.0, 2.0]]), np.array([[4.0, 6.0]]), max_disparity=20, smoothness=1.0, start=start
        )
        assert synchronized.disparity.tolist() == [0]
        assert synchronized.cost == 25.0
    assert synchronize_all(
        np.array([[[1.0, 2.0]], [[4.0, 6.0]]]), max_disparity=20, smoothness=1.0
    ).cost.tolist() == [
        [0.0, 25.0],
        [25.0, 0.0],
    ]


@given(seeds, st.integers(2, 40), penalties, starts)
@settings(max_examples=30)
def test_a_shift_of_both_and_a_change_of_unit_move_no_path(
    seed: int, frames: int, penalty: str, start: str
) -> None:
    generator = np.random.default_rng(seed)
    sequences = np.stack([performance(generator, frames) for _ in range(3)])
    switch: dict[str, Any] = {"max_disparity": frames // 3, "penalty": penalty, "start": start}
    mu = generator.exponential()
    synchronized = synchronize_all(sequences, smoothness=mu, **switch)
    shifted = synchronize_all(sequences + 100.0 * generator.standard_normal(4), smoothness=mu, **switch)
    assert np.array_equal(shifted.disparity, synchronized.disparity)
    assert np.allclose(shifted.cost, synchronized.cost, rtol=1e-9, atol=1e-9)
    unit = 10.0 ** generator.uniform(-3, 3)
    scaled = synchronize_all(sequences * unit, smoothness=mu * unit**2, **switch)
    assert np.array_equal(scaled.disparity, synchronized.disparity)
    assert np.allclose(scaled.cost, synchronized.cost * unit**2, rtol=1e-9, atol=1e-9 * unit**2)


def test_postures_far_from_the_origin_lose_nothing() -> None:
    # Multiples of 1/1024, so that the shift itself is exact.
    sequences = np.stack([performance(np.random.default_rng(n), 40) for n in range(4)])
    sequences = np.round(sequences * 1024) / 1024
    synchronized = synchronize_all(sequences, max_disparity=13, smoothness=0.5)
    far = synchronize_all(sequences + 2.0**30, max_disparity=13, smoothness=0.5)
    assert np.array_equal(far.disparity, synchronized.disparity)
    assert np.allclose(far.cost, synchronized.cost, rtol=1e-12, atol=0)


@given(seeds, st.integers(2, 60), switches(widest=30))
@settings(max_examples=60)
def test_time_never_runs_backwards_nor_leaves_the_sequence(
    seed: int, frames: int, switch: dict[str, Any]
) -> None:
    generator = np.random.default_rng(seed)
    x_n, x_m = performance(generator, frames), performance(generator, frames)
    synchronized = synchronize(x_n, x_m, **switch)
    tau = rate_to_rate(synchronized.disparity)
    assert tau[-1] == frames - 1
    assert tau[0] == 0 or (switch["start"] == "free" and tau[0] > 0)
    rates = 1 - np.array(switch["steps"])
    assert set(np.diff(tau)) <= set(rates.tolist())
    assert np.diff(tau).min() >= 0
    assert np.abs(synchronized.disparity).max() <= switch["max_disparity"]
    along = synchronization_distance(
        x_n, x_m, synchronized.disparity, smoothness=switch["smoothness"], penalty=switch["penalty"]
    )
    assert along == pytest.approx(synchronized.cost, rel=1e-9)


def test_the_default_steps_run_time_at_rates_from_none_to_twice() -> None:
    slow, fast = np.repeat(np.arange(10.0), 4)[:, None], np.repeat(np.arange(10.0), 4)[:, None] ** 2
    tau = rate_to_rate(synchronize(slow, fast, max_disparity=20, smoothness=0).disparity)
    assert set(np.diff(tau)) == {0, 1, 2}
    wider = rate_to_rate(
        synchronize(slow, fast, max_disparity=20, smoothness=0, steps=(-3, -2, -1, 0, 1)).disparity
    )
    assert np.diff(wider).max() > 2


@given(seeds)
@settings(max_examples=20)
def test_more_freedom_never_costs_more(seed: int) -> None:
    generator = np.random.default_rng(seed)
    x_n, x_m = performance(generator, 30), performance(generator, 30)
    base: dict[str, Any] = {"max_disparity": 6, "smoothness": 2.0}
    cost = synchronize(x_n, x_m, **base).cost
    freer: list[dict[str, Any]] = [
        {"max_disparity": 12},
        {"smoothness": 1.0},
        {"start": "free"},
        {"steps": (-2, -1, 0, 1)},
    ]
    for change in freer:
        assert synchronize(x_n, x_m, **{**base, **change}).cost <= cost + 1e-12
    straight = synchronize(x_n, x_m, max_disparity=0, smoothness=2.0)
    assert straight.cost == pytest.approx(((x_n - x_m) ** 2).sum(), rel=1e-12)
    assert cost <= straight.cost + 1e-12


def test_a_band_wider_than_the_sequence_changes_nothing() -> None:
    generator = np.random.default_rng(3)
    sequences = np.stack([performance(generator, 12) for _ in range(3)])
    for start in ("fixed", "free"):
        wide = synchronize_all(sequences, max_disparity=10**9, smoothness=0.5, start=start)
        just = synchronize_all(sequences, max_disparity=11, smoothness=0.5, start=start)
        assert np.array_equal(wide.disparity, just.disparity)
        assert np.array_equal(wide.cost, just.cost)
        synchronized = synchronize(
            sequences[0], sequences[1], max_disparity=10**9, smoothness=0.5, start=start
        )
        assert np.array_equal(synchronized.disparity, just.disparity[0, 1])


def test_a_step_longer_than_the_sequence_takes_no_memory() -> None:
    synchronized = synchronize(GOOD, GOOD + 1, max_disparity=5, smoothness=0.5, steps=(-(10**12), 0, 1))
    assert not synchronized.disparity.any()


def test_the_distance_is_not_symmetric() -> None:
    generator = np.random.default_rng(0)
    result = synchronize_all(
        [performance(generator, 50) for _ in range(4)], max_disparity=16, smoothness=0.5
    ).cost
    distance = np.abs(result - result.T)[~np.eye(4, dtype=bool)]
    assert distance.min() > 0


def test_the_printed_penalty_pulls_towards_no_synchronization() -> None:
    base = movement(np.linspace(0, 1, 60))
    late = movement(smooth_warp(np.random.default_rng(1), 60, 0.12))
    paths = {
        penalty: synchronize(base, late, max_disparity=20, smoothness=1e3, penalty=penalty).disparity
        for penalty in ("change", "as_printed")
    }
    assert not paths["as_printed"].any()
    some = synchronize(base, late, max_disparity=20, smoothness=0.5, penalty="as_printed").disparity
    more = synchronize(base, late, max_disparity=20, smoothness=0.5).disparity
    assert np.abs(some).sum() < np.abs(more).sum()


# --- many pairs in tiles ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("tile", "kept"), [(1, 1), (2**12, 2**30), (2**16, 2**16), (2**24, 2**27)])
def test_the_size_of_a_tile_is_no_matter(monkeypatch: pytest.MonkeyPatch, tile: int, kept: int) -> None:
    generator = np.random.default_rng(8)
    sequences = np.stack([performance(generator, 25) for _ in range(7)])
    expected = synchronize_all(sequences, max_disparity=9, smoothness=0.7)
    monkeypatch.setattr(all_pairs, "_TILE_BYTES", tile)
    monkeypatch.setattr(all_pairs, "_KEPT_BYTES", kept)
    synchronized = synchronize_all(sequences, max_disparity=9, smoothness=0.7)
    assert np.array_equal(synchronized.disparity, expected.disparity)
    assert np.allclose(synchronized.cost, expected.cost, rtol=1e-12)


def test_memory_beside_the_result_does_not_grow_with_the_pairs() -> None:
    def peak(count: int) -> int:
        sequences = np.random.default_rng(0).standard_normal((count, 20, 2))
        tracemalloc.start()
        synchronized = synchronize_all(sequences, max_disparity=6, smoothness=1.0)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most - synchronized.cost.nbytes - synchronized.disparity.nbytes - 10 * sequences.nbytes

    # Nine times the pairs; the inputs and the result are taken off.
    assert peak(180) < 1.5 * peak(60)


def test_disparities_of_all_pairs_are_small_numbers() -> None:
    synchronized = synchronize_all(np.zeros((2, 3, 1)), max_disparity=1, smoothness=1.0)
    assert synchronized.disparity.dtype == np.int16
    assert synchronized.disparity.shape == (2, 2, 3)


def test_all_identical_is_allowed_and_the_median_is_the_first() -> None:
    same = np.tile(performance(np.random.default_rng(2), 30), (5, 1, 1))
    result = synchronize_all(same, max_disparity=10, smoothness=0.1).cost
    assert not result.any()
    assert median_sequence(result) == 0


# --- the median -------------------------------------------------------------------------------------------


@given(seeds, st.integers(1, 8))
def test_the_median_has_the_least_sum_of_its_row(seed: int, count: int) -> None:
    costs = np.random.default_rng(seed).integers(0, 3, (count, count)).astype(float)
    np.fill_diagonal(costs, 0.0)
    totals = [sum(row) for row in costs.tolist()]
    median = median_sequence(costs)
    assert type(median) is int
    assert median == totals.index(min(totals))


def test_the_median_is_a_pattern_and_not_what_is_patterned() -> None:
    assert median_sequence(np.array([[0.0, 9.0, 9.0], [1.0, 0.0, 9.0], [1.0, 1.0, 0.0]])) == 2


def test_sums_that_differ_by_rounding_are_tied() -> None:
    costs = np.array([[0.0, 0.1, 0.2, 0.3], [0.3, 0.0, 0.2, 0.1], [1.0, 1, 0, 1], [1.0, 1, 1, 0]])
    assert costs[0].sum() != costs[1].sum()
    assert median_sequence(costs) == median_sequence(costs[[1, 0, 2, 3]]) == 0


def test_the_median_of_warped_performances_is_the_one_in_the_middle() -> None:
    t = np.linspace(0, 1, 60)
    strengths = [-0.2, -0.1, 0.01, 0.1, 0.2]
    sequences = np.stack([movement(t + a * np.sin(np.pi * t)) for a in strengths])
    assert median_sequence(synchronize_all(sequences, max_disparity=20, smoothness=0.5).cost) == 2


# --- time, image, warp ------------------------------------------------------------------------------------


@given(seeds, st.integers(1, 40), st.integers(2, 60))
def test_normalised_time_keeps_both_ends_and_straight_lines(seed: int, frames: int, wanted: int) -> None:
    generator = np.random.default_rng(seed)
    sequence = performance(generator, frames)
    normalised = normalise(sequence, wanted)
    assert normalised.shape == (wanted, 4)
    assert np.array_equal(normalised[[0, -1]], sequence[[0, -1]])
    t, wanted_t = np.linspace(0, 1, frames), np.linspace(0, 1, wanted)
    expected = np.column_stack([np.interp(wanted_t, t, column) for column in sequence.T])
    assert np.allclose(normalised, expected, rtol=1e-9, atol=1e-9)
    assert np.array_equal(normalise(sequence, frames), sequence)
    assert np.array_equal(normalise(np.full((frames, 1), 0.1), wanted), np.full((wanted, 1), 0.1))


def test_the_disparity_space_image_is_infinite_outside_of_the_other_sequence() -> None:
    image = disparity_space_image(
        np.array([[0.0], [1.0], [3.0]]), np.array([[0.0], [2.0], [5.0]]), max_disparity=2
    )
    inf = np.inf
    assert image.tolist() == [[inf, inf, 0, 4, 25], [inf, 1, 1, 16, inf], [9, 1, 4, inf, inf]]


@given(seeds, st.integers(1, 50), st.integers(0, 30))
@settings(max_examples=30)
def test_the_disparity_space_image_equals_its_definition(seed: int, frames: int, band: int) -> None:
    generator = np.random.default_rng(seed)
    x_n, x_m = performance(generator, frames, 17), performance(generator, frames, 17)
    image = disparity_space_image(x_n, x_m, max_disparity=band)
    distance = ((x_n[:, None] - x_m[None]) ** 2).sum(axis=2)
    for p, d in itertools.product(range(frames), range(-band, band + 1)):
        q = p + d
        expected = distance[p, q] if 0 <= q < frames else np.inf
        assert image[p, d + band] == pytest.approx(expected, rel=1e-12)


def test_a_warp_takes_samples_at_the_shifted_times_of_one_or_of_many() -> None:
    generator = np.random.default_rng(4)
    sequences = np.stack([performance(generator, 15) for _ in range(4)])
    synchronized = synchronize_all(sequences, max_disparity=5, smoothness=0.2)
    together = warp(sequences, synchronized.disparity[1])
    for m in range(4):
        first = warp(sequences[m], synchronized.disparity[1, m])
        assert np.array_equal(together[m], first)
        assert all(
            np.array_equal(first[p], sequences[m, p + d]) for p, d in enumerate(synchronized.disparity[1, m])
        )


# --- bad input --------------------------------------------------------------------------------------------

GOOD = np.zeros((6, 2))


def with_gap(value: float) -> np.ndarray:
    broken = GOOD.copy()
    broken[4, 1] = value
    return broken


@pytest.mark.parametrize(
    ("x_m", "code", "values"),
    [
        (with_gap(np.nan), "not_finite", {"index": (4, 1)}),
        (with_gap(-np.inf), "not_finite", {"index": (4, 1)}),
        (with_gap(1e200), "too_large", {"index": (4, 1)}),
        (GOOD[:, :1], "other_dimension", {"dimension": 1}),
        (GOOD[:5], "other_length", {"frames": 5}),
        (GOOD[:0], "wrong_shape", {"shape": (0, 2)}),
        (GOOD[:, 0], "wrong_shape", {"shape": (6,)}),
    ],
)
def test_a_sequence_that_cannot_be_used_is_named_with_its_frame(
    x_m: np.ndarray, code: str, values: dict[str, Any]
) -> None:
    with rejects(code, "x_m", **values):
        synchronize(GOOD, x_m, max_disparity=2, smoothness=1.0)
    with rejects(code, "sequence 2", **values):
        synchronize_all([GOOD, GOOD, x_m], max_disparity=2, smoothness=1.0)


@pytest.mark.parametrize(
    ("name", "value", "code", "where"),
    [
        ("smoothness", -0.1, "out_of_range", "the smoothness (mu)"),
        ("smoothness", np.nan, "out_of_range", "the smoothness (mu)"),
        ("smoothness", np.inf, "out_of_range", "the smoothness (mu)"),
        ("smoothness", "1", "out_of_range", "the smoothness (mu)"),
        ("max_disparity", -1, "out_of_range", "the largest disparity"),
        ("max_disparity", 2.5, "out_of_range", "the largest disparity"),
        ("penalty", "size", "unknown_choice", "penalty"),
        ("start", "pinned", "unknown_choice", "start"),
        ("steps", (-1, 1), "no_zero_step", ""),
        ("steps", (-1, 0, 0.5), "out_of_range", "a step"),
        ("steps", (-2, -1, 0, 1, 2), "step_runs_backwards", ""),
    ],
)
def test_a_switch_that_is_none_is_refused(name: str, value: Any, code: str, where: str) -> None:
    switches: dict[str, Any] = {"max_disparity": 2, "smoothness": 1.0, name: value}
    for call in (
        lambda: synchronize(GOOD, GOOD, **switches),
        lambda: synchronize_all([GOOD, GOOD], **switches),
    ):
        with rejects(code, where) as rejection:
            call()
        if name != "steps":
            assert rejection.value.values["value"] is value


@pytest.mark.parametrize("count", [0, 1])
def test_one_alone_has_nothing_to_be_synchronized_with(count: int) -> None:
    with rejects("too_few_performances", count=count):
        synchronize_all(np.zeros((count, 5, 2)), max_disparity=2, smoothness=1.0)


@pytest.mark.parametrize(
    ("costs", "rejection"),
    [
        (np.zeros((2, 3)), rejects("wrong_shape", "distances", shape=(2, 3))),
        (np.zeros((0, 0)), rejects("out_of_range", "sequences", value=0)),
        (np.array([[0.0, np.nan], [1.0, 0.0]]), rejects("invalid_distance", index=(0, 1))),
        (np.array([[0.0, 1.0], [-1.0, 0.0]]), rejects("invalid_distance", index=(1, 0))),
    ],
)
def test_distances_that_are_none_have_no_median(costs: np.ndarray, rejection: AbstractContextManager) -> None:
    with rejection:
        median_sequence(costs)


def test_a_warp_that_leaves_the_sequence_or_does_not_fit_is_refused() -> None:
    with rejects("beyond_samples", sample=5, position=6):
        warp(GOOD, np.array([0, 0, 0, 0, 0, 1]))
    with rejects("beyond_samples", sample=0, position=-1):
        warp(GOOD, np.array([-1, 0, 0, 0, 0, 0]))
    for wrong in (np.zeros(5, dtype=int), np.zeros(6)):
        with rejects("mismatch"):
            warp(GOOD, wrong)


def test_time_that_cannot_be_normalised_is_refused() -> None:
    with rejects("too_few_samples"):
        normalise(GOOD, 1)
    with rejects("not_finite", "the sequence", index=(4, 1)):
        normalise(with_gap(np.nan), 5)
    for wrong in (0, 2.5):
        with rejects("out_of_range", "the number of frames"):
            normalise(GOOD, wrong)  # type: ignore[arg-type]


def test_arguments_are_left_as_they_are() -> None:
    sequences = np.random.default_rng(0).standard_normal((3, 10, 2))
    original = sequences.copy()
    synchronize(sequences[0], sequences[1], max_disparity=3, smoothness=0.1)
    synchronize_all(sequences, max_disparity=3, smoothness=0.1)
    normalise(sequences[0], 4)
    assert np.array_equal(sequences, original)


def test_the_trellis_of_two_pinned_ends_is_a_rhombus() -> None:
    nodes = allowed_disparities(7, max_disparity=2, smoothness=1.0)
    assert nodes.high.tolist() == [0, 1, 2, 2, 2, 1, 0]
    assert nodes.low.tolist() == [0, -1, -2, -2, -2, -1, 0]
    free = allowed_disparities(7, max_disparity=2, smoothness=1.0, start="free")
    assert free.high.tolist() == [2, 2, 2, 2, 2, 1, 0]
    assert free.low.tolist() == [0, -1, -2, -2, -2, -1, 0]
    faster = allowed_disparities(7, max_disparity=6, smoothness=1.0, steps=(-2, -1, 0, 1))
    assert faster.high.tolist() == [0, 2, 4, 3, 2, 1, 0]
    assert faster.low.tolist() == [0, -1, -2, -3, -4, -2, 0]


def test_a_disparity_space_image_does_not_depend_on_its_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = np.random.default_rng(3).standard_normal((2, 9, 4))
    image = pair.disparity_space_image(first, second, max_disparity=2)
    monkeypatch.setattr(pair, "_CHUNK", 1)
    np.testing.assert_array_equal(pair.disparity_space_image(first, second, max_disparity=2), image)
    for p in range(9):
        for d in range(-2, 3):
            inside = 0 <= p + d < 9
            distance = ((second[p + d] - first[p]) ** 2).sum() if inside else np.inf
            assert image[p, d + 2] == pytest.approx(distance)
