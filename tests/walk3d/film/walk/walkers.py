"""Population of 14 synthetic walkers, and simulated clips of a walker who is not in the model."""

from __future__ import annotations

import functools

import numpy as np

from pipeline.core import walking
from pipeline.synthetic import walkers
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import Detector, Prior, TrainingWalk, prepare, train, training_walk

RATE = 60.0
CLEAN = DetectorError(white_px=0.5, slow_px=0.0, bias_mm=0.0, missing=0.0, swaps_per_s=0.0)


@functools.cache
def motions() -> tuple[np.ndarray, ...]:
    """Return the positions of 14 synthetic walkers on a treadmill, relative to the mean pelvis."""
    people = walkers.walking_population(
        np.random.default_rng(3), male=7, female=7, duration_s=2.8, frame_rate_hz=RATE, marker_noise_mm=0.5
    )
    level = (walking.treadmill_equivalent(p, RATE, locomotion="treadmill") for p in people.positions_mm)
    return tuple(walking.set_origin(positions, origin="pelvis_mean") for positions in level)


@functools.cache
def walks() -> tuple[TrainingWalk, ...]:
    """Return the synthetic walkers as training walks of the model."""
    return tuple(training_walk(motion, RATE, walking.stature(motion)) for motion in motions())


@functools.cache
def prior() -> Prior:
    """Return the prior that is learnt from all synthetic walkers except the first."""
    return prepare(train(list(walks()[1:]), np.arange(len(walks()) - 1)), Detector())


def clip(
    heading_deg: float,
    error: DetectorError = CLEAN,
    seed: int = 0,
    speed: float = 1200.0,
    frame_rate_hz: float = 30.0,
) -> SimulatedKeypoints:
    """Return a simulated clip of the first synthetic walker."""
    filming = Filming(heading_rad=np.radians(heading_deg), speed_mm_s=speed, frame_rate_hz=frame_rate_hz)
    return simulate_keypoints(np.random.default_rng(seed), motions()[0], RATE, filming, error)
