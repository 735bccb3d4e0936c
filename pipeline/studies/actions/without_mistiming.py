"""The same performances with nothing to synchronize: what the methods of mozerov2006 do all the same.

Where the true course of the action is known, every performance is brought to that of the median sequence, and then
synchronized again, by key-frames and automatically: whatever these still take off follows differences of posture, not
of time.  Of recorded people the true course is not known; there the null is no synchronization, linear normalisation
alone, which takes nothing off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import action_model, synchronization
from pipeline.core.resampling import interpolate
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import Action, ActionSpaceModel


@dataclass(frozen=True)
class WithoutMistiming:
    """Performances without mistiming (or, where that is unknown, linearly normalised), and synchronized again.

    Attributes
    ----------
    linear, keyframe, synchronized : (M, P, b)
        Before; by key-frames; automatically.
    disparity : (M, P) int
        Brings each to the rate of the median sequence.
    distances : (M,)
        Synchronization distance from the median sequence.
    distances_linear : (M,)
        The same along zero disparity.
    """

    linear: np.ndarray
    keyframe: np.ndarray
    synchronized: np.ndarray
    disparity: np.ndarray
    distances: np.ndarray
    distances_linear: np.ndarray


def without_mistiming(dataset: Postures, action: Action, options: ActionSpaceModel) -> WithoutMistiming:
    """Return the performances without mistiming, and what synchronization makes of them."""
    linear, median = action.linear, action.median
    if dataset.phase is None:
        apart = ((linear - linear[median]) ** 2).sum(axis=(1, 2))
        still = np.zeros(linear.shape[:2], dtype=int)
        return WithoutMistiming(linear, linear, linear, still, apart, apart)
    frames, _ = dataset.true_course(median, linear.shape[1])
    true = np.stack([interpolate(x, at) for x, at in zip(action.sequences("raw"), frames, strict=True)])
    found = [
        synchronization.synchronize(true[median], x, smoothness=action.smoothness, **options.path_options)
        for x in true
    ]
    disparity = np.stack([f.disparity for f in found])
    return WithoutMistiming(
        linear=true,
        keyframe=action_model.by_key_frames(
            list(true), samples=linear.shape[1], count=options.key_frames
        ).sequences,
        synchronized=synchronization.warp(true, disparity),
        disparity=disparity,
        distances=np.array([f.cost for f in found]),
        distances_linear=((true - true[median]) ** 2).sum(axis=(1, 2)),
    )
