"""Frames in which a detector took left for right: the cheapest sequence of labels, for legs and arms each.

The two states of a frame are its labels as they are and exchanged; changing state costs `SWITCH`.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15

LIMBS = {
    "legs": [(WALKER15.index(f"left_{j}"), WALKER15.index(f"right_{j}")) for j in ("hip", "knee", "ankle")],
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
    gain = kept - exchanged
    labels = np.zeros(len(kept), dtype=bool)
    if np.maximum(gain, 0.0).sum() < SWITCH and gain.sum() <= 0.0:  # not worth a change, nor as a whole
        return labels
    came_from = [(False, False)]
    a, b = float(kept[0]), float(exchanged[0])
    for same, other in zip(kept[1:].tolist(), exchanged[1:].tolist(), strict=True):
        came_from.append((b + SWITCH < a, a + SWITCH >= b))
        a, b = min(a, b + SWITCH) + same, min(b, a + SWITCH) + other
    state = b < a
    for t in range(len(kept) - 1, -1, -1):
        labels[t] = state
        state = came_from[t][state]
    return labels


def exchange(values: np.ndarray, frames: dict[str, np.ndarray]) -> np.ndarray:
    """Keypoints or weights (T, 15, …) with left and right exchanged in the frames (T,) of each pair of limbs."""
    found = values.copy()
    for limb, pairs in LIMBS.items():
        for left, right in pairs:
            rows = frames[limb]
            found[rows, left], found[rows, right] = values[rows, right], values[rows, left]
    return found


def exchange_all(values: np.ndarray) -> np.ndarray:
    """Keypoints or weights (T, 15, …) with left and right exchanged throughout."""
    return np.asarray(values[:, list(WALKER15.mirror)])
