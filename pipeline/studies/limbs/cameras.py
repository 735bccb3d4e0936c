"""Paths of the camera in all trials, and the options that place the camera.

A new path needs a member of `Camera`, its colour, and a case in `CameraSweep.camera`.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import numpy as np

from pipeline.core import camera_paths
from pipeline.core.pinhole import Pinhole
from pipeline.studies.study import Sweep
from pipeline.validation import Distinct, Finite, bounded


class Camera(StrEnum):
    """Motion of the camera."""

    still = "still"
    """Camera with fixed position and direction."""
    moving = "moving"
    """Camera that circles at constant distance and speed, directed at the middle of the motion."""
    shaky = "shaky"
    """Moving camera with the shaking of a hand."""

    @property
    def words(self) -> str:
        """Name of the camera in captions and legends."""
        return f"{self} camera"

    @property
    def colour(self) -> str:
        """Colour of the lines that belong to the camera in pictures and recordings."""
        return {Camera.still: "orange", Camera.moving: "purple", Camera.shaky: "blue"}[self]


class CameraSweep(Sweep):
    """Options of the cameras in a sweep: kind of motion, distance, focal length and angle of movement."""

    draws_random_numbers = True

    cameras: Distinct[Camera] = [Camera.still, Camera.moving, Camera.shaky]  # cameras to compare
    distance_mm: Annotated[float, bounded(at_least=1)] = 4000.0  # distance of the camera
    focal_px: Annotated[float, bounded(at_least=1)] = 1000.0  # focal length
    around_deg: Finite = 60.0  # angle that a moving or shaky camera covers

    def camera(
        self,
        kind: Camera,
        root: np.ndarray,
        generator: np.random.Generator,
        *,
        azimuth_rad: float | None = None,
    ) -> Pinhole:
        """Return a camera that is directed at the mean position of a moving root.

        Parameters
        ----------
        kind : Camera
        root : (F, 3)
            Trajectory, mm.
        generator : numpy.random.Generator
            Generator of the side, the sense of rotation and the motion of the hand.
        azimuth_rad : float, optional
            Azimuth of the camera's middle position; random by default.
        """
        side = generator.uniform(-np.pi, np.pi) if azimuth_rad is None else azimuth_rad
        way = generator.choice([-1.0, 1.0])
        middle = np.nanmean(root, axis=0)
        camera = camera_paths.around(
            len(root),
            target=middle,
            sweep_rad=0.0 if kind is Camera.still else way * np.radians(self.around_deg),
            distance_mm=self.distance_mm,
            azimuth_rad=side,
            px_per_mm=self.focal_px / self.distance_mm,
        )
        if kind is Camera.shaky:
            return camera_paths.hand_held(generator, camera, target=middle)
        return camera

    def upright_mm(self, image: np.ndarray) -> np.ndarray:
        """Convert image points (…, 2) from px to mm at the camera's distance, with axes to the right and up."""
        return image * (self.distance_mm / self.focal_px) * [1.0, -1.0]
