"""The view angle given the image: the marginal likelihood over the whole circle, and its modes.

Symbols
-------
``beta``  candidate view angle; ``o`` observed coefficients (across and up)
``J``     ``(o - m_o)^T (C_oo + N)^-1 (o - m_o) + log det (C_oo + N)``, both at beta: -2 log p(o | beta)

``p(beta | o)`` is proportional to ``exp(-J / 2)``.  The coefficients are integrated out, so no angle is favoured
because it has more of them to spend. J is laid out over the circle and interpolated by a periodic cubic spline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.core.choice import first_lowest
from walk3d.anatomy.prior.conditional import Noise, heights_seen
from walk3d.anatomy.prior.prior import Prior, mirror_image

FINE = 8
"""Fine angles to a candidate: of the interpolated posterior."""


def circle(count: int) -> np.ndarray:
    """Candidates (G,) over the whole circle from -pi on, an even number of them."""
    return -np.pi + 2.0 * np.pi * np.arange(count) / count


def view_costs(prior: Prior, observed: np.ndarray, candidates: int, *, noise: Noise) -> np.ndarray:
    """J (n, G) of observations at the angles of `circle`.

    Parameters
    ----------
    prior : Prior
        Equal to its mirror image.
    observed : (n, 15, 2, 1 + 2H)
        Across and up, mm.
    candidates : int
        G, even.
    noise : Noise

    Notes
    -----
    The mirror image of an observation is as likely at -beta as the observation is at beta, so that half of the circle
    is enough for both.  It negates across, and not up.
    """
    half = circle(candidates)[candidates // 2 :]  # 0 up to pi, pi not included
    half = np.append(half, np.pi)
    both = np.concatenate([observed, mirror_image(observed)]).reshape(2 * len(observed), -1)
    heights = heights_seen(prior, noise=noise)
    parts = np.array_split(half, 4)  # which fit into the cache
    costs = np.concatenate([heights.from_views(part).cost(both) for part in parts])
    costs = costs.reshape(len(half), 2, len(observed))
    forwards, backwards = costs[:, 0], costs[:, 1]  # at beta, and at -beta
    return np.concatenate([backwards[:0:-1], forwards[:-1]]).T


@dataclass(frozen=True)
class ViewPosterior:
    """Highest modes of the posterior of the view angle for n observations.

    Attributes
    ----------
    angle_rad : (n,)
        Of the highest mode, in [-pi, pi).
    other_cost : (n,)
        By how much J is higher at the next mode; infinite if there is none.
    """

    angle_rad: np.ndarray
    other_cost: np.ndarray


def posterior_of(costs: np.ndarray) -> ViewPosterior:
    """Highest modes of the posterior, under a uniform prior, from costs (n, G) at the angles of `circle`."""
    count = costs.shape[1]
    at = np.append(circle(count), np.pi)
    spline = CubicSpline(at, np.hstack([costs, costs[:, :1]]), axis=1, bc_type="periodic")
    fine = circle(FINE * count)
    J = spline(fine)
    here = first_lowest(J)
    rows = np.arange(len(J))
    # A parabola through the lowest angle and its neighbours.
    before, middle, after = J[rows, here - 1], J[rows, here], J[rows, (here + 1) % J.shape[1]]
    bend = before - 2.0 * middle + after
    step = fine[1] - fine[0]
    angle = fine[here] + step * np.where(
        bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0
    )
    minima = (np.roll(J, 1, axis=1) > J) & (np.roll(J, -1, axis=1) >= J)
    minima[rows, here] = False
    return ViewPosterior(
        angle_rad=np.mod(angle + np.pi, 2.0 * np.pi) - np.pi,
        other_cost=np.where(minima, J, np.inf).min(axis=1) - middle,
    )
