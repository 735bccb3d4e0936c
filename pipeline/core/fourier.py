"""A walk as a low-order Fourier series: zhang2007 section 3.1 (zhang2004 section 3.1).

Symbols
-------
``p(t)``      posture at time t, (T, J, 3) mm
``p0``        average posture
``p_h, q_h``  characteristic postures of harmonic h: p_h multiplies the sine, q_h the cosine
``omega``     fundamental angular frequency, rad/s; ``omega = 2 pi frequency_hz``
``w``         Fourier representation (1 + 2H, J, 3) in the printed order p0, p1, q1, p2, q2 [zhang2007 3.2]
``phi``       phase at the first frame

Why not an FFT: clips are not whole numbers of cycles.  The series is a regression on sines and cosines, and
the frequency is the one whose regression leaves least (variable projection: the linear part is eliminated).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from pipeline.refusal import Refusal
from pipeline.skeleton import WALKER15

SEARCH_HZ = (0.4, 1.6)
"""Where the stride frequency of a walking human is looked for."""

_LEFT_ANKLE = WALKER15.index("left_ankle")
_RIGHT_ANKLE = WALKER15.index("right_ankle")


@dataclass(frozen=True)
class FourierRepresentation:
    """One walk as a Fourier series with its phase removed.

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


def design(frequency_hz: float, times_s: np.ndarray, harmonics: int) -> np.ndarray:
    """Columns 1, sin wt, cos wt, sin 2wt, cos 2wt, … of [zhang2007 3.1]; (T, 1 + 2H)."""
    angle = 2.0 * np.pi * frequency_hz * np.asarray(times_s, dtype=float)
    columns = [np.ones_like(angle)]
    for h in range(1, harmonics + 1):
        columns += [np.sin(h * angle), np.cos(h * angle)]
    return np.stack(columns, axis=-1)


def _explained(frequency_hz: float, times_s: np.ndarray, values: np.ndarray, harmonics: int) -> np.ndarray:
    """Sum of squares that each column of the design adds to the ones before it; (1 + 2H,)."""
    basis, _ = np.linalg.qr(design(frequency_hz, times_s, harmonics))
    return ((basis.T @ values) ** 2).sum(axis=1)


def single_frequency_power(frequencies_hz: np.ndarray, times_s: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """Sum of squares that a constant and one sinusoid of each frequency explain in (T,) `signal`; (C,).

    `times_s` (T,) are equally spaced.
    """
    frames = len(times_s)
    step = float(times_s[-1] - times_s[0]) / max(frames - 1, 1)
    ones = np.ones(frames)
    sine_cosine = _transform(frequencies_hz, step, signal - signal.mean())
    mean, twice = _transform(frequencies_hz, step, ones), _transform(2.0 * frequencies_hz, step, ones)
    # Products of the columns sin and cos about their means, by the double angle.
    ss = (frames - twice.real) / 2.0 - mean.imag**2 / frames
    cc = (frames + twice.real) / 2.0 - mean.real**2 / frames
    sc = twice.imag / 2.0 - mean.real * mean.imag / frames
    s, c = sine_cosine.imag, sine_cosine.real
    return (cc * s**2 - 2.0 * sc * s * c + ss * c**2) / (ss * cc - sc**2)


def _transform(frequencies_hz: np.ndarray, step_s: float, signal: np.ndarray) -> np.ndarray:
    """Sum of signal times exp(i w t) over equally spaced t from zero, complex (C,).

    exp(i w (a + b)) = exp(i w a) exp(i w b): of T exponentials only some 2 sqrt(T) are worked out.
    """
    block = int(np.ceil(np.sqrt(len(signal))))
    rows = np.zeros(block * block)
    rows[: len(signal)] = signal
    turn = 2j * np.pi * step_s * frequencies_hz[:, None] * np.arange(block)
    within = np.exp(turn) @ rows.reshape(block, block).T
    return (within * np.exp(block * turn)).sum(axis=1)


def fundamental_frequency(
    positions: np.ndarray, frame_rate_hz: float, *, harmonics: int = 2, signal: np.ndarray | None = None
) -> float:
    """Fundamental frequency in Hz: the one whose harmonic regression leaves the least residual.

    Parameters
    ----------
    positions : (T, J, S) mm
    frame_rate_hz : float
    harmonics : int
    signal : (T,), optional
        The series whose spectrum gives the first guess; by default left ankle y - right ankle y.

    Raises
    ------
    Refusal
        If the clip cannot hold a cycle, or has too few frames in a second for its fastest harmonic.

    Notes
    -----
    The first guess is the strongest frequency of `signal` between 0.4 and 1.6 Hz that completes a cycle in
    the clip; the regression over all joints then moves it by at most 15 %, so that neither the half nor the
    double of the true frequency can be reached by a small gain in fit.  In a clip of many cycles the fit has
    side lobes every 1/(H T) Hz, so the best of a grid of six points to a lobe is taken before it is refined.
    """
    frames = len(positions)
    times = np.arange(frames) / frame_rate_hz
    if signal is None:
        signal = positions[:, _LEFT_ANKLE, 1] - positions[:, _RIGHT_ANKLE, 1]
    duration = frames / frame_rate_hz
    lowest = max(SEARCH_HZ[0], 1.0 / duration)
    if lowest >= SEARCH_HZ[1]:
        raise Refusal(
            "the clip is too short for a walking cycle",
            expected=f"more than {1 / SEARCH_HZ[1]:.2f} s",
            received=f"{duration:.2f} s",
        )
    # Six candidates to the clip's resolution cannot step over the peak.
    count = int(np.ceil((SEARCH_HZ[1] - lowest) * duration * 6)) + 8
    candidates = np.linspace(lowest, SEARCH_HZ[1], count)
    guess = float(candidates[int(np.argmax(single_frequency_power(candidates, times, signal)))])
    _check_rate(frame_rate_hz, guess, harmonics)
    values = positions.reshape(frames, -1)
    values = values - values.mean(axis=0)

    def unexplained(frequency_hz: float) -> float:
        # The values have no mean, so the constant explains nothing by itself.
        columns = design(frequency_hz, times, harmonics)
        projected = columns.T @ values
        return -float((projected * np.linalg.solve(columns.T @ columns, projected)).sum())

    # The guess is good to the clip's resolution, 1/T, of which twice is looked at: in long clips less than 15 %.
    reach = min(0.15 * guess, 2.0 / duration)
    bounds = max(guess - reach, 0.85 * lowest), guess + reach
    grid = np.linspace(*bounds, int(np.ceil((bounds[1] - bounds[0]) * duration * harmonics * 6)) + 3)
    best = int(np.argmin([unexplained(frequency) for frequency in grid]))
    found = minimize_scalar(
        unexplained,
        bounds=(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]),
        method="bounded",
        options={"xatol": 1e-8},
    )
    return float(found.x)


