"""Tests of the action model: its mean and standard deviation, the bounds of acceptance, and random postures within
them.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest, truncnorm

from pipeline.core.action_model import ActionModel, acceptance_left_out, accepted, learn, sample
from tests.rejects import rejects
from tests.strategies import seeds


def performances(generator: np.random.Generator, count: int = 12, samples: int = 9, b: int = 4) -> np.ndarray:
    mean = np.cumsum(generator.standard_normal((samples, b)), axis=0)
    return mean + generator.uniform(0.2, 2.0, (samples, b)) * generator.standard_normal((count, samples, b))


# --- learning ---------------------------------------------------------------------------------------------


def test_mean_and_spread_by_hand() -> None:
    model = learn(np.array([[[1.0, 5.0], [0.0, 2.0]], [[3.0, 5.0], [0.0, 6.0]]]))
    floor = 0.01 * np.sqrt((2.0 + 8.0) / 4)  # of the root mean square of sqrt 2, 0, 0 and sqrt 8
    np.testing.assert_allclose(model.mean, [[2.0, 5.0], [0.0, 4.0]])
    np.testing.assert_allclose(model.standard_deviation, [[np.sqrt(2.0), floor], [floor, np.sqrt(8.0)]])
    np.testing.assert_array_equal(model.floored, [[False, True], [True, False]])


@given(seeds)
def test_the_divisor_is_one_less_than_the_performances(seed: int) -> None:
    given_ = performances(np.random.default_rng(seed))
    model = learn(given_)
    squared = ((given_ - given_.mean(axis=0)) ** 2).sum(axis=0) / 11
    np.testing.assert_allclose(model.standard_deviation**2, squared, rtol=1e-10)
    assert not model.floored.any()


@given(seeds, st.floats(1e-3, 1e3))
def test_the_model_has_the_units_of_the_aspace(seed: int, scale: float) -> None:
    given_ = performances(np.random.default_rng(seed))
    given_[:, 3, 1] = 7.0
    model, scaled = learn(given_), learn(scale * given_)
    np.testing.assert_allclose(scaled.standard_deviation, scale * model.standard_deviation, rtol=1e-9)
    np.testing.assert_array_equal(scaled.floored, model.floored)


def test_a_constant_phase_gets_a_floor_of_a_hundredth_of_the_typical_spread() -> None:
    given_ = performances(np.random.default_rng(1))
    given_[:, :2] = given_[0, :2]
    model = learn(given_)
    assert model.floored[:2].all()
    assert not model.floored[2:].any()
    typical = np.sqrt((given_.std(axis=0, ddof=1) ** 2).mean())
    np.testing.assert_allclose(model.standard_deviation[:2], 0.01 * typical)
    assert accepted(model, given_[0] + 0.02 * typical)[:2].all()
    assert not accepted(model, given_[0] + 0.04 * typical)[:2].any()


# --- acceptance -------------------------------------------------------------------------------------------


def test_every_coordinate_must_lie_within_three_standard_deviations() -> None:
    model = ActionModel(np.zeros((2, 2)), np.array([[1.0, 2.0], [1.0, 1.0]]), np.zeros((2, 2), bool))
    postures = np.array([[[3.0, 6.0], [0.0, 0.0]], [[3.01, 0.0], [0.0, -3.01]]])
    np.testing.assert_array_equal(accepted(model, postures), [[True, True], [False, False]])
    np.testing.assert_array_equal(accepted(model, postures[:, 0], at=0), [True, False])
    np.testing.assert_array_equal(accepted(model, postures[:, 0], at=1), [False, False])
    np.testing.assert_array_equal(accepted(model, postures, bound=3.1), [[True, True], [True, True]])
    assert accepted(model, np.array([np.nan, 0.0]), at=0).tolist() is False


@given(seeds)
def test_the_mean_is_accepted_and_a_larger_bound_accepts_no_less(seed: int) -> None:
    generator = np.random.default_rng(seed)
    model = learn(performances(generator))
    assert accepted(model, model.mean).all()
    strangers = model.mean + 2.0 * model.standard_deviation * generator.standard_normal((50, 9, 4))
    small, large = (accepted(model, strangers, bound=b) for b in (1.5, 3.0))
    assert not (small & ~large).any()
    assert 0 < small.sum() < large.sum() < small.size


# --- sampling ---------------------------------------------------------------------------------------------


@given(seeds, st.sampled_from([0.5, 3.0]))
def test_every_draw_is_accepted(seed: int, bound: float) -> None:
    model = learn(performances(np.random.default_rng(seed)))
    generator = np.random.default_rng(seed)
    drawn = sample(model, 200, generator, bound=bound)
    assert drawn.shape == (200, 9, 4)
    assert accepted(model, drawn, bound=bound).all()
    drawn = sample(model, 200, generator, at=5, bound=bound)
    assert drawn.shape == (200, 4)
    assert accepted(model, drawn, at=5, bound=bound).all()
    assert sample(model, 0, generator, at=0).shape == (0, 4)


def test_draws_are_a_truncated_normal_with_independent_coordinates() -> None:
    model = learn(performances(np.random.default_rng(3)))
    for bound in (1.0, 3.0, np.inf):
        drawn = sample(model, 4000, np.random.default_rng(7), at=2, bound=bound)
        z = (drawn - model.mean[2]) / model.standard_deviation[2]
        for column in z.T:
            assert kstest(column, truncnorm(-bound, bound).cdf).pvalue > 1e-3
        assert np.abs(np.corrcoef(z.T) - np.eye(4)).max() < 0.06


def test_the_seed_decides_and_the_model_is_left_alone() -> None:
    model = learn(performances(np.random.default_rng(3)))
    before = model.mean.copy()
    first, again, other = (sample(model, 5, np.random.default_rng(s)) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()
    np.testing.assert_array_equal(model.mean, before)


# --- performances that the model has not seen -------------------------------------------------------------


def test_one_left_out_is_judged_by_the_others_alone() -> None:
    given_ = performances(np.random.default_rng(5))
    inside = acceptance_left_out(given_)
    assert inside.shape == (12, 9)
    for m in range(12):
        others = learn(np.delete(given_, m, axis=0))
        np.testing.assert_array_equal(inside[m], accepted(others, given_[m]))
    changed = given_.copy()
    changed[4] += 1e6
    np.testing.assert_array_equal(acceptance_left_out(changed)[4], False)
    assert 0.8 < inside.mean() < 1.0


def test_one_actor_s_performances_leave_together() -> None:
    given_ = performances(np.random.default_rng(6))
    actors = np.repeat([3, 1, 2], 4)
    inside = acceptance_left_out(given_, groups=actors)
    for actor in (1, 2, 3):
        others = learn(given_[actors != actor])
        np.testing.assert_array_equal(inside[actors == actor], accepted(others, given_[actors == actor]))


# --- bad input --------------------------------------------------------------------------------------------


def test_what_teaches_nothing_is_refused() -> None:
    given_ = performances(np.random.default_rng(8))
    with rejects("too_few_performances", count=1):
        learn(given_[:1])
    with rejects("identical_performances"):
        learn(given_[[0, 0, 0]])
    missing = given_.copy()
    missing[2, 5, 1] = np.nan
    with rejects("not_finite", "performance 2, sample 5"):
        learn(missing)
    with rejects("wrong_shape", shape=(9, 4)):
        learn(given_[0])
    with rejects("mismatch"):
        learn([given_[0], given_[1, :5]])  # type: ignore[arg-type]


def test_what_the_model_does_not_have_is_refused() -> None:
    given_ = performances(np.random.default_rng(8))
    model, generator = learn(given_), np.random.default_rng(0)
    with rejects("wrong_shape", shape=(9, 3)):
        accepted(model, given_[0, :, :3])
    with rejects("out_of_range", "the sample of the action model", value=9):
        accepted(model, given_[0], at=9)
    with rejects("out_of_range", "the sample of the action model", value=-1):
        sample(model, 3, generator, at=-1)
    with rejects("out_of_range", "the bound", value=0.0):
        sample(model, 3, generator, bound=0.0)
    with rejects("out_of_range", "the number of postures", value=-3):
        sample(model, -3, generator)
    with rejects("wrong_shape", "groups", shape=(3,)):
        acceptance_left_out(given_, groups=np.arange(3))
    with rejects("too_few_performances", "without group 0", count=1):
        acceptance_left_out(given_, groups=np.r_[np.zeros(11, int), 1])
