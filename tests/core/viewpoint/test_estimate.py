"""Tests of the joint estimation of view angle and coefficients [zhang2007 4.5, 4.6, B.1-B.3] [zhang2004 14]."""

from __future__ import annotations

import inspect
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera, reconstruction, viewpoint
from pipeline.core.linear_model import LinearModel, fit, flatten, unflatten
from pipeline.core.reconstruction import gram_of
from pipeline.core.statistics import angle_difference_deg
from pipeline.core.viewpoint import search
from pipeline.core.viewpoint.estimate import _observations, estimate
from tests.rejects import rejects
from tests.strategies import Fold, angles, folds, seeds, walkers

methods = st.sampled_from([("least_squares", None), ("map", 1.0), ("map", 70.0), ("map", 1e4)])


def seen(sample: np.ndarray, angle: float) -> np.ndarray:
    """Return the 2D Fourier representation (150,) or (151,) of a walker at a view angle."""
    return camera.projection_matrix(angle, trailing=sample.size - 225) @ sample


def printed_cost(
    model: LinearModel, observed: np.ndarray, angle: float, k: np.ndarray, noise_variance: float | None
) -> float:
    """Return the printed cost, [zhang2007 4.5] squared or [zhang2007 4.6] times 2 sigma², for given coefficients."""
    trailing = model.mean.size - 225
    C = camera.projection_matrix(angle, trailing=trailing)
    w_hat = np.append(observed[:150], model.last_scale * observed[150:])
    misfit = float(((w_hat - C @ model.mean - C @ model.components.T @ k) ** 2).sum())
    if noise_variance is None:
        return misfit
    retained = model.eigenvalues > 0
    return misfit + noise_variance * float((k[retained] ** 2 / model.eigenvalues[retained]).sum())


def printed_minimum(
    model: LinearModel, observed: np.ndarray, angle: float, noise_variance: float | None
) -> tuple[float, np.ndarray]:
    """Return the printed cost at a view angle with the optimal coefficients, and these coefficients."""
    trailing = model.mean.size - 225
    C = camera.projection_matrix(angle, trailing=trailing)
    d = np.append(observed[:150], model.last_scale * observed[150:]) - C @ model.mean
    E = C @ model.components.T
    if noise_variance is None:
        k = reconstruction.least_squares(E, d)
    else:
        k = reconstruction.maximum_a_posteriori(E, d, model.eigenvalues, noise_variance=noise_variance)
    return printed_cost(model, observed, angle, k, noise_variance), k


def brute_force(
    model: LinearModel, observed: np.ndarray, noise_variance: float | None
) -> tuple[float, float]:
    """Return the best view angle, degrees, and its cost, from a search in steps of a hundredth of a degree."""

    def cost(degree: float) -> float:
        return printed_minimum(model, observed, np.radians(degree), noise_variance)[0]

    coarse = np.arange(-180.0, 180.0)
    costs = np.array([cost(degree) for degree in coarse])
    lowest = coarse[np.argsort(costs)[:5]]
    fine = np.unique(np.round(np.add.outer(lowest, np.arange(-100, 101) / 100), 2))
    costs = np.array([cost(degree) for degree in fine])
    return float(fine[costs.argmin()]), float(costs.min())


@pytest.mark.parametrize("trailing", [0, 1])
@pytest.mark.parametrize(("method", "noise_variance"), [("least_squares", None), ("map", 70.0)])
@pytest.mark.parametrize("style", ["generic", "degenerate"])
def test_the_global_solver_finds_what_a_hundredth_of_a_degree_finds(
    trailing: int, method: str, noise_variance: float | None, style: str
) -> None:
    generator = np.random.default_rng(trailing)
    people = flatten(walkers(generator, 13, style), generator.uniform(0.7, 1.1, 13) if trailing else None)
    components = 8 if style == "generic" else 4  # no more than the degenerate population has
    model = fit(people[1:], components, scale_last=30.0 if trailing else 1.0)
    observed = seen(people[0], generator.uniform(-np.pi, np.pi))
    estimated = viewpoint.estimate(model, observed, method=method, noise_variance=noise_variance)
    angle_deg, cost = brute_force(model, observed, noise_variance)
    assert abs(angle_difference_deg(np.degrees(estimated.angle_rad), angle_deg)) <= 0.01
    assert estimated.converged
    assert estimated.cost <= cost + 1e-9 * abs(cost)
    assert estimated.cost == pytest.approx(cost, rel=1e-3, abs=1e-3)
    at_angle, k = printed_minimum(model, observed, float(estimated.angle_rad), noise_variance)
    assert estimated.cost == pytest.approx(at_angle, rel=1e-8, abs=1e-6)
    np.testing.assert_allclose(estimated.coefficients, k, rtol=0, atol=1e-6 * np.abs(k).max())


