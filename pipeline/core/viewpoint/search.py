"""The search over the view angle: one function of one angle, over the whole circle at once.

Symbols
-------
``beta``   a candidate view angle, rad; G of them on the grid
``J``      ``min over k`` of ||w_hat - w_bar_hat(beta) - E_hat(beta) k||² (+ sigma² sum k²/lambda)
``B``      eigenwalkers, times sqrt(lambda) where there is a prior; ``z = k / sqrt(lambda)`` or k
``A``      ``B_hat^T B_hat``, and `ridge` times the unit matrix (sigma², or rounding without a prior)
``M``      matrix of the quadratic form J(beta) in the coordinates of an observation

Observations are written horizontal (A, 75) and vertical (A, 75, or 76 with the scaled frequency last).
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import polynomial

from pipeline.core.linear_model import WhitenedModel

_TOLERANCE_RAD = 1e-10
_MOST_STEPS = 40


def global_minimum(
    white: WhitenedModel,
    across: np.ndarray,
    up: np.ndarray,
    angle_range_rad: tuple[float, float],
    step_rad: float,
    ridge: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Angle (A,), z (A, N), J (A,), lowest other minimum (A,), converged (A,) and steps (A,) of each observation.

    The lowest local minimum of the grid, by the parabola through its cell and the neighbours, is refined;
    where another comes so near that the parabolas cannot tell, both are.
    """
    low, high = angle_range_rad
    grid, closed = candidates(low, high, step_rad)
    cost = cost_on_grid(white, across, up, grid, ridge)
    height, start = local_minima(cost, grid, closed=closed)
    first, every = height.argmin(axis=1), np.arange(len(cost))
    second, runner_up = lowest_but(height, first, closed=closed)

    def refined(rows: np.ndarray, cells: np.ndarray) -> list[np.ndarray]:
        step = grid[1] - grid[0]
        lower, upper = grid[cells] - step, grid[cells] + step
        if not closed:
            lower, upper = np.maximum(lower, low), np.minimum(upper, high)
        guess, curvature = _local_minimum(cost[rows], cells, start[rows, cells], grid, closed=closed)
        guess = np.clip(guess, lower, upper)
        return list(_refine(white, across[rows], up[rows], guess, curvature, lower, upper, ridge))

    found = refined(every, first)
    # A parabola's lowest point is trusted to within what it lies below its cell: runner_up - height of the
    # first <= the two dips, where the first's height cancels.
    contested = np.flatnonzero(2.0 * runner_up <= cost[every, first] + cost[every, second])
    if len(contested):
        others = refined(contested, second[contested])
        lower_cost = others[2] < found[2][contested]
        runner_up[contested] = np.where(lower_cost, found[2][contested], others[2])
        for mine, other in zip(found, others, strict=True):
            mine[contested[lower_cost]] = other[lower_cost]
    angle, z, minimum, converged, iterations = found
    return angle, z, minimum, runner_up, converged, iterations


def candidates(low: float, high: float, step: float) -> tuple[np.ndarray, bool]:
    """Candidate angles (G,) from low to high, and whether they close the circle.

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
    outer[:, :rank, rank] = outer[:, rank, :rank] = -(
        mean @ basis[:, :points].T + white.mean_z @ basis[:, points:].T
    )
    outer[:, rank, rank] = (mean**2).sum(axis=1) + (white.mean_z**2).sum()
    gram = white.gram(c[:, 0], s[:, 0]) + _ridge_matrix(white, ridge)
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


def _ridge_matrix(white: WhitenedModel, ridge: float) -> np.ndarray:
    """sigma² I; for least squares a floor at rounding level that keeps an unseen eigenwalker at zero."""
    size = white.bx.shape[1]
    scale = sum(np.einsum("pn,pn->", b, b) for b in (white.bx, white.by, white.bz))
    floor = scale * np.finfo(float).eps if scale > 0 else 1.0
    return (ridge if ridge > 0 else floor) * np.eye(size)


def local_minima(cost: np.ndarray, grid: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Lowest value (A, G) of the parabola through each cell and its neighbours, and where it is (A, G) rad.

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


def lowest_but(height: np.ndarray, taken: np.ndarray, *, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Cell (A,) and value (A,) of the lowest local minimum away from the cell that is taken.

    Its neighbours are left out with it: a minimum half way between two cells shows in both.
    """
    others, last = height.copy(), height.shape[1] - 1
    for cell in (taken - 1, taken, taken + 1):
        others[np.arange(len(height)), cell % (last + 1) if closed else np.clip(cell, 0, last)] = np.inf
    return others.argmin(axis=1), others.min(axis=1)


