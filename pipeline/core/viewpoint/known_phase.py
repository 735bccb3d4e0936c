"""View angle and coefficients together: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3.

Symbols
-------
``alpha``  true view angle of an observation; ``beta`` a candidate, rad
``J``      ``min over k`` of ||w_hat - w_bar_hat(beta) - E_hat(beta) k||² (+ sigma² sum k²/lambda)
``z``      whitened coefficients, k = sqrt(lambda) z

Why computed differently from how it is printed: for a candidate beta the coefficients are eliminated (variable
projection), so that what is left is a function of one angle.  That function is laid out over the whole circle
and its lowest dip is refined by Newton steps that cannot leave it (`pipeline.core.view_search`): the global
minimum, unless a dip hides between two points of the grid, with neither a start to choose nor whole degrees.
`solver="published"` is what the appendix describes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares as trust_region

from pipeline.core.linear_model import LinearModel, WhitenedModel, whiten
from pipeline.core.reconstruction import check_noise_variance
from pipeline.core.viewpoint import search as view_search
from pipeline.validation import InvalidInput

FULL_CIRCLE = (-np.pi, np.pi)


@dataclass(frozen=True)
class ViewEstimate:
    """View angles and coefficients of A observations (scalars and (N,) where one flat observation was given).

    Attributes
    ----------
    angle_rad : (A,)
        In (-pi, pi].
    coefficients : (A, N)
        k in mm.
    cost : (A,)
        The minimum of [zhang2007 4.5], squared, or of [zhang2007 4.6] times 2 sigma²; mm².
    runner_up_cost : (A,)
        The lowest cost of any other local minimum, to the accuracy of the grid; infinite where there is none
        or, from one start, none was looked for.  Near `cost`, the view is ambiguous (a front seen for a back).
    converged : (A,) bool
    n_iterations : (A,) int
    """

    angle_rad: np.ndarray
    coefficients: np.ndarray
    cost: np.ndarray
    runner_up_cost: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray


def estimate(
    model: LinearModel,
    observed: np.ndarray,
    *,
    method: str,
    noise_variance: float | None = None,
    solver: str = "global",
    angle_range_rad: tuple[float, float] = FULL_CIRCLE,
    grid_step_rad: float | None = None,
    start_rad: float = 0.0,
) -> ViewEstimate:
    """View angle and coefficients of 2D Fourier representations [zhang2007 4.5] [zhang2007 4.6] [zhang2004 14].

    Parameters
    ----------
    model : LinearModel
        Of 225 numbers, or of 226 with the frequency last.
    observed : (150,) or (A, 150), or (5, 15, 2) or (A, 5, 15, 2)
        2D Fourier representations in the printed order, horizontal and vertical of each joint together; with a
        model of 226 numbers, (151,) or (A, 151) with the angular frequency in rad/s last.
    method : {"least_squares", "map"}
    noise_variance : float, optional
        sigma² in mm²; needed for ``map``.
    solver : {"global", "published"}
        ``published``: trust-region least squares from `start_rad` and the average walker for approach I, the
        best candidate of the grid for approach II, as in appendix B.
    angle_range_rad : (low, high)
        Candidates; the whole circle by default (the appendix scans 0 to pi).  The trust region has no bounds.
    grid_step_rad : float, optional
        By default 2 degrees where the best cell is refined, and the 1 degree of appendix B where it is not.
    start_rad : float
        Where the published solver of approach I starts, with all coefficients zero.

    Raises
    ------
    InvalidInput
        Unknown method or solver, sigma² missing or not positive, an empty range, no observation or one of
        another size than the model's, or values that are not finite.
    """
    if method not in ("least_squares", "map"):
        raise InvalidInput("the method is unknown", expected="least_squares or map", received=str(method))
    if method == "map" and noise_variance is None:
        raise InvalidInput(
            "MAP needs a noise variance", expected="noise_variance in mm² > 0", received="none"
        )
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    if solver not in ("global", "published"):
        raise InvalidInput("the solver is unknown", expected="global or published", received=str(solver))
    low, high = angle_range_rad
    if grid_step_rad is None:
        grid_step_rad = np.pi / 180 * (2.0 if solver == "global" else 1.0)
    if not (-np.inf < low < high < np.inf and grid_step_rad > 0):
        raise InvalidInput(
            "the range of view angles is empty",
            expected="low < high and step > 0",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg by {np.degrees(grid_step_rad):g}",
        )
    ridge = float(noise_variance) if method == "map" and noise_variance is not None else 0.0
    white = whiten(model, prior=solver == "published" or method == "map")
    across, up, single = _observations(model, white, observed)
    if solver == "published" and method == "least_squares":
        result = _published_trust_region(white, across, up, start_rad)
    elif solver == "published":
        result = _published_grid(white, across, up, angle_range_rad, grid_step_rad, ridge)
    else:
        result = view_search.global_minimum(white, across, up, angle_range_rad, grid_step_rad, ridge)
    angle, coordinates, minimum, runner_up, converged, iterations = result
    angle = np.pi - np.mod(np.pi - angle, 2 * np.pi)  # in (-pi, pi]
    answer = (angle, coordinates * white.spread, minimum, runner_up, converged, iterations)
    return ViewEstimate(*(a[0] for a in answer)) if single else ViewEstimate(*answer)


def _observations(
    model: LinearModel, white: WhitenedModel, observed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Horizontal (A, 75) and vertical (A, 75 or 76, the scaled frequency last) of the observations."""
    observed = np.asarray(observed, dtype=float)
    if observed.ndim >= 3 and observed.shape[-1] == 2:
        observed = observed.reshape(*observed.shape[:-3], -1)
    single = observed.ndim == 1
    rows = np.atleast_2d(observed)
    points = len(white.mean_x)
    trailing = len(white.mean_z) - points
    if rows.ndim != 2 or rows.shape[1] != 2 * points + trailing:
        raise InvalidInput(
            "the observation has another size than the model",
            expected=f"({2 * points + trailing},) or (A, {2 * points + trailing})",
            received=str(observed.shape),
        )
    if not len(rows):
        raise InvalidInput("there is no observation", expected="one or more", received=str(observed.shape))
    if not np.isfinite(rows).all():
        raise InvalidInput("an observed value is not finite")
    up = np.concatenate([rows[:, 1 : 2 * points : 2], model.last_scale * rows[:, 2 * points :]], axis=1)
    return rows[:, 0 : 2 * points : 2], up, single


