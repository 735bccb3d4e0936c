"""Joint centres from joint angles, for a chain of rigid segments that walks on a belt.

Legend: arrays are (space, side, frame) until the last line of `walk`; sides are ordered left, right.
"""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from pipeline.synthetic.walkers import normative_gait as norm
from pipeline.synthetic.walkers.footfall import rolling_foot, weight_shares
from pipeline.synthetic.walkers.person import SIDE, Person, leaning
from pipeline.synthetic.walkers.strides import Strides


def walk(person: Person, strides: Strides, frame_rate_hz: float) -> np.ndarray:
    """Return the joint centres (T, 15, 3), mm, of a walk, in WALKER15 order, with the floor at z = 0."""
    phase, gains = strides.phase, strides.gains

    # Legs: angles first, in the plane of each leg.
    thigh = person.curve("thigh", phase, gains["thigh"])
    knee = norm.stopped(person.curve("knee", phase, gains["knee"]), norm.KNEE_STOP_DEG)
    reach = person.body.thigh * np.sin(thigh) + person.body.shank * np.sin(thigh - knee)
    length = person.body.thigh * np.cos(thigh) + person.body.shank * np.cos(thigh - knee)

    # The plane of each leg leans sideways so that the ankle stays on its line.
    hips = person.hips(phase)
    sway = gains["trunk"] * person.sideways(phase)
    lean = np.arcsin((person.ankle_lines + strides.foot - sway - hips[0]) / length)

    # The standing leg determines the position of the pelvis; the walker corrects the drift along the belt.
    weights = weight_shares(phase)
    shift, ankle_height = rolling_foot(person, phase, person.foot_gains)
    height = (weights * (ankle_height + length * np.cos(lean) - hips[2])).sum(axis=0)
    between = (weights[:, 1:] + weights[:, :-1]) / 2.0
    steps = (between * np.diff(shift - hips[1] - reach, axis=1)).sum(axis=0) - person.speed / frame_rate_hz
    decay = 1.0 - 1.0 / (frame_rate_hz * norm.BELT_RETURN_S)
    surge = np.array(list(accumulate(steps.tolist(), lambda drift, step: decay * drift + step, initial=0.0)))
    pelvis = np.stack([sway + strides.lane, surge, height])

    hips = pelvis[:, None] + hips
    ankles = hips + np.stack([length * np.sin(lean), reach, -length * np.cos(lean)])
    knees = hips + _knees(person, thigh, knee, lean)
    sternum, head, shoulders, thorax_yaw = _upper_body(person, phase, gains["trunk"], pelvis)
    elbows, wrists = _arms(person, phase, gains["arm"], thorax_yaw, shoulders)
    left, right = 0, 1
    return np.stack(
        [
            head,
            sternum,
            *(joint[:, left] for joint in (shoulders, elbows, wrists)),
            *(joint[:, right] for joint in (shoulders, elbows, wrists)),
            pelvis,
            *(joint[:, left] for joint in (hips, knees, ankles)),
            *(joint[:, right] for joint in (hips, knees, ankles)),
        ]
    ).transpose(2, 0, 1)


def _knees(person: Person, thigh: np.ndarray, knee: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Return the positions of the knees relative to the hips, (3, 2, T), mm.

    The knee is in front of the line from hip to ankle, and turned outwards about this line.
    """
    # Angle between the thigh and the line hip–ankle, in the plane of the leg.
    bend = np.arctan2(person.body.shank * np.sin(knee), person.body.thigh + person.body.shank * np.cos(knee))
    inclination = thigh - bend
    sin, cos = np.sin(inclination), np.cos(inclination)
    line = np.stack([cos * np.sin(lean), sin, -cos * np.cos(lean)])
    forward = np.stack([-sin * np.sin(lean), cos, sin * np.cos(lean)])
    outward = SIDE * np.stack([np.cos(lean), np.zeros_like(lean), np.sin(lean)])
    turned = np.cos(person.knee_out) * forward + np.sin(person.knee_out) * outward
    return person.body.thigh * (np.cos(bend) * line + np.sin(bend) * turned)


def _upper_body(
    person: Person, phase: np.ndarray, gain: np.ndarray, pelvis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return sternum and head (3, T), shoulders (3, 2, T), mm, and the axial rotation of the thorax (T,), radians."""
    lean = person.opposed("trunk_sway", phase) * gain
    up = leaning(person.shared("trunk_lean", phase), lean)
    sternum = pelvis + person.body.trunk * up
    # The head leans sideways by a third of the trunk's lean.
    head = sternum + person.body.head * leaning(person.shared("head_lean", phase), lean / 3.0)
    yaw = person.opposed("thorax_rotation", phase) * gain
    roll = person.opposed("thorax_obliquity", phase) * gain
    axis = np.stack([np.cos(yaw) * np.cos(roll), np.sin(yaw) * np.cos(roll), np.sin(roll)])
    axis = axis - (axis * up).sum(axis=0) * up
    axis = axis / np.linalg.norm(axis, axis=0)
    middle = sternum - person.body.shoulder_drop * up
    return sternum, head, middle[:, None] + person.body.half_shoulders * SIDE * axis[:, None], yaw


def _arms(
    person: Person, phase: np.ndarray, gain: np.ndarray, yaw: np.ndarray, shoulders: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return elbows and wrists, each (3, 2, T), mm; the planes of arm swing rotate with the thorax."""
    swing = person.curve("upper_arm", phase, gain)
    bend = norm.stopped(person.curve("elbow", phase, gain), norm.ELBOW_STOP_DEG)
    still = np.zeros_like(yaw)
    outward = SIDE * np.stack([np.cos(yaw), np.sin(yaw), still])[:, None]
    ahead = np.stack([-np.sin(yaw), np.cos(yaw), still])[:, None]
    upward = np.array([0.0, 0.0, 1.0])[:, None, None]
    hanging = np.sin(swing) * ahead - np.cos(swing) * upward
    forward = np.cos(swing) * ahead + np.sin(swing) * upward
    upper_arm = np.cos(person.arm_out) * hanging + np.sin(person.arm_out) * outward
    inward = np.sin(person.arm_out) * hanging - np.cos(person.arm_out) * outward
    turned = np.cos(person.forearm_in) * forward + np.sin(person.forearm_in) * inward
    elbows = shoulders + person.body.upper_arm * upper_arm
    return elbows, elbows + person.body.forearm * (np.cos(bend) * upper_arm + np.sin(bend) * turned)
