"""Joints hidden from a camera, each by itself, in runs of frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.validation import require_range

MOST_OCCLUDED = 0.9
"""Largest share of joints that may be hidden; a run of hidden frames must end before the next begins."""


def require_occlusion(shares: Sequence[float], mean_frames: float) -> None:
    """Validate ``sweep.occluded`` and ``sweep.occlusion_frames``.

    Raises
    ------
    InvalidInput
        A share below 0 or above 0.9, or runs too short for it.
    """
    for share in shares:
        require_range("sweep.occluded", share, at_least=0, at_most=MOST_OCCLUDED)
        least = max(1.0, share / (1.0 - share))
        require_range("sweep.occlusion_frames", mean_frames, at_least=least, unit="frames")


def occlusion(
    frames: int, joints: int, share: float, mean_frames: float, generator: np.random.Generator
) -> np.ndarray:
    """Return which joints are hidden, (T, J) bool: each by itself, in runs of frames.

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
        A share below 0 or above 0.9, or runs too short for it.

    Notes
    -----
    Joints go and come back with constant probabilities, and begin as they go on.
    """
    require_occlusion([share], mean_frames)
    chance = generator.random((frames, joints))
    hidden = np.empty((frames, joints), bool)
    hidden[0] = chance[0] < share
    goes, stays = share / (mean_frames * (1.0 - share)), 1.0 - 1.0 / mean_frames
    for t in range(1, frames):
        hidden[t] = chance[t] < np.where(hidden[t - 1], stays, goes)
    return hidden
