"""Search for the frames in which a detector exchanged left and right.

The result is the sequence of labels with the smallest total cost.

Legs and arms have separate labels.

A frame's labels are either as detected or exchanged; changing between the two costs `SWITCH`.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import LEFT_LEG, RIGHT_LEG, WALKER15

LIMBS = {
    "legs": list(zip(LEFT_LEG, RIGHT_LEG, strict=True)),
    "arms": [(WALKER15.index(f"left_{j}"), WALKER15.index(f"right_{j}")) for j in ("shoulder", "elbow", "wrist")],
}  # fmt: skip
"""Pairs of left and right joints that a detector exchanges together, for the legs and for the arms."""
SWITCH = 14.0
"""Cost of one change from detected to exchanged labels, or back: twice a negative log probability."""


def cheapest_labels(unchanged: np.ndarray, exchanged: np.ndarray) -> np.ndarray:
    """Return the mask (T,) of frames whose labels should be exchanged.

    The arguments are the costs (T,) of the detected and of the exchanged labels.

    Examples
    --------
    >>> cheapest_labels(np.array([0.0, 50.0, 0.0]), np.array([50.0, 0.0, 50.0])).tolist()
    [False, True, False]
    >>> cheapest_labels(np.array([0.0, 20.0, 0.0]), np.array([20.0, 0.0, 20.0])).tolist()
    [False, False, False]
    """
    # Dynamic programming on the difference of the two accumulated costs, which one change limits to ±SWITCH.
    gain, less, last = (unchanged - exchanged).tolist(), list[float](), 0.0
    for difference in gain:
        last = (SWITCH if last > SWITCH else -SWITCH if last < -SWITCH else last) + difference
        less.append(last)
    state, labels = less[-1] > 0.0, [False] * len(gain)
    for t in range(len(gain) - 1, -1, -1):
        state = state if -SWITCH <= less[t] <= SWITCH or t == len(gain) - 1 else less[t] > 0.0
        labels[t] = state
    return np.array(labels)


def exchange(values: np.ndarray, frames: dict[str, np.ndarray]) -> np.ndarray:
    """Return keypoints or weights (T, 15, …) with left and right exchanged in the given frames of legs and arms."""
    which = np.zeros(values.shape[:2], bool)
    for limb, pairs in LIMBS.items():
        which[:, np.ravel(pairs)] = frames[limb][:, None]
    return np.where(which.reshape(*which.shape, *[1] * (values.ndim - 2)), exchange_all(values), values)


def exchange_all(values: np.ndarray) -> np.ndarray:
    """Return keypoints or weights (T, 15, …) with left and right exchanged in all frames."""
    return values[:, list(WALKER15.mirror)]
