"""A pinhole camera that sees somebody walk: walker's axes to camera axes, and the image.

Symbols
-------
``theta``  heading seen from above, rad: 0 walks towards the camera, +90° to the image's right, 180° away
``A``      walker's axes (right, forwards, up) to level camera axes (right, down, away)
``phi``    pitch of the camera, rad, about its horizontal axis
``f``      focal length in pixels; pixels are relative to the principal point

View angle of the papers: ``alpha = 180° - theta``, so their frontal view, 0, is what a camera sees from behind: image
right is there the walker's right.
"""

from __future__ import annotations

import numpy as np


def level_axes(heading_rad: np.ndarray | float) -> np.ndarray:
    """Rotations A (…, 3, 3) from the walker's axes to level camera axes.

    Examples
    --------
    >>> np.round(level_axes(0.0) @ np.array([0.0, 1.0, 0.0]), 12) + 0.0  # forwards is towards the camera
    array([ 0.,  0., -1.])
    """
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [[-c, s, zero], [zero, zero, -one], [-s, -c, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_level(own: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Vectors (3, …, T) in level camera axes of vectors (3, …, T) in the axes of a walker of headings (T,)."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([s * own[1] - c * own[0], -own[2], -s * own[0] - c * own[1]])


def to_walker(level: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Vectors (3, …, T) in the walker's axes: the inverse of `to_level`."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([-c * level[0] - s * level[2], s * level[0] - c * level[2], -level[1]])


def pitched(pitch_rad: float) -> np.ndarray:
    """Rotation (3, 3) from level camera axes to those of a camera pitched about its horizontal axis."""
    c, s = np.cos(pitch_rad), np.sin(pitch_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def project(points: np.ndarray, focal_px: float) -> np.ndarray:
    """Pixels (…, 2), relative to the principal point, of points (…, 3) in camera axes."""
    return focal_px * points[..., :2] / points[..., 2:]


def view_angle_deg(heading_rad: float) -> float:
    """View angle of the papers, in degrees within ±180, of a heading."""
    return (180.0 - np.degrees(heading_rad) + 180.0) % 360.0 - 180.0
