"""Performances of bending to the floor by people of different sizes and manners, with known timing.

No performance is drawn from a linear model.  Each has a body (`walkers.person`), a manner (`manner`), joint angles that
are functions of a phase, and joints at the ends of rigid segments kept in balance (`kinematics`).  The phase is a
smooth monotone function of time (`time_warps`), drawn for each performance: the truth that synchronization is to
recover.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.synthetic.bending import time_warps
from pipeline.synthetic.bending.kinematics import bend
from pipeline.synthetic.bending.manner import DOWN, UP, draw_manner, draw_sway, varied
from pipeline.synthetic.walkers.person import Person, draw_person
from pipeline.validation import require_count, require_range

FRAMES_SD, LEAST_FRAMES = 0.15, 10
"""Standard deviation of the logarithm of the durations, half of it between people."""

PLACE_MM, FACING_SD = 500.0, np.radians(6.0)
"""Half the range of places on the floor; standard deviation of one person's heading between performances."""

SUBJECT_SHARE = 0.5
"""Share of the variance of durations and rates that is a person's own."""


@dataclass(frozen=True)
class BendingPerformances:
    """Performances of one action with known answers.

    Attributes
    ----------
    positions_mm : tuple of (F_i, 15, 3) float64
        WALKER15 order, z up, the floor at z = 0; people stand anywhere and face anywhere.
    phase : tuple of (F_i,) float64
        True phase of the action at each frame, 0 to 1, increasing.
    subject : (M,) int
        Index of the performer.
    people : tuple of S Person
    moving_phase : (float, float)
        Approximate phases between which the body moves; before and after it stands still and the phase cannot be
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
    """Return performances of bending; by default forty of a hundred frames on average [mozerov2006 2].

    Parameters
    ----------
    generator : numpy.random.Generator
        One number is drawn from it, which seeds a generator for each subject and performance: the first
        performances stay the same when more are asked for.
    performances : int
        Their number; the subjects take turns.
    subjects : int
        Their number; women and men alternate.
    frames_mean : float
        Frames of a performance of mean duration.
    frame_rate_hz : float
    rate_spread : float
        Standard deviation of the logarithm of the rate within a performance; 0 is a constant rate.
    marker_noise_mm : float
        Standard deviation of white noise on each coordinate.

    Raises
    ------
    InvalidInput
        If there are no performances or subjects, under ten frames on average, a rate that is not positive, or a
        negative spread or noise.

    Examples
    --------
    >>> bends = bending_performances(np.random.default_rng(1), performances=3, subjects=2)
    >>> bends.subject.tolist(), len(bends.positions_mm), bends.positions_mm[0].shape[1:]
    ([0, 1, 0], 3, (15, 3))
    """
    require_count("performances", performances)
    require_count("subjects", subjects)
    require_range("frames_mean", frames_mean, at_least=LEAST_FRAMES)
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
        others = np.sqrt(1.0 - SUBJECT_SHARE)
        slower = slower + others * FRAMES_SD * pace.standard_normal() - FRAMES_SD**2 / 2.0
        frames = max(round(frames_mean * np.exp(slower)), LEAST_FRAMES // 2)
        waves = waves + others * time_warps.draw_waves(pace, rate_spread)
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
    """Return joints (F, 15, 3) turned about the vertical and moved to a random place on the floor."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return joints @ turn.T + [*rng.uniform(-PLACE_MM, PLACE_MM, 2), 0.0]
