"""Random smooth time warps, in which a performance speeds up and slows down [mozerov2006 8, 9].

A warp is a phase w(x) in [0, 1] of the relative time x in [0, 1]: w(0) = 0, w(1) = 1, increasing.  Its rate is the
exponential of a few slow waves, so that it is positive and as likely doubled as halved.  Unlike in [mozerov2006 13],
it is not bounded by 2.
"""

from __future__ import annotations

import numpy as np

WAVES = 4
"""Number of waves whose sum is the logarithm of a performance's speed.

Wave k has k half periods within a performance.  Its standard deviation is 1/k of that of the first wave.
"""

_GRID = 2001


def draw_waves(generator: np.random.Generator, spread: float) -> np.ndarray:
    """Draw the amplitudes (2, K) of the cosine and sine waves whose sum is the log of a performance's speed.

    Parameters
    ----------
    generator : numpy.random.Generator
    spread : float
        Standard deviation of the logarithm of the rate, over time and draws, before `warp` scales it to end at 1.
    """
    scale = 1.0 / np.arange(1, WAVES + 1)
    return spread / np.sqrt((scale**2).sum()) * scale * generator.standard_normal((2, WAVES))


def warp(waves: np.ndarray, frames: int) -> np.ndarray:
    """Return the phase (F,) of a performance, from 0 at its first frame to 1 at its last frame.

    Parameters
    ----------
    waves : (2, K)
        Amplitudes from `draw_waves`, or a sum of such amplitudes.
    frames : int
    """
    x = np.linspace(0.0, 1.0, _GRID)
    angles = np.pi * np.outer(x, np.arange(1, waves.shape[1] + 1))
    rate = np.exp(np.cos(angles) @ waves[0] + np.sin(angles) @ waves[1])
    passed = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0)])
    return np.interp(np.linspace(0.0, 1.0, frames), x, passed / passed[-1])


def correspondence(phase_n: np.ndarray, phase_m: np.ndarray) -> np.ndarray:
    """Return the fractional frame (F_n,) of performance m that corresponds to each frame of performance n.

    Corresponding frames have the same phase.

    Parameters
    ----------
    phase_n, phase_m : (F_n,), (F_m,)
        Increasing phases of the frames.

    Examples
    --------
    >>> correspondence(np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.25, 0.5, 0.75, 1.0])).tolist()
    [0.0, 2.0, 4.0]
    """
    return np.interp(phase_n, phase_m, np.arange(len(phase_m), dtype=float))
