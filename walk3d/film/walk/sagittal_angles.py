"""Signed joint angles in the plane of progression, as gait laboratories report them.

In the walker's axes (right, forwards, up), the plane of progression is that of forwards and up.  Every angle is an
inclination of a segment in this plane, or a difference of two.  Flexion is positive and extension negative, as the ISB
defines hip and knee [Wu 2002].  A thigh, an upper arm or a forearm is flexed in front of the segment above it, a shank
behind it.  Trunk and shank are measured from the vertical, positive if the upper end is in front.

Symbols
-------
``v``  a segment, from its upper joint to its lower one
``e``  its inclination ``atan2(v_y, -v_z)``: 0 where it hangs, positive where its lower end is in front
``M``  signs of the inclinations in each angle: +1 and -1
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15

SIDES = ("left", "right")
KINDS = ("knee", "hip", "shank", "elbow", "shoulder", "trunk")
"""Kinds of angles; the trunk has no side."""
ANGLES = (*(f"{side}_{kind}" for kind in KINDS[:-1] for side in SIDES), "trunk")
"""Names of the angles, in the order of all arrays of angles."""

_LIMBS = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle"), "upper arm": ("shoulder", "elbow"),
          "forearm": ("elbow", "wrist")}  # fmt: skip
_SEGMENTS = {"trunk": ("sternum", "pelvis")} | {
    f"{side} {limb}": (f"{side}_{upper}", f"{side}_{lower}")
    for side in SIDES
    for limb, (upper, lower) in _LIMBS.items()
}
_SEGMENTS_OF_KIND = {
    "knee": ("thigh", "shank"), "hip": ("thigh", "trunk"), "shank": ("", "shank"), "elbow": ("forearm", "upper arm"),
    "shoulder": ("upper arm", "trunk"), "trunk": ("", "trunk"),
}  # fmt: skip
"""Segment whose inclination is measured, and reference segment, for each kind of joint angle.

An empty reference is the vertical.
"""


def _signs() -> np.ndarray:
    names = list(_SEGMENTS)
    signs = np.zeros((len(ANGLES), len(names)))
    for row, angle in zip(signs, ANGLES, strict=True):
        side, _, kind = angle.rpartition("_")
        for sign, segment in zip((1.0, -1.0), _SEGMENTS_OF_KIND[kind], strict=True):
            if segment:
                row[names.index(segment if segment == "trunk" else f"{side} {segment}")] = sign
    return signs


_M = _signs()
_ENDS = np.stack(
    [
        np.eye(len(WALKER15.joints))[WALKER15.index(lower)]
        - np.eye(len(WALKER15.joints))[WALKER15.index(upper)]
        for upper, lower in _SEGMENTS.values()
    ]
)
"""Matrix (9, 15) from joint positions to segment vectors."""
_SLOPE_MATRIX = (_M[:, None] * _ENDS.T).reshape(-1, len(_ENDS))
"""Matrix (165, 9) from derivatives of segment inclinations to derivatives of joint angles.

Its rows are angles and joints; its columns are segments.
"""
JOINTS_OF = tuple(np.flatnonzero(row) for row in np.abs(_M) @ np.abs(_ENDS))
"""Indices of the joints on which each angle depends.

Only the forward and upward coordinates of these joints matter.
"""


def sagittal_angles(positions: np.ndarray) -> np.ndarray:
    """Return the signed joint angles (…, 11), rad, in the order of `ANGLES`.

    The positions of joints (…, 15, 3) are in the walker's axes.

    Examples
    --------
    A thigh that is raised forwards over a hanging shank: hip and knee are flexed.

    >>> at = np.zeros((15, 3))
    >>> at[WALKER15.index("sternum")] = [0, 0, 500]
    >>> at[WALKER15.index("left_knee")] = [0, 100, -100]
    >>> at[WALKER15.index("left_ankle")] = [0, 100, -200]
    >>> angles = dict(zip(ANGLES, np.degrees(sagittal_angles(at)).round(6) + 0.0, strict=True))
    >>> [float(angles[name]) for name in ("left_hip", "left_knee", "left_shank", "trunk")]
    [45.0, 45.0, 0.0, 0.0]
    """
    segments = _ENDS @ positions
    inclined = np.arctan2(segments[..., 1], -segments[..., 2])
    return (inclined @ _M.T + np.pi) % (2.0 * np.pi) - np.pi


def sagittal_slopes(positions: np.ndarray) -> np.ndarray:
    """Return the derivatives (…, 11, 15, 3) of `sagittal_angles` by the joint positions, rad per unit of length."""
    segments = _ENDS @ positions
    y, z = segments[..., 1], segments[..., 2]
    slope = np.stack([np.zeros_like(y), -z, y], axis=-1) / np.maximum(y**2 + z**2, 1e-12)[..., None]
    return (_SLOPE_MATRIX @ slope).reshape(*slope.shape[:-2], len(_M), -1, 3)