def _check_rate(frame_rate_hz: float, frequency_hz: float, harmonics: int) -> None:
    """Nothing; a Refusal unless the fastest harmonic has more than two frames to its period."""
    if not frame_rate_hz > 2 * harmonics * frequency_hz:
        raise Refusal(
            "the frame rate is too low for the harmonics",
            expected=f"more than {2 * harmonics * frequency_hz:.3g} Hz",
            received=f"{frame_rate_hz:g} Hz",
        )


def shift(coefficients: np.ndarray, phase_rad: float | np.ndarray) -> np.ndarray:
    """Coefficients of the same motion with its phase moved by `phase_rad` to zero.

    A time shift by phi rotates (p_h, q_h) by h phi.  `coefficients` is (…, 1 + 2H, J, S); `phase_rad`
    broadcasts against the leading axes.

    Examples
    --------
    >>> w = np.zeros((3, 1, 1)); w[2] = 1.0            # cos wt = sin(wt + pi/2)
    >>> np.round(shift(w, np.pi / 2)[:, 0, 0], 12) + 0.0
    array([0., 1., 0.])
    """
    moved = np.array(coefficients, dtype=float)
    phase = np.asarray(phase_rad, dtype=float)[..., None, None]
    for h in range(1, (moved.shape[-3] + 1) // 2):
        p, q = coefficients[..., 2 * h - 1, :, :], coefficients[..., 2 * h, :, :]
        c, s = np.cos(h * phase), np.sin(h * phase)
        moved[..., 2 * h - 1, :, :] = c * p + s * q
        moved[..., 2 * h, :, :] = c * q - s * p
    return moved


def represent(
    positions: np.ndarray,
    frame_rate_hz: float,
    *,
    harmonics: int = 2,
    frequency_hz: float | None = None,
    phase_joints: tuple[int, int] = (_LEFT_ANKLE, _RIGHT_ANKLE),
) -> FourierRepresentation:
    """Fourier representation of one walk at phase zero [zhang2007 3.1] [zhang2007 3.2] [zhang2004 1] [zhang2004 2].

    Parameters
    ----------
    positions : (T, J, 3) mm
        Heading along +y and free of drift.
    frame_rate_hz : float
    harmonics : int
    frequency_hz : float, optional
        Known fundamental frequency; estimated when absent.
    phase_joints : pair of int
        Phase zero is where the fundamental of (first joint's y - second joint's y) is A sin wt with A > 0;
        by default left ankle and right ankle.

    Returns
    -------
    FourierRepresentation

    Raises
    ------
    Refusal
        If positions are not finite, the rate or a given frequency is not positive, or the clip is shorter
        than the regression.
    """
    positions = np.asarray(positions, dtype=float)
    if positions.ndim != 3:
        raise Refusal("positions have the wrong shape", expected="(T, J, 3)", received=str(positions.shape))
    if not 0 < frame_rate_hz < np.inf:
        raise Refusal("the frame rate is not positive", expected="hertz > 0", received=f"{frame_rate_hz:g}")
    if frequency_hz is not None and not 0 < frequency_hz < np.inf:
        raise Refusal("the frequency is not positive", expected="hertz > 0", received=f"{frequency_hz:g}")
    if harmonics < 1:
        raise Refusal("no harmonics", expected="1 or more", received=str(harmonics))
    if len(positions) <= 1 + 2 * harmonics:
        raise Refusal(
            "the clip is shorter than its Fourier series",
            expected=f"more than {1 + 2 * harmonics} frames",
            received=str(len(positions)),
        )
    if not np.isfinite(positions).all():
        frame, joint = np.argwhere(~np.isfinite(positions))[0][:2]
        raise Refusal(f"a position is not finite at frame {frame}, joint {joint}")
    times = np.arange(len(positions)) / frame_rate_hz
    if frequency_hz is None:
        difference = positions[:, phase_joints[0], 1] - positions[:, phase_joints[1], 1]
        frequency_hz = fundamental_frequency(positions, frame_rate_hz, harmonics=harmonics, signal=difference)
    _check_rate(frame_rate_hz, frequency_hz, harmonics)
    matrix = design(frequency_hz, times, harmonics)
    basis, triangle = np.linalg.qr(matrix)
    values = positions.reshape(len(positions), -1)
    projected = basis.T @ values
    coefficients = np.linalg.solve(triangle, projected).reshape(-1, *positions.shape[1:])
    residual = (values - basis @ projected).reshape(positions.shape)
    centred = positions - positions.mean(axis=0)
    total = float((centred**2).sum())
    # The first orthonormal column is the constant, so the rest adds up to variance about the time mean.
    gains = (projected[1:] ** 2).sum(axis=1).reshape(harmonics, 2).sum(axis=1)
    difference = coefficients[:, phase_joints[0], 1] - coefficients[:, phase_joints[1], 1]
    phase = float(np.arctan2(difference[2], difference[1]))
    return FourierRepresentation(
        coefficients=shift(coefficients, phase),
        frequency_hz=float(frequency_hz),
        phase_rad=phase,
        variance_fractions=gains / total if total > 0 else np.zeros(harmonics),
        residual_fraction=float((residual**2).sum() / total) if total > 0 else 0.0,
        residual_covariance=np.einsum("tja,tjb->jab", residual, residual) / len(positions),
        temporal_covariance=np.einsum("tja,tjb->jab", centred, centred) / len(positions),
    )


def synthesise(coefficients: np.ndarray, frequency_hz: float, times_s: np.ndarray) -> np.ndarray:
    """Motion (T, J, S) of a Fourier representation at the given times [zhang2007 3.1] [zhang2004 1].

    Examples
    --------
    >>> w = np.array([1.0, 2.0, 0.0]).reshape(3, 1, 1)   # 1 + 2 sin wt
    >>> synthesise(w, 1.0, np.array([0.0, 0.25]))[:, 0, 0]
    array([1., 3.])
    """
    coefficients = np.asarray(coefficients, dtype=float)
    harmonics = (coefficients.shape[0] - 1) // 2
    return np.tensordot(design(frequency_hz, times_s, harmonics), coefficients, axes=1)


def mirrored(coefficients: np.ndarray, mirror: tuple[int, ...] = WALKER15.mirror) -> np.ndarray:
    """The walker's mirror image: left and right exchanged, shifted by half a cycle so that phase zero stays.

    `coefficients` is (…, 1 + 2H, J, 3).  Applied twice it gives the walker back.
    """
    image = np.array(coefficients[..., list(mirror), :], dtype=float)
    image[..., 0] *= -1.0
    harmonics = (image.shape[-3] - 1) // 2
    for h in range(1, harmonics + 1, 2):  # half a cycle turns the sign of the odd harmonics
        image[..., 2 * h - 1 : 2 * h + 1, :, :] *= -1.0
    return image