def _published_trust_region(
    white: WhitenedModel, across: np.ndarray, up: np.ndarray, start_rad: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Approach I as in appendix B: 150 differences, trust region, one start; analytic Jacobian."""
    size = white.bx.shape[1]

    def differences(v: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """[zhang2007 B.1]: the horizontal rows [zhang2007 B.2], then the vertical ones [zhang2007 B.3]."""
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
    return (
        solutions[:, 0],
        solutions[:, 1:],
        np.array([2.0 * fit.cost for fit in fits]),
        np.full(len(fits), np.inf),
        np.array([fit.success for fit in fits]),
        np.array([fit.nfev for fit in fits]),
    )


def _published_grid(
    white: WhitenedModel,
    across: np.ndarray,
    up: np.ndarray,
    angle_range_rad: tuple[float, float],
    step_rad: float,
    ridge: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Approach II as in appendix B: the best of the candidates, 181 whole degrees from 0 to pi."""
    grid, closed = view_search.candidates(*angle_range_rad, step_rad)
    cost = view_search.cost_on_grid(white, across, up, grid, ridge)
    best = cost.argmin(axis=1)
    height, _ = view_search.local_minima(cost, grid, closed=closed)
    _, runner_up = view_search.lowest_but(height, best, closed=closed)
    minimum, coordinates, _, _ = view_search.reduced_cost(white, across, up, grid[best], ridge, bend=False)
    converged, iterations = np.ones(len(best), dtype=bool), np.zeros(len(best), dtype=int)
    return grid[best], coordinates, minimum, runner_up, converged, iterations
