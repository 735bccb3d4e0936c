"""Flexion of hips, knees, shoulders and elbows, computed from joint centres.

Joint centres show flexion but not the rotation of a limb about its long axis.  Knee and elbow flexion is the departure
from a straight limb, in any plane.  Hip and shoulder flexion is the angle of the thigh or upper arm about the axis
through both hips or both shoulders: 0 along the trunk, positive forwards.  The joints do not show the tilt of the
pelvis, so hip flexion is measured against the trunk.

Symbols
-------
``x, f, u``  unit vectors of the trunk: to its right, forwards, upwards; ``u`` is the trunk's direction less its part
             along ``x``
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.validation import require_shape

JOINT_ANGLES = ("hip", "knee", "shoulder", "elbow")
"""Names of the joint angles, in the order of all arrays of joint angles."""

SIDES = ("left", "right")

LIMBS = {"hip": ("hip", "knee", "ankle"), "shoulder": ("shoulder", "elbow", "wrist")}
"""Joints along each limb, by the joint angle at the first of these joints.

The angle at the middle joint has the name of that joint.
"""

_TRUNK = ("pelvis", "sternum")


def joints_of(angle: str) -> tuple[int, ...]:
    """Return the indices in WALKER15 of the joints from which the left and right values of an angle are computed.

    Examples
    --------
    >>> [WALKER15.joints[j] for j in joints_of("elbow")][:3]
    ['left_shoulder', 'left_elbow', 'left_wrist']
    """
    root = angle if angle in LIMBS else next(root for root, limb in LIMBS.items() if limb[1] == angle)
    chain = LIMBS[root] if angle not in LIMBS else LIMBS[root][:2]
    names = [f"{side}_{joint}" for side in SIDES for joint in chain]
    return tuple(WALKER15.index(name) for name in (*names, *(_TRUNK if angle in LIMBS else ())))


def flexion(positions: np.ndarray) -> np.ndarray:
    """Return the flexion (…, 4, 2) of hips, knees, shoulders and elbows, radians, from joint positions (…, 15, 3).

    The flexion of limbs that hang straight down is 0.

    The axis of length 4 has the order of `JOINT_ANGLES`; the last axis has the order left, right.

    Parameters
    ----------
    positions : (…, 15, 3)
        Joints of WALKER15 in any unit, position and heading.

    Returns
    -------
    flexion : (…, 4, 2)
        Hip and shoulder from -π to π, knee and elbow from 0 to π.  NaN where a segment has length 0, or the trunk is
        parallel to the axis of hips or shoulders.
    """
    positions = np.asarray(positions, float)
    require_shape("positions", positions, (*positions.shape[:-2], len(WALKER15.joints), 3))
    at = {name: positions[..., number, :] for number, name in enumerate(WALKER15.joints)}
    trunk = at["sternum"] - at["pelvis"]
    result = np.empty((*positions.shape[:-2], len(JOINT_ANGLES), len(SIDES)))
    for pair, (root, limb) in enumerate(LIMBS.items()):
        right = _unit(at[f"right_{root}"] - at[f"left_{root}"])
        up = _unit(trunk - (trunk * right).sum(axis=-1, keepdims=True) * right)
        forwards = np.cross(up, right)
        for number, side in enumerate(SIDES):
            start, middle, end = (at[f"{side}_{joint}"] for joint in limb)
            upper, lower = _unit(middle - start), _unit(end - middle)
            result[..., 2 * pair, number] = np.arctan2(
                (upper * forwards).sum(axis=-1), -(upper * up).sum(axis=-1)
            )
            # The half angle is also accurate for a straight limb.
            result[..., 2 * pair + 1, number] = 2.0 * np.arctan2(
                np.linalg.norm(upper - lower, axis=-1), np.linalg.norm(upper + lower, axis=-1)
            )
    return result


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, np.nan)


def angle_errors(found: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the root mean square errors (…) of joint angles over a cycle, with and without their mean error, radians.

    Parameters
    ----------
    found, true : (…, T)
        Angles in radians at T instants; differences are taken around the circle.

    Examples
    --------
    >>> rmse, offset_free = angle_errors(np.array([0.3, 0.5]), np.array([0.1, 0.3]))
    >>> float(np.round(rmse, 12)), float(np.round(offset_free, 12))
    (0.2, 0.0)
    """
    off = np.angle(np.exp(1j * (np.asarray(found) - np.asarray(true))))
    square, mean = (off**2).mean(axis=-1), off.mean(axis=-1)
    return np.sqrt(square), np.sqrt(np.maximum(((off - mean[..., None]) ** 2).mean(axis=-1), 0.0))
