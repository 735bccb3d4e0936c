"""The same performances with nothing to synchronize: what the methods of mozerov2006 do all the same.

Every performance is brought to a common time, and then synchronized again, by key-frames and automatically: whatever
these still take off follows differences of posture, not of time.

Where the true course of the action is known, the common time is that of the median sequence by the true course.  Of
recorded people it is not known; there each performance's deviation from the mean synchronized performance changes its
sign, which keeps mean, size and smoothness, and leaves nothing that the path was chosen by.  On synthetic performances
both leave about as much (0.70 and 0.75 of the variance).
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
    """Performances without mistiming, and synchronized again.

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
    samples, median = action.linear.shape[1], action.median
    if dataset.phase is None:
        common = 2.0 * action.synchronized.mean(axis=0) - action.synchronized
    else:
        frames, _ = dataset.true_course(median, samples)
        raw = action.sequences("raw")
        common = np.stack([interpolate(x, at) for x, at in zip(raw, frames, strict=True)])
    found = [
        synchronization.synchronize(common[median], x, smoothness=action.smoothness, **options.path_options)
        for x in common
    ]
    disparity = np.stack([f.disparity for f in found])
    return WithoutMistiming(
        linear=common,
        keyframe=action_model.by_key_frames(
            list(common), samples=samples, count=options.key_frames
        ).sequences,
        synchronized=synchronization.warp(common, disparity),
        disparity=disparity,
        distances=np.array([f.cost for f in found]),
        distances_linear=((common - common[median]) ** 2).sum(axis=(1, 2)),
    )
