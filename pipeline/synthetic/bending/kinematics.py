"""Joint centres of a person who bends to the floor and rises again, at given phases of the action.

Steps
-----
1. Knee and hip flexion follow the phase with separate timing, over the range that brings the hands to the target.
2. Shank, thigh and trunk are a chain in the sagittal plane, which rotates about the ankles until the centre of mass is
   over the feet.
3. The feet do not move; knees are at the ends of thighs and shanks, and turned out.
4. The trunk leans and twists towards the reaching hand; head and arms follow.

Legend: arrays are (frame, space), or (side, frame, space) with left before right; angles in radians, forward and
flexed positive; x right, y ahead, z up, the floor at z = 0.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from pipeline.core import anthropometry as body
from pipeline.synthetic.bending.manner import DOWN, SWAY, SWAY_BENT, TIMED, UP, Manner
from pipeline.synthetic.walkers.person import SIDE, Person, leaning

LEG_MASSES, UPPER_MASS = {"thigh": 0.200, "shank": 0.093}, 0.678
LEG_CENTRE, UPPER_CENTRE = 0.433, 0.626
"""Relative masses of both thighs, both shanks and the upper body, and positions of their centres of mass.

The upper body is head, arms and trunk.

The centres are fractions of the distance from the upper end of thigh and shank, and from the hips to the shoulders.
Published: Winter 2009 table 4.1."""

MAX_FLEXION = np.radians(135.0)
"""Largest flexion of knee and hip in bending, radians. Assumed."""

MIN_BEND = np.radians(4.0)
"""Smallest knee flexion in standing, radians, which determines the largest height of the hips. Assumed."""

_DEEPEST = (DOWN[1] + UP[0]) / 2.0
_DEPTHS = (0.2, 1.6)


def bend(person: Person, manner: Manner, phase: np.ndarray, sway: dict[str, np.ndarray]) -> np.ndarray:
    """Return the joint centres (F, 15, 3), mm, of a bending person at phases (F,) of the action.

    The joints are in WALKER15 order.  The person faces +y.
    """
    no_sway = dict.fromkeys(SWAY, np.zeros(1))
    target = manner.statures[0] * person.body.stature
    share = np.array([1.0 - manner.one_handed, 1.0 + manner.one_handed]) / 2.0

    def over_target(depth: float) -> float:
        deepest = _posture(person, manner, np.array([_DEEPEST]), no_sway, depth)
        return share @ deepest[0, [4, 7], 2] - target

    # Hands that cannot reach the target come as close as possible.
    ends = [over_target(depth) for depth in _DEPTHS]
    depth = (
        brentq(over_target, *_DEPTHS, xtol=1e-6) if ends[0] > 0.0 > ends[1] else _DEPTHS[int(ends[1] > 0.0)]
    )
    return _posture(person, manner, phase, sway, float(depth))


def _posture(
    person: Person, manner: Manner, phase: np.ndarray, sway: dict[str, np.ndarray], depth: float
) -> np.ndarray:
    angles = manner.angles
    progress = {name: manner.progress(name, phase) for name in TIMED}
    sway = {name: (1.0 + SWAY_BENT * progress["hip"]) * wave for name, wave in sway.items()}
    knee, hip = (
        angles[f"standing_{name}"] + progress[name] * np.minimum(depth * angles[name], MAX_FLEXION)
        for name in ("knee", "hip")
    )
    _, width, ahead, balance = manner.statures * person.body.stature
    tilt, pelvis = _balanced(person, knee, hip, balance + sway["balance_mm"])
    tilt = tilt + sway["trunk"]

    # The body leans to the side of the reaching hand.
    side_lean = manner.one_handed * progress["lean"]
    lean = side_lean * angles["lean"] + sway["lean"]
    twist = progress["twist"] * manner.one_handed * angles["twist"] + sway["twist"]
    pelvis[:, 0] = sway["sideways_mm"] + 25.0 * side_lean

    ankles = np.zeros((2, len(phase), 3))
    ankles[:, :, 0] = SIDE * width / 2.0
    ankles[:, :, 1] = -SIDE * ahead / 2.0
    ankles[:, :, 2] = body.SEGMENTS["ankle_height"] * person.body.stature
    yaw = 0.4 * twist
    across = np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)])
    hips = pelvis + (person.body.half_hips * SIDE)[..., None] * across
    excess = _excess_height(person, hips, ankles)
    pelvis[:, 2] -= excess
    hips[..., 2] -= excess
    opened = person.knee_out + progress["knee"] * angles["opened_knees"]
    opened = opened + np.stack([sway["left_knee"], sway["right_knee"]])
    knees = _knees(person, hips, ankles, opened)

    up = leaning(tilt, lean).T
    sternum = pelvis + person.body.trunk * up
    nod = angles["standing_head"] + 0.8 * tilt - progress["head"] * angles["head"] + sway["head"]
    head = sternum + person.body.head * leaning(nod, lean / 2.0).T
    right = across - (across * up).sum(axis=-1, keepdims=True) * up
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    turn = (twist - yaw)[:, None]
    right = np.cos(turn) * right + np.sin(turn) * np.cross(up, right)
    shoulders = (
        sternum - person.body.shoulder_drop * up + (person.body.half_shoulders * SIDE)[..., None] * right
    )
    elbows, wrists = _arms(person, manner, progress, sway, tilt, up, right, shoulders)
    limbs = [shoulders, elbows, wrists]
    legs = [hips, knees, ankles]
    upper = [head, sternum, *(j[0] for j in limbs), *(j[1] for j in limbs)]
    return np.stack([*upper, pelvis, *(j[0] for j in legs), *(j[1] for j in legs)], axis=1)


def _balanced(
    person: Person, knee: np.ndarray, hip: np.ndarray, ahead: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the tilt of the trunk (F,), radians, and the pelvis position (F, 3), mm, at which a person is balanced.

    The centre of mass is `ahead` (F,) mm in front of the ankles.
    """
    thigh, shank = person.body.thigh.mean(), person.body.shank.mean()

    def along(tilt: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(tilt), np.cos(tilt)])

    # First with an upright shank: positions (2, F) of thigh and trunk, ahead and up from the ankles.
    knees = shank * along(np.zeros_like(knee))
    hips = knees + thigh * along(-knee)
    upper = hips + UPPER_CENTRE * person.body.trunk * along(hip - knee)
    centre = (
        LEG_MASSES["shank"] * (1.0 - LEG_CENTRE) * knees
        + LEG_MASSES["thigh"] * (hips + LEG_CENTRE * (knees - hips))
        + UPPER_MASS * upper
    ) / (sum(LEG_MASSES.values()) + UPPER_MASS)
    # Then the complete chain rotates about the ankles.
    turn = np.arcsin(ahead / np.hypot(*centre)) - np.arctan2(*centre)
    hips = shank * along(turn) + thigh * along(turn - knee)
    ankle = body.SEGMENTS["ankle_height"] * person.body.stature
    return turn - knee + hip, np.stack([np.zeros_like(knee), hips[0], ankle + hips[1]], axis=-1)


