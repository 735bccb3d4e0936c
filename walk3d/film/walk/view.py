"""Pinhole camera that films a walk: transformations from the walker's axes to camera axes and to the image.

Symbols
-------
``theta``  heading seen from above, rad: 0 walks towards the camera, +90° to the image's right, 180° away
``A``      walker's axes (right, forwards, up) to level camera axes (right, down, away)
``phi``    pitch of the camera, rad, about its horizontal axis
``f``      focal length in pixels; pixels are relative to the principal point

View angle of the papers: ``alpha = 180° - theta``.  Their frontal view, 0, is a camera's view from behind, where image
right is the walker's right.
"""

from __future__ import annotations

import numpy as np


def level_axes(heading_rad: np.ndarray | float) -> np.ndarray:
    """Return rotations A (…, 3, 3) from the walker's axes to level camera axes.

    Examples
    --------
    >>> np.round(level_axes(0.0) @ np.array([0.0, 1.0, 0.0]), 12) + 0.0  # forwards is towards the camera
    array([ 0.,  0., -1.])
    """
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    zero, ones = np.zeros_like(c), np.ones_like(c)
    rows = [[-c, s, zero], [zero, zero, -ones], [-s, -c, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_level(vectors: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Convert vectors (3, …, T) from the walker's axes, with headings (T,), to level camera axes."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([s * vectors[1] - c * vectors[0], -vectors[2], -s * vectors[0] - c * vectors[1]])


def to_walker(level: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Convert vectors (3, …, T) from level camera axes to the walker's axes; the inverse of `to_level`."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([-c * level[0] - s * level[2], s * level[0] - c * level[2], -level[1]])


def pitched(pitch_rad: float) -> np.ndarray:
    """Return the rotation (3, 3) from level camera axes to the axes of a camera with the given pitch, rad."""
    c, s = np.cos(pitch_rad), np.sin(pitch_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def project(points: np.ndarray, focal_px: float) -> np.ndarray:
    """Project points (…, 3) in camera axes to pixels (…, 2) relative to the principal point."""
    return focal_px * points[..., :2] / points[..., 2:]


def view_angle_deg(heading_rad: float) -> float:
    """Return the view angle as the papers define it, degrees within ±180, from a heading in radians."""
    return (180.0 - np.degrees(heading_rad) + 180.0) % 360.0 - 180.0