def reduced_cost(
    white: WhitenedModel, across: np.ndarray, up: np.ndarray, angle: np.ndarray, ridge: float, *, bend: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """J, z, J' and (only with `bend`) J'' at one angle per observation.

    z has been eliminated, so J' is the partial derivative at that z.
    """
    c, s = np.cos(angle), np.sin(angle)
    gram = white.gram(c, s) + _ridge_matrix(white, ridge)
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


def _local_minimum(
    cost: np.ndarray, cells: np.ndarray, start: np.ndarray, grid: np.ndarray, *, closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Where the polynomial through seven cells about `cells` is lowest (A,) rad, and its curvature there (A,).

    Good to some 1e-6 rad on a grid of 2 degrees, so that one step on the cost itself is nearly the last.
    """
    count = min(7, len(grid))
    first = cells - count // 2 if closed else np.clip(cells - count // 2, 0, len(grid) - count)
    window = first[:, None] + np.arange(count)
    heights = np.take_along_axis(cost, window % len(grid), axis=1)
    step, middle = grid[1] - grid[0], count // 2
    # Coefficients in units of cells about the window's middle, lowest power first.
    series = np.linalg.solve(np.vander(np.arange(count) - float(middle), increasing=True), heights.T)
    slopes, bends = polynomial.polyder(series), polynomial.polyder(series, 2)
    origin = grid[0] + step * (first + middle)
    place = (start - origin) / step
    for _ in range(4):
        bend = polynomial.polyval(place, bends, tensor=False)
        slope = polynomial.polyval(place, slopes, tensor=False)
        place = place - np.where(bend > 0, slope / np.where(bend > 0, bend, 1.0), 0.0)
    curvature = polynomial.polyval(place, bends, tensor=False) / step**2
    return origin + step * place, curvature


def _refine(
    white: WhitenedModel,
    across: np.ndarray,
    up: np.ndarray,
    start: np.ndarray,
    curvature: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    ridge: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Angle, z, J, converged and steps at the zero of J' inside a shrinking bracket.

    Steps are Newton's, with the curvature that is given for the first and that of the last two slopes after it;
    a step out of the bracket, or uphill, becomes a bisection.
    """
    angle, lower, upper = start.copy(), lower.copy(), upper.copy()
    iterations = np.zeros(len(angle), dtype=int)
    converged = np.zeros(len(angle), dtype=bool)
    z, cost = np.empty((len(angle), white.bx.shape[1])), np.empty(len(angle))
    last_angle, last_slope, last_curvature = angle.copy(), np.zeros(len(angle)), curvature.copy()
    for step in range(_MOST_STEPS):
        active = np.flatnonzero(~converged)
        if not len(active):
            break
        here = angle[active]
        cost[active], z[active], slope, _ = reduced_cost(
            white, across[active], up[active], here, ridge, bend=False
        )
        bend = last_curvature[active]
        if step > 0:
            travelled = here - last_angle[active]
            bend = np.where(
                np.abs(travelled) > 1e-9,
                (slope - last_slope[active]) / np.where(travelled == 0, 1.0, travelled),
                bend,
            )
        last_angle[active], last_slope[active], last_curvature[active] = here, slope, bend
        rising = slope > 0
        upper[active[rising]] = here[rising]
        lower[active[~rising]] = here[~rising]
        bowl = bend > 0
        proposal = here - slope / np.where(bowl, bend, 1.0)
        # A step within rounding of here needs no bracket: its own end may be here.
        near = bowl & (np.abs(proposal - here) < _TOLERANCE_RAD)
        inside = bowl & (proposal >= lower[active]) & (proposal <= upper[active])
        proposal = np.where(inside | near, proposal, 0.5 * (lower[active] + upper[active]))
        iterations[active] += 1
        converged[active] = np.abs(proposal - here) < _TOLERANCE_RAD
        # What has converged stays where its cost and coefficients were worked out.
        angle[active] = np.where(converged[active], here, proposal)
    if not converged.all():
        cost, z, _, _ = reduced_cost(white, across, up, angle, ridge, bend=False)
    return angle, z, cost, converged, iterations
