"""What a tracker is shown of a performance: joints in an image, with noise, some of them hidden for a while.

The camera is known: orthographic at a view angle, or a pinhole at a distance that looks the same way, so that both
images agree as the distance grows.  The detector's noise is given in millimetres at the actor for both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pipeline.core import camera as orthographic
from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.tracking.likelihood import Likelihood
from pipeline.validation import bounded, require_range


class CameraKind(StrEnum):
    """How the known camera projects."""

    orthographic = "orthographic"
    perspective = "perspective"


MOST_OCCLUDED = 0.9
"""Largest share of joints that may be hidden; a run of hidden frames must end before the next begins."""

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


Occluded = Annotated[float, bounded(at_least=0, at_most=MOST_OCCLUDED)]
"""Share of frames in which a joint is hidden."""


def require_occlusion(shares: Sequence[float], mean_frames: float) -> None:
    """Validate ``sweep.occluded`` and ``sweep.occlusion_frames``.

    Raises
    ------
    InvalidInput
        Runs too short for a share.
    """
    for share in shares:
        least = max(1.0, share / (1.0 - share))
        require_range("sweep.occlusion_frames", mean_frames, at_least=least, unit="frames")


def occlusion(
    frames: int, joints: int, share: float, mean_frames: float, generator: np.random.Generator
) -> np.ndarray:
    """Return which joints are hidden, (T, J) bool: each by itself, in runs of frames.

    Parameters
    ----------
    frames, joints : int
    share : float
        Expected part of all joints in all frames.
    mean_frames : float
        Expected length of a run.
    generator : numpy.random.Generator

    Raises
    ------
    InvalidInput
        A share below 0 or above 0.9, or runs too short for it.

    Notes
    -----
    Joints go and come back with constant probabilities, and begin as they go on.
    """
    require_occlusion([share], mean_frames)
    chance = generator.random((frames, joints))
    hidden = np.empty((frames, joints), dtype=bool)
    hidden[0] = chance[0] < share
    goes, stays = share / (mean_frames * (1.0 - share)), 1.0 - 1.0 / mean_frames
    for t in range(1, frames):
        hidden[t] = chance[t] < np.where(hidden[t - 1], stays, goes)
    return hidden


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
