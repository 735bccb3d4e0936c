"""A walker from known views, the phase one more unknown of the fit.

The papers take the phase from the 3D motion before it is projected [zhang2007 3.1, 3.4].  Here the image alone
gives it.

Symbols
-------
``o``      2D Fourier representation of the clip in its own phase: time zero is the first frame
``phi``    phase of the walker at the first frame; ``f = (1, cos phi, sin phi, cos 2 phi, sin 2 phi)``
``U``      ``shift(o, phi) = f U``; ``D``: U with the projected average walker taken from row 0
``A``      ``B_hat^T B_hat`` of `gram`; ``H = D B_hat``; ``G = D D^T``
``M``      ``G - H (A + sigma² I)^-1 H^T``: with the coefficients eliminated the cost is ``J = f^T M f``

Why this is exact: with k eliminated J is a trigonometric polynomial in phi of degree four, so a grid sees every
minimum and Newton's method finishes it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import newton
from pipeline.core.fourier import shift
from pipeline.core.linear_model import LinearModel, WhitenedModel
from pipeline.core.reconstruction.gram import gram_of
from pipeline.validation import InvalidInput, require_finite

_ROUNDING = 1e-14
"""Difference of two costs, relative to the sum of the magnitudes of their terms, that may be rounding alone."""


def turning(phase_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """f (…, 1 + 2H) = (1, cos phi, sin phi, cos 2 phi, …): weights of a shift by phi.

    Examples
    --------
    >>> np.round(turning(np.pi / 2, 2), 12) + 0.0
    array([ 1.,  0.,  1., -1.,  0.])
    """
    angle = np.asarray(phase_rad, dtype=float)[..., None] * np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(*angle.shape[:-1], -1)
    return np.concatenate([np.ones((*angle.shape[:-1], 1)), waves], axis=-1)


def turned(coefficients: np.ndarray) -> np.ndarray:
    """U (A, 1 + 2H, (1 + 2H) J): ``turning(phi) @ U`` is `shift` of (A, 1 + 2H, J) by phi, flat."""
    blocks = coefficients.shape[1]
    rows = np.zeros((len(coefficients), blocks, *coefficients.shape[1:]))
    rows[:, 0, 0] = coefficients[:, 0]
    for p in range(1, blocks, 2):
        q = p + 1
        rows[:, p, p], rows[:, p, q] = coefficients[:, p], coefficients[:, q]
        rows[:, q, p], rows[:, q, q] = coefficients[:, q], -coefficients[:, p]
    return rows.reshape(len(coefficients), blocks, -1)


@dataclass(frozen=True)
class PhaseMinimum:
    """The phases of lowest cost for n observations.

    Attributes
    ----------
    phase_rad : (n,)
        In (-pi, pi].
    cost : (n,)
        f^T M f there, mm².
    """

    phase_rad: np.ndarray
    cost: np.ndarray


def lowest_phase(forms: np.ndarray) -> PhaseMinimum:
    """The phase at which f^T M f is lowest, for n forms M (n, 1 + 2H, 1 + 2H)."""
    size = forms.shape[-1]
    order = np.arange(1, size)  # f f^T holds harmonics up to twice those of the walk
    samples = turning(np.arange(2 * size - 1) * (2 * np.pi / (2 * size - 1)), (size - 1) // 2)
    outer = (samples[:, :, None] * samples[:, None, :]).reshape(len(samples), -1)
    series = np.fft.rfft(outer, axis=0) * (2.0 / len(samples))
    expansion = np.concatenate([series[:1].real / 2, series[1:].real, -series[1:].imag]).T
    waves = forms.reshape(len(forms), -1) @ expansion  # constant, cosines, sines
    constant, cosines, sines = waves[:, 0], waves[:, 1:size], waves[:, size:]
    step = 2 * np.pi / (16 * (size - 1))
    angles = step * np.arange(16 * (size - 1))[:, None] * order
    cost = waves @ np.concatenate([np.ones((len(angles), 1)), np.cos(angles), np.sin(angles)], axis=1).T
    before, after = np.roll(cost, 1, axis=1), np.roll(cost, -1, axis=1)
    # The cell nearest to the minimum lies above it by no more than this; only such cells need refining.
    slack = step**2 / 8 * (np.hypot(cosines, sines) @ order**2)
    candidate = (cost <= before) & (cost <= after) & (cost <= (cost.min(axis=1) + slack)[:, None])
    row, cell = np.nonzero(candidate)
    a, b = cosines[row], sines[row]

    def derivatives(rows: np.ndarray, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s = np.cos(phase[:, None] * order), np.sin(phase[:, None] * order)
        slope = ((b[rows] * c - a[rows] * s) * order).sum(axis=1)
        return slope, -((a[rows] * c + b[rows] * s) * order**2).sum(axis=1)

    start = step * cell
    phase = newton.minimise(
        derivatives, start, start - step, start + step, tolerance=1e-12, most_iterations=50
    ).at
    c, s = np.cos(phase[:, None] * order), np.sin(phase[:, None] * order)
    varying = (a * c + b * s).sum(axis=1)
    lowest = np.full(len(forms), np.inf)
    np.minimum.at(lowest, row, varying)
    # The first phase of those that are as low as the lowest, up to rounding of the sum.
    as_low = varying <= (lowest + _ROUNDING * np.abs(waves[:, 1:]).sum(axis=1))[row]
    _, which = np.unique(row[as_low], return_index=True)
    first = np.flatnonzero(as_low)[which]
    return PhaseMinimum(np.pi - np.mod(np.pi - phase[first], 2 * np.pi), constant + varying[first])


class TurnedObservations:
    """Observations under every phase, and what M is made of when one model is held against them."""

    def __init__(
        self, model: LinearModel, white: WhitenedModel, image: np.ndarray, frequency_hz: np.ndarray | None
    ) -> None:
        image = np.asarray(image, dtype=float)
        points, trailing = len(white.mean_x), len(white.mean_z) - len(white.mean_x)
        if image.ndim != 4 or image.shape[-1] != 2 or image.shape[1] * image.shape[2] != points:
            raise InvalidInput(
                "the observation has another size than the model",
                expected=f"(A, 1 + 2H, J, 2) with {points} points",
                received=str(image.shape),
            )
        frequency = np.empty(0) if frequency_hz is None else np.asarray(frequency_hz, dtype=float)
        if trailing and frequency.shape != (len(image),):
            raise InvalidInput(
                "the model knows the frequency, the observation does not give it",
                expected=f"({len(image)},) hertz",
                received="none" if frequency_hz is None else str(frequency.shape),
            )
        self.white = white
        self.across, self.up = turned(image[..., 0]), turned(image[..., 1])
        if trailing:
            last = np.zeros((*self.up.shape[:2], 1))
            last[:, 0, 0] = model.last_scale * 2 * np.pi * frequency
            self.up = np.concatenate([self.up, last], axis=-1)
        require_finite("the observation", np.concatenate([self.across, self.up], axis=-1))
        self._products = [self.across @ white.bx, self.across @ white.by, self.up @ white.bz]
        self._overlaps = [self.across @ white.mean_x, self.across @ white.mean_y, self.up @ white.mean_z]
        self._squares = self.across @ np.swapaxes(self.across, 1, 2) + self.up @ np.swapaxes(self.up, 1, 2)

    def against(self, c: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """G (A, 1 + 2H, 1 + 2H) and H (A, 1 + 2H, N) at cosine and sine of each view angle."""
        white = self.white
        x, y, z = self._products
        H = c[:, None, None] * x + s[:, None, None] * y + z
        c, s = c[:, None], s[:, None]
        mean = c * white.mean_x + s * white.mean_y
        H[:, 0] -= c * (mean @ white.bx) + s * (mean @ white.by) + white.mean_z @ white.bz
        x, y, z = self._overlaps
        overlap = c * x + s * y + z
        G = self._squares - 0.0
        G[:, 0] -= overlap
        G[:, :, 0] -= overlap
        G[:, 0, 0] += (mean**2).sum(axis=1) + white.mean_z @ white.mean_z
        return G, H


@dataclass(frozen=True)
class PhasedViews:
    """One walker reconstructed from A known views, its phase found too.

    Attributes
    ----------
    phase_rad : (A,)
        Phase at the first frame, in (-pi, pi].
    cost : (A,)
        The minimum over coefficients and phase, mm².
    coefficients : (A, N)
        k in mm.
    missing : (A, 1 + 2H, J)
        Reconstructed Fourier coefficients of the missing dimension, in the clip's own phase as the image is.
    """

    phase_rad: np.ndarray
    cost: np.ndarray
    coefficients: np.ndarray
    missing: np.ndarray


def from_known_views_unknown_phase(
    model: LinearModel,
    image: np.ndarray,
    view_angles_rad: np.ndarray,
    *,
    noise_variance: float | None,
    frequency_hz: np.ndarray | None = None,
) -> PhasedViews:
    """Missing dimension and phase from each of A known views [zhang2007 3.9, 3.15] with the phase unknown.

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker, of walkers at phase zero.
    image : (A, 1 + 2H, J, 2) mm
        `ViewedClip.image`.
    view_angles_rad : (A,)
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).
    frequency_hz : (A,), optional
        `ViewedClip.frequency_hz`; needed by a model of 226 numbers.

    Raises
    ------
    InvalidInput
        If the observation does not fit the model or is not finite, or the noise variance is not positive.
    """
    gram = gram_of(model, noise_variance)
    white = gram.white
    rows = TurnedObservations(model, white, image, frequency_hz)
    c, s = np.cos(view_angles_rad), np.sin(view_angles_rad)
    G, H = rows.against(c, s)
    spectrum = gram.spectrum(c, s)
    inverse = spectrum.inverse(noise_variance)[:, None]
    K = H @ spectrum.vectors
    lowest = lowest_phase(G - (K * inverse) @ np.swapaxes(K, 1, 2))
    phase = lowest.phase_rad
    f = turning(phase, image.shape[1] // 2)[:, None]
    z = ((f @ K * inverse) @ np.swapaxes(spectrum.vectors, 1, 2))[:, 0]
    x, y = white.mean_x + z @ white.bx.T, white.mean_y + z @ white.by.T
    missing = (-s[:, None] * x + c[:, None] * y).reshape(image.shape[:3])
    return PhasedViews(phase, lowest.cost, z * white.scale, shift(missing[..., None], -phase)[..., 0])
