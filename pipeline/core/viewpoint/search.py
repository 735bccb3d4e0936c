"""Search over the whole circle for the view angle of lowest cost.

Symbols
-------
``beta``   a candidate view angle, rad; G of them on the grid
``J``      ``min over k`` of ||w_hat - w_bar_hat(beta) - E_hat(beta) k||² (+ sigma² sum k²/lambda), mm²
``B, z``   whitened eigenwalkers and their coefficients: see `reconstruction.Gram`, which eliminates them
``M``      matrix of the quadratic form J(beta) in the coordinates of an observation

Observations are written horizontal (A, 75) and vertical (A, 75, or 76 with the scaled frequency last).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import newton
from pipeline.core.choice import MARGIN, first_lowest
from pipeline.core.reconstruction import Gram
from pipeline.core.viewpoint.view_estimate import ViewEstimate

TOLERANCE_RAD = 1e-10
"""Step of the view angle, rad, below which the search has converged."""

_MOST_STEPS = 60

_POLYNOMIAL_STEPS = 5
"""Number of Newton steps on the interpolating polynomial; the fourth already reaches rounding error."""


@dataclass(frozen=True)
class ReducedCost:
    """Cost J of A observations, each at its own view angle, with the optimal coefficients.

    Attributes
    ----------
    cost : (A,)
        J, mm².
    z : (A, N)
        Coefficients in whitened form.
    slope : (A,)
        Derivative of J by the angle.
    """

    cost: np.ndarray
    z: np.ndarray
    slope: np.ndarray


def global_minimum(
    gram: Gram,
    across: np.ndarray,
    up: np.ndarray,
    angle_range_rad: tuple[float, float],
    step_rad: float,
    noise_variance: float | None,
) -> ViewEstimate:
    """Return the view angle of lowest cost for each of A observations, and the coefficients at this angle.

    Parameters
    ----------
    gram : Gram
    across, up : (A, 75), (A, 75 or 76)
        Observations.
    angle_range_rad : (low, high)
    step_rad : float
        Of the grid of candidates.
    noise_variance : float or None
        sigma² in mm²; None for least squares.

    Notes
    -----
    The lowest local minimum of the grid, by the parabola through its cell and the neighbours, is refined; where
    another comes so near that the parabolas cannot tell, both are.  The other is preferred only where its cost is
    lower by more than rounding: of two views that explain an image equally well the first of the grid is taken.
    """
    low, high = angle_range_rad
    grid, closed = candidates(low, high, step_rad)
    cost = cost_on_grid(gram, across, up, grid, noise_variance)
    height, start = local_minima(cost, grid, closed=closed)
    first, every = first_lowest(height), np.arange(len(cost))
    second, runner_up = lowest_but(height, first, closed=closed)

    def refined(rows: np.ndarray, cells: np.ndarray) -> ViewEstimate:
        step = grid[1] - grid[0]
        lower, upper = grid[cells] - step, grid[cells] + step
        if not closed:
            lower, upper = np.maximum(lower, low), np.minimum(upper, high)
        guess, curvature = _polynomial_minimum(cost[rows], cells, start[rows, cells], grid, closed=closed)
        guess = np.clip(guess, lower, upper)
        z, minimum = np.empty((len(rows), len(gram.white.scale))), np.empty(len(rows))

        def slopes_of(active: np.ndarray, angle: np.ndarray) -> np.ndarray:
            at_angle = reduced_cost(gram, across[rows[active]], up[rows[active]], angle, noise_variance)
            z[active], minimum[active] = at_angle.z, at_angle.cost
            return at_angle.slope

        minima = newton.minimise(
            slopes_of,
            guess,
            lower,
            upper,
            tolerance=TOLERANCE_RAD,
            most_iterations=_MOST_STEPS,
            curvature=curvature,
        )
        return ViewEstimate(minima.at, z, minimum, runner_up[rows], minima.converged, minima.n_iterations)

    best = refined(every, first)
    # A parabola's lowest point is trusted to within what it lies below its cell: runner_up - height of the
    # first <= the two dips, where the first's height cancels.
    contested = np.flatnonzero(2.0 * runner_up <= cost[every, first] + cost[every, second])
    return prefer_lower(best, refined(contested, second[contested]), contested)


def prefer_lower(best: ViewEstimate, other: ViewEstimate, rows: np.ndarray) -> ViewEstimate:
    """Replace each view angle estimate by its second-best minimum if that has a clearly lower cost after refinement.

    Parameters
    ----------
    best : ViewEstimate
        Of A observations.
    other : ViewEstimate
        Other minima of n of them, whose costs become those of the runners-up where they are not lower.
    rows : (n,) int
        Which observations these are.
    """
    lower = other.cost < best.cost[rows] * (1.0 - MARGIN)
    runner_up = best.runner_up_cost.copy()
    runner_up[rows] = np.where(lower, best.cost[rows], np.maximum(other.cost, best.cost[rows]))
    parts = {}
    for name in ("angle_rad", "coefficients", "cost", "converged", "n_iterations"):
        parts[name] = getattr(best, name).copy()
        parts[name][rows[lower]] = getattr(other, name)[lower]
    return ViewEstimate(runner_up_cost=runner_up, **parts)


def candidates(low: float, high: float, step: float) -> tuple[np.ndarray, bool]:
    """Return the grid of candidate view angles (G,), and True if it covers the whole circle.

    On the whole circle the end, which is the start again, is left out.

    Examples
    --------
    >>> np.degrees(candidates(0.0, np.pi, np.pi / 4)[0])
    array([  0.,  45.,  90., 135., 180.])
    """
    if high - low >= 2 * np.pi - 1e-12:
        count = max(round(2 * np.pi / step), 3)
        return low + np.arange(count) * (2 * np.pi / count), True
    return np.linspace(low, high, max(round((high - low) / step), 2) + 1), False


def cost_on_grid(
    gram: Gram, across: np.ndarray, up: np.ndarray, grid: np.ndarray, noise_variance: float | None
) -> np.ndarray:
    """Return the cost J (A, G), mm², of every observation at every candidate angle.

    The observations are written in an orthonormal basis of their span (three rows for all views of one
    walker), so that each candidate costs one solve with a handful of right-hand sides, whatever A is.
    """
    white = gram.white
    rows = np.hstack([across, up])
    basis = _orthonormal_rows(rows)
    rank, points = len(basis), across.shape[1]
    c, s = np.cos(grid)[:, None], np.sin(grid)[:, None]
    # H = [basis; -mean] B_hat, (G, rank + 1, N)
    mean = c * white.mean_x + s * white.mean_y
    bx, by = basis[:, :points] @ white.bx, basis[:, :points] @ white.by
    bz = basis[:, points:] @ white.bz
    sides = c[..., None] * bx + s[..., None] * by + bz
    mean_side = c * (mean @ white.bx) + s * (mean @ white.by) + white.mean_z @ white.bz
    H = np.concatenate([sides, -mean_side[:, None]], axis=1)
    G = np.empty((len(grid), rank + 1, rank + 1))
    G[:, :rank, :rank] = basis @ basis.T
    G[:, :rank, rank] = G[:, rank, :rank] = -(mean @ basis[:, :points].T + white.mean_z @ basis[:, points:].T)
    G[:, rank, rank] = (mean**2).sum(axis=1) + (white.mean_z**2).sum()
    M = gram.eliminate(c[:, 0], s[:, 0], G, H, noise_variance)
    coordinates = np.column_stack([rows @ basis.T, np.ones(len(rows))])
    pairs = (coordinates[:, :, None] * coordinates[:, None, :]).reshape(len(rows), -1)
    return pairs @ M.reshape(len(grid), -1).T


def _orthonormal_rows(rows: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis of the space that the rows (A, D) span, by pivoted Gram-Schmidt."""
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


