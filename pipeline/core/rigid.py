"""Clusters of points that move rigidly, and their motion in each frame.

Symbols
-------
``reference``  (P, 3) mm, the points in one posture
``positions``  (T, P, 3) mm, the same points over time, NaN where one was not seen
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import pdist

_FLAT = 1e-3
"""Ratio of second to first singular value of a cluster below which its points count as lying on a line."""

_FRAMES = 100
"""Number of frames, evenly spaced over a clip, in which distances between points are measured."""

_MOST_POINTS = 500
"""Largest number of points that are searched for rigid clusters; larger sets are body surfaces."""

_APART_MM = 1e9
"""Change assumed for the distance between two points that were never visible in the same frame, mm."""


@dataclass(frozen=True)
class RigidMotion:
    """Rotation and translation of a cluster of points in each frame.

    NaN in frames with fewer than three visible points, or with visible points on a line.

    Attributes
    ----------
    rotation : (T, 3, 3)
    translation : (T, 3)
        mm.
    residual_mm : (T,)
        Root mean square distance of the points seen from where the motion puts them.
    """

    rotation: np.ndarray
    translation: np.ndarray
    residual_mm: np.ndarray

    def carry(self, points: np.ndarray) -> np.ndarray:
        """Move points (Q, 3) of the reference posture with the rigid motion to each frame; return (T, Q, 3)."""
        return points @ np.swapaxes(self.rotation, 1, 2) + self.translation[:, None]


def fit_rigid_motion(reference: np.ndarray, positions: np.ndarray) -> RigidMotion:
    """Return the rigid motion that fits the points best in each frame, by least squares [Kabsch 1976].

    Parameters
    ----------
    reference : (P, 3)
        mm.
    positions : (T, P, 3)
        mm; points with NaN take no part in their frame.
    """
    finite = np.isfinite(positions).all(axis=-1)[..., None]
    count = np.maximum(finite.sum(axis=1), 1)
    centre = np.where(finite, reference, 0.0).sum(axis=1) / count
    centroid = np.where(finite, positions, 0.0).sum(axis=1) / count
    ours = np.where(finite, reference - centre[:, None], 0.0)
    theirs = np.where(finite, positions - centroid[:, None], 0.0)
    u, size, v = np.linalg.svd(np.swapaxes(theirs, 1, 2) @ ours)
    sign = np.ones_like(size)
    sign[:, 2] = np.linalg.det(u @ v)  # a mirror image is no motion
    usable = (count[:, 0] >= 3) & (size[:, 1] > _FLAT * size[:, 0])
    rotation = np.where(usable[:, None, None], (u * sign[:, None]) @ v, np.nan)
    left = theirs - ours @ np.swapaxes(rotation, 1, 2)
    residual = np.sqrt((left**2).sum(axis=(1, 2)) / count[:, 0])
    return RigidMotion(rotation, centroid - np.einsum("tij,tj->ti", rotation, centre), residual)


def rigid_clusters(
    positions: np.ndarray, tolerance_mm: float, reference: np.ndarray | None = None
) -> list[list[int]]:
    """Return groups of three or more points whose distances from each other stay constant over the clip.

    The list is empty for more than 500 points, which are a surface.

    Parameters
    ----------
    positions : (T, P, 3)
        mm.
    tolerance_mm : float
        Largest root mean square change of a distance within a group (complete linkage).
    reference : (P, 3), optional
        Posture in which the points have the distances they are to keep; by default their mean over the clip.
    """
    if not 3 <= positions.shape[1] <= _MOST_POINTS:
        return []
    times, lengths, squares = (np.zeros(positions.shape[1] * (positions.shape[1] - 1) // 2) for _ in range(3))
    for frame in positions[:: max(1, len(positions) // _FRAMES)]:
        distance = pdist(frame)
        finite = np.isfinite(distance)
        times += finite
        lengths += np.where(finite, distance, 0.0)
        squares += np.where(finite, distance**2, 0.0)
    mean, square = lengths / np.maximum(times, 1), squares / np.maximum(times, 1)
    rest = mean if reference is None else pdist(reference)
    change = np.sqrt(np.maximum(square - 2 * rest * mean + rest**2, 0.0))
    change = np.where((times > 0) & np.isfinite(change), change, _APART_MM)
    group = fcluster(linkage(change, "complete"), tolerance_mm, "distance")
    groups = [np.flatnonzero(group == g).tolist() for g in np.unique(group)]
    return sorted(members for members in groups if len(members) >= 3)
