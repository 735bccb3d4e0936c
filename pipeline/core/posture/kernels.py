"""Compiled loops that compute joint positions from postures, the inverse of [mozerov2006 1].

A particle filter asks for the joints of millions of postures; as some two hundred operations on arrays of three
columns, nine tenths of the time went into looping over threes.  Vectors are tuples (x, y, z), frames are tuples of
their axes in the world; which frame gives which limb stands in `frames`.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from pipeline.compilation import compiled_exactly

DEFINED, NOT_FINITE, NO_COSINES, NO_STANCE, NO_HIP, NO_SHOULDER, AGAINST_REST = range(7)
"""Result codes of a posture: valid, or the reason why its joints are undefined."""

HIP, TORSO, SHOULDER, NECK = range(4)
FIRST_ARM = 8
"""Indices of limbs in the list POSTURE12."""

UP = (0.0, 0.0, 1.0)


@compiled_exactly
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_exactly
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled_exactly
def _sum(p, a, q, b):
    """Return the linear combination p a + q b of two vectors."""
    return p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]


@compiled_exactly
def _in_world(frame, v):
    """Return the vector in world coordinates that has components `v` in a frame of reference."""
    x, y, z = frame
    return (
        v[0] * x[0] + v[1] * y[0] + v[2] * z[0],
        v[0] * x[1] + v[1] * y[1] + v[2] * z[1],
        v[0] * x[2] + v[1] * y[2] + v[2] * z[2],
    )


@compiled_exactly
def _axes(x, upward, least_sine):
    """Return a frame of reference with a given x axis, and True if the frame is well defined.

    Its z axis is as close as possible to a second direction.
    """
    z = _sum(1.0, upward, -_dot(x, upward), x)
    length = np.sqrt(_dot(z, z))
    inverse = 1.0 / length
    z = (z[0] * inverse, z[1] * inverse, z[2] * inverse)
    return (x, _cross(z, x), z), length >= least_sine


@compiled_exactly
def _turned(rest, to, v, least_sine):
    """Rotate a vector by the smallest rotation between two directions; also return True if the rotation is defined."""
    axis, cosine = _cross(rest, to), _dot(rest, to)
    turned = _sum(1.0, _sum(cosine, v, 1.0, _cross(axis, v)), _dot(axis, v) / (1.0 + cosine), axis)
    return turned, cosine >= 0.0 or np.sqrt(_dot(axis, axis)) >= least_sine


@compiled_exactly
def _row(array, i):
    return array[i, 0], array[i, 1], array[i, 2]


@compiled_exactly
def _frames(cosines, in_parent, least_sine):
    """Return directions and frames of reference of hip, torso and shoulder, and a result code."""
    h = _row(cosines, HIP)
    stance, stands = _axes(h, UP, least_sine)
    t = _in_world(stance, _row(cosines, TORSO))
    hip, holds = _axes(h, t, least_sine)
    torso = (_cross(hip[1], t), hip[1], t)
    s = _in_world(torso if in_parent else hip, _row(cosines, SHOULDER))
    shoulder, spans = _axes(s, t, least_sine)
    wrong = DEFINED
    if not stands:
        wrong = NO_STANCE
    elif not holds:
        wrong = NO_HIP
    elif not spans:
        wrong = NO_SHOULDER
    return (h, t, s), (hip, torso, shoulder), wrong


@compiled_exactly
def _normalise(cosines):
    """Scale the direction cosines (12, 3) of limbs to unit length; return a result code and the index of an invalid
    limb.
    """
    for limb in range(len(cosines)):
        length = np.sqrt(_dot(cosines[limb], cosines[limb]))
        if not np.isfinite(length):
            return NOT_FINITE, limb
        if length == 0.0:
            return NO_COSINES, limb
        inverse = 1.0 / length
        for axis in range(3):
            cosines[limb, axis] *= inverse
    return DEFINED, 0


@compiled_exactly
def place_joints(postures, leg_length_mm, body, tree, positions, found):
    """Compute the joint positions (S, 15, 3), mm, of postures (S, 37), with NaN for invalid postures.

    Parameters
    ----------
    postures : (S, 37)
    leg_length_mm : float
    body : tuple
        Lengths (12,), pelvis (3,) and shoulders (3,) of `LimbLengths`, mm.
    tree : tuple
        Pelvis and sternum; ends (12, 2) of limbs; the limb over each (12,), or -1; rest directions (12, 3); whether
        cosines are relative to the parent; the least sine between two directions that make a frame.
    positions : (S, 15, 3)
    found : (S, 2) int
        What each posture is, and the limb that is wrong.
    """
    lengths, pelvis_mm, shoulders_mm = body
    pelvis, sternum, ends, over, rest, in_parent, least_sine = tree
    cosines = np.empty((len(lengths), 3))
    for i in range(len(postures)):
        for number in range(cosines.size):
            cosines[number // 3, number % 3] = postures[i, 1 + number]
        wrong, limb = _normalise(cosines)
        height_mm = postures[i, 0] * leg_length_mm
        if not np.isfinite(height_mm):
            wrong = NOT_FINITE
        if wrong == DEFINED:
            (h, t, s), (hip, torso, shoulder), wrong = _frames(cosines, in_parent, least_sine)
        if wrong == DEFINED:
            root = (0.0, 0.0, height_mm)
            chest = _sum(1.0, root, lengths[TORSO], t)
            hips = _sum(1.0, root, -1.0, _in_world(hip, pelvis_mm))
            shoulders = _sum(1.0, chest, 1.0, _in_world(shoulder, shoulders_mm))
            for axis in range(3):
                positions[i, pelvis, axis] = root[axis]
                positions[i, sternum, axis] = chest[axis]
                for side in range(2):
                    half = side - 0.5
                    positions[i, ends[HIP, side], axis] = hips[axis] + half * lengths[HIP] * h[axis]
                    positions[i, ends[SHOULDER, side], axis] = (
                        shoulders[axis] + half * lengths[SHOULDER] * s[axis]
                    )
            for beyond in range(NECK, len(lengths)):
                direction = _row(cosines, beyond)
                if in_parent and over[beyond] >= 0:
                    above = over[beyond]
                    direction, defined = _turned(
                        _row(rest, above), _row(cosines, above), direction, least_sine
                    )
                    if not defined:
                        wrong, limb = AGAINST_REST, above
                        break
                parent = hip  # of thighs and legs, and of all where cosines are relative to the hip
                if in_parent and beyond == NECK:
                    parent = torso
                elif in_parent and beyond >= FIRST_ARM:
                    parent = shoulder
                direction = _in_world(parent, direction)
                for axis in range(3):
                    start = positions[i, ends[beyond, 0], axis]
                    positions[i, ends[beyond, 1], axis] = start + lengths[beyond] * direction[axis]
        found[i] = wrong, limb
        if wrong != DEFINED:
            positions[i] = np.nan


@compiled_exactly
def nearest_of_each(points, recorded, distances):
    """Compute the distance (S, M) from each of S bodies to the nearest posture of each of M performances.

    The distance is the mean over joints.
    """
    joints = points.shape[1]
    for i in range(len(points)):
        start = 0
        for m in range(len(recorded)):
            least, nearest = np.inf, start
            for step in range(recorded.shape[1]):
                # From where the last performance was nearest: most others are soon found to be farther.
                p = (start + step) % recorded.shape[1]
                total = 0.0
                for j in range(joints):
                    square = 0.0
                    for d in range(3):
                        square += (points[i, j, d] - recorded[m, p, j, d]) ** 2
                    total += np.sqrt(square)
                    if total >= least:
                        break
                if total < least:
                    least, nearest = total, p
            start = nearest
            distances[i, m] = least / joints
