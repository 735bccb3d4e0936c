"""Simulated keypoints of a recorded walk: perspective projection and the errors of detectors.

The walk is placed in front of a pinhole camera, on a straight path overground or on a treadmill, and its joints are
projected.  Each error is an option: a fixed bias of every joint (a detector's hip is not the joint centre), white
error, slow error (AR(1)), missing keypoints, and short times with left and right exchanged.  The ground truth is
the posture in every frame, so any method can be tested.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.shortened import shortened
from pipeline.skeleton import ANKLES, PELVIS, WALKER15
from pipeline.validation import require_range, require_shape
from walk3d.film.walk.exchanged import LIMBS, exchange
from walk3d.film.walk.view import level_axes, pitched, project


@dataclass(frozen=True, kw_only=True)
class DetectorError:
    """Errors of a simulated detector.

    Attributes
    ----------
    white_px, slow_px : float
        Standard deviation per image axis of independent error, and of autocorrelated error.
    slow_s : float
        Time in which the slow error decorrelates by a factor of e.
    bias_mm : float
        Standard deviation per axis of each joint's fixed offset, in the walker's frame.
    missing : float
        Share of keypoints that are missing.
    swaps_per_s : float
        Rate at which labels become exchanged, per second, for legs and for arms.
    swap_s : tuple of float
        Shortest and longest time of exchanged labels.
    shake_px, shake_s : float
        Standard deviation per image axis of the camera's shake, common to all keypoints of a frame; time in which it
        decorrelates.
    """

    white_px: float = 3.0
    slow_px: float = 4.0
    slow_s: float = 0.3
    bias_mm: float = 10.0
    missing: float = 0.05
    swaps_per_s: float = 0.15
    swap_s: tuple[float, float] = (0.1, 0.4)
    shake_px: float = 0.0
    shake_s: float = 0.2


@dataclass(frozen=True, kw_only=True)
class Filming:
    """Camera, and path of the walker in front of the camera.

    Attributes
    ----------
    heading_rad : float
        Heading: 0 towards the camera, +90° to the image's right.
    speed_mm_s : float
        Speed of the straight path along the heading; 0 on a treadmill.
    drift_mm_s : float
        Standard deviation of the drift on a treadmill, per horizontal axis.
    distance_mm, height_mm : tuple of float
        Ranges of the camera's distance and height.
    nearest_mm : float
        Smallest distance of the walker; the camera is moved away if necessary.
    aim_sd_rad : float
        Standard deviation of the pitch about aiming at the pelvis.
    person_px : float
        Height of the walker in the image, on average.
    frame_rate_hz : float
    """

    heading_rad: float
    speed_mm_s: float = 0.0
    drift_mm_s: float = 40.0
    distance_mm: tuple[float, float] = (3000.0, 6000.0)
    height_mm: tuple[float, float] = (800.0, 1600.0)
    nearest_mm: float = 2300.0
    aim_sd_rad: float = float(np.radians(2.5))
    person_px: float = 600.0
    frame_rate_hz: float = 30.0


@shortened
class SimulatedKeypoints:
    """Simulated keypoints with their ground truth.

    Attributes
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point, NaN where missing.
    exchanged : dict of str to (T,) bool
        Frames in which legs and arms were exchanged.
    positions_mm : (T, 15, 3)
        Ground truth, relative to the pelvis, in level camera axes (right, down, away).
    heading_rad, focal_px, frame_rate_hz : float
    """

    pixels: np.ndarray
    exchanged: dict[str, np.ndarray]
    positions_mm: np.ndarray
    heading_rad: float
    focal_px: float
    frame_rate_hz: float


def slow_error(generator: np.random.Generator, shape: tuple[int, ...], sd: float, decay: float) -> np.ndarray:
    """Draw autocorrelated Gaussian errors (T, …), each `decay` times the previous error plus independent noise."""
    fresh = generator.normal(size=shape)
    errors = np.empty(shape)
    errors[0] = fresh[0]
    for t in range(1, len(errors)):
        errors[t] = decay * errors[t - 1] + np.sqrt(1.0 - decay**2) * fresh[t]
    return sd * errors


def swap_times(
    generator: np.random.Generator, frames: int, frame_rate_hz: float, error: DetectorError
) -> np.ndarray:
    """Draw a mask (T,) of the frames in which left and right labels are exchanged."""
    swapped = np.zeros(frames, bool)
    starts = np.flatnonzero(generator.random(frames) < error.swaps_per_s / frame_rate_hz)
    for start in starts:
        length = generator.uniform(*error.swap_s) * frame_rate_hz
        swapped[start : start + max(round(length), 1)] = True
    return swapped


def resample(positions: np.ndarray, frame_rate_hz: float, wanted_hz: float) -> np.ndarray:
    """Return positions (T, J, 3) resampled to another frame rate by linear interpolation."""
    times = np.arange(0.0, (len(positions) - 1) / frame_rate_hz + 1e-9, 1.0 / wanted_hz) * frame_rate_hz
    before = np.minimum(times.astype(int), len(positions) - 2)
    share = (times - before)[:, None, None]
    return (1.0 - share) * positions[before] + share * positions[before + 1]


def simulate_keypoints(
    generator: np.random.Generator,
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    filming: Filming,
    error: DetectorError,
) -> SimulatedKeypoints:
    """Simulate the film of a walk and the keypoints that a detector returns.

    Parameters
    ----------
    generator : numpy.random.Generator
    positions_mm : (T, 15, 3)
        Treadmill equivalent of a walk about the mean pelvis, mm, z up, along +y.
    frame_rate_hz : float
        Frame rate of the positions.
    filming : Filming
    error : DetectorError
    """
    require_shape("positions", positions_mm, ("T", len(WALKER15.joints), 3))
    require_range("the frame rate", frame_rate_hz, above=0, unit="Hz")
    motion = resample(positions_mm, frame_rate_hz, filming.frame_rate_hz)
    T = len(motion)
    times = (np.arange(T) - (T - 1) / 2.0) / filming.frame_rate_hz
    ground = np.percentile(motion[:, ANKLES, 2], 2)
    stature = motion[:, 0, 2].mean() - ground
    A = level_axes(filming.heading_rad)
    drawn = motion + generator.normal(0.0, error.bias_mm, size=(1, *motion.shape[1:]))
    path = np.zeros((T, 3))
    if filming.speed_mm_s > 0:
        path += np.outer(times * filming.speed_mm_s, A[:, 1])
    else:
        drift = generator.normal(0.0, filming.drift_mm_s, size=2)
        path[:, 0], path[:, 2] = times * drift[0], times * drift[1]
    distance = generator.uniform(*filming.distance_mm)
    distance = max(distance, filming.nearest_mm - path[:, 2].min())
    height = generator.uniform(*filming.height_mm)
    # The camera is `height` above the ground: the pelvis (the origin) is lower than it by the difference.
    below = height + ground
    pitch = np.arctan2(below, distance) + generator.normal(0.0, filming.aim_sd_rad)
    focal = filming.person_px * distance / stature
    level = drawn @ A.T + path[:, None] + np.array([0.0, below, distance])
    pixels = project(level @ pitched(pitch).T, focal)
    decay = np.exp(-1.0 / (error.slow_s * filming.frame_rate_hz))
    pixels = pixels + slow_error(generator, pixels.shape, error.slow_px, decay)
    pixels += generator.normal(0.0, error.white_px, size=pixels.shape)
    swapped = {limb: swap_times(generator, T, filming.frame_rate_hz, error) for limb in LIMBS}
    pixels = exchange(pixels, swapped)
    pixels[generator.random(pixels.shape[:2]) < error.missing] = np.nan
    if error.shake_px:
        decay = np.exp(-1.0 / (error.shake_s * filming.frame_rate_hz))
        pixels = pixels + slow_error(generator, (T, 1, 2), error.shake_px, decay)
    return SimulatedKeypoints(
        pixels=pixels,
        exchanged=swapped,
        positions_mm=(motion - motion[:, PELVIS : PELVIS + 1]) @ A.T,
        heading_rad=filming.heading_rad,
        focal_px=focal,
        frame_rate_hz=filming.frame_rate_hz,
    )
