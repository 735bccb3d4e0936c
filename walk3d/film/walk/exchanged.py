"""Frames in which a detector took left for right: the cheapest sequence of labels, for legs and arms each.

The two states of a frame are its labels as they are and exchanged; changing state costs `SWITCH`.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import LEFT_LEG, RIGHT_LEG, WALKER15

LIMBS = {
    "legs": list(zip(LEFT_LEG, RIGHT_LEG, strict=True)),
    "arms": [(WALKER15.index(f"left_{j}"), WALKER15.index(f"right_{j}")) for j in ("shoulder", "elbow", "wrist")],
}  # fmt: skip
"""Pairs of left and right joints that a detector exchanges together."""
SWITCH = 14.0
"""Cost of one change between labels as they are and exchanged, twice a negative logarithm of a probability."""


def cheapest_labels(kept: np.ndarray, exchanged: np.ndarray) -> np.ndarray:
    """Frames (T,) bool that are better exchanged, of costs (T,) as they are and exchanged.

    Examples
    --------
    >>> cheapest_labels(np.array([0.0, 50.0, 0.0]), np.array([50.0, 0.0, 50.0])).tolist()
    [False, True, False]
    >>> cheapest_labels(np.array([0.0, 20.0, 0.0]), np.array([20.0, 0.0, 20.0])).tolist()
    [False, False, False]
    """
    # All that is told of the two costs so far is how much less the second is; beyond a change's cost, who is dearer
    # came from the other.
    gain, less, last = (kept - exchanged).tolist(), list[float](), 0.0
    for one in gain:
        last = (SWITCH if last > SWITCH else -SWITCH if last < -SWITCH else last) + one
        less.append(last)
    state, labels = less[-1] > 0.0, [False] * len(gain)
    for t in range(len(gain) - 1, -1, -1):
        state = state if -SWITCH <= less[t] <= SWITCH or t == len(gain) - 1 else less[t] > 0.0
        labels[t] = state
    return np.array(labels)


def exchange(values: np.ndarray, frames: dict[str, np.ndarray]) -> np.ndarray:
    """Keypoints or weights (T, 15, …) with left and right exchanged in the frames (T,) of each pair of limbs."""
    which = np.zeros(values.shape[:2], bool)
    for limb, pairs in LIMBS.items():
        which[:, np.ravel(pairs)] = frames[limb][:, None]
    return np.where(which.reshape(*which.shape, *[1] * (values.ndim - 2)), exchange_all(values), values)


def exchange_all(values: np.ndarray) -> np.ndarray:
    """Keypoints or weights (T, 15, …) with left and right exchanged throughout."""
    return values[:, list(WALKER15.mirror)]
