"""Cameras for tests: a still camera, and its orthographic limit."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core.camera_paths import PX_PER_MM, around
from pipeline.core.pinhole import Pinhole


def still(frames: int, *, target: np.ndarray, **options: Any) -> Pinhole:
    """Return a camera at a fixed position that turns to follow a moving target.

    Options are those of `around`.
    """
    return around(frames, target=target, sweep_rad=0.0, **options)


def off_centre(camera: Pinhole) -> Pinhole:
    """Return a camera with its principal point moved to (320, 240) px."""
    shift = np.array([[0.0, 0.0, 320.0], [0.0, 0.0, 240.0], [0.0, 0.0, 0.0]])
    return Pinhole(camera.intrinsics + shift, camera.rotation, camera.centre)


def parallel(
    frames: int, *, target: np.ndarray, azimuth_rad: float = 0.0, px_per_mm: float = PX_PER_MM
) -> np.ndarray:
    """Return horizontal orthographic cameras (F, 3, 4), the limit of `still` for a large distance.

    Both candidates of every frame are then mirror images and no basis tells which is right: a tie.

    Parameters
    ----------
    frames : int
    target : (3,) or (F, 3)
        Appears at pixel 0, 0.
    azimuth_rad : float
    px_per_mm : float
    """
    target = np.broadcast_to(target, (frames, 3))
    c, s = np.cos(azimuth_rad), np.sin(azimuth_rad)
    rows = px_per_mm * np.array([[-c, -s, 0.0], [0.0, 0.0, -1.0]])  # image right and down
    cameras = np.zeros((frames, 3, 4))
    cameras[:, :2, :3] = rows
    cameras[:, :2, 3] = -target @ rows.T
    cameras[:, 2, 3] = 1.0
    return cameras
