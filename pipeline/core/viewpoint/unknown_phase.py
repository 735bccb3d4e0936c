"""View angle, phase and coefficients together, from the image and its frequency alone.

Symbols are those of `observed_phase`; ``beta`` is the view angle.

Why this is enough: with coefficients and phase eliminated the lowest cost J is a function of one angle beta; as
the lower envelope of smooth curves it has no local minimum at a kink, so a bracket suffices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.linear_model import LinearModel, whiten
from pipeline.core.reconstruction import check_noise_variance
from pipeline.core.reconstruction.unknown_phase import TurnedObservations, inverse_eigenvalues, lowest_phase
from pipeline.core.viewpoint import search as view_search
from pipeline.core.viewpoint.known_phase import FULL_CIRCLE, ViewEstimate
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class PhasedEstimate(ViewEstimate):
    """View angles, coefficients and phases of A observations.

    Attributes
    ----------
    phase_rad : (A,)
        Phase at the first frame, in (-pi, pi]; the others are those of `ViewEstimate`.
    """

    phase_rad: np.ndarray


def estimate(
    model: LinearModel,
    image: np.ndarray,
    *,
    noise_variance: float | None,
    frequency_hz: np.ndarray | None = None,
    angle_range_rad: tuple[float, float] = FULL_CIRCLE,
    grid_step_rad: float = np.pi / 90,
) -> PhasedEstimate:
    """View angle, phase and coefficients together [zhang2007 4.5, 4.6] [zhang2004 14], the phase unknown too.

    Parameters and refusals are those of `observed_phase.from_known_views`; `angle_range_rad` bounds the
    candidates, and the two lowest minima of their grid are refined, so that `runner_up_cost` is the exact cost of
    the second.
    """
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    low, high = angle_range_rad
    if not high > low or not grid_step_rad > 0:
        raise InvalidInput(
            "the range of view angles is empty",
            expected="low < high and step > 0",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg by {np.degrees(grid_step_rad):g}",
        )
    white = whiten(model, prior=noise_variance is not None)
    rows = TurnedObservations(model, white, image, frequency_hz)
    grid, closed = view_search.candidates(low, high, grid_step_rad)
    c, s = np.cos(grid), np.sin(grid)
    values, vectors = np.linalg.eigh(white.gram(c, s))
    roots = vectors * np.sqrt(inverse_eigenvalues(values, noise_variance))[:, None]
    cost = np.empty((len(rows.across), len(grid)))
    for g in range(len(grid)):
        G, H = rows.against(c[g : g + 1], s[g : g + 1])
        K = H @ roots[g]
        cost[:, g] = lowest_phase(G - K @ np.swapaxes(K, 1, 2))[1]
    height, start = view_search.local_minima(cost, grid, closed=closed)
    first, every = height.argmin(axis=1), np.arange(len(cost))
    second, other = view_search.lowest_but(height, first, closed=closed)
    contenders = np.flatnonzero(np.isfinite(other))
    which, cell = np.concatenate([every, contenders]), np.concatenate([first, second[contenders]])
    step = grid[1] - grid[0]
    lower, upper = grid[cell] - step, grid[cell] + step
    if not closed:
        lower, upper = np.maximum(lower, low), np.minimum(upper, high)
    found = _descend(rows, which, start[which, cell], lower, upper, noise_variance or 0.0)
    best, rival = every.copy(), np.full(len(every), -1)
    rival[contenders] = len(every) + np.arange(len(contenders))
    swapped = contenders[found[2][rival[contenders]] < found[2][contenders]]
    best[swapped], rival[swapped] = rival[swapped], swapped
    runner_up = np.where(rival >= 0, found[2][rival], np.inf)
    angle, z, lowest, phase, converged, iterations = (part[best] for part in found)
    angle = np.pi - np.mod(np.pi - angle, 2 * np.pi)  # in (-pi, pi]
    return PhasedEstimate(angle, z * white.spread, lowest, runner_up, converged, iterations, phase)


def _profile(
    rows: TurnedObservations, which: np.ndarray, angle: np.ndarray, ridge: float, *, bend: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """J lowest over phase and coefficients at one angle per row: J, z, J', phase and J'' at a fixed phase.

    Phase and coefficients are at their minimum, so J' is the partial derivative there.
    """
    c, s = np.cos(angle), np.sin(angle)
    G, H = rows.against(c, s, which)
    gram = rows.white.gram(c, s)
    floor = ridge or np.finfo(float).eps * float(np.trace(gram, axis1=1, axis2=2).max())
    forms = G - H @ np.linalg.solve(gram + floor * np.eye(gram.shape[-1]), np.swapaxes(H, 1, 2))
    phase, _ = lowest_phase(forms)
    across, up = rows.at(phase, which)
    cost, z, slope, curvature = view_search.reduced_cost(rows.white, across, up, angle, ridge, bend=bend)
    return cost, z, slope, phase, curvature


def _descend(
    rows: TurnedObservations,
    which: np.ndarray,
    start: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    ridge: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The zero of J' inside a shrinking bracket: angle, z, J, phase, converged, steps.

    The first step takes the curvature at a fixed phase, which is never too small; later ones that of the last
    two slopes; a step out of the bracket, or uphill, becomes a bisection.
    """
    angle, lower, upper = start.copy(), lower.copy(), upper.copy()
    steps, converged = np.zeros(len(angle), dtype=int), np.zeros(len(angle), dtype=bool)
    last_angle, last_slope, curvature = angle.copy(), np.zeros(len(angle)), np.zeros(len(angle))
    for step in range(60):
        active = np.flatnonzero(~converged)
        if not len(active):
            break
        here = angle[active]
        _, _, slope, _, bend = _profile(rows, which[active], here, ridge, bend=step == 0)
        if step:
            travelled = here - last_angle[active]
            far = np.abs(travelled) > 1e-9
            secant = (slope - last_slope[active]) / np.where(far, travelled, 1.0)
            bend = np.where(far, secant, curvature[active])
        last_angle[active], last_slope[active], curvature[active] = here, slope, bend
        rising = slope > 0
        upper[active[rising]] = here[rising]
        lower[active[~rising]] = here[~rising]
        moved = here - slope / np.where(bend > 0, bend, np.inf)
        inside = (bend > 0) & (moved >= lower[active]) & (moved <= upper[active])
        moved = np.where(inside, moved, 0.5 * (lower[active] + upper[active]))
        angle[active] = moved
        steps[active] += 1
        converged[active] = np.abs(moved - here) < 1e-10
    cost, z, _, phase, _ = _profile(rows, which, angle, ridge, bend=False)
    return angle, z, cost, phase, converged, steps
