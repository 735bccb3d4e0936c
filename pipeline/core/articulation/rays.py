"""Rays through the image of a joint, relative to the parent joint (park2011 section 3.2).

Symbols
-------
``P``    3 x 4 camera of a frame, ``[M | p4]``; ``m1, m2, m3`` are the rows of ``M``
``x``    pixel of the joint; ``X_p`` its parent's position, mm
``chi``  relative direction vector: the joint less its parent, mm
``v``    unit direction of the ray, away from the camera
``m``    point of the ray nearest the parent, relative to it, so ``m . v = 0``

Why not as printed
------------------
[park2011 8] begins at the camera's centre, and so [park2011 9] subtracts squares of distances to it, where little
but rounding is left when the camera is far.  A point ``X_p + chi`` has the image ``x`` when

    (M_12 - x m3) chi = q3 x - q_12,    q = P (X_p, 1)

two equations in three unknowns whose solution of least norm is ``m`` and whose null vector is ``v``.  They are of the
size of the limb however far the camera stands, ask for no centre and no inverse, and hold for parallel rays
(orthographic and affine cameras, last row 0 0 0 1) as they stand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.validation import InvalidInput, require_range, require_shape

_NO_CENTRE = 1e-12
"""Sine of the angle between viewing direction and image plane below which a camera matrix counts as degenerate."""

_AT_JOINT_MM = 1e-3
"""Distance between camera centre and parent joint, mm, below which rays do not constrain the limb."""


@dataclass(frozen=True)
class Rays:
    """Rays through the images of a joint in F frames, relative to its parent joint; NaN where an input is missing.

    Attributes
    ----------
    middle : (F, 3) float64
        m, the point nearest the parent, relative to it, mm.
    direction : (F, 3) float64
        v, unit, away from the camera.
    ahead : (F,) float64
        How far m lies ahead of the camera, mm: negative behind it, infinite for parallel rays.
    """

    middle: np.ndarray
    direction: np.ndarray
    ahead: np.ndarray

    @property
    def distance(self) -> np.ndarray:
        """Distance (F,) between ray and parent joint, mm, which is the smallest possible limb length in each frame."""
        return np.linalg.norm(self.middle, axis=-1)

    @property
    def axis(self) -> np.ndarray:
        """Unit direction (F, 3) from camera to parent joint, or the common ray direction of a parallel projection."""
        parallel = np.isinf(self.ahead)[:, None]
        towards = np.where(parallel, 1.0, self.ahead[:, None]) * self.direction
        towards = np.where(parallel, towards, towards - self.middle)
        return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


def cast_rays(cameras: np.ndarray, pixels: np.ndarray, parents: np.ndarray) -> Rays:
    """Return the rays through the pixels of a joint, relative to its parent joint [park2011 8].

    Parameters
    ----------
    cameras : (F, 3, 4) or (3, 4)
        P of each frame, or of one camera that stands still; any scale, perspective or affine.
    pixels : (F, 2)
        NaN where the joint was not seen.
    parents : (F, 3)
        X_p, mm.

    Raises
    ------
    InvalidInput
        If shapes do not fit, there is no frame, or a camera is neither perspective nor affine or stands at the
        parent joint.
    """
    cameras, pixels, parents = _by_frame(cameras, pixels, parents)
    finite = np.isfinite(np.column_stack([cameras.reshape(-1, 12), pixels, parents])).all(axis=1)
    frames = np.flatnonzero(finite)
    M, p4, x = cameras[finite, :, :3], cameras[finite, :, 3], pixels[finite]
    parallel = np.asarray(~M[:, 2].any(axis=1))
    det = _determinant(M, p4, parallel, frames)
    q = (M @ parents[finite, :, None])[..., 0] + p4
    left = M[:, :2] - x[:, :, None] * M[:, 2:]
    right = q[:, 2:] * x - q[:, :2]
    # det M times M^-1 (x, 1): away from the camera whatever P's sign.
    along = _cross(left[:, 0], left[:, 1])
    size = np.linalg.norm(along, axis=1)
    v = along / size[:, None]
    m = (right[:, :1] * _cross(left[:, 1], v) + right[:, 1:] * _cross(v, left[:, 0])) / size[:, None]
    depth = (M[:, 2] * m).sum(axis=1) + q[:, 2]
    ahead = np.where(parallel, np.inf, depth * size / np.where(parallel, 1.0, det))
    at_joint = np.hypot(np.linalg.norm(m, axis=1), ahead) < _AT_JOINT_MM
    if at_joint.any():
        raise InvalidInput(
            "the camera centre coincides with the parent joint",
            f"frame {frames[at_joint.argmax()]}",
            code="camera_at_parent",
        )
    rays = Rays(*(np.full((len(finite), *shape), np.nan) for shape in ((3,), (3,), ())))
    rays.middle[finite], rays.direction[finite], rays.ahead[finite] = m, v, ahead
    return rays


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross products (n, 3) of short arrays of vectors, several times faster than NumPy's `cross`."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _by_frame(cameras: np.ndarray, pixels: np.ndarray, parents: np.ndarray) -> tuple[np.ndarray, ...]:
    cameras, pixels, parents = (np.asarray(a, float) for a in (cameras, pixels, parents))
    frames = len(require_shape("pixels", pixels, ("F", 2)))
    require_range("frames", frames, at_least=1)
    if cameras.shape == (3, 4):
        cameras = np.broadcast_to(cameras, (frames, 3, 4))
    require_shape("cameras", cameras, (frames, 3, 4))
    return cameras, pixels, require_shape("parents", parents, (frames, 3))


def _determinant(M: np.ndarray, p4: np.ndarray, parallel: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return the determinants (n,) of the left 3 x 3 blocks of camera matrices, after checking that they are valid."""
    across = _cross(M[:, 0], M[:, 1])
    det = (across * M[:, 2]).sum(axis=1)
    sizes = np.linalg.norm(M, axis=2)
    flat = np.linalg.norm(across, axis=1) <= _NO_CENTRE * sizes[:, 0] * sizes[:, 1]
    wrong = np.where(parallel, flat | (p4[:, 2] == 0.0), np.abs(det) <= _NO_CENTRE * sizes.prod(axis=1))
    if wrong.any():
        raise InvalidInput(
            "the camera is neither perspective nor affine",
            f"frame {frames[wrong.argmax()]}",
            "a 3 x 4 matrix whose left part can be inverted, or whose last row is 0 0 0 1",
            code="invalid_camera",
        )
    return det
