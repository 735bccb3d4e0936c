"""The camera paths of all trials, and the options that place a camera.

A further path is a member of `Camera`, its colour, and what `CameraSweep.camera` does for it.
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
    """How the camera moves."""

    still = "still"
    """Fixed in place and direction."""
    moving = "moving"
    """Walking around at constant distance and speed, turned to the middle of the motion."""
    shaky = "shaky"
    """The same in somebody's hand."""

    @property
    def words(self) -> str:
        """Name for captions and legends."""
        return f"{self} camera"

    @property
    def colour(self) -> str:
        """Colour of its lines in pictures and recordings."""
        return {Camera.still: "orange", Camera.moving: "purple", Camera.shaky: "blue"}[self]


class CameraSweep(Sweep):
    """A sweep over motion that is seen by perspective cameras."""

    draws_random_numbers = True

    cameras: Distinct[Camera] = [Camera.still, Camera.moving, Camera.shaky]  # that are compared
    distance_mm: Annotated[float, bounded(at_least=1)] = 4000.0  # of the camera
    focal_px: Annotated[float, bounded(at_least=1)] = 1000.0  # focal length
    around_deg: Finite = 60.0  # how far a moving or shaky camera walks around

    def camera(
        self,
        kind: Camera,
        root: np.ndarray,
        generator: np.random.Generator,
        *,
        azimuth_rad: float | None = None,
    ) -> Pinhole:
        """Return a camera that looks at the mean place of a moving root from one side.

        Parameters
        ----------
        kind : Camera
        root : (F, 3)
            Trajectory, mm.
        generator : numpy.random.Generator
            For the side, the way round and the hand.
        azimuth_rad : float, optional
            Of its middle position; drawn if not given.
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
        """Return an image (…, 2), px, to the right and up in mm at the camera's distance."""
        return image * (self.distance_mm / self.focal_px) * [1.0, -1.0]
