"""Intersection of image rays with the sphere on which the end of a limb lies (park2011 sections 2 and 3.2).

Symbols
-------
``r``    length of the limb, mm
``chi``  relative direction vector: the joint less its parent, mm
``m``    point of the ray nearest the parent, relative to it (`middle`); ``v`` the ray's unit direction
``u``    half of the chord that the sphere cuts from the ray (`half_chord`): ``v sqrt(r^2 - |m|^2)``
``s``    +1 for the far candidate, -1 for the near one

The roots of [park2011 9], counted along a unit direction from the camera, are those of ``m`` plus and minus the half
chord.  With ``m`` from `pipeline.core.articulation.rays` nothing cancels, however far the camera stands.
"""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum, StrEnum

import numpy as np

from pipeline.core.articulation.rays import Rays, cast_rays
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_choice, require_range

Adjustment = StrEnum("Adjustment", ["per_frame", "global", "robust"])
Adjustment.__doc__ = """Treatment of a ray that misses the sphere of a limb."""

ROBUST_QUANTILE = 0.95
"""Fraction of the image rays that reach the sphere after a robust adjustment of its radius."""


class RayStatus(IntEnum):
    """Result of intersecting the image ray of one frame with the sphere of possible joint positions.

    TWO: two candidates in front of the camera.  TANGENT: one, as the ray touches the sphere, or misses it and the
    radius was adjusted in this frame.  FORCED: the near candidate is behind the camera, so it is the far one.
    BEHIND: both are, so the frame is dropped.  MISSING: image, camera or parent is not known.
    """

    TWO = 0
    TANGENT = 1
    FORCED = 2
    BEHIND = 3
    MISSING = 4


@shortened
class RayHits:
    """The two candidate positions of a joint in each frame, ``middle ± half_chord``, relative to its parent joint.

    Frames that are missing or dropped are NaN.

    Attributes
    ----------
    middle, half_chord : (F, 3) float64
        m and u, mm.
    status : (F,) int8
        A `RayStatus` for each frame.
    radius : float
        Of the sphere, after adjustment, mm; frames whose ray misses it have their own, |m|.
    adjusted : (F,) bool
        Where the ray misses the sphere of the radius that was given.
    rays : Rays
    """

    middle: np.ndarray
    half_chord: np.ndarray
    status: np.ndarray
    radius: float
    adjusted: np.ndarray
    rays: Rays

    @property
    def usable(self) -> np.ndarray:
        """Mask (F,) of the frames with a candidate position in front of the camera."""
        return self.status <= RayStatus.FORCED

    @property
    def far(self) -> np.ndarray:
        """Candidate positions (F, 3) farther from the camera, relative to the parent joint, mm."""
        return self.middle + self.half_chord

    @property
    def near(self) -> np.ndarray:
        """Candidate positions (F, 3) nearer to the camera, relative to the parent joint, mm.

        They are behind the camera in frames whose sign is forced.
        """
        return self.middle - self.half_chord

    def chosen(self, signs: np.ndarray) -> np.ndarray:
        """Return the candidate positions (F, 3) selected by signs (F,), relative to the parent, mm [park2011 10, 11].

        With b = (1 + s) / 2, the blocks of E are 2 u and those of F are m - u.

        Raises
        ------
        InvalidInput
            If there is not one sign, +1 or -1, to each frame.
        """
        signs = np.asarray(signs, float)
        if signs.shape != self.status.shape or not (np.abs(signs) == 1.0).all():
            raise InvalidInput(
                "must be +1 or -1 for each frame", "signs", received=signs.shape, code="not_signs"
            )
        return self.middle + signs[:, None] * self.half_chord

    def resolved(self) -> RayHits:
        """Replace both candidates by the far candidate in frames whose near candidate is behind the camera.

        Whatever signs are chosen, none of the candidates then lies behind its camera.
        """
        forced = (self.status == RayStatus.FORCED)[:, None]
        return replace(
            self,
            middle=np.where(forced, self.far, self.middle),
            half_chord=np.where(forced, 0.0, self.half_chord),
        )


