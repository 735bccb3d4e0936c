"""Simulated activities besides walking: squats, sitting down, running, turning on the spot, and standing.

Bodies have the limbs of a standing person.  Thighs, shanks and arms turn in the sagittal plane with smooth joint
angles. The lower ankle stays on the ground, except in running.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from pipeline.core import walking
from pipeline.skeleton import LEFT_LEG, PELVIS, RIGHT_LEG, WALKER15

_STERNUM, _HEAD = (WALKER15.index(joint) for joint in ("sternum", "head"))
_LEGS = [LEFT_LEG, RIGHT_LEG]
_ARMS = [
    [WALKER15.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist")]
    for side in ("left", "right")
]
FLIGHT_MM = 60.0
"""Amplitude, mm, of the vertical motion of a runner's pelvis."""


class Activity(StrEnum):
    """Activities other than walking."""

    squat = "squat"
    sit = "sit"
    run = "run"
    turn = "turn"


def _below(length: float, angle_rad: np.ndarray) -> np.ndarray:
    """Return vectors (T, 3) of the given length that point down and are rotated forwards by the angles (T,)."""
    return length * np.stack([0.0 * angle_rad, np.sin(angle_rad), -np.cos(angle_rad)], axis=-1)


def _pose(standing: np.ndarray, angles: dict[str, list[np.ndarray]], lean_rad: np.ndarray) -> np.ndarray:
    """Return positions (T, 15, 3) relative to the pelvis, for joint angles, rad, of the left and the right side."""
    positions = np.repeat((standing - standing[PELVIS])[None], len(lean_rad), axis=0)
    for joint in (_STERNUM, _HEAD, _ARMS[0][0], _ARMS[1][0]):
        positions[:, joint, 1:] = -_below(standing[joint, 2] - standing[PELVIS, 2], -lean_rad)[:, 1:]
    for limbs, upper, bend, sign in ((_LEGS, "hip", "knee", -1.0), (_ARMS, "shoulder", "elbow", 1.0)):
        for side, (root, middle, end) in enumerate(limbs):
            lengths = (np.linalg.norm(standing[b] - standing[a]) for a, b in ((root, middle), (middle, end)))
            raised = angles[upper][side]
            positions[:, middle] = positions[:, root] + _below(float(next(lengths)), raised)
            positions[:, end] = positions[:, middle] + _below(
                float(next(lengths)), raised + sign * angles[bend][side]
            )
    return positions


def perform(
    activity: Activity,
    generator: np.random.Generator,
    walk: np.ndarray,
    frame_rate_hz: float,
    duration_s: float,
) -> np.ndarray:
    """Return positions (T, 15, 3), mm, of a person with a walker's limbs during another activity.

    Parameters
    ----------
    activity : Activity
    generator : numpy.random.Generator
        Random numbers for rates and depths.
    walk : (n, 15, 3)
        Positions of the walker.  The mean posture is used for standing; turning on the spot uses its steps.
    frame_rate_hz, duration_s : float
    """
    standing = walk.mean(axis=0)
    t = np.arange(round(duration_s * frame_rate_hz) + 1) / frame_rate_hz
    if activity is Activity.turn:
        frame = np.arange(len(t)) % (2 * (len(walk) - 1))
        steps = walk[len(walk) - 1 - np.abs(len(walk) - 1 - frame)]
        pose = standing + generator.uniform(0.3, 0.5) * (steps - standing)
        yaw = 2.0 * np.pi * generator.uniform(0.2, 0.5) * t
        return walking.turn_about_vertical(pose, yaw[:, None])
    if activity is Activity.run:
        turned = 2.0 * np.pi * generator.uniform(1.25, 1.5) * t + generator.uniform(0, 2 * np.pi)
        sides = [turned, turned + np.pi]
        angles = {
            "hip": [0.25 + 0.55 * np.sin(side) for side in sides],
            "knee": [0.35 + 1.3 * np.maximum(np.cos(side), 0.0) ** 2 for side in sides],
            "shoulder": [0.5 * np.sin(side + np.pi) for side in sides],
            "elbow": [np.full_like(t, 1.5)] * 2,
        }
        positions = _pose(standing, angles, np.full_like(t, 0.12))
        positions[..., 2] -= FLIGHT_MM * np.cos(2.0 * turned)[:, None]
        return positions
    rate = generator.uniform(0.3, 0.6)
    depth = generator.uniform(0.7, 1.0) * 0.5 * (1.0 - np.cos(2.0 * np.pi * rate * t))
    if activity is Activity.sit:  # down, a pause, and up again
        depth = np.clip(1.6 * depth - 0.3, 0.0, 0.9)
    angles = {
        "hip": [1.5 * depth] * 2,
        "knee": [1.9 * depth] * 2,
        "shoulder": [(1.2 if activity is Activity.squat else 0.3) * depth] * 2,
        "elbow": [0.2 + 0.0 * t] * 2,
    }
    positions = _pose(standing, angles, 0.5 * depth)
    return positions - positions[:, [_LEGS[0][2]]] + positions[0, _LEGS[0][2]]


def with_standing(
    walk: np.ndarray, frame_rate_hz: float, speed_mm_s: float, still_s: float, start_s: float = 0.4
) -> np.ndarray:
    """Return positions (T, 15, 3), mm, of a person who stands, then walks, then stands again.

    Parameters
    ----------
    walk : (n, 15, 3)
        Treadmill equivalent of the walk, mm.
    frame_rate_hz : float
    speed_mm_s : float
        Speed of the walker along +y.
    still_s, start_s : float
        Time of standing before and after, and time in which the legs start to move.
    """
    n = round(still_s * frame_rate_hz)
    padded = np.concatenate([np.repeat(walk[:1], n, axis=0), walk, np.repeat(walk[-1:], n, axis=0)])
    frames = np.arange(len(padded))
    ramp = start_s * frame_rate_hz
    moving = np.clip((frames - n) / ramp, 0.0, 1.0) * np.clip((len(frames) - 1 - n - frames) / ramp, 0.0, 1.0)
    standing = walk.mean(axis=0)
    positions = standing + moving[:, None, None] * (padded - standing)
    path = np.cumsum(moving) * speed_mm_s / frame_rate_hz
    positions[..., 1] += (path - path.mean())[:, None]
    return positions