@given(seed=seeds, method=methods, wild=st.sampled_from([20.0, 300.0, 1000.0]))
@settings(max_examples=25, deadline=None)
def test_no_candidate_of_a_fine_grid_is_better(
    seed: int, method: tuple[str, float | None], wild: float
) -> None:
    """No view angle of a fine grid has a lower cost than the estimate, even for untypical walkers."""
    name, noise_variance = method
    generator = np.random.default_rng(seed)
    people = flatten(walkers(generator, 21))
    model = fit(people, int(generator.integers(1, 20)))
    strangers = people[:6] + wild * generator.standard_normal((6, 225))
    observed = np.stack([seen(w, generator.uniform(-3, 3)) for w in strangers])
    estimated = viewpoint.estimate(model, observed, method=name, noise_variance=noise_variance)
    gram = gram_of(model, noise_variance)
    across, up, _ = _observations(model, gram.white, observed)
    fine = np.radians(np.arange(-180, 180, 0.25))
    cost = search.cost_on_grid(gram, across, up, fine, noise_variance)
    assert (estimated.cost <= cost.min(axis=1) * (1 + 1e-9)).all()
    assert (estimated.runner_up_cost >= estimated.cost * (1 - 1e-9)).all()
    assert estimated.converged.all()
    assert ((estimated.n_iterations >= 1) & (estimated.n_iterations < 30)).all()


@pytest.mark.parametrize("step_deg", [5.0, 10.0, 15.0])
def test_the_lower_of_two_dips_wins_though_the_lowest_candidate_lies_in_the_other(step_deg: float) -> None:
    """The search finds the lower of two minima, even if the lowest grid point belongs to the other one."""
    points = np.zeros((75, 3))
    points[0, 0], points[1, 1] = 100.0, 30.0
    model = LinearModel(points.reshape(-1), np.eye(225)[-1:], np.ones(1), 1.0)
    observed = np.zeros(150)
    observed[0], observed[2] = 60.0, -0.1

    def cost(angle: np.ndarray) -> np.ndarray:
        return (60 - 100 * np.cos(angle)) ** 2 + (-0.1 - 30 * np.sin(angle)) ** 2

    low, step = np.radians(48.73 - 180), np.radians(step_deg)
    candidates, closed = search.candidates(low, low + 2 * np.pi, step)
    assert closed
    assert np.degrees(candidates[cost(candidates).argmin()]) == pytest.approx(48.73)
    gram = gram_of(model, None)
    across, up, _ = _observations(model, gram.white, observed)
    result = search.global_minimum(gram, across, up, (low, low + 2 * np.pi), step, None)
    fine = np.radians(np.arange(-180, 180, 0.001))
    assert np.degrees(result.angle_rad[0]) == pytest.approx(np.degrees(fine[cost(fine).argmin()]), abs=1e-3)
    assert result.cost[0] == pytest.approx(cost(fine).min(), rel=1e-6)
    assert result.runner_up_cost[0] == pytest.approx(cost(fine[fine > 0]).min(), rel=1e-6)


# The function of one angle


