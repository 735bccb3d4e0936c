"""Minimisation of many functions of one variable by Newton's method, each within its own bracket.

Symbols
-------
``f'``, ``f''``  slope and curvature of a function at a point
``[l, u]``       its bracket: f falls at l and rises at u

Why not Newton's method alone: far from a minimum its step may go uphill, out of the bracket, or be one of many that
hardly shrink.  Such a step is replaced by halving the bracket, which every slope makes smaller.  And a curvature taken
from two slopes far apart may be that of another part of the function, so a step that it calls short is made long enough
for the next curvature to be local.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Slopes = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function that returns the slopes (n,) of the functions with the given indices (n,) at points (n,)."""


@dataclass(frozen=True)
class BracketedMinima:
    """Minima of A functions of one variable, with the convergence and the number of iterations of each.

    Attributes
    ----------
    at : (A,)
        The last point at which each function was evaluated: within the tolerance of the minimum if converged.
    converged : (A,) bool
    n_iterations : (A,) int
    """

    at: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray


def minimise(
    slopes_of: Slopes,
    start: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    *,
    tolerance: float,
    most_iterations: int,
    curvature: np.ndarray,
) -> BracketedMinima:
    """Find the minimum of each of A functions within its bracket, from the slopes of the functions.

    Parameters
    ----------
    slopes_of : callable
        f' of the functions still worked on; f'' is that of the last two slopes.
    start, lower, upper : (A,)
        First points and brackets.
    tolerance : float
        Length of a step at which a function has converged.
    most_iterations : int
    curvature : (A,)
        f'' at the start; with 0 the first step halves the bracket.

    Examples
    --------
    >>> found = minimise(
    ...     lambda rows, x: 4.0 * x**3 - 4.0 * x,  # of x^4 - 2 x^2
    ...     np.array([0.1]), np.array([0.0]), np.array([3.0]), tolerance=1e-12, most_iterations=50,
    ...     curvature=np.array([-4.0]),
    ... )
    >>> found.at.round(9).tolist(), found.converged.tolist()
    ([1.0], [True])
    """
    following, lower, upper = (np.array(values, float) for values in (start, lower, upper))
    at, slopes = following.copy(), np.zeros(len(following))
    bends, converged = np.array(curvature, float), np.zeros(len(at), bool)
    iterations = np.zeros(len(at), int)
    active, probe = np.arange(len(at)), np.sqrt(tolerance)
    lengths = np.full((2, len(at)), np.inf)  # of the last step and the one before
    for step in range(most_iterations):
        if not len(active):
            break
        point = following[active]
        slope, bend = slopes_of(active, point), bends[active]
        local = np.ones(len(active), bool)
        if step > 0:
            travelled = point - at[active]
            far = np.abs(travelled) > 10.0 * tolerance  # nearer, the difference of slopes is rounding
            bend = np.where(far, (slope - slopes[active]) / np.where(far, travelled, 1.0), bend)
            local = np.abs(travelled) <= probe
        at[active], slopes[active], bends[active] = point, slope, bend
        iterations[active] += 1
        rising = slope > 0
        upper[active[rising]] = point[rising]
        lower[active[~rising]] = point[~rising]
        bowl = bend > 0
        newton = point - slope / np.where(bowl, bend, 1.0)
        near = bowl & (np.abs(newton - point) < tolerance)
        newton = np.where(near & ~local, point - np.where(rising, probe, -probe), newton)
        # A step within the tolerance needs no bracket: its own end may be here.
        near &= local
        inside = (newton >= lower[active]) & (newton <= upper[active])
        shrinks = np.abs(newton - point) <= 0.5 * lengths[1, active]
        proposal = np.where(near | (bowl & inside & shrinks), newton, 0.5 * (lower[active] + upper[active]))
        lengths[:, active] = np.abs(proposal - point), lengths[0, active]
        done = np.abs(proposal - point) < tolerance
        converged[active] = done
        following[active] = proposal
        active = active[~done]
    return BracketedMinima(at, converged, iterations)