def local_minima(cost: np.ndarray, grid: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return, for each grid point, the minimum (A, G) of a parabola through three points, and its angle (A, G), rad.

    The value is infinite where a cell is no local minimum.
    """
    before, after = np.roll(cost, 1, axis=1), np.roll(cost, -1, axis=1)
    if not closed:  # beyond an end the cost is taken to rise as it does inwards
        before[:, 0], after[:, -1] = cost[:, 1], cost[:, -2]
    lowest = (cost <= before) & (cost <= after)
    bend = before - 2.0 * cost + after
    curved = lowest & (bend > 0)
    offset = np.where(curved, 0.5 * (before - after) / np.where(curved, bend, 1.0), 0.0)
    height = np.where(lowest, cost - 0.25 * (before - after) * offset, np.inf)
    return height, grid + offset * (grid[1] - grid[0])


def lowest_but(height: np.ndarray, excluded: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the grid index (A,) and the cost (A,) of the lowest local minimum that is not at a given index (A,).

    The neighbours of that cell are left out with it: a minimum half way between two cells shows in both.
    """
    others, last = height.copy(), height.shape[1] - 1
    for cell in (excluded - 1, excluded, excluded + 1):
        others[np.arange(len(height)), cell % (last + 1) if closed else np.clip(cell, 0, last)] = np.inf
    return first_lowest(others), others.min(axis=1)


def reduced_cost(
    gram: Gram,
    across: np.ndarray,
    up: np.ndarray,
    angle: np.ndarray,
    noise_variance: float | None,
) -> ReducedCost:
    """Return the cost J, its slope, and the optimal coefficients of A observations, each at its own view angle (A,).

    z has been eliminated, so J' is the partial derivative at that z.
    """
    white, cosine, sine = gram.white, np.cos(angle), np.sin(angle)
    c, s = cosine[:, None], sine[:, None]
    dx = across - c * white.mean_x - s * white.mean_y
    dz = up - white.mean_z
    h = c * (dx @ white.bx) + s * (dx @ white.by) + dz @ white.bz
    z = gram.solve(cosine, sine, h[..., None], noise_variance)[..., 0]
    full_x, full_y = white.mean_x + z @ white.bx.T, white.mean_y + z @ white.by.T
    image, depth = c * full_x + s * full_y, -s * full_x + c * full_y  # d(image)/d(beta) = depth
    e = across - image
    ez = dz - z @ white.bz.T
    cost = (e**2).sum(axis=1) + (ez**2).sum(axis=1) + (noise_variance or 0.0) * (z**2).sum(axis=1)
    return ReducedCost(cost, z, -2.0 * (e * depth).sum(axis=1))


def _polynomial_minimum(
    cost: np.ndarray, cells: np.ndarray, start: np.ndarray, grid: np.ndarray, *, closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the minimum (A,), rad, of the polynomial through seven grid points, and its second derivative there (A,).

    Good to some 1e-6 rad on a grid of 2 degrees, so that one step on the cost itself is nearly the last.
    """
    count = min(7, len(grid))
    first = cells - count // 2 if closed else np.clip(cells - count // 2, 0, len(grid) - count)
    window = first[:, None] + np.arange(count)
    heights = np.take_along_axis(cost, window % len(grid), axis=1)
    step, middle = grid[1] - grid[0], count // 2
    # Coefficients in units of cells about the window's middle, lowest power first.
    series = np.linalg.solve(np.vander(np.arange(count) - float(middle), increasing=True), heights.T)
    degrees = np.arange(count)[:, None]
    slopes, bends = (degrees * series)[1:], (degrees * (degrees - 1) * series)[2:]
    origin = grid[0] + step * (first + middle)
    cell = (grid[0] + step * cells - origin) / step
    scaled = (start - origin) / step
    for _ in range(_POLYNOMIAL_STEPS):
        powers = scaled ** degrees[:-1]
        slope, bend = (slopes * powers).sum(axis=0), (bends * powers[:-1]).sum(axis=0)
        scaled -= np.where(bend > 0, slope / np.where(bend > 0, bend, 1.0), 0.0)
        scaled = np.clip(scaled, cell - 1.0, cell + 1.0)
    return origin + step * scaled, (bends * scaled ** degrees[:-2]).sum(axis=0) / step**2
