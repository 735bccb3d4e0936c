"""How figures of walks name and draw the two approaches, and set walkers on the ground."""

from __future__ import annotations

import numpy as np

from pipeline.palette import Style

METHODS = {
    "least_squares": Style("approach I (least squares)", "least_squares"),
    "map": Style("approach II (MAP)", "map", line="dashed"),
}

VIEW_AXIS = "Viewpoint (degree)"

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing walkers on the ground."""


def entity_name(name: str) -> str:
    """Return a walker's name as the path of a recording's entity can hold it."""
    return "".join(ch if ch.isalnum() else "_" for ch in name)


def lift(motion: np.ndarray) -> np.ndarray:
    """Return what to add to a motion (T, 15, 3) so that its lower ankle stands on the ground, (3,) mm."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])
