"""A walker from a known view, the phase one more unknown of the fit.

The papers take the phase from the 3D motion before it is projected [zhang2007 3.1, 3.4].  Here the image alone
gives it.

Symbols
-------
``d``    observation, shifted by the phase, less the projected average walker
``h, z`` right-hand side and whitened coefficients: see `gram`
``J``    ``|d|² - h^T z``: the cost that is left once the coefficients are eliminated

Why this is exact: a shift is a trigonometric polynomial of degree H in the phase and J is a quadratic form of it, so a
few values of J give it everywhere, and the roots of its derivative are all its stationary points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.core import camera
from pipeline.core.choice import first_lowest
from pipeline.core.fourier import equal_phases, shift
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction.gram import gram_of
from pipeline.core.reconstruction.known_view import deviation, from_known_views, right_hand_side


@dataclass(frozen=True)
class PhasedView:
    """One walker reconstructed from a known view, its phase found too.

    Attributes
    ----------
    phase_rad : float
        At the first frame, in [-pi, pi].
    coefficients : (N,)
        k in mm.
    missing : (1 + 2H, J)
        Reconstructed Fourier coefficients of the missing dimension, in the clip's own phase as the image is.
    """

    phase_rad: float
    coefficients: np.ndarray
    missing: np.ndarray


def from_known_view_unknown_phase(
    model: LinearModel,
    image: np.ndarray,
    view_angle_rad: float,
    *,
    noise_variance: float | None,
    frequency_hz: float,
) -> PhasedView:
    """Missing dimension and phase from a known view [zhang2007 3.9, 3.15] with the phase unknown.

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker, of walkers at phase zero.
    image : (1 + 2H, J, 2)
        Fourier coefficients of the clip in the view, time zero at its first frame, mm.
    view_angle_rad : float
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).
    frequency_hz : float
        Of the clip; observed by a model of 226 numbers.

    Raises
    ------
    InvalidInput
        If the observation does not fit the model or is not finite, or the noise variance is not positive.
    """
    gram = gram_of(model, noise_variance)
    c, s = np.cos([view_angle_rad]), np.sin([view_angle_rad])
    seen = camera.combine(image, np.zeros(image.shape[:-1]), view_angle_rad)
    trailing = [2 * np.pi * frequency_hz] if model.mean.size > seen.size else []

    def shifted(phase_rad: float) -> np.ndarray:
        return np.append(shift(seen, phase_rad), trailing)

    def cost(phase_rad: float) -> float:
        d = deviation(model, gram.white, shifted(phase_rad))
        h = right_hand_side(gram.white, d, c, s)
        z = gram.solve(c, s, h[..., None], noise_variance)[..., 0]
        across = c * d.x + s * d.y
        return across @ across + d.z @ d.z - h[0] @ z[0]

    phase = lowest_phase(cost, len(image) - 1)
    found = from_known_views(model, shifted(phase), np.array([view_angle_rad]), noise_variance=noise_variance)
    return PhasedView(phase, found.coefficients[0], shift(found.missing[0][..., None], -phase)[..., 0])


def lowest_phase(cost: Callable[[float], float], degree: int) -> float:
    """Phase at which a trigonometric polynomial of a degree is lowest, in [-pi, pi].

    Examples
    --------
    >>> round(lowest_phase(lambda phase: 3.0 - np.cos(phase - 0.5) - np.cos(2.0 * (phase - 0.5)), 2), 9)
    0.5
    """
    values = [cost(phase) for phase in equal_phases(2 * degree + 1)]
    series = np.fft.rfft(values) / len(values)
    order = np.arange(1, degree + 1)
    # With u = exp(i phase) the slope, times u^degree, is a polynomial in u; a constant cost has no roots.
    slope = 1j * order * series[1:]
    stationary = np.append(np.angle(np.roots(np.concatenate([slope[::-1], [0.0], slope.conj()]))), 0.0)
    varying = (np.exp(1j * stationary[:, None] * order) @ series[1:]).real
    return float(stationary[first_lowest(varying)])
