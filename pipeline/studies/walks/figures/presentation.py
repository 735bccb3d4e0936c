"""How figures of walks name and draw the two approaches, and set walkers on the ground."""

from __future__ import annotations

import numpy as np

METHOD_NAMES = {"least_squares": "approach I (least squares)", "map": "approach II (MAP)"}
METHOD_STYLES = {"least_squares": "solid", "map": "dashed"}
METHOD_COLOURS = {"least_squares": "orange", "map": "blue"}

VIEW_AXIS = "Viewpoint (degree)"

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing walkers on the ground."""


def entity_name(name: str) -> str:
    """Return a walker's name as the path of a recording's entity can hold it."""
    return "".join(ch if ch.isalnum() else "_" for ch in name)


def lift(motion: np.ndarray) -> np.ndarray:
    """Return what to add to a motion (T, 15, 3) so that its lower ankle stands on the ground, (3,) mm."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])
