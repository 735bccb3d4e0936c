"""Learn an action model from postures: synchronize the performances, then compute mean and standard deviation.

mozerov2006 sections 2 to 4 in one piece, as a tracker without one performance and the figures with all of them
need it.  Every performance goes through the aSpace, linear normalisation, synchronization to the median sequence.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core import aspace
from pipeline.core.action_model.bounds import ActionModel, learn
from pipeline.core.aspace import ASpace
from pipeline.core.synchronization import (
    KeyFrameSynchronization,
    choose_key_frames,
    median_sequence,
    normalise,
    resample_by_key_frames,
    synchronize_all,
    warp,
)
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput


@shortened
class LearntAction:
    """The aSpace, the synchronized performances and the action model of one action.

    Attributes
    ----------
    space : ASpace
    raw : tuple of (F_i, b)
        Performances in the aSpace.
    linear : (M, P, b)
        With linearly normalised time.
    smoothness : float
        mu, in squared aSpace units.
    distances : (M, M)
        C(n, m) of all ordered pairs.
    median : int
        The pattern: the median sequence.
    disparity : (M, P) int
        Brings each performance to the rate of the median sequence.
    synchronized : (M, P, b)
    model : ActionModel
        Of the synchronized performances.
    """

    space: ASpace
    raw: tuple[np.ndarray, ...]
    linear: np.ndarray
    smoothness: float
    distances: np.ndarray
    median: int
    disparity: np.ndarray
    synchronized: np.ndarray
    model: ActionModel


def learn_action(
    postures: Sequence[np.ndarray],
    *,
    samples: int = 100,
    variance: float = 0.95,
    dimensions: int | None = None,
    max_disparity: int = 49,
    smoothness: float = 0.02,
    penalty: str = "change",
    start: str = "fixed",
    steps: Sequence[int] = (-1, 0, 1),
) -> LearntAction:
    """Learn the aSpace, the median sequence, the synchronized performances and the action model of one action.

    Parameters
    ----------
    postures : sequence of (F_i, 37)
        At least two performances.
    samples : int
        P, of a performance after linear normalisation.
    variance, dimensions
        As for `aspace.learn`.
    max_disparity
        As for `synchronization.synchronize`.
    smoothness : float
        mu in mean squared deviations of a frame, so that it does not depend on the action or its units.
    penalty, start, steps
        As for `synchronization.synchronize`.

    Raises
    ------
    InvalidInput
        As `aspace.learn`, `synchronization.synchronize` and `learn`.
    """
    if len(postures) < 2:
        raise InvalidInput(
            "one performance alone cannot be synchronized",
            expected="2 or more",
            received=len(postures),
            code="too_few_performances",
            count=len(postures),
        )
    space = aspace.learn(postures, variance=variance, dimensions=dimensions)
    raw = tuple(space.project(p) for p in postures)
    linear = np.stack([normalise(x, samples) for x in raw])
    mu = smoothness * mean_squared_deviation(linear)
    pairs = synchronize_all(
        linear, max_disparity=max_disparity, smoothness=mu, penalty=penalty, start=start, steps=steps
    )
    median = median_sequence(pairs.cost)
    disparity = pairs.disparity[median]
    synchronized = np.stack([warp(x, d) for x, d in zip(linear, disparity, strict=True)])
    return LearntAction(
        space=space,
        raw=raw,
        linear=linear,
        smoothness=mu,
        distances=pairs.cost,
        median=median,
        disparity=disparity,
        synchronized=synchronized,
        model=learn(synchronized),
    )


def mean_squared_deviation(performances: np.ndarray) -> float:
    """Return the mean squared distance of a posture from the mean posture, squared aSpace units.

    Parameters
    ----------
    performances : (M, P, b)
    """
    deviation = performances - performances.mean(axis=(0, 1))
    return (deviation**2).sum(axis=-1).mean()


def by_key_frames(
    raw: Sequence[np.ndarray], *, samples: int = 100, count: int = 5
) -> KeyFrameSynchronization:
    """Synchronize performances by key-frames, the baseline of the paper.

    The result has the same number of frames between key-frames in all performances.

    Parameters
    ----------
    raw : sequence of (F_i, b)
        Performances in the aSpace.
    samples : int
        P.
    count : int
        Key-frames of a performance.

    Raises
    ------
    InvalidInput
        As `choose_key_frames` and `resample_by_key_frames`.
    """
    return resample_by_key_frames(raw, choose_key_frames(raw, count=count).frames, samples)


def variance_left(performances: np.ndarray) -> np.ndarray:
    """Return the variance (P,) between performances at each sample, summed over the dimensions of the aSpace.

    Parameters
    ----------
    performances : (M, P, b)
    """
    return performances.var(axis=0, ddof=1).sum(axis=-1)
