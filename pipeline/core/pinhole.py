"""Perspective camera (park2011 section 2), also used as the known camera of the tracker (mozerov2006 section 1).

Symbols
-------
``K``  intrinsics, px: upper triangular, focal lengths on the diagonal, principal point in the last column
``R``  rotation, world to camera: camera x to the right of the image, y down, z away from the camera
``C``  centre of the camera in the world, mm
``P``  ``K R [I | -C]``, 3 x 4: a homogeneous world point to a homogeneous image point

What stands behind the camera has no image: its pixels are NaN, never the mirrored ones that the division gives.
"""

from __future__ import annotations

import numpy as np

from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_shape

_ROUNDING = 1e-6
"""Tolerance for the entries of R R^T - I; files often contain rotation matrices with only seven digits."""


@shortened
class Pinhole:
    """Perspective camera, fixed or different in each of F frames; NaN marks frames without a known camera.

    Attributes
    ----------
    intrinsics : (3, 3) or (F, 3, 3)
        K, px.
    rotation : (3, 3) or (F, 3, 3)
        R, world to camera.
    centre : (3,) or (F, 3)
        C, mm.

    Raises
    ------
    InvalidInput
        If a shape is wrong, frames disagree, K is not that of a camera, or R is not a rotation.

    Examples
    --------
    >>> camera = Pinhole(np.diag([1000.0, 1000.0, 1.0]), np.eye(3), np.array([0.0, 0.0, -2000.0]))
    >>> camera.project(np.array([[100.0, 50.0, 0.0], [0.0, 0.0, -3000.0]]))
    array([[50., 25.],
           [nan, nan]])
    """

    intrinsics: np.ndarray
    rotation: np.ndarray
    centre: np.ndarray

    def __post_init__(self) -> None:
        frames = set()
        for name, shape in (("intrinsics", (3, 3)), ("rotation", (3, 3)), ("centre", (3,))):
            # A copy that cannot be written to: the camera stays the one that was checked.
            value = np.array(getattr(self, name), float)
            if value.shape[-len(shape) :] != shape or value.ndim > len(shape) + 1:
                words = ", ".join(map(str, shape))
                raise InvalidInput(
                    f"the array {name!r} of a camera has the wrong shape",
                    expected=f"({words}{',' * (len(shape) == 1)}) or (F, {words})",
                    received=value.shape,
                    code="wrong_shape",
                    array=name,
                    shape=value.shape,
                )
            if value.ndim > len(shape):
                frames.add(len(value))
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        if len(frames) > 1:
            raise InvalidInput(
                "the arrays of a camera have different numbers of frames",
                expected="equal numbers of frames",
                received=" and ".join(map(str, sorted(frames))),
                code="frames_disagree",
                frames=sorted(frames),
            )
        _check_intrinsics(self.intrinsics)
        _check_rotation(self.rotation)

    @property
    def frames(self) -> int | None:
        """Number of frames F, or None if the camera is the same in all frames."""
        per_frame = [
            len(value)
            for value, dimensions in ((self.intrinsics, 2), (self.rotation, 2), (self.centre, 1))
            if value.ndim > dimensions
        ]
        return per_frame[0] if per_frame else None

    @property
    def known(self) -> np.ndarray:
        """Mask (F,) of frames with a known camera; shape () if the camera is the same in all frames."""
        return (
            np.isfinite(self.intrinsics).all(axis=(-2, -1))
            & np.isfinite(self.rotation).all(axis=(-2, -1))
            & np.isfinite(self.centre).all(axis=-1)
        )

    @property
    def matrix(self) -> np.ndarray:
        """Camera matrix P = K R [I | -C], (3, 4) or (F, 3, 4)."""
        turned = self.intrinsics @ self.rotation
        centre = np.broadcast_to(self.centre, (*turned.shape[:-2], 3)) if turned.ndim > 2 else self.centre
        moved = -(turned @ centre[..., None])
        return np.concatenate([np.broadcast_to(turned, (*moved.shape[:-1], 3)), moved], axis=-1)

    def at(self, frame: int) -> Pinhole:
        """Return the camera in one frame."""
        if self.frames is None:
            return self
        return Pinhole(
            self.intrinsics[frame] if self.intrinsics.ndim > 2 else self.intrinsics,
            self.rotation[frame] if self.rotation.ndim > 2 else self.rotation,
            self.centre[frame] if self.centre.ndim > 1 else self.centre,
        )

    def in_camera(self, points: np.ndarray) -> np.ndarray:
        """Return the camera coordinates (…, 3) of world points (…, 3), mm; the last coordinate is the depth.

        Cameras of F frames take points (F, …, 3).

        Raises
        ------
        InvalidInput
            If the points have no three coordinates or another number of frames than the cameras.
        """
        points, flat = self._by_frame(points, 3)
        relative = flat - self.centre[..., None, :]
        return (relative @ np.swapaxes(self.rotation, -1, -2)).reshape(points.shape)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Project world points (…, 3) to pixels (…, 2) [park2011 7].

        Points that are not in front of the camera give NaN.

        Cameras of F frames take points (F, …, 3).
        """
        points, flat = self._by_frame(points, 3)
        turned = self.intrinsics @ self.rotation
        homogeneous = (flat - self.centre[..., None, :]) @ np.swapaxes(turned, -1, -2)
        depth = homogeneous[..., 2:]
        pixels = homogeneous[..., :2] / np.where(depth > 0, depth, np.nan)
        return pixels.reshape(*points.shape[:-1], 2)

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return the directions (…, 3), in world coordinates, of the rays through pixels (…, 2).

        A direction d has a depth of one: the point C + s d is at depth s.

        Cameras of F frames take pixels (F, …, 2).
        """
        pixels, flat = self._by_frame(pixels, 2)
        homogeneous = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
        inverse = np.linalg.inv(self.intrinsics)  # triangular, three by three
        directions = homogeneous @ np.swapaxes(inverse, -1, -2) @ self.rotation
        return directions.reshape(*pixels.shape[:-1], 3)

    def back_project(self, pixels: np.ndarray, depth: float | np.ndarray) -> np.ndarray:
        """Return the world points (…, 3) that project to pixels (…, 2) and have a given depth (…), mm."""
        rays = self.rays(pixels)
        ahead = np.asarray(depth, float)
        between = rays.ndim - self.centre.ndim
        centre = self.centre.reshape(*self.centre.shape[:-1], *([1] * between), 3)
        return centre + rays * (ahead[..., None] if ahead.ndim else ahead)

    def _by_frame(self, values: np.ndarray, last: int) -> tuple[np.ndarray, np.ndarray]:
        """Return `values` as floats twice: in their original shape, and flattened to a list of vectors.

        The flat shape is (n, last), or (F, n, last) for cameras of F frames.
        """
        values = np.asarray(values, float)
        frames = self.frames
        if values.ndim < 1 + (frames is not None) or values.shape[-1] != last:
            shape = f"(…, {last})" if frames is None else f"({frames}, …, {last})"
            raise InvalidInput(
                "the array of points for a camera has the wrong shape",
                expected=shape,
                received=values.shape,
                code="wrong_shape",
                shape=values.shape,
            )
        if frames is None:
            return values, values.reshape(-1, last)
        if len(values) != frames:
            raise InvalidInput(
                "points and cameras have different numbers of frames",
                expected=frames,
                received=len(values),
                code="frames_disagree",
                frames=len(values),
            )
        return values, values.reshape(frames, -1, last)


