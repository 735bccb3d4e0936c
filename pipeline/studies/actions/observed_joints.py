"""What a tracker is shown of a performance: joints in an image, with noise, some of them hidden for a while.

The camera is known: orthographic at a view angle, or a pinhole at a distance that looks the same way, so that both
images agree as the distance grows.  The detector's noise is given in millimetres at the actor for both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import camera as orthographic
from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.tracking import Likelihood
from pipeline.studies.options import TrackingSweep
from pipeline.validation import InvalidInput

CAMERAS = ("orthographic", "perspective")

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
        """Image (…, 2) of joints (…, 3), in image units."""
        if isinstance(self.camera, Pinhole):
            return self.camera.project(joints_mm)
        return orthographic.project(joints_mm, self.camera)

    def upright_mm(self, image: np.ndarray) -> np.ndarray:
        """An image (…, 2) in mm at the actor, to the right and up, to be shown."""
        if not isinstance(self.camera, Pinhole):
            return image
        return image / self.scale * [1.0, -1.0] + [0.0, _CAMERA_HEIGHT_MM]

    def likelihood(self, image: np.ndarray, noise_mm: np.ndarray) -> Likelihood:
        """How well joints explain an image (T, 15, 2), errors (15,) in mm at the actor.

        The orthographic image is known up to a shift along its horizontal, for the place of the actor is not known
        but the floor is.  Under a pinhole the place is given.
        """
        if isinstance(self.camera, Pinhole):
            return Likelihood(image, self.camera, self.scale * noise_mm, root=np.zeros(3))
        return Likelihood(image, self.camera, self.scale * noise_mm, unknown_place="across")


def camera_of(options: TrackingSweep) -> Camera:
    """The camera that the options name.

    Raises
    ------
    InvalidInput
        If it is unknown, or stands at no distance or angle.
    """
    if options.camera not in CAMERAS:
        raise InvalidInput(
            "the camera is unknown",
            where="sweep.camera",
            expected=" or ".join(CAMERAS),
            received=options.camera,
        )
    for name, value, good in (
        ("view_angle_deg", options.view_angle_deg, np.isfinite(options.view_angle_deg)),
        ("distance_mm", options.distance_mm, 0.0 < options.distance_mm < np.inf),
    ):
        if not good:
            raise InvalidInput(
                "a camera cannot stand there", where=f"sweep.{name}", expected="finite", received=f"{value:g}"
            )
    angle = float(np.radians(options.view_angle_deg))
    if options.camera == "orthographic":
        return Camera(angle, 1.0)
    ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])  # along the dimension that the view misses
    target = np.array([0.0, 0.0, _CAMERA_HEIGHT_MM])
    pinhole = look_at(target - options.distance_mm * ahead, target, focal_px=_FOCAL_PX)
    return Camera(pinhole, _FOCAL_PX / options.distance_mm)


def occlusion(
    frames: int, joints: int, share: float, mean_frames: float, generator: np.random.Generator
) -> np.ndarray:
    """Which joints are hidden, (T, J) bool: each by itself, in runs of frames.

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
    if not 0.0 <= share <= MOST_OCCLUDED:
        raise InvalidInput(
            "the share of hidden joints is none",
            where="sweep.occluded",
            expected=f"0 to {MOST_OCCLUDED:g}",
            received=f"{share:g}",
        )
    least = max(1.0, share / (1.0 - share))
    if not least <= mean_frames < np.inf:
        raise InvalidInput(
            "hidden runs are too short",
            where="sweep.occlusion_frames",
            expected=f"{least:g} frames or more",
            received=f"{mean_frames:g}",
        )
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
    """Image (T, 15, 2) of a performance, NaN where a joint is hidden.

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
