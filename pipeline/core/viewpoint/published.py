"""Estimation of view angle and coefficients as in zhang2007 appendix B: by local search, or on a grid of angles."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares as trust_region

from pipeline.core.choice import first_lowest
from pipeline.core.linear_model import WhitenedModel
from pipeline.core.reconstruction import Gram
from pipeline.core.viewpoint.search import (
    candidates,
    cost_on_grid,
    local_minima,
    lowest_but,
    reduced_cost,
)
from pipeline.core.viewpoint.view_estimate import ViewEstimate


def from_one_start(
    white: WhitenedModel, across: np.ndarray, up: np.ndarray, start_rad: float
) -> ViewEstimate:
    """Estimate view angle and coefficients by approach I: trust-region least squares from one start
    [zhang2007 B.1-B.3].

    The 150 differences have an analytic Jacobian.

    Parameters
    ----------
    white : WhitenedModel
        With the prior, as a scale of the unknowns only.
    across, up : (A, 75), (A, 75 or 76)
        Observations.
    start_rad : float
        The coefficients start from zero.
    """
    size = white.bx.shape[1]

    def differences(v: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the differences between observed and modelled image, horizontal then vertical
        [zhang2007 B.1] [zhang2007 B.2] [zhang2007 B.3].
        """
        c, s, z = np.cos(v[0]), np.sin(v[0]), v[1:]
        return np.concatenate(
            [
                x - c * (white.mean_x + white.bx @ z) - s * (white.mean_y + white.by @ z),
                y - white.mean_z - white.bz @ z,
            ]
        )

    def jacobian(v: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        c, s, z = np.cos(v[0]), np.sin(v[0]), v[1:]
        turning = s * (white.mean_x + white.bx @ z) - c * (white.mean_y + white.by @ z)
        first = np.concatenate([turning, np.zeros(len(y))])
        return np.column_stack([first, np.concatenate([-c * white.bx - s * white.by, -white.bz])])

    start = np.concatenate([[start_rad], np.zeros(size)])
    fits = [
        trust_region(differences, start, jac=jacobian, args=(x, y), method="trf")
        for x, y in zip(across, up, strict=True)
    ]
    solutions = np.stack([fit.x for fit in fits])
    return ViewEstimate(
        angle_rad=solutions[:, 0],
        coefficients=solutions[:, 1:],
        cost=np.array([2.0 * fit.cost for fit in fits]),
        runner_up_cost=np.full(len(fits), np.inf),
        converged=np.array([fit.success for fit in fits]),
        n_iterations=np.array([fit.nfev for fit in fits]),
    )


def best_candidate(
    gram: Gram,
    across: np.ndarray,
    up: np.ndarray,
    angle_range_rad: tuple[float, float],
    step_rad: float,
    noise_variance: float,
) -> ViewEstimate:
    """Estimate the view angle by approach II: the angle of lowest cost on a grid; the paper has 181 whole degrees.

    Parameters
    ----------
    gram : Gram
    across, up : (A, 75), (A, 75 or 76)
        Observations.
    angle_range_rad : (low, high)
    step_rad : float
    noise_variance : float
        sigma² in mm².
    """
    grid, closed = candidates(*angle_range_rad, step_rad)
    cost = cost_on_grid(gram, across, up, grid, noise_variance)
    best = first_lowest(cost)
    height, _ = local_minima(cost, grid, closed=closed)
    _, runner_up = lowest_but(height, best, closed=closed)
    minimum = reduced_cost(gram, across, up, grid[best], noise_variance)
    return ViewEstimate(
        angle_rad=grid[best],
        coefficients=minimum.z,
        cost=minimum.cost,
        runner_up_cost=runner_up,
        converged=np.ones(len(best), bool),
        n_iterations=np.zeros(len(best), int),
    )
