"""Simulated occlusion: each joint is hidden in random runs of frames, independently of other joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.validation import require_range

MAX_OCCLUDED = 0.9
"""Largest share of hidden frames of a joint; with a larger share, hidden runs would overlap."""


def require_occlusion(shares: Sequence[float], mean_frames: float) -> None:
    """Validate the options ``sweep.occluded`` and ``sweep.occlusion_frames``.

    Raises
    ------
    InvalidInput
        If a share is below 0 or above 0.9, or the runs are too short for it.
    """
    for share in shares:
        require_range("sweep.occluded", share, at_least=0, at_most=MAX_OCCLUDED)
        shortest = max(1.0, share / (1.0 - share))
        require_range("sweep.occlusion_frames", mean_frames, at_least=shortest, unit="frames")


def occlusion(
    frames: int, joints: int, share: float, mean_frames: float, generator: np.random.Generator
) -> np.ndarray:
    """Return a mask (T, J) of hidden joints, with independent random runs of hidden frames for each joint.

    Parameters
    ----------
    frames, joints : int
    share : float
        Expected part of all joints in all frames.
    mean_frames : float
        Expected length of a run.
    generator : numpy.random.Generator

    Raises
    ------
    InvalidInput
        If a share is below 0 or above 0.9, or the runs are too short for it.

    Notes
    -----
    Each joint is a two-state Markov chain with constant probabilities that begins in its stationary state.
    """
    require_occlusion([share], mean_frames)
    chance = generator.random((frames, joints))
    hidden = np.empty((frames, joints), bool)
    hidden[0] = chance[0] < share
    goes, stays = share / (mean_frames * (1.0 - share)), 1.0 - 1.0 / mean_frames
    for t in range(1, frames):
        hidden[t] = chance[t] < np.where(hidden[t - 1], stays, goes)
    return hidden
