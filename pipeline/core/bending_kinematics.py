"""How one person bends to the floor and comes up again: manner, joint angles by phase, and joints.

How a posture is made
---------------------
1. Knee and hip flexion follow the phase, each with its own timing: as far as brings the hands to their target.
2. Shank, thigh and trunk make a chain in the plane of walking.  It turns about the ankles until the centre of mass
   is over the feet: so the hips go back as the trunk goes forward, and the shanks lean in a squat.
3. The feet stay where they stand; knees are where thighs and shanks meet, turned out.
4. Trunk, head and arms follow: leaning and twisting towards the hand that reaches, the arms hanging from the trunk.

Legend: phases tau in [0, 1] of the action; arrays are (frame, space), or (side, frame, space) with left before
right; angles in radians, forward and flexed positive; x right, y ahead, z up, the floor at z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pipeline.core import anthropometry as body
from pipeline.core.person import SIDE, Person

DOWN, UP = (0.10, 0.45), (0.55, 0.90)
"""Phases in which the body goes down and comes up; before, between and after it rests.  Assumed."""

LEG_MASSES, UPPER_MASS = {"thigh": 0.200, "shank": 0.093}, 0.678
LEG_CENTRE, UPPER_CENTRE = 0.433, 0.626
"""Both thighs, both shanks, and head, arms and trunk as fractions of the body's mass; where their centres lie: from
the upper end of thigh and shank, from the hips towards the shoulders.  Published: Winter 2009 table 4.1."""

MANNERS_DEG = {
    "knee": (62.0, 28.0),
    "hip": (98.0, 10.0),
    "lean": (3.0, 4.0),
    "twist": (6.0, 7.0),
    "head": (8.0, 18.0),
    "arms": (8.0, 9.0),
    "elbows": (14.0, 12.0),
    "standing_knee": (8.0, 2.0),
    "standing_hip": (8.0, 3.0),
    "standing_head": (8.0, 5.0),
    "standing_arms": (0.0, 3.0),
    "standing_elbows": (14.0, 6.0),
    "opened_knees": (8.0, 7.0),
}
"""Mean and SD between people; first how far each angle goes, then how it stands.  That straight-legged stoops, full
squats and all between are in use: Burgess-Limerick 2003, Straker 2003.  Sizes assumed."""

WITHIN = 0.2
"""Spread of one person's performances, as a part of that between people.  Assumed."""

TIMED = ("knee", "hip", "lean", "twist", "head", "arms", "elbows")
TIMING_SD, SKEW_SD = 0.02, 0.15
"""How much earlier or later each angle begins and ends to change, in phase; logarithm of its progress's power."""

TARGET_HEIGHT, STANCE_WIDTH, FOOT_AHEAD, BALANCE = (0.10, 0.03), (0.13, 0.03), (0.0, 0.015), (0.03, 0.006)
"""Wrists over the floor at the deepest, distance of the ankles, left ankle ahead of the right, and centre of mass
ahead of the ankles, in statures: mean and SD between people.  Assumed."""

LEAST = {"knee": 12.0, "standing_knee": 5.0, "standing_elbows": 4.0, "opened_knees": 0.0}
STOP = np.radians(135.0)
"""Least angles in degrees; most flexion of knee and hip."""

SWAY = {"balance_mm": 4.0, "sideways_mm": 5.0, "trunk": 0.012, "twist": 0.015, "head": 0.025, "arms": 0.03}
SWAY_HZ, SWAY_WAVES = (0.1, 0.7), 3
"""Root mean square of what never stands still, mm and radians, and its slow waves.  Assumed."""

_DEEPEST = (DOWN[1] + UP[0]) / 2.0
_DEPTHS = (0.2, 1.6)


@dataclass(frozen=True)
class Manner:
    """How somebody bends: `angles` in radians, `timing` (7, 4) in phase and `skew` (7,) in the order of `TIMED`.

    `statures` are those of `TARGET_HEIGHT` … `BALANCE`, as fractions; `one_handed` is 0 with both hands, 1 with the
    right one alone.
    """

    angles: dict[str, float]
    timing: np.ndarray
    skew: np.ndarray
    statures: np.ndarray
    one_handed: float

    def progress(self, name: str, phase: np.ndarray) -> np.ndarray:
        """How far an angle has gone, 0 standing to 1 at the deepest, (F,); minimum jerk down and up."""
        shift = self.timing[TIMED.index(name)]
        way = np.clip((phase - (DOWN[0] + shift[0])) / (DOWN[1] - DOWN[0] + shift[1] - shift[0]), 0.0, 1.0)
        back = np.clip((phase - (UP[0] + shift[2])) / (UP[1] - UP[0] + shift[3] - shift[2]), 0.0, 1.0)
        risen = ((6.0 * way - 15.0) * way + 10.0) * way**3 * (1.0 - ((6.0 * back - 15.0) * back + 10.0) * back**3)
        return np.asarray(risen ** self.skew[TIMED.index(name)])


