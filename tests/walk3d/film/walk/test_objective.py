"""Tests of the cost function: derivatives against finite differences, and the minimum against a general minimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.walk3d.film.walk.walkers import clip, prior
from walk3d.film.walk.objective import (
    AX,
    HEADING,
    LOG_F,
    PHASE,
    PITCH,
    SIZE,
    TURN,
    UNKNOWNS,
    VX,
    Z0,
    Keypoints,
    Noise,
    Objective,
    Setting,
)  # fmt: skip
from walk3d.film.walk.path import TRUNK
from walk3d.film.walk.refinement import Refinement, initial_unknowns
from walk3d.film.walk.start import find_starts

NOISE = Noise(4.0, 2.0)


def _case(overground: bool, **more: float) -> tuple[Objective, np.ndarray, Keypoints]:
    sim = clip(40.0, speed=1200.0 if overground else 0.0)
    times = (np.arange(len(sim.pixels)) - (len(sim.pixels) - 1) / 2) / sim.frame_rate_hz
    rng = np.random.default_rng(1)
    keypoints = Keypoints(sim.pixels, (rng.random(sim.pixels.shape[:2]) > 0.1).astype(float))
    starts = find_starts(keypoints.pixels, keypoints.weights, times, sim.focal_px, prior())
    setting = Setting(times, sim.focal_px, overground, **more)  # type: ignore[arg-type]
    objective = Objective(prior(), setting, starts.starts[0].frequency_hz)
    x = np.zeros(objective.unknowns)
    x[:UNKNOWNS] = initial_unknowns(prior(), starts.starts[0], starts.path, sim.focal_px, TRUNK)
    x[:SIZE] += rng.normal(scale=8.0, size=SIZE)
    sizes = np.array([20, 20, 50, 50, 50, 0.05, 0.03, 0.05, 0.02, 30, 30, 0.05])
    x[SIZE:UNKNOWNS] += rng.normal(size=12) * sizes
    x[UNKNOWNS:] += rng.normal(size=objective.unknowns - UNKNOWNS) * 0.1
    return objective, x, keypoints


@pytest.mark.parametrize(
    ("overground", "more"), [(True, {}), (False, {}), (True, {"focal_sd": 0.35}), (False, {"cosines": 2})]
)
def test_the_gradient_is_that_of_the_cost(overground: bool, more: dict[str, float]) -> None:
    objective, x, keypoints = _case(overground, **more)
    result = objective.quadratic(objective.at(x), keypoints, NOISE)
    assert result.cost == pytest.approx(objective.cost(objective.at(x), keypoints, NOISE), rel=1e-12)
    for index in [0, 26, 27 * 8 + 9, 27 * 13 + 4, SIZE - 1, *range(SIZE, objective.unknowns)]:
        step = np.zeros(objective.unknowns)
        angle = index in (HEADING, PITCH, PHASE, LOG_F, TURN) or ("focal_sd" in more and index >= UNKNOWNS)
        step[index] = 1e-6 if angle else 1e-3
        numeric = objective.cost(objective.at(x + step), keypoints, NOISE) - objective.cost(
            objective.at(x - step), keypoints, NOISE
        )
        slope = 2.0 * result.gradient[index]
        assert numeric / (2.0 * step[index]) == pytest.approx(
            slope, rel=1e-4, abs=1e-4 * np.abs(slope) + 1e-3
        )


def test_a_step_of_the_focal_length_keeps_the_size_of_the_image() -> None:
    objective, x, _ = _case(True, focal_sd=0.35)
    step = np.zeros(len(x))
    step[-1], step[Z0] = 0.4, 0.4 * x[Z0]  # to first order distance goes as the focal length
    moved = objective.moved(x, step)
    assert moved[Z0] / objective.focal_px(moved) == pytest.approx(x[Z0] / objective.focal_px(x), rel=1e-12)
    step *= 1e-4
    np.testing.assert_allclose(objective.moved(x, step), x + step, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("more", [{}, {"focal_sd": 0.35}, {"cosines": 2}])
def test_the_matrix_is_positive_and_of_the_derivatives_of_the_image(more: dict[str, float]) -> None:
    objective, x, keypoints = _case(not more, **more)
    matrix = objective.quadratic(objective.at(x), keypoints, NOISE).matrix
    assert np.linalg.eigvalsh(matrix).min() > 0  # of the lower triangle
    unseen = Keypoints(keypoints.pixels, np.zeros_like(keypoints.weights))
    of_data = matrix - objective.quadratic(objective.at(x), unseen, NOISE).matrix
    r2 = (objective.residual(x, keypoints) ** 2).sum(axis=-1) / NOISE.sigma_px**2
    w = keypoints.weights * 6.0 / (4.0 + r2) / NOISE.kappa / NOISE.sigma_px**2
    some = [0, 4, 26, 27 * 8 + 9, 27 * 13 + 4, SIZE - 1, *range(SIZE, objective.unknowns)]
    slopes = []
    for index in some:
        step = np.zeros(objective.unknowns)
        step[index] = 1e-5 if index in (HEADING, PITCH, PHASE, LOG_F, TURN) else 1e-3
        ends = [objective.residual(x + sign * step, keypoints) for sign in (1.0, -1.0)]
        slopes.append((ends[0] - ends[1]) / (2.0 * step[index]))
    expected = np.einsum("atjd,tj,btjd->ab", slopes, w, slopes, optimize=True)
    scale = np.sqrt(np.diag(expected))
    result = np.tril(of_data)[np.ix_(some, some)]
    np.testing.assert_allclose(
        result / np.outer(scale, scale), np.tril(expected / np.outer(scale, scale)), atol=1e-5
    )


def test_a_generic_minimiser_finds_nothing_lower(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("walk3d.film.walk.refinement.MAX_STEPS", 30)
    sim = clip(40.0)
    times = (np.arange(len(sim.pixels)) - (len(sim.pixels) - 1) / 2) / sim.frame_rate_hz
    keypoints = Keypoints(sim.pixels, np.ones(sim.pixels.shape[:2]))
    starts = find_starts(keypoints.pixels, keypoints.weights, times, sim.focal_px, prior())
    setting = Setting(times, sim.focal_px, True)
    refinement = Refinement(prior(), setting, keypoints, starts.starts[0], starts.path, relabel=False)
    fit = refinement.advance().fit()
    objective = fit.objective
    # In units in which the curvature is one, so that a method without curvature gets somewhere.
    start = objective.quadratic(objective.at(fit.x), keypoints, fit.noise)
    back = np.linalg.inv(np.linalg.cholesky(start.matrix)).T
    rng = np.random.default_rng(0)

    def cost(z: np.ndarray) -> tuple[float, np.ndarray]:
        result = objective.quadratic(objective.at(fit.x + back @ z), keypoints, fit.noise)
        return result.cost, 2.0 * back.T @ result.gradient

    generic = minimize(cost, rng.normal(size=UNKNOWNS), jac=True, method="L-BFGS-B", options={"maxiter": 60})
    assert refinement.cost(fit.noise) <= generic.fun + 0.2
    assert generic.fun < cost(rng.normal(size=UNKNOWNS))[0]


def test_a_path_that_agrees_with_the_feet_costs_less() -> None:
    objective, x, _ = _case(True)
    speed = 2 * np.pi * np.exp(x[LOG_F]) * float(prior().belt @ x[:SIZE])
    x[[VX, VX + 1]] = speed * np.sin(x[HEADING]), -speed * np.cos(x[HEADING])
    x[[AX, AX + 1, TURN]] = 0.0
    agrees = objective.at(x).prior_cost
    x[VX] += 500.0
    assert objective.at(x).prior_cost > agrees + 1.0
