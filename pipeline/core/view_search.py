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
        x, y = across[rows], up[rows]
        angle, iterations, converged = _refine(white, x, y, start[rows, cells], lower, upper, ridge)
        minimum, z, _, _ = reduced_cost(white, x, y, angle, ridge, bend=False)
        return [angle, z, minimum, converged, iterations]

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
        _, _, slope, curvature = reduced_cost(white, across[active], up[active], here, ridge, bend=step == 0)
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
