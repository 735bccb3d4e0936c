"""`learn_action` gives the same result as its component functions called one after the other."""

from __future__ import annotations

import dataclasses
from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import action_model, aspace, synchronization
from pipeline.core.action_model import (
    LearntAction,
    by_key_frames,
    learn_action,
    mean_squared_deviation,
    variance_left,
)
from tests.rejects import rejects
from tests.strategies import seeds


def action(seed: int, count: int = 4, numbers: int = 6, noise: float = 0.02) -> list[np.ndarray]:
    """Return random performances of one action, each with its own timing."""
    generator = np.random.default_rng(seed)
    directions = generator.standard_normal((3, numbers))
    postures = []
    for frames in generator.integers(18, 31, count):
        u = np.linspace(0.0, 1.0, frames)
        phase = u ** generator.uniform(0.6, 1.7)
        course = np.column_stack([np.sin(np.pi * phase), np.cos(np.pi * phase), np.sin(3 * np.pi * phase)])
        postures.append(course @ directions + noise * generator.standard_normal((frames, numbers)))
    return postures


# --- learn ------------------------------------------------------------------------------------------------


@given(
    seed=seeds,
    penalty=st.sampled_from(["change", "as_printed"]),
    start=st.sampled_from(["fixed", "free"]),
    steps=st.sampled_from([(-1, 0, 1), (-2, -1, 0, 1)]),
)
@settings(max_examples=12, deadline=None)
def test_it_is_made_of_its_pieces(seed: int, penalty: str, start: str, steps: tuple[int, ...]) -> None:
    postures, samples, relative = action(seed), 15, 0.05
    learnt = learn_action(
        postures,
        samples=samples,
        variance=0.9,
        max_disparity=6,
        smoothness=relative,
        penalty=penalty,
        start=start,
        steps=steps,
    )
    space = aspace.learn(postures, variance=0.9)
    raw = [space.project(p) for p in postures]
    linear = [synchronization.normalise(x, samples) for x in raw]
    together = np.concatenate(linear)
    mu = relative * ((together - together.mean(axis=0)) ** 2).sum(axis=1).mean()
    result = [
        [
            synchronization.synchronize(
                n, m, max_disparity=6, smoothness=mu, penalty=penalty, start=start, steps=steps
            )
            for m in linear
        ]
        for n in linear
    ]
    cost = np.array([[pair.cost for pair in row] for row in result])
    total = cost.sum(axis=1)
    median = int(total.argmin())

    np.testing.assert_allclose(learnt.space.components, space.components, rtol=0, atol=1e-12)
    assert len(learnt.raw) == len(postures)
    for ours, plain in zip(learnt.raw, raw, strict=True):
        np.testing.assert_allclose(ours, plain, rtol=0, atol=1e-12)
    np.testing.assert_allclose(learnt.linear, linear, rtol=0, atol=1e-12)
    assert learnt.smoothness == pytest.approx(mu, rel=1e-10)
    np.testing.assert_allclose(learnt.distances, cost, rtol=0, atol=1e-9 * cost.max())
    assert total[learnt.median] == pytest.approx(total[median], rel=1e-9)
    # Which of several equal paths is taken may hang on rounding; what each costs may not.
    for m, (x, d, y) in enumerate(zip(learnt.linear, learnt.disparity, learnt.synchronized, strict=True)):
        np.testing.assert_array_equal(y, synchronization.warp(x, d))
        along = synchronization.synchronization_distance(
            learnt.linear[learnt.median], x, d, smoothness=mu, penalty=penalty
        )
        assert along == pytest.approx(cost[learnt.median, m], rel=1e-9, abs=1e-12)
    model = action_model.learn(learnt.synchronized)
    np.testing.assert_array_equal(learnt.model.mean, model.mean)
    np.testing.assert_array_equal(learnt.model.standard_deviation, model.standard_deviation)


def test_the_median_sequence_keeps_its_own_time() -> None:
    learnt = learn_action(action(3), samples=15, max_disparity=6)
    assert (learnt.disparity[learnt.median] == 0).all()
    assert learnt.distances[learnt.median, learnt.median] == 0.0
    np.testing.assert_array_equal(learnt.synchronized[learnt.median], learnt.linear[learnt.median])


