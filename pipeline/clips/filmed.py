"""Walks of a corpus before a simulated camera: who is filmed how, and what a detector makes of it."""

from __future__ import annotations

import numpy as np

from pipeline.clips.walks import Walks
from pipeline.core import walking
from pipeline.core.anatomical import stance_rows
from pipeline.core.keypoint_walk import HEIGHT_MM, TrainingWalk, training_walk
from pipeline.synthetic.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints


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


def film(
    generator: np.random.Generator,
    walks: Walks,
    number: int,
    error: DetectorError,
    filming: Filming,
    longest_s: float = np.inf,
) -> SimulatedKeypoints:
    """Film one walk of a corpus, at most the middle `longest_s` seconds of it.

    Parameters
    ----------
    generator : numpy.random.Generator
    walks : Walks
    number : int
        Of the walk.
    error : DetectorError
    filming : Filming
    longest_s : float
    """
    positions, rate = about_pelvis(walks, number), float(walks.frame_rate_hz[number])
    spare = len(positions) - (round(longest_s * rate) + 1 if np.isfinite(longest_s) else len(positions))
    if spare > 0:
        positions = positions[spare // 2 : len(positions) - (spare - spare // 2)]
    return simulate_keypoints(generator, positions, rate, filming, error)
