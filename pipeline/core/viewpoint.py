"""View angle and coefficients together: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3.

Symbols
-------
``alpha``  true view angle of an observation; ``beta`` a candidate, rad
``J``      ``min over k`` of ||w_hat - w_bar_hat(beta) - E_hat(beta) k||² (+ sigma² sum k²/lambda)
``z``      whitened coefficients, k = sqrt(lambda) z; ``A = B_hat^T B_hat``
``M``      matrix of the quadratic form J(beta) in the coordinates of an observation

Why computed differently from how it is printed: for a candidate beta the coefficients are eliminated (variable
projection), so that what is left is a function of one angle.  That function is laid out over the whole circle
and its best cell is refined by Newton steps that cannot leave the cell: a global answer to 1e-10 rad, with
neither a start to choose nor a grid of whole degrees.  `solver="published"` is what the appendix describes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares as trust_region

from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction import WhitenedModel, check_noise_variance, whiten
from pipeline.refusal import Refusal

FULL_CIRCLE = (-np.pi, np.pi)
_TOLERANCE_RAD = 1e-10
_MOST_STEPS = 40


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
        The lowest cost of any other local minimum of the grid; infinite where there is none.  Near `cost`, the
        view is ambiguous (a front seen for a back).
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
    observed : (150,) or (A, 150), or (…, 5, 15, 2)
        2D Fourier representations in the printed order, horizontal and vertical of each joint together; with a
        model of 226 numbers, (151,) or (A, 151) with the angular frequency in rad/s last.
    method : {"least_squares", "map"}
    noise_variance : float, optional
        sigma² in mm²; needed for ``map``.
    solver : {"global", "published"}
        ``published``: trust-region least squares from `start_rad` for approach I, the best whole cell of the
        grid for approach II, as in appendix B.
    angle_range_rad : (low, high)
        Candidates; the whole circle by default (the appendix scans 0 to pi).
    grid_step_rad : float, optional
        By default 2 degrees where the best cell is refined, and the 1 degree of appendix B where it is not.

    Raises
    ------
    Refusal
        Unknown method or solver, sigma² missing or not positive, an empty range, observations of another size
        than the model's, or values that are not finite.
    """
    if method not in ("least_squares", "map"):
        raise Refusal("the method is unknown", expected="least_squares or map", received=str(method))
    if method == "map" and noise_variance is None:
        raise Refusal("MAP needs a noise variance", expected="noise_variance in mm² > 0", received="none")
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    if solver not in ("global", "published"):
        raise Refusal("the solver is unknown", expected="global or published", received=str(solver))
    low, high = angle_range_rad
    if grid_step_rad is None:
        grid_step_rad = np.pi / 180 * (2.0 if solver == "global" else 1.0)
    if not high > low or not grid_step_rad > 0:
        raise Refusal(
            "the range of view angles is empty",
            expected="low < high and step > 0",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg by {np.degrees(grid_step_rad):g}",
        )
    white = whiten(model)
    across, up, single = _observations(model, white, observed)
    ridge = float(noise_variance) if method == "map" and noise_variance is not None else 0.0
    if solver == "published" and method == "least_squares":
        result = _published_trust_region(white, across, up, start_rad)
    else:
        grid = _grid(low, high, grid_step_rad)
        cost = _cost_on_grid(white, across, up, grid, ridge)
        best = cost.argmin(axis=1)
        runner_up = _runner_up(cost, best, closed=_closed(low, high))
        if solver == "published":
            angle = grid[best]
            iterations, converged = np.zeros(len(angle), dtype=int), np.ones(len(angle), dtype=bool)
        else:
            step = grid[1] - grid[0]
            lower, upper = grid[best] - step, grid[best] + step
            if not _closed(low, high):
                lower, upper = np.maximum(lower, low), np.minimum(upper, high)
            start = np.clip(_vertex(cost, best, grid, closed=_closed(low, high)), lower, upper)
            angle, iterations, converged = _refine(white, across, up, start, lower, upper, ridge)
        minimum, coordinates, _, _ = _reduced(white, across, up, angle, ridge, bend=False)
        result = (angle, coordinates, minimum, runner_up, converged, iterations)
    angle, coordinates, minimum, runner_up, converged, iterations = result
    angle = np.pi - np.mod(np.pi - angle, 2 * np.pi)  # in (-pi, pi]
    answer = (angle, coordinates * np.sqrt(model.eigenvalues), minimum, runner_up, converged, iterations)
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
        raise Refusal(
            "the observation has another size than the model",
            expected=f"({2 * points + trailing},) or (A, {2 * points + trailing})",
            received=str(observed.shape),
        )
    if not np.isfinite(rows).all():
        raise Refusal("an observed value is not finite")
    up = np.concatenate([rows[:, 1 : 2 * points : 2], model.last_scale * rows[:, 2 * points :]], axis=1)
    return rows[:, 0 : 2 * points : 2], up, single


