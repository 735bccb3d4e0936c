"""Likelihood of 3D joint positions, given their 2D image from a known view angle.

Symbols
-------
``r_j``    image of a joint less its observed place, over ``sigma_j``: two numbers
``sigma``  standard deviation of an observed coordinate, mm

The errors of joints are independent and normal, log L = -1/2 sum |r_j|² + constants.  A joint that was not seen (NaN)
is left out.  ``sigma`` stands for all that parts the image from the posture: the detector's noise, and what the aSpace
and the lengths of the limbs leave out (15-65 mm a joint).

Where the actor stands need not be known: an unknown shift of the image along its horizontal (the floor is known, so the
height of the pelvis is seen) is integrated out.  With a flat prior that means: horizontal residuals count from their
own weighted mean.  It is what aligning on the image of the root joint is for, without the root's noise in every joint
and without the need to see the root.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pipeline.core import camera
from pipeline.core.tracking import kernels
from pipeline.validation import require_range


@dataclass(frozen=True)
class Likelihood:
    """Observed 2D image of J joints in T frames from a known view angle, with its noise level.

    Attributes
    ----------
    image : (T, J, 2)
        Horizontal and vertical, mm; NaN where a joint was not seen.
    view_angle_rad : float
        Of an orthographic view (`pipeline.core.camera`).
    noise : float or (J,)
        sigma, mm.
    place_known : bool
        Whether the image may not be shifted along its horizontal.

    Raises
    ------
    InvalidInput
        A noise that is not positive.
    """

    image: np.ndarray
    view_angle_rad: float
    noise: float | np.ndarray
    place_known: bool = True
    visible: np.ndarray = field(init=False, repr=False)
    """Mask (T, J) of the visible joints, which contribute to the likelihood."""

    def __post_init__(self) -> None:
        require_range("noise", np.min(self.noise), above=0)
        object.__setattr__(self, "noise", np.broadcast_to(self.noise, self.image.shape[1:2]))
        object.__setattr__(self, "visible", np.isfinite(self.image).all(axis=-1))

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.image)

    @cached_property
    def log_peak(self) -> np.ndarray:
        """Log density (T,) of the image of a perfectly fitting posture; 0 in frames without a visible joint."""
        logarithm = np.where(self.visible, np.log(self.noise), 0.0)
        weights = np.where(self.visible, self.noise**-2.0, 0.0).sum(axis=1)
        count = self.visible.sum(axis=1)
        # Integrating a shift out gives back the width of the mean of the residuals.
        width = np.log(2.0 * np.pi) - np.log(np.where(count, weights, 1.0))
        peak = -count * np.log(2.0 * np.pi) - 2.0 * logarithm.sum(axis=1)
        return np.where(count, peak if self.place_known else peak + 0.5 * width, 0.0)

    def log_density(self, joints: np.ndarray, frame: int) -> np.ndarray:
        """Return the log density (S,) of one frame's image for each of S candidate sets of joint positions (S, J, 3),
        mm.

        Minus infinity where a joint that was seen has no place.
        """
        visible = self.visible[frame].nonzero()[0]
        misfit = np.zeros(len(joints))
        if len(visible):
            kernels.image_misfit(
                joints,
                self._matrix,
                visible,
                self.image[frame, visible],
                1.0 / np.asarray(self.noise)[visible],
                0 if self.place_known else 1,
                misfit,
            )
        return self.log_peak[frame] - 0.5 * misfit

    @cached_property
    def _matrix(self) -> np.ndarray:
        """Matrix (2, 3) that projects a 3D point to the image."""
        return np.ascontiguousarray(camera.project(np.eye(3), self.view_angle_rad).T)