def _excess_height(person: Person, hips: np.ndarray, ankles: np.ndarray) -> float:
    """Return the largest excess, mm, of the hips' height over the reach of straight legs; 0 if always in reach."""
    thigh, shank = person.body.thigh[:, 0], person.body.shank[:, 0]
    reach = np.sqrt(thigh**2 + shank**2 + 2.0 * thigh * shank * np.cos(MIN_BEND))
    leg = hips - ankles
    highest = np.sqrt(reach[:, None] ** 2 - (leg[..., :2] ** 2).sum(axis=-1))
    return max(0.0, (leg[..., 2] - highest).max())


def _knees(person: Person, hips: np.ndarray, ankles: np.ndarray, opened: np.ndarray) -> np.ndarray:
    """Return the positions of the knees (2, F, 3), mm, from the positions of hips and ankles.

    The plane of each leg is turned outwards by `opened` (2, F), radians.
    """
    line = ankles - hips
    distance = np.linalg.norm(line, axis=-1, keepdims=True)
    line = line / distance
    thigh, shank = person.body.thigh[..., None], person.body.shank[..., None]
    cos = (thigh**2 + distance**2 - shank**2) / (2.0 * thigh * distance)
    forward = np.array([0.0, 1.0, 0.0]) - line[..., 1:2] * line
    forward = forward / np.linalg.norm(forward, axis=-1, keepdims=True)
    outward = SIDE[..., None] * np.cross(forward, -line)
    turned = np.cos(opened)[..., None] * forward + np.sin(opened)[..., None] * outward
    return hips + thigh * (cos * line + np.sqrt(1.0 - cos**2) * turned)


def _arms(
    person: Person,
    manner: Manner,
    progress: dict[str, np.ndarray],
    sway: dict[str, np.ndarray],
    tilt: np.ndarray,
    up: np.ndarray,
    right: np.ndarray,
    shoulders: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return elbows and wrists, each (2, F, 3), mm; an arm that does not reach down stays bent near the trunk."""
    angles = manner.angles
    idle = np.array([[manner.one_handed], [0.0]])
    forward = np.array([[angles["left_arm"]], [angles["right_arm"]]])
    swing = angles["standing_arms"] + progress["arms"] * (1.0 - 0.4 * idle) * (tilt + forward)
    swing = swing + np.stack([sway["left_arm"], sway["right_arm"]])
    midway = 4.0 * progress["elbows"] * (1.0 - progress["elbows"])
    flexed = np.maximum(angles["standing_elbows"] + midway * angles["elbows"], np.radians(2.0))
    flexed = flexed + progress["elbows"] * idle * np.radians(40.0)
    ahead = np.cross(up, right)
    sin, cos = np.sin(swing)[..., None], np.cos(swing)[..., None]
    hanging, forward = sin * ahead - cos * up, cos * ahead + sin * up
    outward = SIDE[..., None] * right
    out, turned_in = person.arm_out[..., None], person.forearm_in[..., None]
    upper = np.cos(out) * hanging + np.sin(out) * outward
    inward = np.sin(out) * hanging - np.cos(out) * outward
    turned = np.cos(turned_in) * forward + np.sin(turned_in) * inward
    elbows = shoulders + person.body.upper_arm * upper
    fore = np.cos(flexed)[..., None] * upper + np.sin(flexed)[..., None] * turned
    return elbows, elbows + person.body.forearm * fore
