"""A walk as a low-order Fourier series: zhang2007 section 3.1 (zhang2004 section 3.1).

Symbols
-------
``p(t)``      posture at time t, (T, J, 3) mm
``p0``        average posture
``p_h, q_h``  characteristic postures of harmonic h: p_h multiplies the sine, q_h the cosine
``omega``     fundamental angular frequency, rad/s; ``omega = 2 pi frequency_hz``
``w``         Fourier representation (1 + 2H, J, 3) in the printed order p0, p1, q1, p2, q2 [zhang2007 3.2]
``phi``       phase at the first frame

Clips are not whole numbers of cycles, so the series is a regression on sines and cosines.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.fourier.frequency import (
    design,
    fundamental_frequency,
    require_rate,
)
from pipeline.shortened import shortened
from pipeline.skeleton import LEFT_LEG, RIGHT_LEG, WALKER15
from pipeline.validation import InvalidInput, require_count, require_range, require_shape


@shortened
class FourierRepresentation:
    """Fourier series of one walk, shifted in time so that it starts at phase zero.

    Attributes
    ----------
    coefficients : (1 + 2H, J, S)
        p0, p1, q1, p2, q2, … in mm, at phase zero.
    frequency_hz : float
        Fundamental (stride) frequency.
    phase_rad : float
        Phase of the fundamental of (left ankle y - right ankle y) at the first frame.
    variance_fractions : (H,)
        Share of the variance about the time mean that each harmonic adds to the ones before it.
    residual_fraction : float
        Share that is left; the fractions and the residual sum to one.
    residual_covariance : (J, S, S)
        Mean over the clip of residual times residual, per joint, mm².
    temporal_covariance : (J, S, S)
        Covariance over time of each joint's motion, residual included, mm².
    """

    coefficients: np.ndarray
    frequency_hz: float
    phase_rad: float
    variance_fractions: np.ndarray
    residual_fraction: float
    residual_covariance: np.ndarray
    temporal_covariance: np.ndarray


def represent(
    positions: np.ndarray,
    frame_rate_hz: float,
    *,
    harmonics: int = 2,
    frequency_hz: float | None = None,
) -> FourierRepresentation:
    """Fit the Fourier series of one walk at phase zero [zhang2007 3.1] [zhang2007 3.2] [zhang2004 1] [zhang2004 2].

    Parameters
    ----------
    positions : (T, 15, 3)
        In WALKER15 order, mm; heading along +y and free of drift.
    frame_rate_hz : float
    harmonics : int
        H.
    frequency_hz : float, optional
        Known fundamental frequency; estimated when absent.

    Raises
    ------
    InvalidInput
        If positions are not finite, the rate or a given frequency is not positive, or the clip is shorter
        than the regression.

    Notes
    -----
    Phase zero is where the fundamental of (left ankle y - right ankle y) is A sin wt with A > 0.
    """
    positions = require_shape("positions", positions, ("T", len(WALKER15.joints), "S")).astype(float)
    require_range("the frame rate", frame_rate_hz, above=0, unit="Hz")
    if frequency_hz is not None:
        require_range("the frequency", frequency_hz, above=0, unit="Hz")
    require_count("harmonics", harmonics)
    if len(positions) <= 1 + 2 * harmonics:
        raise InvalidInput(
            "the clip has too few frames for its Fourier series",
            expected=f"more than {1 + 2 * harmonics} frames",
            received=len(positions),
            code="too_short",
            frames=len(positions),
        )
    if not np.isfinite(positions).all():
        frame, joint = np.argwhere(~np.isfinite(positions))[0][:2]
        raise InvalidInput(
            f"a position is not finite at frame {frame}, joint {joint}",
            code="not_finite",
            index=(frame, joint),
        )
    times = np.arange(len(positions)) / frame_rate_hz
    if frequency_hz is None:
        frequency_hz = fundamental_frequency(positions, frame_rate_hz, harmonics=harmonics)
    require_rate(frame_rate_hz, frequency_hz, harmonics)
    matrix = design(frequency_hz, times, harmonics)
    basis, triangle = np.linalg.qr(matrix)
    values = positions.reshape(len(positions), -1)
    projected = basis.T @ values
    coefficients = np.linalg.solve(triangle, projected).reshape(-1, *positions.shape[1:])
    residual = (values - basis @ projected).reshape(positions.shape)
    centred = positions - positions.mean(axis=0)
    total = (centred**2).sum()
    # The first orthonormal column is the constant, so the rest adds up to variance about the time mean.
    gains = (projected[1:] ** 2).sum(axis=1).reshape(harmonics, 2).sum(axis=1)
    difference = coefficients[:, LEFT_LEG[2], 1] - coefficients[:, RIGHT_LEG[2], 1]
    phase = np.arctan2(difference[2], difference[1])
    return FourierRepresentation(
        coefficients=shift(coefficients, phase),
        frequency_hz=float(frequency_hz),
        phase_rad=phase,
        variance_fractions=gains / total if total > 0 else np.zeros(harmonics),
        residual_fraction=((residual**2).sum() / total) if total > 0 else 0.0,
        residual_covariance=_products(residual) / len(positions),
        temporal_covariance=_products(centred) / len(positions),
    )


def _products(motion: np.ndarray) -> np.ndarray:
    """Return the sum over time of position times position transposed, for each joint, (J, S, S)."""
    by_joint = motion.swapaxes(0, 1)
    return by_joint.swapaxes(1, 2) @ by_joint


def synthesise(coefficients: np.ndarray, frequency_hz: float, times_s: np.ndarray) -> np.ndarray:
    """Return the motion (T, J, S) of a Fourier representation at the given times [zhang2007 3.1] [zhang2004 1].

    Examples
    --------
    >>> w = np.array([1.0, 2.0, 0.0]).reshape(3, 1, 1)   # 1 + 2 sin wt
    >>> synthesise(w, 1.0, np.array([0.0, 0.25]))[:, 0, 0]
    array([1., 3.])
    """
    coefficients = np.asarray(coefficients, float)
    harmonics = (coefficients.shape[0] - 1) // 2
    return np.tensordot(design(frequency_hz, times_s, harmonics), coefficients, axes=1)


def shift(coefficients: np.ndarray, phase_rad: float | np.ndarray) -> np.ndarray:
    """Return the Fourier coefficients of the same motion shifted in time, so that phase `phase_rad` becomes zero.

    A time shift by phi rotates (p_h, q_h) by h phi.  `coefficients` is (…, 1 + 2H, J, S); `phase_rad`
    broadcasts against the leading axes.

    Examples
    --------
    >>> w = np.zeros((3, 1, 1)); w[2] = 1.0            # cos wt = sin(wt + pi/2)
    >>> np.round(shift(w, np.pi / 2)[:, 0, 0], 12) + 0.0
    array([0., 1., 0.])
    """
    moved = np.array(coefficients, float)
    phase = np.asarray(phase_rad, float)[..., None, None]
    for h in range(1, (moved.shape[-3] + 1) // 2):
        p, q = coefficients[..., 2 * h - 1, :, :], coefficients[..., 2 * h, :, :]
        c, s = np.cos(h * phase), np.sin(h * phase)
        moved[..., 2 * h - 1, :, :] = c * p + s * q
        moved[..., 2 * h, :, :] = c * q - s * p
    return moved


def mirrored(coefficients: np.ndarray) -> np.ndarray:
    """Return the mirror image of a walker: left and right exchanged, and shifted by half a cycle.

    The shift keeps phase zero where it was.

    `coefficients` is (…, 1 + 2H, 15, 3).  Applied twice it gives the walker back.
    """
    image = np.array(coefficients[..., list(WALKER15.mirror), :], float)
    image[..., 0] *= -1.0
    harmonics = (image.shape[-3] - 1) // 2
    for h in range(1, harmonics + 1, 2):  # half a cycle turns the sign of the odd harmonics
        image[..., 2 * h - 1 : 2 * h + 1, :, :] *= -1.0
    return image