def _closed(low: float, high: float) -> bool:
    return high - low >= 2 * np.pi - 1e-12


def _grid(low: float, high: float, step: float) -> np.ndarray:
    """Candidates from low to high; on the whole circle the end, which is the start again, is left out."""
    count = max(int(round((high - low) / step)), 2)
    return np.linspace(low, high, count, endpoint=False) if _closed(low, high) else np.linspace(low, high, count + 1)


def _cost_on_grid(
    white: WhitenedModel, across: np.ndarray, up: np.ndarray, grid: np.ndarray, ridge: float
) -> np.ndarray:
    """J (A, G): every observation at every candidate.

    The observations are written in an orthonormal basis of their span (three rows for all views of one
    walker), so that each candidate costs one solve with a handful of right-hand sides, whatever A is.
    """
    rows = np.concatenate([across, up], axis=1)
    basis = _orthonormal_rows(rows)
    rank, points = len(basis), across.shape[1]
    c, s = np.cos(grid)[:, None], np.sin(grid)[:, None]
    # u = B_hat^T [basis; -mean]: right-hand sides (G, N, rank + 1)
    mean = c * white.mean_x + s * white.mean_y
    bx, by = basis[:, :points] @ white.bx, basis[:, :points] @ white.by
    bz = basis[:, points:] @ white.bz
    sides = c[..., None] * bx + s[..., None] * by + bz
    mean_side = c * (mean @ white.bx) + s * (mean @ white.by) + white.mean_z @ white.bz
    u = np.concatenate([sides, -mean_side[:, None]], axis=1)
    outer = np.empty((len(grid), rank + 1, rank + 1))
    outer[:, :rank, :rank] = basis @ basis.T
    outer[:, :rank, rank] = outer[:, rank, :rank] = -(mean @ basis[:, :points].T + white.mean_z @ basis[:, points:].T)
    outer[:, rank, rank] = (mean**2).sum(axis=1) + (white.mean_z**2).sum()
    gram = white.gram(c[:, 0], s[:, 0]) + _ridge(white, ridge)
    M = outer - u @ np.linalg.solve(gram, np.swapaxes(u, 1, 2))
    coordinates = np.concatenate([rows @ basis.T, np.ones((len(rows), 1))], axis=1)
    pairs = (coordinates[:, :, None] * coordinates[:, None, :]).reshape(len(rows), -1)
    return pairs @ M.reshape(len(grid), -1).T


def _orthonormal_rows(rows: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the span of (A, D) rows, by pivoted Gram-Schmidt done twice."""
    left = rows.copy()
    basis = np.empty((0, rows.shape[1]))
    floor = 1e-13 * np.sqrt((rows**2).sum(axis=1).max())
    for _ in range(min(rows.shape)):
        lengths = np.sqrt((left**2).sum(axis=1))
        pivot = int(lengths.argmax())
        if len(basis) and lengths[pivot] <= floor:
            break
        new = left[pivot] - (left[pivot] @ basis.T) @ basis
        length = np.linalg.norm(new)
        if length == 0.0:
            break
        basis = np.concatenate([basis, new[None] / length])
        left = left - (left @ basis[-1])[:, None] * basis[-1]
    return basis


def _ridge(white: WhitenedModel, ridge: float) -> np.ndarray:
    """sigma² I; for least squares a floor at rounding level that keeps an unseen eigenwalker at zero."""
    size = white.bx.shape[1]
    scale = np.einsum("pn,pn->", white.bx, white.bx) + np.einsum("pn,pn->", white.bz, white.bz)
    return (ridge if ridge > 0 else scale * np.finfo(float).eps) * np.eye(size)


def _runner_up(cost: np.ndarray, best: np.ndarray, *, closed: bool) -> np.ndarray:
    """Lowest other local minimum of each row of the grid, infinite where there is none."""
    before, after = np.roll(cost, 1, axis=1), np.roll(cost, -1, axis=1)
    if not closed:
        before[:, 0], after[:, -1] = np.inf, np.inf
    minima = np.where((cost <= before) & (cost <= after), cost, np.inf)
    minima[np.arange(len(cost)), best] = np.inf
    return minima.min(axis=1)


def _vertex(cost: np.ndarray, best: np.ndarray, grid: np.ndarray, *, closed: bool) -> np.ndarray:
    """Where the parabola through each row's best cell and its neighbours is lowest: a start for Newton."""
    every, last = np.arange(len(cost)), cost.shape[1] - 1
    before = cost[every, (best - 1) % (last + 1) if closed else np.maximum(best - 1, 0)]
    after = cost[every, (best + 1) % (last + 1) if closed else np.minimum(best + 1, last)]
    bend = before - 2.0 * cost[every, best] + after
    offset = np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0)
    return grid[best] + np.clip(offset, -1.0, 1.0) * (grid[1] - grid[0])


