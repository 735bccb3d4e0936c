"""Fundamental frequency of a walk, by the harmonic regression with the smallest residual (zhang2007 section 3.1).

Variable projection: at any frequency the best postures follow by linear regression, so only the frequency is
searched.  Why not an FFT: clips are not whole numbers of cycles.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import minimize_scalar

from pipeline.core.choice import first_lowest
from pipeline.skeleton import LEFT_LEG, RIGHT_LEG
from pipeline.validation import InvalidInput

SEARCH_HZ = (0.4, 1.6)
"""Range of human stride frequencies in which the fundamental frequency is searched, Hz."""


def design(frequency_hz: float | np.ndarray, times_s: np.ndarray, harmonics: int) -> np.ndarray:
    """Return the regressors 1, sin wt, cos wt, sin 2wt, cos 2wt, … as columns of a matrix (T, 1 + 2H) [zhang2007 3.1].

    Frequencies (C, 1) give (C, T, 1 + 2H).
    """
    return waves(2.0 * np.pi * frequency_hz * np.asarray(times_s, float), harmonics).swapaxes(-1, -2)


def waves(angle: np.ndarray, harmonics: int) -> np.ndarray:
    """Return 1, sin x, cos x, sin 2x, cos 2x, … for phases x (…, T), as rows of a matrix (…, 1 + 2H, T)."""
    rows = np.empty((*angle.shape[:-1], 1 + 2 * harmonics, angle.shape[-1]))
    rows[..., 0, :] = 1.0
    sine, cosine = np.sin(angle), np.cos(angle)
    s, c = sine, cosine
    for h in range(1, harmonics + 1):
        if h > 1:  # the addition theorem costs a fraction of another sine and cosine
            s, c = s * cosine + c * sine, c * cosine - s * sine
        rows[..., 2 * h - 1, :], rows[..., 2 * h, :] = s, c
    return rows


def cycle_basis(phase_rad: np.ndarray, blocks: int) -> np.ndarray:
    """Return 1, sin x, cos x, sin 2x, cos 2x, … for phases x (…), along the last axis of an array (…, 1 + 2H)."""
    angle = np.asarray(phase_rad)[..., None] * np.arange(1, blocks // 2 + 1)
    basis = np.ones((*angle.shape[:-1], blocks))
    basis[..., 1::2], basis[..., 2::2] = np.sin(angle), np.cos(angle)
    return basis


def cycle_slope(phase_rad: np.ndarray, blocks: int) -> np.ndarray:
    """Return the derivatives (…, 1 + 2H) of `cycle_basis` with respect to the phase."""
    order = np.arange(1, blocks // 2 + 1)
    angle = np.asarray(phase_rad)[..., None] * order
    slope = np.zeros((*angle.shape[:-1], blocks))
    slope[..., 1::2], slope[..., 2::2] = order * np.cos(angle), -order * np.sin(angle)
    return slope


def equal_phases(count: int) -> np.ndarray:
    """Return the given number of equally spaced phases of a cycle, radians, starting at 0."""
    return 2.0 * np.pi * np.arange(count) / count


def single_frequency_power(frequencies_hz: np.ndarray, times_s: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """Return the sum of squares (C,) of `signal` (T,) that a constant and a sinusoid of each of C frequencies explain.

    `times_s` (T,) are equally spaced.
    """
    frames = len(times_s)
    step = (times_s[-1] - times_s[0]) / max(frames - 1, 1)
    sine_cosine = _transform(frequencies_hz, step, signal - signal.mean())
    mean, twice = _of_ones(frequencies_hz, step, frames), _of_ones(2.0 * frequencies_hz, step, frames)
    # Products of the columns sin and cos about their means, by the double angle.
    ss = (frames - twice.real) / 2.0 - mean.imag**2 / frames
    cc = (frames + twice.real) / 2.0 - mean.real**2 / frames
    sc = twice.imag / 2.0 - mean.real * mean.imag / frames
    s, c = sine_cosine.imag, sine_cosine.real
    return (cc * s**2 - 2.0 * sc * s * c + ss * c**2) / (ss * cc - sc**2)


def _transform(frequencies_hz: np.ndarray, step_s: float, signal: np.ndarray) -> np.ndarray:
    """Return the Fourier transform of a signal at C given frequencies, complex (C,): the sum of signal times exp(i w
    t).

    The times t are equally spaced and start at zero.

    exp(i w (a + b)) = exp(i w a) exp(i w b): of T exponentials only some 2 sqrt(T) are worked out.
    """
    block = int(np.ceil(np.sqrt(len(signal))))
    rows = np.zeros(block * block)
    rows[: len(signal)] = signal
    fine, coarse = _exponentials(frequencies_hz.tobytes(), step_s, block)
    return ((fine @ rows.reshape(block, block).T) * coarse).sum(axis=1)


@lru_cache(maxsize=4)  # clips of a data set often have the same length and rate
def _exponentials(frequencies_hz: bytes, step_s: float, block: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the complex exponentials (C, block) of times within a block, and of the start times of blocks."""
    turn = 2j * np.pi * step_s * np.frombuffer(frequencies_hz)[:, None] * np.arange(block)
    return np.exp(turn), np.exp(block * turn)


