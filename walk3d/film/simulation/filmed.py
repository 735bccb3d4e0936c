"""Walks of a corpus before a simulated camera: who is filmed how, and what a detector makes of it."""

from __future__ import annotations

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import fourier, walking
from walk3d.anatomy.prior import stance_rows
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import HARMONICS, HEIGHT_MM, TrainingWalk, training_walk


def about_pelvis(walks: Walks, number: int) -> np.ndarray:
    """Positions (T, 15, 3) of one walk about the mean pelvis, mm."""
    return walking.set_origin(walks.motion(number), origin="pelvis_mean")


def training_walks(walks: Walks) -> list[TrainingWalk]:
    """Walks of a corpus as the model is trained on them."""
    motions = [about_pelvis(walks, k) for k in range(len(walks))]
    return [
        training_walk(motion, float(rate), walking.stature(motion))
        for motion, rate in zip(motions, walks.frame_rate_hz, strict=True)
    ]


def belt_speed_mm_s(walk: TrainingWalk) -> float:
    """Speed of the ground under a walker, by his own feet, in his own size."""
    _, belt = stance_rows(walk.walker)
    return float(2 * np.pi * walk.frequency_hz * (belt @ walk.walker.ravel()) * walk.height_mm / HEIGHT_MM)


def lasting(positions: np.ndarray, frame_rate_hz: float, strides: float) -> np.ndarray:
    """The first so many strides (T, J, 3) of a walk, continued where it was recorded for fewer.

    Its Fourier series goes on; what the series leaves is played back and forth.
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
    """Film one walk of a corpus: at most the middle `longest_s` seconds of it, or so many strides.

    Parameters
    ----------
    generator : numpy.random.Generator
    walks : Walks
    number : int
        Of the walk.
    error : DetectorError
    filming : Filming
    longest_s : float
    strides : float
        0: as many as were recorded.
    """
    positions, rate = about_pelvis(walks, number), float(walks.frame_rate_hz[number])
    if strides:
        return simulate_keypoints(generator, lasting(positions, rate, strides), rate, filming, error)
    spare = len(positions) - (round(longest_s * rate) + 1 if np.isfinite(longest_s) else len(positions))
    if spare > 0:
        positions = positions[spare // 2 : len(positions) - (spare - spare // 2)]
    return simulate_keypoints(generator, positions, rate, filming, error)
