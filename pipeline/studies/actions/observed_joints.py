"""What a tracker is shown of a performance: joints in an image, with noise, some of them hidden for a while.

The camera is known: orthographic at a view angle, or a pinhole at a distance that looks the same way, so that both
images agree as the distance grows.  The detector's noise is given in millimetres at the actor for both.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.core import camera as orthographic
from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.tracking.likelihood import Likelihood
from pipeline.studies.occlusion import occlusion


class CameraKind(StrEnum):
    """How the known camera projects."""

    orthographic = "orthographic"
    perspective = "perspective"


_FOCAL_PX = 1000.0
_CAMERA_HEIGHT_MM = 1000.0


@dataclass(frozen=True)
class Camera:
    """A known camera, and how large a millimetre at the actor appears.

    Attributes
    ----------
    camera : float or Pinhole
        View angle in rad, or a pinhole.
    scale : float
        Image units (mm or px) to the millimetre.
    """

    camera: float | Pinhole
    scale: float

    def project(self, joints_mm: np.ndarray) -> np.ndarray:
        """Return the image (…, 2) of joints (…, 3), in image units."""
        if isinstance(self.camera, Pinhole):
            return self.camera.project(joints_mm)
        return orthographic.project(joints_mm, self.camera)

    def upright_mm(self, image: np.ndarray) -> np.ndarray:
        """Return an image (…, 2) in mm at the actor, to the right and up, to be shown."""
        if not isinstance(self.camera, Pinhole):
            return image
        return image / self.scale * [1.0, -1.0] + [0.0, _CAMERA_HEIGHT_MM]

    def likelihood(self, image: np.ndarray, noise_mm: np.ndarray) -> Likelihood:
        """Return how well joints explain an image (T, 15, 2), errors (15,) in mm at the actor.

        The orthographic image is known up to a shift along its horizontal, for the place of the actor is not known
        but the floor is.  Under a pinhole the place is given.
        """
        if isinstance(self.camera, Pinhole):
            return Likelihood(image, self.camera, self.scale * noise_mm, root=np.zeros(3))
        return Likelihood(image, self.camera, self.scale * noise_mm, unknown_place="across")


def camera_of(kind: CameraKind, *, view_angle_deg: float, distance_mm: float) -> Camera:
    """Return the known camera; the distance is that of a perspective one."""
    angle = float(np.radians(view_angle_deg))
    if kind is CameraKind.orthographic:
        return Camera(angle, 1.0)
    ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])  # along the dimension that the view misses
    target = np.array([0.0, 0.0, _CAMERA_HEIGHT_MM])
    pinhole = look_at(target - distance_mm * ahead, target, focal_px=_FOCAL_PX)
    return Camera(pinhole, _FOCAL_PX / distance_mm)


def observe(
    joints_mm: np.ndarray,
    camera: Camera,
    *,
    noise_mm: float,
    occluded: float,
    occlusion_frames: float,
    seed: tuple[int, ...],
) -> np.ndarray:
    """Return the image (T, 15, 2) of a performance, NaN where a joint is hidden.

    Parameters
    ----------
    joints_mm : (T, 15, 3)
    camera : Camera
    noise_mm : float
        Standard deviation of a coordinate at the actor.
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
    image = camera.project(joints_mm) + camera.scale * noise_mm * noise
    hides = np.random.default_rng([*seed, 1])
    image[occlusion(frames, joints, occluded, occlusion_frames, hides)] = np.nan
    return image
