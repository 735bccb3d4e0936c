"""Synthetic performances of bending to the floor by different people, with known phase in each frame.

No performance is drawn from a linear model.  Each has a body (`walkers.person`), a manner (`manner`), joint angles as
functions of a phase, and joints at the ends of balanced rigid segments (`kinematics`).  The phase is a smooth monotone
function of time (`time_warps`), drawn for each performance.  It is the ground truth of synchronization.
"""

from __future__ import annotations

import numpy as np

from pipeline.shortened import shortened
from pipeline.synthetic.bending import time_warps
from pipeline.synthetic.bending.kinematics import bend
from pipeline.synthetic.bending.manner import DOWN, UP, draw_manner, draw_sway, varied
from pipeline.synthetic.walkers.person import Person, draw_person
from pipeline.validation import require_count, require_range

FRAMES_SD, MIN_FRAMES = 0.15, 10
"""SD of the log duration of a performance, and smallest mean duration in frames."""

MAX_OFFSET_MM, FACING_SD = 500.0, np.radians(6.0)
"""Largest offset of a person on the floor in x and y, mm, and SD of the heading between performances, radians."""

SUBJECT_SHARE = 0.5
"""Share of the variance of durations and rates that is variance between people."""


@shortened
class BendingPerformances:
    """Synthetic performances of bending to the floor, with the true phase of each frame.

    Attributes
    ----------
    positions_mm : tuple of (F_i, 15, 3) float64
        Joint positions in WALKER15 order, z up, the floor at z = 0, with random offsets and headings.
    phase : tuple of (F_i,) float64
        True phase of the action at each frame, 0 to 1, increasing.
    subject : (M,) int
        Index of the person.
    people : tuple of S Person
    moving_phase : (float, float)
        Approximate first and last phase of the movement; at other phases the body stands still and the phase cannot be
        observed.
    """

    positions_mm: tuple[np.ndarray, ...]
    phase: tuple[np.ndarray, ...]
    subject: np.ndarray
    people: tuple[Person, ...]
    moving_phase: tuple[float, float]


def bending_performances(
    generator: np.random.Generator,
    *,
    performances: int = 40,
    subjects: int = 5,
    frames_mean: float = 100.0,
    frame_rate_hz: float = 30.0,
    rate_spread: float = 0.3,
    marker_noise_mm: float = 0.5,
) -> BendingPerformances:
    """Generate performances of bending to the floor [mozerov2006 2].

    The defaults are forty performances with an average of a hundred frames.

    Parameters
    ----------
    generator : numpy.random.Generator
        Generator of a seed for each subject and performance; the first performances do not depend on their number.
    performances : int
        Number of performances; the subjects alternate.
    subjects : int
        Number of subjects; women and men alternate.
    frames_mean : float
        Mean number of frames of a performance.
    frame_rate_hz : float
    rate_spread : float
        Standard deviation of the logarithm of the rate within a performance; 0 is a constant rate.
    marker_noise_mm : float
        Standard deviation of white noise on each coordinate.

    Raises
    ------
    InvalidInput
        If a number is below 1, the mean duration is below ten frames, the rate is not positive, or a spread or the
        noise is negative.

    Examples
    --------
    >>> bends = bending_performances(np.random.default_rng(1), performances=3, subjects=2)
    >>> bends.subject.tolist(), len(bends.positions_mm), bends.positions_mm[0].shape[1:]
    ([0, 1, 0], 3, (15, 3))
    """
    require_count("performances", performances)
    require_count("subjects", subjects)
    require_range("frames_mean", frames_mean, at_least=MIN_FRAMES)
    require_range("frame_rate_hz", frame_rate_hz, above=0)
    require_range("rate_spread", rate_spread, at_least=0)
    require_range("marker_noise_mm", marker_noise_mm, at_least=0)
    entropy = int(generator.integers(2**63))
    people, manners, pacing, facing = [], [], [], []
    for number in range(subjects):
        seeds = np.random.SeedSequence(entropy, spawn_key=(0, number)).spawn(3)
        traits, style, pace = (np.random.default_rng(seed) for seed in seeds)
        people.append(draw_person(traits, male=number % 2 == 1))
        manners.append(draw_manner(style))
        subject_share = np.sqrt(SUBJECT_SHARE)
        pacing.append(
            (
                subject_share * FRAMES_SD * pace.standard_normal(),
                subject_share * time_warps.draw_waves(pace, rate_spread),
            )
        )
        facing.append(pace.uniform(-np.pi, np.pi))

    positions, phases = [], []
    for number in range(performances):
        subject = number % subjects
        seeds = np.random.SeedSequence(entropy, spawn_key=(1, number)).spawn(3)
        style, pace, noise = (np.random.default_rng(seed) for seed in seeds)
        slower, waves = pacing[subject]
        performance_share = np.sqrt(1.0 - SUBJECT_SHARE)
        slower = slower + performance_share * FRAMES_SD * pace.standard_normal() - FRAMES_SD**2 / 2.0
        frames = max(round(frames_mean * np.exp(slower)), MIN_FRAMES // 2)
        waves = waves + performance_share * time_warps.draw_waves(pace, rate_spread)
        phase = time_warps.warp(waves, frames)
        manner = varied(manners[subject], style)
        sway = draw_sway(style, np.arange(frames) / frame_rate_hz)
        joints = bend(people[subject], manner, phase, sway)
        joints = _placed(joints, facing[subject] + FACING_SD * style.standard_normal(), style)
        positions.append(joints + marker_noise_mm * noise.standard_normal(joints.shape))
        phases.append(phase)
    return BendingPerformances(
        positions_mm=tuple(positions),
        phase=tuple(phases),
        subject=np.arange(performances) % subjects,
        people=tuple(people),
        moving_phase=(DOWN[0], UP[1]),
    )


def _placed(joints: np.ndarray, yaw: float, rng: np.random.Generator) -> np.ndarray:
    """Rotate the joints (F, 15, 3) about the vertical, and shift them by a random offset on the floor."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return joints @ turn.T + [*rng.uniform(-MAX_OFFSET_MM, MAX_OFFSET_MM, 2), 0.0]
