"""Likelihood of 3D joints given a 2D image of them under a known camera.

Symbols
-------
``r_j``    image of a joint less its observed place, over ``sigma_j``: two numbers
``sigma``  standard deviation of an observed coordinate: mm under an orthographic view, px under a pinhole

The errors of joints are independent and normal, log L = -1/2 sum |r_j|² + constants.  A joint that was not seen (NaN)
is left out.  ``sigma`` stands for all that parts the image from the posture: the detector's noise, and what the aSpace
and the lengths of the limbs leave out (15-65 mm a joint).

Where the actor stands.  Joints stand where `to_joints` puts them, shifted by `root`.  Under an orthographic view the
place need not be known: an unknown shift of the image, along its horizontal alone (`unknown_place="across"`: the
floor is known, so the height of the pelvis is seen) or along both axes (`"image"`), is integrated out.  With a flat
prior that means: residuals count from their own weighted mean.  It is what aligning on the image of the root joint
is for, without the root's noise in every joint and without the need to see the root.  Under a pinhole an image
shift is no shift of the body: there the root is given (`Pinhole.back_project` makes it from pixels and a depth).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pipeline.core import camera as orthographic
from pipeline.core.pinhole import Pinhole
from pipeline.core.tracking import kernels
from pipeline.validation import InvalidInput, require_choice, require_finite, require_range, require_shape

_FREE_AXES = {"none": 0, "across": 1, "image": 2}


@dataclass(frozen=True)
class Likelihood:
    """The image of J joints in T frames under a known camera, and its noise.

    Attributes
    ----------
    image : (T, J, 2)
        Horizontal and vertical, in the camera's unit; NaN where a joint was not seen.
    camera : float or Pinhole
        View angle in rad of an orthographic view (`pipeline.core.camera`), or a pinhole.
    noise : float or (J,)
        sigma.
    root : (3,) or (T, 3), optional
        Added to all joints, mm; a frame with a NaN is not seen.
    unknown_place : {"none", "across", "image"}
        Shift of an orthographic image that is integrated out.

    Raises
    ------
    InvalidInput
        Shapes, a noise that is not positive, an infinite coordinate, a camera that is neither, cameras for
        another number of frames, or an unknown place under a pinhole.
    """

    image: np.ndarray
    camera: float | Pinhole
    noise: float | np.ndarray
    root: np.ndarray | None = None
    unknown_place: str = "none"
    seen: np.ndarray = field(init=False, repr=False)
    """(T, J) bool: which joints take part."""

    def __post_init__(self) -> None:
        image = require_shape("observed joints", np.asarray(self.image, dtype=float), ("T", "J", 2))
        require_range("observed coordinates", image.size, at_least=1)
        if np.isinf(image).any():
            frame = int(np.isinf(image).any(axis=(1, 2)).argmax())
            raise InvalidInput(
                "an observed coordinate is infinite",
                where=f"frame {frame}",
                expected="a number, or NaN for a joint not seen",
            )
        noise = np.asarray(self.noise, dtype=float)
        require_shape("noise", noise, image.shape[1:2] if noise.ndim else ())
        require_range("noise", float(require_finite("noise", noise).min()), above=0)
        require_choice("unknown_place", self.unknown_place, tuple(_FREE_AXES))
        seen = np.isfinite(image).all(axis=-1) & _camera_known(self.camera, len(image), self.unknown_place)
        if self.root is not None:
            root = np.asarray(self.root, dtype=float)
            require_shape("root", root, (len(image), 3) if root.ndim > 1 else (3,))
            root = np.broadcast_to(root, (len(image), 3))
            seen &= np.isfinite(root).all(axis=-1)[:, None]
            object.__setattr__(self, "root", root)
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "noise", np.broadcast_to(noise, image.shape[1:2]))
        object.__setattr__(self, "seen", seen)

    @property
    def frames(self) -> int:
        """T."""
        return len(self.image)

    @property
    def joints(self) -> int:
        """J."""
        return self.image.shape[1]

    @cached_property
    def log_peak(self) -> np.ndarray:
        """Logarithm of the density of images that fit exactly (T,); 0 with no joint seen."""
        logarithm = np.where(self.seen, np.log(self.noise), 0.0)
        weights = np.where(self.seen, self.noise**-2.0, 0.0).sum(axis=1)
        count = self.seen.sum(axis=1)
        # Integrating a shift out gives back the width of the mean of the residuals.
        axes = _FREE_AXES[self.unknown_place]
        width = np.log(2.0 * np.pi) - np.log(np.where(count, weights, 1.0))
        peak = -count * np.log(2.0 * np.pi) - 2.0 * logarithm.sum(axis=1) + 0.5 * axes * width
        return np.where(count, peak, 0.0)

    def log_density(self, joints: np.ndarray, frame: int) -> np.ndarray:
        """Logarithm of the density (S,) of one frame's image, given S sets of joints (S, J, 3) in mm.

        Minus infinity where a joint that was seen has no image (it stands behind the camera).
        """
        seen, (matrices, centres) = self.seen[frame].nonzero()[0], self._cameras
        misfit = np.zeros(len(joints))
        if len(seen):
            kernels.image_misfit(
                np.asarray(joints, dtype=float),
                (matrices[frame], centres[frame], isinstance(self.camera, Pinhole)),
                seen,
                self.image[frame, seen],
                1.0 / np.asarray(self.noise)[seen],
                _FREE_AXES[self.unknown_place],
                misfit,
            )
        return self.log_peak[frame] - 0.5 * misfit

    @cached_property
    def _cameras(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrices (T, 3, 3) and centres (T, 3) of the camera, less the root: what a point is projected by."""
        if isinstance(self.camera, Pinhole):
            matrix, centre = self.camera.intrinsics @ self.camera.rotation, self.camera.centre
        else:
            matrix, centre = np.zeros((3, 3)), np.zeros(3)
            matrix[:2] = orthographic.project(np.eye(3), self.camera).T
        if self.root is not None:
            centre = centre - self.root
        return np.broadcast_to(matrix, (self.frames, 3, 3)), np.broadcast_to(centre, (self.frames, 3))


def _camera_known(camera: object, frames: int, unknown_place: str) -> np.ndarray:
    """Frames in which the camera is known, (T, 1) or (1, 1) bool; raises InvalidInput if it is no camera."""
    if isinstance(camera, Pinhole):
        if unknown_place != "none":
            raise InvalidInput(
                "a pinhole needs to know where the actor stands",
                expected="a root in mm and unknown_place='none'",
                received=unknown_place,
            )
        if camera.frames not in (None, frames):
            raise InvalidInput(
                "cameras and images disagree in their frames",
                expected=str(frames),
                received=str(camera.frames),
            )
        return np.atleast_1d(camera.known)[:, None]
    if isinstance(camera, bool) or not isinstance(camera, int | float | np.number) or not np.isfinite(camera):
        raise InvalidInput(
            "the camera is unknown",
            expected="a view angle in radians or a Pinhole",
            received=str(camera) if isinstance(camera, int | float | str) else type(camera).__name__,
        )
    return np.ones((1, 1), dtype=bool)
