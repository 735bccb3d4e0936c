"""What a tracker is shown of a performance: joints in an image, with noise, some of them hidden for a while.

The camera is orthographic, its view angle known.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import camera
from pipeline.studies.occlusion import occlusion


def observe(
    joints_mm: np.ndarray,
    view_angle_rad: float,
    *,
    noise_mm: float,
    occluded: float,
    occlusion_frames: float,
    seed: tuple[int, ...],
) -> np.ndarray:
    """Return the image (T, 15, 2) of a performance, mm, NaN where a joint is hidden.

    Parameters
    ----------
    joints_mm : (T, 15, 3)
    view_angle_rad : float
    noise_mm : float
        Standard deviation of a coordinate.
    occluded : float
        Share of joints hidden.
    occlusion_frames : float
        Mean length of a hidden run.
    seed : tuple of int
        The same seed gives the same errors, larger with more noise, and the same runs, longer with more hidden:
        conditions then differ in what is varied alone.
    """
    frames, joints = joints_mm.shape[:2]
    noise = np.random.default_rng([*seed, 0]).standard_normal((frames, joints, 2))
    image = camera.project(joints_mm, view_angle_rad) + noise_mm * noise
    hides = np.random.default_rng([*seed, 1])
    image[occlusion(frames, joints, occluded, occlusion_frames, hides)] = np.nan
    return image
