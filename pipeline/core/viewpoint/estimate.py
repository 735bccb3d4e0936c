"""Joint estimation of view angle and coefficients: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3.

Symbols
-------
``alpha``  true view angle of an observation; ``beta`` a candidate, rad
``J``      ``min over k`` of ||w_hat - w_bar_hat(beta) - E_hat(beta) k||² (+ sigma² sum k²/lambda)
``z``      whitened coefficients, k = sqrt(lambda) z

Why computed differently from how it is printed: for a candidate beta the coefficients are eliminated (variable
projection), so that what is left is a function of one angle.  That function is laid out over the whole circle
and its lowest dip is refined by Newton steps that cannot leave it (`search`): the global minimum, unless a dip hides
between two points of the grid, with neither a start to choose nor whole degrees.  `solver="published"` is what the
appendix describes (`published`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.core.linear_model import LinearModel, WhitenedModel, whiten
from pipeline.core.reconstruction import Gram, require_noise_variance
from pipeline.core.viewpoint.published import best_candidate, from_one_start
from pipeline.core.viewpoint.search import global_minimum
from pipeline.core.viewpoint.view_estimate import ViewEstimate
from pipeline.validation import InvalidInput, require_choice, require_finite, require_range

FULL_CIRCLE = (-np.pi, np.pi)

_GRID_STEP_RAD = {"global": np.pi / 90, "published": np.pi / 180}
"""Spacing of the grid of view angles: 2 degrees if the minimum is refined, 1 degree as in appendix B otherwise."""


def estimate(
    model: LinearModel,
    observed: np.ndarray,
    *,
    method: str,
    noise_variance: float | None = None,
    solver: str = "global",
    angle_range_rad: tuple[float, float] = FULL_CIRCLE,
    start_rad: float = 0.0,
) -> ViewEstimate:
    """Estimate view angle and coefficients from 2D images of walks [zhang2007 4.5] [zhang2007 4.6] [zhang2004 14].

    The images are 2D Fourier representations.

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
    start_rad : float
        Where the published solver of approach I starts, with all coefficients zero.

    Raises
    ------
    InvalidInput
        Unknown method or solver, sigma² missing or not positive, an empty range, no observation or one of
        another size than the model's, or values that are not finite.
    """
    require_choice("method", method, ("least_squares", "map"))
    require_choice("solver", solver, tuple(_GRID_STEP_RAD))
    if noise_variance is not None:
        require_noise_variance(noise_variance)
    elif method == "map":
        raise InvalidInput(
            "MAP estimation needs a noise variance",
            expected="noise_variance in mm² > 0",
            received="none",
            code="no_noise_variance",
        )
    low, high = angle_range_rad
    if not -np.inf < low < high < np.inf:
        raise InvalidInput(
            "the range of view angles is empty",
            expected="low < high",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg",
            code="empty_range",
        )
    sigma2 = noise_variance if method == "map" else None
    white = whiten(model, prior=solver == "published" or sigma2 is not None)
    across, up, single = _observations(model, white, observed)
    step = _GRID_STEP_RAD[solver]
    if solver == "global":
        result = global_minimum(Gram(white), across, up, angle_range_rad, step, sigma2)
    elif sigma2 is None:
        result = from_one_start(white, across, up, start_rad)
    else:
        result = best_candidate(Gram(white), across, up, angle_range_rad, step, sigma2)
    result = replace(
        result,
        angle_rad=np.pi - np.mod(np.pi - result.angle_rad, 2 * np.pi),  # in (-pi, pi]
        coefficients=result.coefficients * white.scale,
    )
    return ViewEstimate(*(values[0] for values in vars(result).values())) if single else result


def _observations(
    model: LinearModel, white: WhitenedModel, observed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return the horizontal and the vertical part (A, 75) of A observations, and True if a single one was passed.

    With a model of 226 numbers, the vertical part is (A, 76) with the scaled frequency last.
    """
    observed = np.asarray(observed, float)
    if observed.ndim >= 3 and observed.shape[-1] == 2:
        observed = observed.reshape(*observed.shape[:-3], -1)
    single = observed.ndim == 1
    rows = np.atleast_2d(observed)
    points = len(white.mean_x)
    trailing = len(white.mean_z) - points
    if rows.ndim != 2 or rows.shape[1] != 2 * points + trailing:
        raise InvalidInput(
            "the size of the observation does not match the model",
            expected=f"({2 * points + trailing},) or (A, {2 * points + trailing})",
            received=observed.shape,
            code="wrong_shape",
            shape=observed.shape,
        )
    require_range("observations", len(rows), at_least=1)
    require_finite("the observation", rows)
    up = np.hstack([rows[:, 1 : 2 * points : 2], model.last_scale * rows[:, 2 * points :]])
    return rows[:, 0 : 2 * points : 2], up, single
