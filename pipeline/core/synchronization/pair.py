"""Synchronization of two performances: one is resampled so that its timing follows the other (mozerov2006 section 3).

Symbols
-------
``x_n``     base sequence, ``x_m`` the sequence to be synchronized to it: P samples of b aSpace coordinates
``Delta``   disparity function, in samples; ``tau = p + Delta(p)`` the rate-to-rate synchronization function
``mu``      smoothness, in squared aSpace units per sample of change
``D``       largest disparity; in the paper also the distance, here C

Everything is in samples: the printed equations multiply some terms by the sampling interval and not others.
Many pairs at once are in `all_pairs`, and the search for the path, which both share, in `trellis`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from pipeline.core.resampling import interpolate
from pipeline.core.synchronization.all_pairs import same_size
from pipeline.core.synchronization.trellis import (
    STEPS,
    accumulate,
    allocate_costs,
    allowed_disparities,
    backtrack,
)
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_count

_CHUNK = 2**16
"""Number of posture differences that are in memory at once during the computation of a disparity space image."""


@shortened
class Synchronization:
    """Disparity function that synchronizes one sequence with another, and the synchronization distance.

    Attributes
    ----------
    disparity : (P,) int
        Delta(p): sample p of the base is matched with sample p + Delta(p) of the other.
    cost : float
        The synchronization distance, squared aSpace units.
    """

    disparity: np.ndarray
    cost: float


def normalise(sequence: np.ndarray, frames: int) -> np.ndarray:
    """Resample a sequence (F, b) linearly to `frames` evenly spaced times, (P, b), with both ends kept
    [mozerov2006 6, 7].

    The first and the last posture are kept.

    Parameters
    ----------
    sequence : (F, b)
    frames : int
        P.

    Raises
    ------
    InvalidInput
        If the sequence is empty or holds a value that is not finite, or one frame is to hold two ends.

    Notes
    -----
    Linear between postures.  With the durations as printed, T = F delta-f, the instants would run past the last
    posture; t_p = p (F - 1) / (P - 1) keeps both ends [mozerov2006 9].  A single posture is repeated.

    Examples
    --------
    >>> normalise(np.array([[0.0], [1.0], [4.0]]), 5)[:, 0]
    array([0. , 0.5, 1. , 2.5, 4. ])
    """
    (sequence,) = same_size([sequence], ["the sequence"])
    samples = require_count("the number of frames", frames)
    last = len(sequence) - 1
    if samples == 1 and last > 0:
        raise InvalidInput(
            "one frame cannot contain both ends of a sequence",
            expected="two frames or more",
            received="1",
            code="too_few_samples",
        )
    return interpolate(sequence, np.arange(samples) * last / max(samples - 1, 1))


def rate_to_rate(disparity: np.ndarray) -> np.ndarray:
    """Return the rate-to-rate synchronization function tau (…, P), in samples: sample number plus disparity
    [mozerov2006 8, 9].

    Parameters
    ----------
    disparity : (…, P) int
        Delta, of one path or of many.

    Notes
    -----
    Its differences are the rates alpha that [mozerov2006 8] integrates.
    """
    disparity = np.asarray(disparity)
    return np.arange(disparity.shape[-1]) + disparity


def warp(x_m: np.ndarray, disparity: np.ndarray) -> np.ndarray:
    """Return the sequence x_m with its timing synchronized to x_n: x_{n,m}(p) = x_m(p + Delta(p)) [mozerov2006 10, 18].

    Parameters
    ----------
    x_m : (…, P, b)
    disparity : (…, P) int
        Of one path or of many: ``warp(sequences, found.disparity[n])`` brings all sequences to the rate of n.

    Raises
    ------
    InvalidInput
        If shapes disagree or a disparity is no whole number or leads outside of the sequence.

    Examples
    --------
    >>> warp(np.array([[0.0], [1.0], [4.0]]), np.array([0, 1, 0]))[:, 0]
    array([0., 4., 4.])
    """
    x_m, disparity = np.asarray(x_m, float), np.asarray(disparity)
    if x_m.ndim < 2 or disparity.shape != x_m.shape[:-1] or disparity.dtype.kind not in "iu":
        raise InvalidInput(
            "sequence and disparity function have incompatible shapes",
            expected="x_m (…, P, b), and integer disparities (…, P)",
            received=f"x_m {x_m.shape} and {disparity.dtype} {disparity.shape}",
            code="mismatch",
        )
    tau = rate_to_rate(disparity)
    outside = (tau < 0) | (tau >= tau.shape[-1])
    if outside.any():
        p = int(np.argwhere(outside)[0][-1])
        raise InvalidInput(
            f"the disparity of sample {p} refers to a sample outside the sequence",
            expected=f"samples 0 to {tau.shape[-1] - 1}",
            received=tau[outside][0],
            code="beyond_samples",
            sample=p,
            position=tau[outside][0],
        )
    return np.take_along_axis(x_m, tau[..., None], axis=-2)


def synchronization_distance(
    x_n: np.ndarray, x_m: np.ndarray, disparity: np.ndarray, *, smoothness: float, penalty: str = "change"
) -> float:
    """Return the synchronization distance of two sequences for a given disparity function, squared aSpace units
    [mozerov2006 11, 12].

    Parameters
    ----------
    x_n, x_m : (P, b)
    disparity : (P,) int
    smoothness : float
        mu.
    penalty : {"change", "as_printed"}

    Raises
    ------
    InvalidInput
        If the sequences cannot be compared, or as `warp`.
    """
    x_n, x_m = same_size([x_n, x_m], ["x_n", "x_m"])
    nodes = allowed_disparities(len(x_n), max_disparity=len(x_n), smoothness=smoothness, penalty=penalty)
    misfit = ((x_n - warp(x_m, disparity)) ** 2).sum(axis=1)
    return nodes.distances_so_far(misfit, np.asarray(disparity))[-1]


def disparity_space_image(x_n: np.ndarray, x_m: np.ndarray, *, max_disparity: int) -> np.ndarray:
    """Return the disparity space image (P, 2D + 1): the squared distances of x_n(p) and x_m(p + d), |d| <= D
    [mozerov2006 14].

    Parameters
    ----------
    x_n, x_m : (P, b)
    max_disparity : int
        D, as it is given: the image of a band wider than the sequence has columns of infinities.

    Raises
    ------
    InvalidInput
        If the sequences cannot be compared, or the largest disparity is no whole number.

    Notes
    -----
    Infinite outside of x_m.
    """
    x_n, x_m = same_size([x_n, x_m], ["x_n", "x_m"])
    band = require_count("the largest disparity", max_disparity, at_least=0)
    frames = len(x_n)
    image = np.empty((frames, 2 * band + 1))
    # windows[p, :, d + D] is x_m(p + d); what lies outside is overwritten below.
    windows = sliding_window_view(np.pad(x_m, ((band, band), (0, 0))), 2 * band + 1, axis=0)
    chunk = max(1, _CHUNK // windows[0].size)
    for first in range(0, frames, chunk):
        chunk_rows = slice(first, first + chunk)
        difference = windows[chunk_rows] - x_n[chunk_rows, :, None]
        image[chunk_rows] = np.square(difference, out=difference).sum(axis=1)
    matched = np.arange(frames)[:, None] + np.arange(-band, band + 1)
    image[(matched < 0) | (matched >= frames)] = np.inf
    return image


def synchronize(
    x_n: np.ndarray,
    x_m: np.ndarray,
    *,
    max_disparity: int,
    smoothness: float,
    penalty: str = "change",
    start: str = "fixed",
    steps: Sequence[int] = STEPS,
) -> Synchronization:
    """Return the disparity function with the smallest synchronization distance, and that distance [mozerov2006 15].

    Parameters
    ----------
    x_n : (P, b)
        Base: its rate is kept.
    x_m : (P, b)
        The sequence to be brought to it; both with linearly normalised time, see `normalise`.
    max_disparity : int
        D, in samples.  One wider than the sequence is no error and changes nothing: no path can use it.
    smoothness : float
        mu, squared aSpace units per sample of change.  Zero is allowed, and asks for the unpenalised path of
        dynamic time warping (step pattern asymmetric, window D), which follows noise.
    penalty : {"change", "as_printed"}
        mu |k| of the distance [mozerov2006 12], or mu |d + k| as the recurrence is printed.
    start : {"fixed", "free"}
        ``fixed`` pins both ends [mozerov2006 9]; ``free`` only the last, as printed.
    steps : sequence of int
        k of the recurrence, each at most 1: the rate is 1 - k, from 0 to 2 by default [mozerov2006 13].

    Raises
    ------
    InvalidInput
        If the sequences differ in length or dimension, a value is not finite (the sequence and the frame are
        named), or a switch is none.

    Notes
    -----
    Among paths of equal cost, the one that from its end backwards prefers k = 0, then -1, then +1.

    Examples
    --------
    >>> x_n = np.array([[0.0], [0.0], [1.0], [2.0], [3.0], [3.0]])
    >>> x_m = np.array([[0.0], [1.0], [2.0], [3.0], [3.0], [3.0]])
    >>> synchronize(x_n, x_m, max_disparity=2, smoothness=0.1).disparity.tolist()
    [0, -1, -1, -1, 0, 0]
    """
    x_n, x_m = same_size([x_n, x_m], ["x_n", "x_m"])
    nodes = allowed_disparities(
        len(x_n),
        max_disparity=max_disparity,
        smoothness=smoothness,
        penalty=penalty,
        start=start,
        steps=steps,
    )
    band = int(max(nodes.high.max(), -nodes.low.min()))
    image = disparity_space_image(x_n, x_m, max_disparity=band)[..., None]
    S = allocate_costs(nodes, 1)
    cost = accumulate(nodes, lambda p, low, high: image[p, low + band : high + band + 1], S)
    return Synchronization(disparity=backtrack(nodes, S)[:, 0], cost=cost[0])
