"""View angle, phase and coefficients together, from the image and its frequency alone.

Symbols are those of `reconstruction.unknown_phase`; ``beta`` is the view angle.

Why this is enough: with coefficients and phase eliminated the lowest cost J is a function of one angle beta; as
the lower envelope of smooth curves it has no local minimum at a kink, so a bracket suffices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import newton
from pipeline.core.choice import first_lowest
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction import Gram, TurnedObservations, gram_of, lowest_phase
from pipeline.core.viewpoint.estimate import FULL_CIRCLE, in_half_open_circle
from pipeline.core.viewpoint.search import (
    TOLERANCE_RAD,
    ReducedCost,
    ViewMinimum,
    candidates,
    local_minima,
    lowest_but,
    prefer_lower,
    reduced_cost,
)
from pipeline.core.viewpoint.view_estimate import ViewEstimate
from pipeline.validation import InvalidInput

_GRID_STEP_RAD = np.pi / 90
_MOST_STEPS = 60


@dataclass(frozen=True)
class PhasedEstimate(ViewEstimate):
    """View angles, coefficients and phases of A observations.

    Attributes
    ----------
    phase_rad : (A,)
        Phase at the first frame, in (-pi, pi]; the others are those of `ViewEstimate`.
    """

    phase_rad: np.ndarray


def estimate_unknown_phase(
    model: LinearModel,
    image: np.ndarray,
    *,
    noise_variance: float | None,
    frequency_hz: np.ndarray | None = None,
    angle_range_rad: tuple[float, float] = FULL_CIRCLE,
) -> PhasedEstimate:
    """View angle, phase and coefficients together [zhang2007 4.5, 4.6] [zhang2004 14], the phase unknown too.

    Parameters
    ----------
    model : LinearModel
        Learnt without these walkers, of walkers at phase zero.
    image : (A, 1 + 2H, J, 2)
        `ViewedClip.image`, mm.
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).
    frequency_hz : (A,), optional
        `ViewedClip.frequency_hz`; needed by a model of 226 numbers.
    angle_range_rad : (low, high)
        Candidates.

    Raises
    ------
    InvalidInput
        If the range is empty, or as `reconstruction.from_known_views_unknown_phase`.

    Notes
    -----
    The two lowest minima on the grid of candidates are refined, so that `runner_up_cost` is the exact cost of the
    second.
    """
    gram = gram_of(model, noise_variance)
    low, high = angle_range_rad
    if not high > low:
        raise InvalidInput(
            "the range of view angles is empty",
            expected="low < high",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg",
        )
    rows = TurnedObservations(model, gram.white, image, frequency_hz)
    grid, closed = candidates(low, high, _GRID_STEP_RAD)
    c, s = np.cos(grid), np.sin(grid)
    spectrum = gram.spectrum(c, s)
    roots = spectrum.vectors * np.sqrt(spectrum.inverse(noise_variance))[:, None]
    cost = np.empty((len(rows.across), len(grid)))
    for g in range(len(grid)):
        G, H = rows.against(c[g : g + 1], s[g : g + 1])
        K = H @ roots[g]
        cost[:, g] = lowest_phase(G - K @ np.swapaxes(K, 1, 2)).cost
    height, start = local_minima(cost, grid, closed=closed)
    first, every = first_lowest(height), np.arange(len(cost))
    second, other = lowest_but(height, first, closed=closed)
    contenders = np.flatnonzero(np.isfinite(other))
    step = grid[1] - grid[0]

    def descend(which: np.ndarray, cell: np.ndarray) -> ViewMinimum:
        lower, upper = grid[cell] - step, grid[cell] + step
        if not closed:
            lower, upper = np.maximum(lower, low), np.minimum(upper, high)
        return _descend(gram, rows, which, start[which, cell], lower, upper, noise_variance)

    best = descend(every, first)
    if contenders.size:  # a cost that has one minimum only leaves none
        best = prefer_lower(best, descend(contenders, second[contenders]), contenders)
    _, phase = _profile(gram, rows, every, best.angle_rad, noise_variance, bend=False)
    return PhasedEstimate(
        in_half_open_circle(best.angle_rad),
        best.z * gram.white.scale,
        best.cost,
        best.runner_up_cost,
        best.converged,
        best.n_iterations,
        phase,
    )


def _profile(
    gram: Gram,
    rows: TurnedObservations,
    which: np.ndarray,
    angle: np.ndarray,
    noise_variance: float | None,
    *,
    bend: bool,
) -> tuple[ReducedCost, np.ndarray]:
    """J lowest over phase and coefficients at one angle per row, its curvature at a fixed phase; and that phase (n,).

    Phase and coefficients are at their minimum, so J' is the partial derivative there.
    """
    c, s = np.cos(angle), np.sin(angle)
    G, H = rows.against(c, s, which)
    phase = lowest_phase(gram.eliminate(c, s, G, H, noise_variance)).phase_rad
    across, up = rows.at(phase, which)
    return reduced_cost(gram, across, up, angle, noise_variance, bend=bend), phase


def _descend(
    gram: Gram,
    rows: TurnedObservations,
    which: np.ndarray,
    start: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    noise_variance: float | None,
) -> ViewMinimum:
    """The minima of J inside brackets (n,) for the observations `which` (n,); runner-up costs infinite.

    The first step takes the curvature at a fixed phase, which is never too small; later ones that of the last
    two slopes.
    """
    first, _ = _profile(gram, rows, which, start, noise_variance, bend=True)
    z, cost = np.empty_like(first.z), np.empty_like(first.cost)

    def derivatives(active: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, None]:
        here, _ = _profile(gram, rows, which[active], angle, noise_variance, bend=False)
        z[active], cost[active] = here.z, here.cost
        return here.slope, None

    found = newton.minimise(
        derivatives,
        start,
        lower,
        upper,
        tolerance=TOLERANCE_RAD,
        most_iterations=_MOST_STEPS,
        curvature=first.curvature,
    )
    runner_up = np.full(len(which), np.inf)
    return ViewMinimum(found.at, z, cost, runner_up, found.converged, found.n_iterations)
