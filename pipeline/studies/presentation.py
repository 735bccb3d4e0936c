"""Names and places of people in the recordings of every study."""

from __future__ import annotations

import re

import numpy as np

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing people on the ground."""


def entity_name(name: str) -> str:
    """Return the name of a clip as the path of a recording's entity can hold it."""
    return re.sub(r"\W", "_", name)


def lift(motion: np.ndarray) -> np.ndarray:
    """Return what to add to a motion (T, 15, 3) so that its lower ankle stands on the ground, (3,) mm."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])