@given(fold=folds(), angle=angles, true=angles, method=methods)
@settings(max_examples=40, deadline=None)
def test_the_cost_on_the_grid_and_the_reduced_cost_are_the_printed_one(
    fold: Fold, angle: float, true: float, method: tuple[str, float | None]
) -> None:
    model, (_, noise_variance) = fold.model, method
    gram = gram_of(model, noise_variance)
    observed = np.stack(
        [seen(fold.sample, true), seen(fold.sample, true + 1.0), 0.0 * seen(fold.sample, 0.0)]
    )
    across, up, _ = _observations(model, gram.white, observed)
    grid = search.cost_on_grid(gram, across, up, np.array([angle, angle + 0.5]), noise_variance)
    reduced = search.reduced_cost(gram, across, up, np.full(3, angle), noise_variance)
    for i, row in enumerate(observed):
        scale = float((row**2).sum() + (model.mean**2).sum())
        expected = printed_cost(model, row, angle, reduced.z[i] * gram.white.scale, noise_variance)
        assert reduced.cost[i] == pytest.approx(expected, rel=1e-9, abs=1e-12 * scale)
        assert grid[i, 0] == pytest.approx(expected, rel=1e-9, abs=1e-11 * scale)
        if noise_variance is not None or fold.drawn.find("generic") >= 0:
            lowest, _ = printed_minimum(model, row, angle, noise_variance)
            assert expected == pytest.approx(lowest, rel=1e-9, abs=1e-11 * scale)


