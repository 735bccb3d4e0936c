"""Similarity of two recorded people, by the proportions of their limbs and by their postures.

A copy may be cut, shifted, resampled, mirrored, resized or noisy.  Two differences tell people apart, whatever the
place, heading, size, side and order in time:

- of limbs: logarithm of the ratio of lengths, less its mean, root mean square over thighs, shanks, upper and forearms;
- of postures: distance of a posture, per joint and for legs of 850 mm, from the nearest one of the other recording,
  median over the postures of the shorter.

Measured, in per cent and millimetres:

==========================================================  ==============  ================
Pairs of recordings                                         limbs           postures
==========================================================  ==============  ================
two people: CMU, HDM05, children of biomechZoo              from 1.4        from 30
two synthetic walkers, of three populations of 80           from 0.15       from 23
one person, other recordings, motion of a skeleton          to 0.005        11 to 280
a recording and itself resampled, cut and resized           to 0.15         to 14
a recording and itself with 5 mm of noise                   to 0.5          to 8
==========================================================  ==============  ================

People whose limbs are equal may have been put on one skeleton, as motion for animation is; they are not refused, but
their number is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pipeline.skeleton import LEFT_LEG, PELVIS, RIGHT_LEG, WALKER15

_SEGMENTS = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
_LIMBS = np.array(
    [[WALKER15.index(f"{side}_{j}") for j in ends] for side in ("left", "right") for ends in _SEGMENTS]
)
_LEGS, _OTHER_SIDE = [2, 3, 6, 7], [4, 5, 6, 7, 0, 1, 2, 3]
_HIPS = [LEFT_LEG[0], RIGHT_LEG[0]]
_LEG_MM = 850.0
_POSTURES_HZ, _MEAN_S = 30.0, 0.1  # the mean over a tenth of a second takes noise off
_LEAST_LIMBS, _LEAST_POSTURES, _MOST_ASKED = 6, 5, 300


@dataclass(frozen=True)
class Likeness:
    """Limb lengths and postures of a recorded person, for comparison with other recordings.

    Attributes
    ----------
    limbs_mm : (8,)
        Median length of each limb; NaN where an end is never seen.
    postures_mm : (N, 15, 3)
        Joints before the pelvis, the hips along x, legs of 850 mm, at about 30 Hz; NaN where a joint is not seen.
    """

    limbs_mm: np.ndarray
    postures_mm: np.ndarray


def likeness(positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float) -> Likeness:
    """Return the limb lengths and postures of a recorded person, for comparison with other recordings.

    Parameters
    ----------
    positions : (T, 15, 3)
        mm.
    valid : (T, 15) bool
    frame_rate_hz : float
    """
    points = np.where(valid[..., None], positions, np.nan)
    lengths = np.linalg.norm(points[:, _LIMBS[:, 1]] - points[:, _LIMBS[:, 0]], axis=-1)
    limbs = np.full(len(_LIMBS), np.nan)
    finite = np.isfinite(lengths).any(axis=0)
    limbs[finite] = np.nanmedian(lengths[:, finite], axis=0)
    across = points[:, _HIPS[1], :2] - points[:, _HIPS[0], :2]
    turn = np.arctan2(across[:, 1], across[:, 0])
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y, z = np.moveaxis(points - points[:, [PELVIS]], -1, 0)
    postures = np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)
    postures *= _LEG_MM / (limbs[_LEGS].sum() / 2.0)
    width = min(max(1, round(_MEAN_S * frame_rate_hz)), len(postures))
    means = np.lib.stride_tricks.sliding_window_view(postures, width, axis=0).mean(axis=-1)
    return Likeness(limbs, means[:: max(1, round(frame_rate_hz / _POSTURES_HZ))])


def limb_differences(one: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the difference in limb proportions, per cent, between one person (8,) and each of N others (N, 8).

    Each difference is the smaller one of the two to the other person and to the person's mirror image.

    NaN where fewer than six limbs are known of both, for legs alone do not tell people apart.
    """
    by_sides = []
    for sides in (others, others[:, _OTHER_SIDE]):
        ratio = np.log(sides / one)
        finite = np.isfinite(ratio)
        count = np.maximum(finite.sum(axis=1, keepdims=True), 1)
        ratio = np.where(finite, ratio, 0.0)
        off = np.where(finite, ratio - ratio.sum(axis=1, keepdims=True) / count, 0.0)
        rms = np.sqrt((off**2).sum(axis=1) / count[:, 0])
        by_sides.append(np.where(finite.sum(axis=1) >= _LEAST_LIMBS, 100.0 * rms, np.nan))
    return np.minimum(*by_sides)


def posture_difference_mm(one: np.ndarray, other: np.ndarray) -> float:
    """Return the distance per joint, mm, between two recordings by their postures (N, 15, 3).

    It is the smaller one of the two to the other recording and to the recording's mirror image.
    """
    short, long = sorted((one, other), key=len)
    short = short[:: -(-len(short) // _MOST_ASKED) or 1]
    mirrored = long[:, WALKER15.mirror] * [-1.0, 1.0, 1.0]
    return min(_median_distance(short, long), _median_distance(short, mirrored))


def _median_distance(asked: np.ndarray, among: np.ndarray) -> float:
    """Return the median distance, mm per joint, from each posture to the nearest posture of another recording.

    Infinite if too few postures have all joints.
    """
    measured = [np.isfinite(postures).any(axis=(0, 2)) for postures in (asked, among)]
    joints = np.flatnonzero(measured[0] & measured[1])
    sets = [postures[:, joints].reshape(len(postures), 3 * len(joints)) for postures in (asked, among)]
    sets = [rows[np.isfinite(rows).all(axis=1)] for rows in sets]
    if not len(joints) or min(map(len, sets)) < _LEAST_POSTURES:
        return np.inf
    return np.median(cKDTree(sets[1]).query(sets[0])[0]) / np.sqrt(len(joints))
