"""Simulated films of the walks of a corpus."""

from __future__ import annotations

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import fourier, walking
from walk3d.anatomy.prior import stance_rows
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import HARMONICS, HEIGHT_MM, TrainingWalk, training_walk


def about_pelvis(walks: Walks, number: int) -> np.ndarray:
    """Return the positions (T, 15, 3), mm, of one walk, with the mean position of the pelvis as origin."""
    return walking.set_origin(walks.motion(number), origin="pelvis_mean")


def training_walks(walks: Walks) -> list[TrainingWalk]:
    """Return the walks of a corpus in the form that the model is trained on."""
    motions = [about_pelvis(walks, k) for k in range(len(walks))]
    return [
        training_walk(motion, float(rate), walking.stature(motion))
        for motion, rate in zip(motions, walks.frame_rate_hz, strict=True)
    ]


def belt_speed_mm_s(walk: TrainingWalk) -> float:
    """Return the speed, mm/s, of the ground relative to a walker's feet, for the walker's actual size."""
    _, belt = stance_rows(walk.walker)
    return float(2 * np.pi * walk.frequency_hz * (belt @ walk.walker.ravel()) * walk.height_mm / HEIGHT_MM)


def lasting(positions: np.ndarray, frame_rate_hz: float, strides: float) -> np.ndarray:
    """Return the given number of strides of a walk (T, J, 3); the walk is continued if the recording has fewer.

    The Fourier series continues; its residual is played back and forth.
    """
    series = fourier.represent(positions, frame_rate_hz, harmonics=HARMONICS)
    start = series.phase_rad / (2.0 * np.pi * series.frequency_hz)
    frames = np.arange(round(strides / series.frequency_hz * frame_rate_hz) + 1)

    def periodic(frame: np.ndarray) -> np.ndarray:
        return fourier.synthesise(series.coefficients, series.frequency_hz, start + frame / frame_rate_hz)

    rest = positions - periodic(np.arange(len(positions)))
    last = len(positions) - 1
    return periodic(frames) + rest[last - np.abs(last - frames % (2 * last))]


def film(
    generator: np.random.Generator,
    walks: Walks,
    number: int,
    error: DetectorError,
    filming: Filming,
    longest_s: float = np.inf,
    strides: float = 0.0,
) -> SimulatedKeypoints:
    """Simulate the film of one recorded walk.

    The film shows the middle `longest_s` seconds at most, or a given number of strides.

    Parameters
    ----------
    generator : numpy.random.Generator
    walks : Walks
    number : int
        Number of the walk.
    error : DetectorError
    filming : Filming
    longest_s : float
    strides : float
        Number of strides; 0: as recorded.
    """
    positions, rate = about_pelvis(walks, number), float(walks.frame_rate_hz[number])
    if strides:
        return simulate_keypoints(generator, lasting(positions, rate, strides), rate, filming, error)
    spare = len(positions) - (round(longest_s * rate) + 1 if np.isfinite(longest_s) else len(positions))
    if spare > 0:
        positions = positions[spare // 2 : len(positions) - (spare - spare // 2)]
    return simulate_keypoints(generator, positions, rate, filming, error)