@pytest.mark.parametrize("noise_variance", [None, 70.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_slope_is_the_limit_of_differences(seed: int, noise_variance: float | None) -> None:
    """The slope of the cost agrees with central differences, whose error falls with the square of the step."""
    generator = np.random.default_rng(seed)
    people = flatten(walkers(generator, 15), generator.uniform(0.7, 1.1, 15))
    model = fit(people[1:], 10, scale_last=None)
    gram = gram_of(model, noise_variance)
    start = generator.uniform(-3, 3, 5)
    observed = np.stack([seen(people[0], angle) for angle in start + 0.3])
    across, up, _ = _observations(model, gram.white, observed)

    def reduced(angle: np.ndarray) -> search.ReducedCost:
        return search.reduced_cost(gram, across, up, angle, noise_variance)

    slope = reduced(start).slope
    wrong = []
    for step in 10.0 ** np.array([-1.5, -2.0, -2.5]):
        above, below = reduced(start + step).cost, reduced(start - step).cost
        wrong.append(np.abs((above - below) / (2 * step) - slope))
    order = np.log10(np.divide(wrong[:-1], wrong[1:])) / 0.5
    np.testing.assert_allclose(np.median(order, axis=-1), 2.0, atol=0.1)
    assert wrong[-1].max() / np.abs(slope).max() < 1e-3


def test_dips_of_a_cost_worked_out_in_the_head() -> None:
    grid = np.radians(np.arange(6.0))
    cost = np.array([[9.0, 1.0, 1.0, 9.0, 4.0, 6.0]])  # one dip in two cells, then another
    height, position = search.local_minima(cost, grid, closed=False)
    np.testing.assert_allclose(height[0], [np.inf, 0.0, 0.0, np.inf, 4.0 - 9.0 / 56.0, np.inf])
    np.testing.assert_allclose(np.degrees(position[0, [1, 2, 4]]), [1.5, 1.5, 4 + 3.0 / 14.0])
    cell, value = search.lowest_but(height, np.array([1]), closed=False)
    assert (cell[0], value[0]) == (4, height[0, 4])
    _, none = search.lowest_but(height[:, :3], np.array([1]), closed=False)
    assert none[0] == np.inf


def test_the_ends_of_a_range_are_dips_and_those_of_a_circle_are_not() -> None:
    grid, cost = np.arange(4.0), np.array([[3.0, 5.0, 4.0, 1.0]])
    height, position = search.local_minima(cost, grid, closed=False)
    assert height[0].tolist() == [3.0, np.inf, np.inf, 1.0]
    assert position[0, [0, 3]].tolist() == [0.0, 3.0]
    height, _ = search.local_minima(cost, grid, closed=True)
    assert np.flatnonzero(np.isfinite(height[0])).tolist() == [3]
    circle, closed = search.candidates(-1.0, -1.0 + 2 * np.pi, np.pi / 2)
    assert closed
    np.testing.assert_allclose(circle, -1.0 + np.arange(4) * np.pi / 2)


# Recovery and invariance


@given(seed=seeds, true=angles, method=methods, count=st.integers(3, 15))
@settings(max_examples=25, deadline=None)
def test_the_view_of_a_walker_within_the_model_is_recovered(
    seed: int, true: float, method: tuple[str, float | None], count: int
) -> None:
    generator = np.random.default_rng(seed)
    model = fit(flatten(walkers(generator, count)), count)
    name, noise_variance = method
    k = generator.standard_normal(len(model.eigenvalues)) * np.sqrt(model.eigenvalues)
    if noise_variance is not None:
        k *= 0.0  # a prior pulls anybody but the average walker, and with the walker the angle
    estimated = viewpoint.estimate(
        model, seen(model.mean + k @ model.components, true), method=name, noise_variance=noise_variance
    )
    assert abs(angle_difference_deg(np.degrees(estimated.angle_rad), np.degrees(true))) < 1e-5
    assert -np.pi < estimated.angle_rad <= np.pi
    np.testing.assert_allclose(estimated.coefficients, k, rtol=0, atol=1e-4)
    assert estimated.cost < 1e-6 * estimated.runner_up_cost


@given(fold=folds(styles=("generic", "tied")), method=methods, view=st.lists(angles, min_size=2, max_size=8))
@settings(max_examples=25, deadline=None)
def test_many_observations_at_once_are_each_alone(
    fold: Fold, method: tuple[str, float | None], view: list[float]
) -> None:
    name, noise_variance = method
    observed = np.stack([seen(fold.sample, angle) for angle in view])
    options: dict[str, Any] = {"method": name, "noise_variance": noise_variance}
    together = viewpoint.estimate(fold.model, observed, **options)
    assert together.angle_rad.shape == (len(view),)
    assert together.coefficients.shape == (len(view), len(fold.model.eigenvalues))
    for i, row in enumerate(observed):
        alone = viewpoint.estimate(fold.model, row, **options)
        assert np.ndim(alone.angle_rad) == 0
        scale = float((row**2).sum())
        assert together.cost[i] == pytest.approx(float(alone.cost), rel=1e-8, abs=1e-12 * scale)
        if alone.runner_up_cost > 1.001 * alone.cost:  # else rounding may decide between two angles
            distance = angle_difference_deg(np.degrees(together.angle_rad[i]), np.degrees(alone.angle_rad))
            assert abs(distance) < 1e-4


def test_every_shape_of_the_same_observations_agrees() -> None:
    people = walkers(np.random.default_rng(0), 9)
    model = fit(flatten(people[1:]), 6)
    blocks = np.stack([camera.project(people[0], angle) for angle in (-0.4, 0.9)])
    assert blocks.shape == (2, 5, 15, 2)
    flat = viewpoint.estimate(model, blocks.reshape(2, 150), method="map", noise_variance=70.0)
    as_blocks = viewpoint.estimate(model, blocks, method="map", noise_variance=70.0)
    np.testing.assert_array_equal(as_blocks.angle_rad, flat.angle_rad)
    estimated = viewpoint.estimate(model, blocks[1], method="map", noise_variance=70.0)
    other = viewpoint.estimate(model, blocks[1].reshape(150), method="map", noise_variance=70.0)
    assert estimated.angle_rad == other.angle_rad
    assert np.ndim(estimated.angle_rad) == 0
    assert estimated.coefficients.shape == (6,)
    assert estimated.angle_rad == pytest.approx(flat.angle_rad[1], abs=1e-9)


def test_no_observation_of_anything_is_no_reason_to_fail() -> None:
    model = fit(flatten(walkers(np.random.default_rng(0), 5)), 3)
    estimated = viewpoint.estimate(model, np.zeros(150), method="map", noise_variance=70.0)
    assert np.isfinite(estimated.cost)
    still = LinearModel(np.zeros(225), np.eye(225)[:2], np.ones(2), 2.0)  # no view is better than another
    flat = viewpoint.estimate(still, np.zeros((2, 150)), method="least_squares")
    assert flat.cost.tolist() == [0.0, 0.0]


def test_the_runner_up_tells_an_ambiguous_view() -> None:
    """The runner-up cost is close to the lowest cost for walkers with little depth, whose view is ambiguous."""
    ratios = []
    for depth in (0.05, 1.0):
        people = walkers(np.random.default_rng(3), 12)
        people[..., 1] *= depth
        model = fit(flatten(people[1:]), 8)
        estimated = viewpoint.estimate(
            model, seen(flatten(people)[0], 0.4), method="map", noise_variance=70.0
        )
        ratios.append(float(estimated.runner_up_cost / estimated.cost))
    assert 1.0 <= ratios[0] < 1.1 < ratios[1]


# Ranges and the published solver


@given(
    seed=seeds, true_deg=st.floats(-179, 179), low_deg=st.integers(-200, 100), width_deg=st.integers(5, 300)
)
@settings(max_examples=30, deadline=None)
def test_a_restricted_range_is_kept_and_its_best_candidate_taken(
    seed: int, true_deg: float, low_deg: int, width_deg: int
) -> None:
    people = flatten(walkers(np.random.default_rng(seed), 9))
    model = fit(people[1:], 5)
    observed = seen(people[0], np.radians(true_deg))
    low, high = np.radians(low_deg), np.radians(low_deg + width_deg)
    estimated = viewpoint.estimate(
        model, observed, method="map", noise_variance=70.0, angle_range_rad=(low, high)
    )
    assert np.mod(estimated.angle_rad - low + 1e-9, 2 * np.pi) <= high - low + 2e-9
    gram = gram_of(model, 70.0)
    across, up, _ = _observations(model, gram.white, observed)
    fine = np.linspace(low, high, 4 * width_deg + 1)
    cost = search.cost_on_grid(gram, across, up, fine, 70.0)
    assert estimated.cost <= cost.min() * (1 + 1e-8)


def test_more_than_a_circle_is_a_circle() -> None:
    people = flatten(walkers(np.random.default_rng(0), 9))
    model, observed = fit(people[1:], 5), seen(people[0], 0.7)
    once, twice = (
        viewpoint.estimate(model, observed, method="least_squares", angle_range_rad=(-np.pi, turns * np.pi))
        for turns in (1, 3)
    )
    assert twice.angle_rad == pytest.approx(once.angle_rad, abs=1e-9)
    assert twice.runner_up_cost == once.runner_up_cost  # the same dip a turn later is no other


@pytest.mark.parametrize("seed", range(5))
def test_the_published_trust_region_reaches_the_minimum_from_nearby(seed: int) -> None:
    generator = np.random.default_rng(seed)
    people = flatten(walkers(generator, 15))
    model, true = fit(people[1:], 8), generator.uniform(-1.5, 1.5)
    observed = seen(people[0], true)
    best = viewpoint.estimate(model, observed, method="least_squares")
    published = viewpoint.estimate(
        model, observed, method="least_squares", solver="published", start_rad=true + 0.2
    )
    assert published.converged
    assert published.angle_rad == pytest.approx(best.angle_rad, abs=1e-3)
    assert published.cost == pytest.approx(best.cost, rel=1e-5)
    assert np.isinf(published.runner_up_cost)
    size = np.abs(best.coefficients).max()
    np.testing.assert_allclose(published.coefficients, best.coefficients, rtol=0, atol=1e-2 * size)


def test_the_published_trust_region_may_end_in_another_dip() -> None:
    """For walkers with little depth, the published local search may end in the wrong minimum."""
    people = walkers(np.random.default_rng(3), 12)
    people[..., 1] *= 0.1
    model, observed = fit(flatten(people[1:]), 8), seen(flatten(people)[0], 0.4)
    best = viewpoint.estimate(model, observed, method="least_squares")
    result = [
        viewpoint.estimate(model, observed, method="least_squares", solver="published", start_rad=start)
        for start in np.radians(np.arange(-180, 180, 30))
    ]
    costs = np.array([float(first.cost) for first in result])
    assert (costs >= best.cost * (1 - 1e-9)).all()
    assert costs.min() == pytest.approx(best.cost, rel=1e-5)
    assert costs.max() == pytest.approx(best.runner_up_cost, rel=1e-2)
    assert costs.max() > 1.02 * best.cost


@pytest.mark.parametrize("trailing", [0, 1])
@pytest.mark.parametrize("range_deg", [(0, 180), (-90, 90)])
def test_the_published_approach_ii_is_the_best_of_181_whole_degrees(
    trailing: int, range_deg: tuple[int, int]
) -> None:
    generator = np.random.default_rng(7)
    people = flatten(walkers(generator, 12), generator.uniform(0.7, 1.1, 12) if trailing else None)
    model = fit(people[1:], 7, scale_last=30.0 if trailing else 1.0)
    observed = np.stack([seen(people[0], angle) for angle in np.radians([12.4, 77.6])])
    estimated = viewpoint.estimate(
        model,
        observed,
        method="map",
        noise_variance=70.0,
        solver="published",
        angle_range_rad=(np.radians(range_deg[0]), np.radians(range_deg[1])),
    )
    whole = np.arange(range_deg[0], range_deg[1] + 1)
    assert len(whole) == 181
    for i, row in enumerate(observed):
        costs = [printed_minimum(model, row, np.radians(degree), 70.0)[0] for degree in whole]
        assert np.degrees(estimated.angle_rad[i]) == pytest.approx(whole[np.argmin(costs)], abs=1e-9)
        assert estimated.cost[i] == pytest.approx(min(costs), rel=1e-9)
    assert estimated.converged.all()


@given(fold=folds(styles=("generic",)), true=angles)
@settings(max_examples=15, deadline=None)
def test_the_coefficients_rebuild_the_walker_as_the_known_view_does(fold: Fold, true: float) -> None:
    """The MAP coefficients equal those for a known view at the estimated view angle."""
    estimated = viewpoint.estimate(fold.model, seen(fold.sample, true), method="map", noise_variance=70.0)
    white_observation = seen(fold.sample, true)
    _, k = printed_minimum(fold.model, white_observation, float(estimated.angle_rad), 70.0)
    np.testing.assert_allclose(estimated.coefficients, k, rtol=0, atol=1e-7 * max(np.abs(k).max(), 1.0))
    rebuilt = unflatten(fold.model.mean + estimated.coefficients @ fold.model.components)
    assert rebuilt.shape == (5, 15, 3)


# Refusals

MODEL = fit(flatten(walkers(np.random.default_rng(1), 5)), 3)
WITH_FREQUENCY = fit(flatten(walkers(np.random.default_rng(1), 5), np.array([0.8, 0.9, 1.0, 0.85, 0.95])), 3)
SEEN = seen(MODEL.mean, 0.3)
HOLED = SEEN.copy()
HOLED[3] = np.nan


@pytest.mark.parametrize(
    ("observed", "options", "rejection"),
    [
        (SEEN, {"method": "bayes"}, rejects("unknown_choice", "method", value="bayes")),
        (SEEN, {"method": "map"}, rejects("no_noise_variance")),
        (
            SEEN,
            {"method": "map", "noise_variance": 0.0},
            rejects("out_of_range", "the noise variance (sigma²)", value=0.0),
        ),
        (
            SEEN,
            {"method": "least_squares", "noise_variance": -1.0},
            rejects("out_of_range", "the noise variance (sigma²)", value=-1.0),
        ),
        (SEEN, {"solver": "matlab"}, rejects("unknown_choice", "solver", value="matlab")),
        (SEEN, {"angle_range_rad": (1.0, 1.0)}, rejects("empty_range")),
        (SEEN, {"angle_range_rad": (0.0, np.inf)}, rejects("empty_range")),
        (SEEN, {"angle_range_rad": (0.0, np.nan)}, rejects("empty_range")),
        (SEEN[:-1], {}, rejects("wrong_shape", shape=(149,))),
        (np.append(SEEN, 5.0), {}, rejects("wrong_shape", shape=(151,))),
        (np.zeros((2, 3, 150)), {}, rejects("wrong_shape", shape=(2, 3, 150))),
        (np.zeros((0, 150)), {}, rejects("out_of_range", "observations", value=0)),
        (HOLED, {}, rejects("not_finite", "the observation", index=(0, 3))),
    ],
)
def test_what_cannot_be_estimated_is_refused(
    observed: np.ndarray, options: dict, rejection: AbstractContextManager
) -> None:
    with rejection:
        viewpoint.estimate(MODEL, observed, **({"method": "least_squares"} | options))


def test_a_model_with_the_frequency_needs_it_observed() -> None:
    with rejects("wrong_shape", shape=(150,)):
        viewpoint.estimate(WITH_FREQUENCY, SEEN, method="least_squares")
    with rejects("wrong_shape", shape=(150,)):
        viewpoint.estimate(WITH_FREQUENCY, SEEN.reshape(5, 15, 2), method="least_squares")


def test_the_published_solver_starts_at_a_view_angle_of_zero() -> None:
    signature = inspect.signature(estimate).parameters
    assert (signature["start_rad"].default, signature["angle_range_rad"].default) == (0.0, (-np.pi, np.pi))
