"""Baseline of synchronization: the variance that it removes from performances without timing errors.

Every performance is brought to a common time, then synchronized again, by key-frames and automatically.  The variance
that this removes comes from differences of posture, not of time.

If the true course of the action is known, it gives the common time, that of the median sequence.  For recorded people
it is unknown: there the deviation of each performance from the mean synchronized performance changes its sign.  This
keeps mean, size and smoothness, and removes the features that determined the path.  On synthetic performances both
leave similar shares of the variance (0.70 and 0.75).
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
    """Performances without timing errors, before and after synchronization.

    Attributes
    ----------
    linear, keyframe, synchronized : (M, P, b)
        Performances before; synchronized by key-frames; synchronized automatically.
    disparity : (M, P) int
        Disparity that brings each performance to the rate of the median sequence.
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
    """Return performances that have no timing errors, before and after they are synchronized."""
    samples, median = action.linear.shape[1], action.median
    if dataset.phase is None:
        common = 2.0 * action.synchronized.mean(axis=0) - action.synchronized
    else:
        frames, _ = dataset.true_course(median, samples)
        raw = action.sequences("raw")
        common = np.stack([interpolate(x, at) for x, at in zip(raw, frames, strict=True)])
    results = [
        synchronization.synchronize(common[median], x, smoothness=action.smoothness, **options.path_options)
        for x in common
    ]
    disparity = np.stack([f.disparity for f in results])
    return WithoutMistiming(
        linear=common,
        keyframe=action_model.by_key_frames(
            list(common), samples=samples, count=options.key_frames
        ).sequences,
        synchronized=synchronization.warp(common, disparity),
        disparity=disparity,
        distances=np.array([f.cost for f in results]),
        distances_linear=((common - common[median]) ** 2).sum(axis=(1, 2)),
    )
