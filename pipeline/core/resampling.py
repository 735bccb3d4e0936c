"""Linear interpolation of sampled sequences.

A recording is read at another frame rate, a cycle of a walk at as many frames as it has, a performance at the frames
that key-frames call for [mozerov2006 6] and an action model at the phase of a particle; all are this one reading.

Positions are counted in samples from 0 to T - 1 and may be fractional: 1.25 lies a quarter of the way from sample 1 to
sample 2.  A sequence is not continued beyond its ends, for whoever asks there has lost count.

Legend: ``x`` the sequence (T, …), ``t`` a position, ``b`` the whole part of t, ``s = t - b`` the share of sample b + 1.
"""

from __future__ import annotations

import numpy as np

from pipeline.validation import InvalidInput

_ROUNDING = 1e-9
"""Largest overshoot of the last sample by rounding errors, in samples, that interpolation tolerates."""


def interpolate(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the values (N, …) of a sequence at fractional positions, by linear interpolation between samples.

    Parameters
    ----------
    values : (T, …)
        Samples x of anything, in any unit.
    at : (N,)
        Positions t in samples, 0 to T - 1, in any order.

    Raises
    ------
    InvalidInput
        If there are no samples, or a position is not a number between 0 and T - 1.

    Notes
    -----
    At a whole position the sample comes back as it is, unless the next one is missing: its share there is zero, and
    zero times NaN is NaN.  So a missing sample is missing from the sample before it up to the one after it.

    Examples
    --------
    >>> interpolate(np.array([0.0, 10.0, 40.0]), np.array([0.0, 0.5, 1.5, 2.0]))
    array([ 0.,  5., 25., 40.])
    """
    values, at = np.asarray(values), np.asarray(at)
    last = len(values) - 1
    if last < 0:
        raise InvalidInput(
            "there are no samples to interpolate", expected="one or more", received="0", code="no_samples"
        )
    beyond = ~((at >= -_ROUNDING) & (at <= last + _ROUNDING))  # NaN is neither
    if beyond.any():
        index = int(beyond.argmax())
        raise InvalidInput(
            "a position lies outside the sequence",
            f"position {index}",
            f"0 to {last}",
            f"{at[index]:g}",
            code="beyond_samples",
            position=at[index],
        )
    at = np.clip(at, 0, last)
    before = at.astype(int)
    after = np.minimum(before + 1, last)
    share = (at - before).reshape(-1, *[1] * (values.ndim - 1))
    # Exact at whole positions, and equal samples stay equal in between.
    return values[before] + share * (values[after] - values[before])


def frames_at_rate(frames: int, rate_hz: float, wanted_hz: float) -> np.ndarray:
    """Return the fractional frame positions (N,) that resample a clip at a lower frame rate.

    All frames are returned if the wanted rate is not lower.

    Parameters
    ----------
    frames : int
        T, of the clip.
    rate_hz, wanted_hz : float
        0 wanted: as recorded.

    Examples
    --------
    >>> frames_at_rate(5, 120.0, 60.0)
    array([0., 2., 4.])
    """
    if wanted_hz == 0 or wanted_hz >= rate_hz:
        return np.arange(frames, dtype=float)
    count = max(2, round((frames - 1) / rate_hz * wanted_hz) + 1)
    return np.linspace(0.0, frames - 1.0, count)
