"""Rotations about coordinate axes, for hierarchies of joints (BVH, Acclaim)."""

from __future__ import annotations

import numpy as np


def turn(rotations: np.ndarray, axis: str, angles_rad: np.ndarray) -> None:
    """Multiply rotation matrices (T, 3, 3) from the right, in place, by rotations by angles (T,) about an axis."""
    # A rotation from the right about x mixes columns y and z, and so on in a cycle.
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    cosine, sine = np.cos(angles_rad[:, None]), np.sin(angles_rad[:, None])
    column_i, column_j = rotations[:, :, i].copy(), rotations[:, :, j].copy()
    rotations[:, :, i] = cosine * column_i + sine * column_j
    rotations[:, :, j] = cosine * column_j - sine * column_i