def draw_manner(rng: np.random.Generator) -> Manner:
    """A person's own manner; the number of draws is the same for everyone."""
    angles = {
        name: np.radians(max(rng.normal(mean, sd), LEAST.get(name, -np.inf)))
        for name, (mean, sd) in MANNERS_DEG.items()
    }
    return Manner(
        angles=angles,
        timing=TIMING_SD * np.clip(rng.standard_normal((len(TIMED), 4)), -2.5, 2.5),
        skew=np.exp(SKEW_SD * rng.standard_normal(len(TIMED))),
        statures=_statures(rng.standard_normal(4)),
        one_handed=float(rng.beta(0.5, 0.5)),
    )


def varied(manner: Manner, rng: np.random.Generator) -> Manner:
    """The same person's manner on another occasion."""
    angles = {
        name: max(
            manner.angles[name] + np.radians(WITHIN * sd) * rng.standard_normal(),
            np.radians(LEAST.get(name, -np.inf)),
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
    """What never stands still, each (F,): a few slow waves."""
    size = (len(SWAY), SWAY_WAVES)
    turns = rng.uniform(*SWAY_HZ, size)[..., None] * times_s + rng.uniform(size=size)[..., None]
    waves = (rng.standard_normal(size)[..., None] * np.sin(2.0 * np.pi * turns)).sum(axis=1)
    return {
        name: rms * np.sqrt(2.0 / SWAY_WAVES) * wave
        for (name, rms), wave in zip(SWAY.items(), waves, strict=True)
    }


def bend(person: Person, manner: Manner, phase: np.ndarray, sway: dict[str, np.ndarray]) -> np.ndarray:
    """Joint centres (F, 15, 3) mm in WALKER15 order, facing +y, of a person at these phases of the action."""
    still = dict.fromkeys(SWAY, np.zeros(1))
    target = manner.statures[0] * person.stature
    share = np.array([1.0 - manner.one_handed, 1.0 + manner.one_handed]) / 2.0

    def too_high(depth: float) -> float:
        deepest = _posture(person, manner, np.array([_DEEPEST]), still, depth)
        return float(share @ deepest[0, [4, 7], 2] - target)

    # Hands that cannot come down as far (or are low already) go as far as they can.
    ends = [too_high(depth) for depth in _DEPTHS]
    depth = brentq(too_high, *_DEPTHS, xtol=1e-6) if ends[0] > 0.0 > ends[1] else _DEPTHS[int(ends[1] > 0.0)]
    return _posture(person, manner, phase, sway, float(depth))


def _statures(normal: np.ndarray) -> np.ndarray:
    mean, sd = np.transpose([TARGET_HEIGHT, STANCE_WIDTH, FOOT_AHEAD, BALANCE])
    return np.maximum(mean + sd * normal, [0.04, 0.08, -0.04, 0.01])


def _posture(
    person: Person, manner: Manner, phase: np.ndarray, sway: dict[str, np.ndarray], depth: float
) -> np.ndarray:
    angles = manner.angles
    gone = {name: manner.progress(name, phase) for name in TIMED}
    knee, hip = (
        angles[f"standing_{name}"] + gone[name] * np.minimum(depth * angles[name], STOP)
        for name in ("knee", "hip")
    )
    _, width, ahead, balance = manner.statures * person.stature
    shank, tilt, pelvis = _balanced(person, knee, hip, balance + sway["balance_mm"])
    tilt = tilt + sway["trunk"]

    # To the side of the reaching hand.
    aside = manner.one_handed * gone["lean"]
    lean, twist = aside * angles["lean"], gone["twist"] * manner.one_handed * angles["twist"] + sway["twist"]
    pelvis[:, 0] = sway["sideways_mm"] + 25.0 * aside

    ankles = np.zeros((2, len(phase), 3))
    ankles[:, :, 0] = SIDE * width / 2.0
    ankles[:, :, 1] = -SIDE * ahead / 2.0
    ankles[:, :, 2] = body.SEGMENTS["ankle_height"] * person.stature
    yaw = 0.4 * twist
    across = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=-1)
    hips = pelvis + (person.half_hips * SIDE)[..., None] * across
    lowered = _too_far(person, hips, ankles)
    pelvis[:, 2] -= lowered
    hips[..., 2] -= lowered
    opened = person.knee_out + gone["knee"] * angles["opened_knees"]
    knees = _knees(person, hips, ankles, opened)

    up = _direction(tilt, lean)
    sternum = pelvis + person.trunk * up
    nod = angles["standing_head"] + 0.8 * tilt - gone["head"] * angles["head"] + sway["head"]
    head = sternum + person.head * _direction(nod, lean / 2.0)
    right = across - (across * up).sum(axis=-1, keepdims=True) * up
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    turn = (twist - yaw)[:, None]
    right = np.cos(turn) * right + np.sin(turn) * np.cross(up, right)
    shoulders = sternum - person.shoulder_drop * up + (person.half_shoulders * SIDE)[..., None] * right
    elbows, wrists = _arms(person, manner, gone, sway["arms"], tilt, up, right, shoulders)
    del shank
    limbs = [shoulders, elbows, wrists]
    legs = [hips, knees, ankles]
    return np.stack(
        [head, sternum, *(j[0] for j in limbs), *(j[1] for j in limbs), pelvis]
        + [*(j[0] for j in legs), *(j[1] for j in legs)],
        axis=1,
    )