def _of_ones(frequencies_hz: np.ndarray, step_s: float, frames: int) -> np.ndarray:
    """Return the Fourier transform of a signal of ones at given frequencies, which is a geometric series."""
    half = np.pi * step_s * frequencies_hz
    return np.exp(1j * (frames - 1) * half) * np.sin(frames * half) / np.sin(half)


def fundamental_frequency(positions: np.ndarray, frame_rate_hz: float, *, harmonics: int = 2) -> float:
    """Return the fundamental frequency, Hz, for which harmonic regression has the smallest residual.

    Parameters
    ----------
    positions : (T, 15, S)
        In WALKER15 order, mm.
    frame_rate_hz : float
    harmonics : int

    Raises
    ------
    InvalidInput
        If the clip cannot hold a cycle, or has too few frames in a second for its fastest harmonic.

    Notes
    -----
    The first guess is the strongest frequency of left ankle y - right ankle y between 0.4 and 1.6 Hz that completes a
    cycle in the clip: left and right do the same half a cycle apart, so that this has hardly a second harmonic.  The
    regression over all joints then moves it by at most 15 %, so that neither the half nor the double of the true
    frequency can be reached by a small gain in fit.  In a clip of many cycles the fit has side lobes every 1/(H T) Hz,
    so the best of a grid of six points to a lobe is taken before it is refined.
    """
    frames = len(positions)
    times = np.arange(frames) / frame_rate_hz
    ankle_distance = positions[:, LEFT_LEG[2], 1] - positions[:, RIGHT_LEG[2], 1]
    duration = frames / frame_rate_hz
    lowest = max(SEARCH_HZ[0], 1.0 / duration)
    if lowest >= SEARCH_HZ[1]:
        raise InvalidInput(
            "the clip is too short for a walking cycle",
            expected=f"more than {1 / SEARCH_HZ[1]:.2f} s",
            received=f"{duration:.2f} s",
            code="too_short",
            duration_s=duration,
        )
    # Six candidates to the clip's resolution cannot step over the peak.
    count = int(np.ceil((SEARCH_HZ[1] - lowest) * duration * 6)) + 8
    candidates = np.linspace(lowest, SEARCH_HZ[1], count)
    guess = candidates[first_lowest(-single_frequency_power(candidates, times, ankle_distance))]
    require_rate(frame_rate_hz, guess, harmonics)
    values = positions.reshape(frames, -1)
    values = values - values.mean(axis=0)

    # The values have no mean, so the constant explains nothing by itself.
    def unexplained(frequencies_hz: np.ndarray) -> np.ndarray:
        columns = design(frequencies_hz[:, None], times, harmonics)
        across = columns.swapaxes(-1, -2)
        projected = across @ values
        return -(projected * np.linalg.solve(across @ columns, projected)).sum(axis=(-2, -1))

    # The guess is accurate to the clip's resolution, 1/T. Search twice that range: less than 15 % in long clips.
    reach = min(0.15 * guess, 2.0 / duration)
    bounds = max(guess - reach, 0.85 * lowest), guess + reach
    grid = np.linspace(*bounds, int(np.ceil((bounds[1] - bounds[0]) * duration * harmonics * 6)) + 3)
    best = int(first_lowest(unexplained(grid)))
    minimum = minimize_scalar(
        lambda frequency_hz: unexplained(np.array([frequency_hz]))[0],
        bounds=(grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]),
        method="bounded",
        options={"xatol": 1e-8},
    )
    return float(minimum.x)


def require_rate(frame_rate_hz: float, frequency_hz: float, harmonics: int) -> None:
    """Check that the frame rate is more than twice the frequency of the highest harmonic.

    Raises
    ------
    InvalidInput
        If the frame rate is too low.
    """
    if not frame_rate_hz > 2 * harmonics * frequency_hz:
        raise InvalidInput(
            "the frame rate is too low for the harmonics",
            expected=f"more than {2 * harmonics * frequency_hz:.3g} Hz",
            received=f"{frame_rate_hz:g} Hz",
            code="rate_too_low",
            frame_rate_hz=frame_rate_hz,
        )
