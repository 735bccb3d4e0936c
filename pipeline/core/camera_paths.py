"""Camera paths: cameras that move around a target, or that are hand-held (park2011 sections 4 and 5).

All look at a target from a distance, upright.  The focal length grows with the distance (`px_per_mm`), so the target
keeps its size in the image and a far camera is the orthographic limit.  Azimuth 0 is a camera on +y, ahead of a person
who walks along +y; it grows towards their left (-x), counterclockwise as seen from above.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.pinhole import Pinhole, look_at
from pipeline.validation import InvalidInput, require_finite, require_range, require_shape

DISTANCE_MM, PX_PER_MM = 4000.0, 0.25
"""Distance, mm, and image scale, px/mm, of the default camera; its focal length is therefore 1000 px."""

SWAY_WAVES = 4
"""Number of slow sine waves in the sway of a hand-held camera; each has 0.5 to 2 periods in the clip."""


def around(
    frames: int,
    *,
    target: np.ndarray,
    sweep_rad: float,
    distance_mm: float = DISTANCE_MM,
    azimuth_rad: float = 0.0,
    height_mm: float = 0.0,
    px_per_mm: float = PX_PER_MM,
) -> Pinhole:
    """Return the path of a camera that moves around a target at constant height, distance and speed.

    Parameters
    ----------
    frames : int
    target : (3,) or (F, 3)
        World, mm; the path goes around the mean of a moving one, and the camera turns to follow.
    sweep_rad : float
        Angle from the first frame to the last: 2 pi is once around.
    distance_mm : float
        Horizontal, from the target.
    azimuth_rad : float
        In the middle of the path.
    height_mm : float
        Above the target.
    px_per_mm : float
        Size of the image at that distance: focal length over distance.

    Raises
    ------
    InvalidInput
        If there are no frames, a distance or size is not positive, or the target is none.
    """
    target = _target(frames, target)
    require_range("distance_mm", distance_mm, above=0.0)
    require_range("px_per_mm", px_per_mm, above=0.0)
    require_finite("angles and height", (azimuth_rad, sweep_rad, height_mm))
    angle = azimuth_rad + sweep_rad * (np.linspace(-0.5, 0.5, frames) if frames > 1 else np.zeros(1))
    offset = [-distance_mm * np.sin(angle), distance_mm * np.cos(angle), np.full(frames, float(height_mm))]
    return look_at(
        target.mean(axis=0) + np.stack(offset, axis=1),
        target,
        focal_px=px_per_mm * distance_mm,
    )


def hand_held(
    generator: np.random.Generator,
    camera: Pinhole,
    *,
    target: np.ndarray,
    sway_mm: float = 60.0,
    tremor_mm: float = 15.0,
) -> Pinhole:
    """Return the path of a camera as if it were hand-held: with slow sway and tremor, still directed at the target.

    Parameters
    ----------
    generator : numpy.random.Generator
    camera : Pinhole
        Of F frames, with one K.
    target : (3,) or (F, 3)
        What the hand keeps in the middle, world, mm.
    sway_mm : float
        Standard deviation of slow waves in each coordinate.
    tremor_mm : float
        Standard deviation of white noise in each coordinate: what a trajectory basis cannot span.

    Raises
    ------
    InvalidInput
        If the camera does not have frames of one K, an amplitude is negative, or the target is none.
    """
    if camera.frames is None or camera.intrinsics.ndim > 2 or camera.centre.ndim < 2:
        raise InvalidInput(
            "a hand-held camera path needs a centre for each frame, and one intrinsic matrix K for all frames",
            code="not_a_path",
        )
    require_range("sway_mm", sway_mm, at_least=0.0)
    require_range("tremor_mm", tremor_mm, at_least=0.0)
    frames = camera.frames
    target = _target(frames, target)
    waves = np.cos(np.pi * np.arange(1, SWAY_WAVES + 1) * (np.arange(frames)[:, None] + 0.5) / frames)
    slow = waves @ generator.standard_normal((SWAY_WAVES, 3)) * (sway_mm * np.sqrt(2.0 / SWAY_WAVES))
    centre = camera.centre + slow + tremor_mm * generator.standard_normal((frames, 3))
    shaken = look_at(centre, target, focal_px=1.0)
    return Pinhole(camera.intrinsics, shaken.rotation, centre)


def _target(frames: int, target: np.ndarray) -> np.ndarray:
    require_range("frames", frames, at_least=1)
    target = np.asarray(target, float)
    require_finite("target", require_shape("target", target, (frames, 3) if target.ndim > 1 else (3,)))
    return np.broadcast_to(target, (frames, 3))