def ray_sphere(
    cameras: np.ndarray,
    pixels: np.ndarray,
    parents: np.ndarray,
    radius: float,
    *,
    adjust: Adjustment = Adjustment.per_frame,
) -> RayHits:
    """Intersect the ray of each frame with a sphere about the parent joint [park2011 8, 9].

    The radius of the sphere is the length of the limb.

    Parameters
    ----------
    cameras : (F, 3, 4) or (3, 4)
        P of each frame, or of one camera that stands still; any scale, perspective or affine.
    pixels : (F, 2)
        NaN where the joint was not seen.
    parents : (F, 3)
        X_p, mm.
    radius : float
        r, mm; 0 is a joint that coincides with its parent.
    adjust : {"per_frame", "global", "robust"}
        What to do with a ray that misses the sphere.  Longer in that frame alone, best when r is known; as long
        as the farthest ray asks for, in all frames (the paper, section 5.1); as long as 95 % of rays ask for, then
        longer in a frame alone, for when r is a guess.

    Raises
    ------
    InvalidInput
        If the radius is no length, no ray meets the sphere in front of its camera, or `cast_rays` refuses.

    Examples
    --------
    >>> camera = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]])  # at the origin, looks along z
    >>> hits = ray_sphere(camera, np.zeros((1, 2)), np.array([[3.0, 0, 10]]), 5.0)
    >>> hits.far.tolist(), hits.near.tolist()
    ([[-3.0, 0.0, 4.0]], [[-3.0, 0.0, -4.0]])
    """
    return on_sphere(cast_rays(cameras, pixels, parents), radius, adjust=adjust)


def on_sphere(rays: Rays, radius: float, *, adjust: Adjustment = Adjustment.per_frame) -> RayHits:
    """Intersect precomputed rays with a sphere, as `ray_sphere` does, so that several radii can share the rays.

    Parameters
    ----------
    rays : Rays
    radius : float
        r, mm.
    adjust : {"per_frame", "global", "robust"}

    Raises
    ------
    InvalidInput
        If the radius is no length, or no ray meets the sphere in front of its camera.
    """
    require_range("radius", radius, at_least=0.0, unit="mm")
    distance = rays.distance
    finite = np.isfinite(distance)
    reachable = rays.ahead > -_half(radius, distance)  # False where NaN
    if not reachable.any():
        raise InvalidInput(
            "no image ray meets the sphere around the parent joint in front of the camera",
            expected="a frame with an image of the joint, a camera and a parent position",
            received=f"{(~finite).sum()} of {len(finite)} frames without data, {finite.sum()} with the joint behind",
            code="no_ray_hits",
            missing=(~finite).sum(),
            behind=finite.sum(),
        )
    used = _adjusted(distance[reachable], float(radius), adjust)
    half = _half(used, distance)
    status = np.full(len(finite), RayStatus.MISSING, np.int8)
    status[finite] = np.where(half[finite] > 0.0, RayStatus.TWO, RayStatus.TANGENT)
    status[rays.ahead <= half] = RayStatus.FORCED
    status[rays.ahead <= -half] = RayStatus.BEHIND
    dropped = (status == RayStatus.BEHIND)[:, None]
    return RayHits(
        middle=np.where(dropped, np.nan, rays.middle),
        half_chord=np.where(dropped, np.nan, half[:, None] * rays.direction),
        status=status,
        radius=used,
        adjusted=(distance > radius) & ~dropped[:, 0],
        rays=rays,
    )


def _half(radius: float, distance: np.ndarray) -> np.ndarray:
    """Return half the length (F,) of the chord that a sphere cuts from each ray; 0 for rays that miss the sphere.

    As (r - d)(r + d), not r^2 - d^2: nearly tangent rays carry the information.
    """
    return np.sqrt(np.maximum(radius - distance, 0.0) * (radius + distance))


def _adjusted(distance: np.ndarray, radius: float, adjust: Adjustment) -> float:
    require_choice("adjust", adjust, Adjustment)
    if adjust == "per_frame":
        return radius
    return max(radius, np.quantile(distance, 1.0 if adjust == "global" else ROBUST_QUANTILE))
