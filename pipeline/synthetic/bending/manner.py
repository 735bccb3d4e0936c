"""Variation of the bending movement between people, and between performances of the same person.

The grades of support (*published*, *assumed*) are those of `walkers.normative_gait`.  The sizes were not fitted to any
recording.  Differences between the sides and the sway of the bent body were increased once, because nearly symmetric
and repeatable people needed only three dimensions.  They were not fitted to the sixteen dimensions of the paper, which
they do not reach.

Legend: phases tau in [0, 1] of the action; angles in radians unless stated otherwise, forward and flexed positive.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DOWN, UP = (0.10, 0.45), (0.55, 0.90)
"""First and last phase of the downward and of the upward movement; the body rests at other phases. Assumed."""

MANNERS_DEG = {
    "knee": (62.0, 28.0),
    "hip": (98.0, 10.0),
    "lean": (8.0, 5.0),
    "twist": (14.0, 8.0),
    "head": (8.0, 18.0),
    "left_arm": (8.0, 9.0),
    "right_arm": (8.0, 9.0),
    "elbows": (14.0, 12.0),
    "standing_knee": (8.0, 2.0),
    "standing_hip": (8.0, 3.0),
    "standing_head": (8.0, 5.0),
    "standing_arms": (0.0, 3.0),
    "standing_elbows": (14.0, 6.0),
    "opened_knees": (8.0, 7.0),
}
"""Mean and SD over people, in degrees, of each angle's range of motion and of its value in standing.

People stoop with straight legs, squat, or do anything between: Burgess-Limerick 2003, Straker 2003.  Sizes assumed."""

WITHIN = 0.2
"""SD between performances of a person, as a fraction of the SD between people. Assumed."""

TIMED = ("knee", "hip", "lean", "twist", "head", "arms", "elbows")
"""Angles of the bending movement that each have a separately drawn timing."""
TIMING_SD, SKEW_SD = 0.02, 0.15
"""SD of the phases at which an angle starts and stops, and SD of the log of the exponent that skews its course."""

TARGET_HEIGHT, STANCE_WIDTH, FOOT_AHEAD, BALANCE = (0.10, 0.03), (0.13, 0.03), (0.0, 0.05), (0.03, 0.006)
"""Mean and SD over people of lengths in bending, such as the stance width, as fractions of stature. Assumed.

They are the lowest height of the wrists, the distance of the ankles, the distance of the left ankle ahead of the
right, and that of the centre of mass ahead of the ankles."""

MIN_ANGLES_DEG = {"knee": 12.0, "standing_knee": 5.0, "standing_elbows": 4.0, "opened_knees": 0.0}
"""Smallest values of the randomly drawn angles, degrees."""

SWAY = {
    "balance_mm": 4.0,
    "sideways_mm": 5.0,
    "trunk": 0.012,
    "lean": 0.010,
    "twist": 0.015,
    "head": 0.025,
    "left_arm": 0.025,
    "right_arm": 0.025,
    "left_knee": 0.020,
    "right_knee": 0.020,
}
"""Root mean square of the postural sway, mm and radians; the knees sway outwards. Assumed."""

SWAY_HZ, SWAY_WAVES, SWAY_BENT = (0.1, 0.7), 3, 3.0
"""Frequency range (Hz) and number of waves of the postural sway, and its relative increase in the deepest posture.

Assumed, so that angles vary by 2-6 degrees, as in repeated lifts (direction: Scholz 1993)."""


@dataclass(frozen=True)
class Manner:
    """Personal parameters of the bending movement: angles, timing and lengths.

    `angles` are in radians, `timing` (7, 4) in phase, `skew` (7,) in the order of `TIMED`.  `statures` are the values
    of `TARGET_HEIGHT` … `BALANCE`, as fractions.  `one_handed` is 0 for both hands, and 1 for the right hand alone.
    """

    angles: dict[str, float]
    timing: np.ndarray
    skew: np.ndarray
    statures: np.ndarray
    one_handed: float

    def progress(self, name: str, phase: np.ndarray) -> np.ndarray:
        """Return the relative change (F,) of an angle, from 0 in standing to 1 in the deepest posture.

        Its way down and its way up are minimum-jerk curves.
        """
        shift = self.timing[TIMED.index(name)]
        down = np.clip((phase - (DOWN[0] + shift[0])) / (DOWN[1] - DOWN[0] + shift[1] - shift[0]), 0.0, 1.0)
        up = np.clip((phase - (UP[0] + shift[2])) / (UP[1] - UP[0] + shift[3] - shift[2]), 0.0, 1.0)
        progress = (
            ((6.0 * down - 15.0) * down + 10.0) * down**3 * (1.0 - ((6.0 * up - 15.0) * up + 10.0) * up**3)
        )
        return np.maximum(progress, 0.0) ** self.skew[TIMED.index(name)]


def draw_manner(rng: np.random.Generator) -> Manner:
    """Draw the personal parameters of the bending movement; each person uses the same number of random draws."""
    angles = {
        name: np.radians(max(rng.normal(mean, sd), MIN_ANGLES_DEG.get(name, -np.inf)))
        for name, (mean, sd) in MANNERS_DEG.items()
    }
    return Manner(
        angles=angles,
        timing=TIMING_SD * np.clip(rng.standard_normal((len(TIMED), 4)), -2.5, 2.5),
        skew=np.exp(SKEW_SD * rng.standard_normal(len(TIMED))),
        statures=_statures(rng.standard_normal(4)),
        one_handed=rng.beta(0.5, 0.5),
    )


def varied(manner: Manner, rng: np.random.Generator) -> Manner:
    """Draw the parameters of another performance of the same person, near the personal parameters."""
    angles = {
        name: max(
            manner.angles[name] + np.radians(WITHIN * sd) * rng.standard_normal(),
            np.radians(MIN_ANGLES_DEG.get(name, -np.inf)),
        )
        for name, (_, sd) in MANNERS_DEG.items()
    }
    mean = _statures(np.zeros(4))
    return Manner(
        angles=angles,
        timing=manner.timing + WITHIN * TIMING_SD * rng.standard_normal(manner.timing.shape),
        skew=manner.skew * np.exp(WITHIN * SKEW_SD * rng.standard_normal(len(TIMED))),
        statures=manner.statures + WITHIN * (_statures(rng.standard_normal(4)) - mean),
        one_handed=manner.one_handed,
    )


def draw_sway(rng: np.random.Generator, times_s: np.ndarray) -> dict[str, np.ndarray]:
    """Draw the postural sway of each body part, (F,), as a sum of slow sine waves."""
    size = (len(SWAY), SWAY_WAVES)
    turns = rng.uniform(*SWAY_HZ, size)[..., None] * times_s + rng.uniform(size=size)[..., None]
    waves = (rng.standard_normal(size)[..., None] * np.sin(2.0 * np.pi * turns)).sum(axis=1)
    return {
        name: rms * np.sqrt(2.0 / SWAY_WAVES) * wave
        for (name, rms), wave in zip(SWAY.items(), waves, strict=True)
    }


def _statures(normal: np.ndarray) -> np.ndarray:
    mean, sd = np.transpose([TARGET_HEIGHT, STANCE_WIDTH, FOOT_AHEAD, BALANCE])
    return np.maximum(mean + sd * normal, [0.04, 0.08, -0.12, 0.01])
