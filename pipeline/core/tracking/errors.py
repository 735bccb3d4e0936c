"""Joint errors of a tracked performance, mm, and those of the mean performance at its best timing.

The action model without an image is its mean performance; the question is at which phase.  With a constant rate
nothing of the performer is used but the duration; at the best phase of each frame (`best_phase`)
it is the least error that any timing of the mean performance can have.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.choice import first_lowest
from pipeline.skeleton import PELVIS


def best_phase(performance: np.ndarray, mean_performance: np.ndarray) -> np.ndarray:
    """Return the phase (T,), in whole samples, at which the mean performance is nearest to each frame of a performance.

    Parameters
    ----------
    performance : (T, J, c)
        Joints in 3D (then this is an oracle) or in the image; NaN where not known.
    mean_performance : (P, J, c)

    Notes
    -----
    Nearest in the mean squared distance of the joints that are known; the earlier on ties; not held to be monotone.
    """
    finite = np.isfinite(performance).all(axis=-1)
    observed = np.where(finite[..., None], performance, 0.0)
    weights = np.broadcast_to(finite[..., None], observed.shape).reshape(len(observed), -1).astype(float)
    of_mean = mean_performance.reshape(len(mean_performance), -1)
    # |a - b|² over the known joints, less |a|², which is the same for all phases.
    misfit = weights @ of_mean.T**2 - 2.0 * observed.reshape(len(observed), -1) @ of_mean.T
    return first_lowest(misfit).astype(float)


def joint_error(estimated: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the mean distance (T,), mm, between estimated and true joints in each frame, relative to the pelvis.

    The estimated pelvis is first moved to the true pelvis; the mean is over the other joints.

    Parameters
    ----------
    estimated, true : (T, 15, 3)
        In WALKER15 order, mm.
    """
    difference = np.asarray(estimated, float) - true
    difference = np.delete(difference - difference[:, PELVIS, None], PELVIS, axis=1)
    return np.linalg.norm(difference, axis=-1).mean(axis=1)