def test_the_order_of_the_performances_does_not_matter() -> None:
    postures = action(4, count=5)
    order = [3, 0, 4, 1, 2]
    first = learn_action(postures, samples=15, max_disparity=6)
    other = learn_action([postures[i] for i in order], samples=15, max_disparity=6)
    assert order[other.median] == first.median
    np.testing.assert_allclose(other.distances, first.distances[np.ix_(order, order)], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(other.synchronized, first.synchronized[order], rtol=0, atol=1e-9)


@given(seed=seeds, scale=st.floats(1e-3, 1e3))
@settings(max_examples=10, deadline=None)
def test_smoothness_does_not_depend_on_the_units(seed: int, scale: float) -> None:
    postures = action(seed)
    first = learn_action(postures, samples=15, max_disparity=6)
    other = learn_action([scale * p for p in postures], samples=15, max_disparity=6)
    assert other.smoothness == pytest.approx(scale**2 * first.smoothness, rel=1e-9)
    size = scale**2 * first.distances.max()
    np.testing.assert_allclose(other.distances, scale**2 * first.distances, rtol=1e-6, atol=1e-9 * size)
    assert other.median == first.median


def test_synchronized_performances_differ_less() -> None:
    learnt = learn_action(action(6), samples=40, max_disparity=19)
    left = variance_left(learnt.synchronized).mean()
    assert left < 0.5 * variance_left(learnt.linear).mean()


def test_as_many_dimensions_as_are_asked_for() -> None:
    learnt = learn_action(action(2), samples=15, dimensions=2, max_disparity=6)
    assert learnt.linear.shape == learnt.synchronized.shape == (4, 15, 2)
    assert learnt.model.mean.shape == (15, 2)


def test_nothing_that_is_given_is_changed() -> None:
    postures = action(8)
    before = [p.copy() for p in postures]
    learn_action(postures, samples=15, max_disparity=6)
    for old, new in zip(before, postures, strict=True):
        np.testing.assert_array_equal(old, new)


def test_what_is_learnt_is_a_value() -> None:
    learnt = learn_action(action(9), samples=15, max_disparity=6)
    assert isinstance(learnt, LearntAction)
    with pytest.raises(dataclasses.FrozenInstanceError):
        learnt.median = 0  # type: ignore[misc]


@pytest.mark.parametrize("count", [0, 1])
def test_a_performance_alone_is_refused(count: int) -> None:
    with rejects("too_few_performances", count=count):
        learn_action(action(1)[:count])


@pytest.mark.parametrize(
    ("options", "rejection"),
    [
        ({"variance": 0.0}, rejects("out_of_range", "the share of the variance", value=0.0)),
        ({"dimensions": 99}, rejects("out_of_range", "the number of dimensions", value=99)),
        ({"samples": 1}, rejects("too_few_samples")),
        ({"penalty": "none"}, rejects("unknown_choice", "penalty", value="none")),
        ({"start": "late"}, rejects("unknown_choice", "start", value="late")),
        ({"steps": (0, 2)}, rejects("step_runs_backwards")),
        ({"smoothness": -1.0}, rejects("out_of_range", "the smoothness (mu)")),
        ({"max_disparity": -1}, rejects("out_of_range", "the largest disparity", value=-1)),
    ],
)
def test_what_a_piece_refuses_is_refused(options: dict, rejection: AbstractContextManager) -> None:
    with rejection:
        learn_action(action(1), **{"samples": 15, "max_disparity": 6, **options})


def test_performances_that_are_all_the_same_have_nothing_to_teach() -> None:
    first = action(1)[0]
    with rejects("identical_performances"):
        learn_action([first, first.copy()], samples=15, max_disparity=6)


# --- what is left, and the comparison ---------------------------------------------------------------------


def test_variance_left_by_hand() -> None:
    """For two performances, the variance is half the squared difference, summed over dimensions."""
    given_ = np.array([[[0.0, 1.0], [5.0, 5.0]], [[2.0, 4.0], [5.0, 5.0]]])
    np.testing.assert_allclose(variance_left(given_), [2.0 + 4.5, 0.0])


@given(seeds, st.integers(2, 7), st.integers(1, 5), st.integers(1, 4))
def test_variance_left_is_the_trace_of_the_covariance_at_each_sample(
    seed: int, count: int, samples: int, b: int
) -> None:
    given_ = np.random.default_rng(seed).standard_normal((count, samples, b))
    traces = [np.trace(np.cov(given_[:, p].T).reshape(b, b)) for p in range(samples)]
    np.testing.assert_allclose(variance_left(given_), traces, rtol=1e-9)


@given(seeds, st.integers(1, 6), st.integers(1, 5), st.integers(1, 4))
def test_the_mean_squared_deviation_is_that_of_single_postures(
    seed: int, count: int, samples: int, b: int
) -> None:
    given_ = np.random.default_rng(seed).standard_normal((count, samples, b))
    postures = [given_[m, p] for m in range(count) for p in range(samples)]
    mean = sum(postures) / len(postures)
    plain = sum(float((x - mean) @ (x - mean)) for x in postures) / len(postures)
    assert mean_squared_deviation(given_) == pytest.approx(plain, rel=1e-9, abs=1e-12)


def test_mean_squared_deviation_by_hand() -> None:
    assert mean_squared_deviation(np.array([[[0.0, 0.0], [2.0, 0.0]], [[0.0, 2.0], [2.0, 2.0]]])) == 2.0


def test_by_key_frames_is_choosing_and_resampling() -> None:
    raw = action(11)
    ours = by_key_frames(raw, samples=20, count=3)
    chosen = synchronization.choose_key_frames(raw, count=3)
    plain = synchronization.resample_by_key_frames(raw, chosen.frames, 20)
    np.testing.assert_array_equal(ours.sequences, plain.sequences)
    np.testing.assert_array_equal(ours.warp, plain.warp)
    np.testing.assert_array_equal(ours.samples, plain.samples)
    assert ours.sequences.shape == (4, 20, 6)


def test_by_key_frames_refuses_as_its_pieces_do() -> None:
    with rejects("no_performances"):
        by_key_frames([])
    with rejects("out_of_range", "the number of key-frames", value=0):
        by_key_frames(action(1), count=0)
    with rejects("too_few_samples", samples=6):
        by_key_frames(action(1), samples=6, count=5)
