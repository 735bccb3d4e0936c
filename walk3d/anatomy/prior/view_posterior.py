"""Posterior of the view angle given the image: marginal likelihood over the full circle, and its modes.

Symbols
-------
``beta``  candidate view angle; ``o`` observed coefficients (across and up)
``J``     ``(o - m_o)^T (C_oo + N)^-1 (o - m_o) + log det (C_oo + N)``, both at beta: -2 log p(o | beta)

``p(beta | o)`` is proportional to ``exp(-J / 2)``.  The coefficients are integrated out, so that the number of
coefficients that fit an angle does not favour it.  J is computed at candidates over the circle and interpolated by a
periodic cubic spline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.core.choice import first_lowest
from walk3d.anatomy.prior.conditional import Noise, heights_seen
from walk3d.anatomy.prior.prior import Prior, mirror_image

FINE = 8
"""Number of angles in the interpolated posterior of the view angle per candidate angle."""


def circle(count: int) -> np.ndarray:
    """Return `count` candidate view angles (G,), rad, equally spaced on the full circle from -pi; `count` is even."""
    return -np.pi + 2.0 * np.pi * np.arange(count) / count


def view_costs(prior: Prior, observed: np.ndarray, candidates: int, *, noise: Noise) -> np.ndarray:
    """Return the costs J (n, G) of n observations at the G candidate view angles of `circle`.

    Parameters
    ----------
    prior : Prior
        Prior that equals its mirror image.
    observed : (n, 15, 2, 1 + 2H)
        Coefficients across and up, mm.
    candidates : int
        G, even.
    noise : Noise

    Notes
    -----
    The mirror image of an observation is as likely at -beta as the observation is at beta, so half of the circle is
    enough.  Mirroring changes the sign across, but not up.
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
        Angle of the highest mode, in [-pi, pi).
    other_cost : (n,)
        J at the next mode less J at the highest one; infinite if there is no other mode.
    """

    angle_rad: np.ndarray
    other_cost: np.ndarray


def posterior_of(costs: np.ndarray) -> ViewPosterior:
    """Return the highest modes of the posterior of the view angle under a uniform prior, from costs (n, G)."""
    count = costs.shape[1]
    at = np.append(circle(count), np.pi)
    spline = CubicSpline(at, np.hstack([costs, costs[:, :1]]), axis=1, bc_type="periodic")
    fine = circle(FINE * count)
    J = spline(fine)
    lowest = first_lowest(J)
    rows = np.arange(len(J))
    # Minimum of a parabola through the lowest angle and its neighbours.
    before, middle, after = J[rows, lowest - 1], J[rows, lowest], J[rows, (lowest + 1) % J.shape[1]]
    bend = before - 2.0 * middle + after
    step = fine[1] - fine[0]
    angle = fine[lowest] + step * np.where(
        bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0
    )
    minima = (np.roll(J, 1, axis=1) > J) & (np.roll(J, -1, axis=1) >= J)
    minima[rows, lowest] = False
    return ViewPosterior(
        angle_rad=np.mod(angle + np.pi, 2.0 * np.pi) - np.pi,
        other_cost=np.where(minima, J, np.inf).min(axis=1) - middle,
    )