def project_by_matrix(cameras: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Project points (F, …, 3) to pixels (F, …, 2) with camera matrices, perspective or affine [park2011 7].

    The matrices may have any scale.

    Parameters
    ----------
    cameras : (F, 3, 4) or (3, 4)
        P; the last row 0 0 0 1 makes parallel rays, which have no centre and so are no `Pinhole`.
    points : (F, …, 3)
        World, mm.

    Raises
    ------
    InvalidInput
        If the shapes do not fit.
    """
    cameras, points = np.asarray(cameras, float), np.asarray(points, float)
    require_shape("points", points, (*points.shape[:-1], 3))
    require_shape("cameras", cameras, (len(points), 3, 4) if cameras.ndim > 2 else (3, 4))
    flat = points.reshape(len(points), -1, 3)
    image = flat @ np.swapaxes(cameras[..., :3], -1, -2) + cameras[..., None, :, 3]
    depth = image[..., 2:]
    # det M < 0 is the same camera written with the other sign; parallel rays have no front and back.
    det = np.linalg.det(cameras[..., :3])[..., None, None]
    in_front = np.where(det == 0.0, depth != 0.0, depth * det > 0.0)
    return (image[..., :2] / np.where(in_front, depth, np.nan)).reshape(*points.shape[:-1], 2)


def look_at(
    centre: np.ndarray,
    target: np.ndarray,
    *,
    focal_px: float,
) -> Pinhole:
    """Return an upright camera at a given position that is directed at a target.

    The target is at pixel (0, 0).

    Parameters
    ----------
    centre, target : (3,) or (F, 3)
        mm.
    focal_px : float

    Raises
    ------
    InvalidInput
        If centre and target coincide, or the camera looks along the vertical.
    """
    centre, target = np.asarray(centre, float), np.asarray(target, float)
    ahead = target - centre
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    distance, across = np.linalg.norm(ahead, axis=-1), np.linalg.norm(right, axis=-1)
    if (across <= 1e-9 * np.maximum(distance, 1e-300)).any():
        raise InvalidInput(
            "the camera is vertically above or below its target, or in the same place",
            expected="a target with a horizontal distance from the camera",
            code="along_vertical",
        )
    ahead = ahead / distance[..., None]
    right = right / across[..., None]
    return Pinhole(
        np.diag([focal_px, focal_px, 1.0]), np.stack([right, np.cross(ahead, right), ahead], axis=-2), centre
    )


def _check_intrinsics(intrinsics: np.ndarray) -> None:
    matrices = (
        intrinsics[np.isfinite(intrinsics).all(axis=(-2, -1))] if intrinsics.ndim > 2 else intrinsics[None]
    )
    focal = matrices[:, [0, 1], [0, 1]]
    if not (focal > 0).all():
        raise InvalidInput(
            "a focal length is not positive",
            expected="px > 0",
            received=f"{focal.min():g}",
            code="out_of_range",
            value=focal.min(),
        )
    if matrices[:, [1, 2, 2], [0, 0, 1]].any() or (matrices[:, 2, 2] != 1).any():
        raise InvalidInput(
            "the camera's intrinsic matrix is invalid",
            expected="zeros below the diagonal and a last row of 0, 0, 1",
            code="invalid_intrinsics",
        )


def _check_rotation(rotation: np.ndarray) -> None:
    finite = rotation[np.isfinite(rotation).all(axis=(-2, -1))] if rotation.ndim > 2 else rotation[None]
    off = np.abs(finite @ np.swapaxes(finite, -1, -2) - np.eye(3)).max(initial=0.0)
    if not off <= _ROUNDING:
        raise InvalidInput(
            "the rotation matrix of a camera is not orthogonal",
            expected="R R^T = I",
            received=f"a deviation of {off:.3g}",
            code="not_rotation",
        )
    if (np.linalg.det(finite) < 0).any():
        raise InvalidInput(
            "the rotation of a camera is a reflection",
            expected="a determinant of +1",
            received="-1",
            code="reflection",
        )
