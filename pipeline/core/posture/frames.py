"""Local frames of reference for the directions of limbs [mozerov2006 1].

A direction has no twist, so a frame needs a second one.  With h, t, s the unit directions of hip (left to right),
torso (pelvis to sternum) and shoulder (left to right); axes are x to the right, y ahead, z up::

    stance    x = h, z = the vertical made perpendicular to h    gives the torso
    hip       x = h, z = t made perpendicular to h               gives the thighs
    torso     z = t, x = h made perpendicular to t               gives shoulder and neck
    shoulder  x = s, z = t made perpendicular to s               gives the arms
    thigh     the hip frame after the smallest rotation that brings its rest direction to the thigh: gives the leg
    arm       the shoulder frame, likewise to the arm: gives the forearm

The torso cannot be expressed in a frame built from itself: its bend against the vertical would be lost, and with it the
way back to joints.  The hip has no parent: it is given in the world.

The smallest rotation is not defined to the direction opposite to rest (no frame is continuous over all
directions).  Rest is therefore the middle of what the joint can reach, not the hanging limb: with thighs at rest
straight down, a deep squat, knees next to the trunk, comes within 27 degrees of the opposite; from the rest chosen
here, squats, bends, walks and dances stay 50 degrees away.

Frames are arrays (T, 3, 3) whose rows are the axes in the world; directions are (T, 3).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.skeleton import POSTURE12
from pipeline.validation import InvalidInput

HIP, TORSO, SHOULDER, NECK = range(4)
THIGHS, LEGS, ARMS, FOREARMS = (4, 5), (6, 7), (8, 9), (10, 11)
"""Indices of limbs in the list POSTURE12; in a pair the left limb comes first."""

REST = {
    limb: np.array(direction) / np.linalg.norm(direction)
    for limb, direction in zip(
        (*THIGHS, *ARMS),
        ([-0.65, 0.75, 0], [0.65, 0.75, 0], [-0.6, 0.6, -0.5], [0.6, 0.6, -0.5]),
        strict=True,
    )
}
"""Reference directions of thighs and upper arms; the frame of a limb is rotated from its reference direction.

They are given in the frame of the hip or the shoulder.
"""

LEAST_SINE = 1e-3
"""Smallest sine of the angle between two directions that can define a frame of reference."""

HIP_UPRIGHT = "hip_upright", "the hip axis is vertical"
TORSO_ALONG_HIP = "torso_along_hip", "the torso lies along the hip axis"
SHOULDER_ALONG_TORSO = "shoulder_along_torso", "the shoulder axis lies along the torso"
AGAINST_REST = "against_rest", "the limb {limb} points against its rest direction"

_UP = np.array([0.0, 0.0, 1.0])


def stance(h: np.ndarray) -> np.ndarray:
    """Return the frame of reference (T, 3, 3) for the torso direction, with the hip axis as x and z close to vertical.

    Raises
    ------
    InvalidInput
        Where the hip axis is vertical.
    """
    return _axes(h, _UP, HIP_UPRIGHT)


def hip_and_torso(h: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames of reference of hip and torso, each (T, 3, 3); their forward axes are equal.

    Raises
    ------
    InvalidInput
        Where the torso lies along the hip axis.
    """
    hip = _axes(h, t, TORSO_ALONG_HIP)
    return hip, np.stack([np.cross(hip[:, 1], t), hip[:, 1], t], axis=1)


def shoulder(s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return the frame of reference (T, 3, 3) of the shoulders.

    Raises
    ------
    InvalidInput
        Where the shoulder axis lies along the torso.
    """
    return _axes(s, t, SHOULDER_ALONG_TORSO)


def components_in(frames: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the components (T, 3) of world vectors (T, 3) in a frame of reference."""
    return np.einsum("tij,tj->ti", frames, vectors)


def components_after(limb: int, direction: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Transform vectors (T, 3) from the frame of the hip or shoulder into the frame of the thigh or upper arm.

    Raises
    ------
    InvalidInput
        Where the limb points against its rest direction.
    """
    return _turned(direction, REST[limb], vectors, POSTURE12.limbs[limb])


def _axes(x: np.ndarray, upward: np.ndarray, wrong: tuple[str, str]) -> np.ndarray:
    """Return frames of reference (T, 3, 3) with given x axes, and z axes as close as possible to a second direction."""
    z = upward - (x * upward).sum(axis=-1, keepdims=True) * x
    length = np.linalg.norm(z, axis=-1, keepdims=True)
    _require_defined(length[:, 0] < LEAST_SINE, wrong)
    z = z / length
    return np.stack([x, np.cross(z, x), z], axis=1)


def _turned(from_: np.ndarray, to: np.ndarray, vectors: np.ndarray, limb: str) -> np.ndarray:
    """Rotate vectors by the smallest rotation that takes one unit direction to another."""
    axis = np.cross(from_, to)  # of length sine
    cosine = (from_ * to).sum(axis=-1, keepdims=True)
    against = (cosine[:, 0] < 0.0) & (np.linalg.norm(axis, axis=-1) < LEAST_SINE)
    _require_defined(against, AGAINST_REST, limb=limb)
    along = (axis * vectors).sum(axis=-1, keepdims=True)
    return cosine * vectors + np.cross(axis, vectors) + along / (1.0 + cosine) * axis


def undefined(frame: int, fault: tuple[str, str], **values: Any) -> InvalidInput:
    """Return the exception for two directions that cannot define a frame of reference."""
    code, what = fault
    sentence = f"{what.format(**values)}, so its frame is not defined"
    return InvalidInput(sentence, f"frame {frame}", code=code, **values)


def _require_defined(wrong: np.ndarray, fault: tuple[str, str], **values: str) -> None:
    if wrong.any():
        raise undefined(int(wrong.argmax()), fault, **values)