def _reduced(
    white: WhitenedModel, across: np.ndarray, up: np.ndarray, angle: np.ndarray, ridge: float, *, bend: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """J, z, J' and (only with `bend`) J'' at one angle per observation.

    z has been eliminated, so J' is the partial derivative at that z.
    """
    c, s = np.cos(angle), np.sin(angle)
    gram = white.gram(c, s) + _ridge(white, ridge)
    c, s = c[:, None], s[:, None]
    dx = across - c * white.mean_x - s * white.mean_y
    dz = up - white.mean_z
    h = c * (dx @ white.bx) + s * (dx @ white.by) + dz @ white.bz
    z = np.linalg.solve(gram, h[..., None])[..., 0]
    full_x, full_y = white.mean_x + z @ white.bx.T, white.mean_y + z @ white.by.T
    seen, unseen = c * full_x + s * full_y, -s * full_x + c * full_y  # d(seen)/d(beta) = unseen
    e = across - seen
    ez = dz - z @ white.bz.T
    cost = (e**2).sum(axis=1) + (ez**2).sum(axis=1) + ridge * (z**2).sum(axis=1)
    slope = -2.0 * (e * unseen).sum(axis=1)
    if not bend:
        return cost, z, slope, np.empty(0)
    mixed = 2.0 * (
        c * (unseen @ white.bx) + s * (unseen @ white.by) + s * (e @ white.bx) - c * (e @ white.by)
    )
    curvature = 2.0 * ((unseen**2).sum(axis=1) + (e * seen).sum(axis=1))
    curvature = curvature - 0.5 * (mixed * np.linalg.solve(gram, mixed[..., None])[..., 0]).sum(axis=1)
    return cost, z, slope, curvature


def _refine(
    white: WhitenedModel,
    across: np.ndarray,
    up: np.ndarray,
    start: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    ridge: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The zero of J' inside a shrinking bracket; a step out of it, or uphill, becomes a bisection.

    The first step is Newton's; later ones take the curvature from the last two slopes, which is as good so
    near the minimum and saves half of the solves.
    """
    angle, lower, upper = start.copy(), lower.copy(), upper.copy()
    iterations = np.zeros(len(angle), dtype=int)
    converged = np.zeros(len(angle), dtype=bool)
    last_angle, last_slope, last_curvature = angle.copy(), np.zeros(len(angle)), np.zeros(len(angle))
    for step in range(_MOST_STEPS):
        active = np.flatnonzero(~converged)
        if not len(active):
            break
        here = angle[active]
        _, _, slope, curvature = _reduced(white, across[active], up[active], here, ridge, bend=step == 0)
        if step > 0:
            travelled = here - last_angle[active]
            curvature = np.where(
                np.abs(travelled) > 1e-9,
                (slope - last_slope[active]) / np.where(travelled == 0, 1.0, travelled),
                last_curvature[active],
            )
        last_angle[active], last_slope[active], last_curvature[active] = here, slope, curvature
        rising = slope > 0
        upper[active[rising]] = here[rising]
        lower[active[~rising]] = here[~rising]
        middle = 0.5 * (lower[active] + upper[active])
        bowl = curvature > 0
        proposal = here - slope / np.where(bowl, curvature, 1.0)
        inside = bowl & (proposal >= lower[active]) & (proposal <= upper[active])
        proposal = np.where(inside, proposal, middle)
        angle[active] = proposal
        iterations[active] += 1
        converged[active] = np.abs(proposal - here) < _TOLERANCE_RAD
    return angle, iterations, converged


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
