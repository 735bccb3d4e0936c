"""Error bars: standard deviations of positions at instants, and multipliers learnt from other people.

Symbols
-------
``z``  error of a number over its standard deviation
``m``  multiplier of a level: the quantile of |z| of the others, in place of the normal distribution's
"""

from __future__ import annotations

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import WALKER15

GROUPS = {
    "trunk": ("head", "sternum", "pelvis"),
    "shoulder": ("left_shoulder", "right_shoulder"),
    "elbow": ("left_elbow", "right_elbow"),
    "wrist": ("left_wrist", "right_wrist"),
    "hip": ("left_hip", "right_hip"),
    "knee": ("left_knee", "right_knee"),
    "ankle": ("left_ankle", "right_ankle"),
}
"""Joints whose errors are alike."""

GROUP_OF_JOINT = np.array(
    [next(n for n, names in enumerate(GROUPS.values()) if joint in names) for joint in WALKER15.joints]
)
"""Group (15,) of each joint."""


def at_instants(coefficients: np.ndarray, phases: int) -> np.ndarray:
    """Positions (…, K) of coefficients (…, 1 + 2H) at K equally spaced phases."""
    basis = fourier.cycle_basis(fourier.equal_phases(phases), coefficients.shape[-1])
    return coefficients @ basis.T


def deviation_at_instants(covariance: np.ndarray, blocks: int, phases: int) -> np.ndarray:
    """Standard deviations (…, U / B, K) at instants, of coefficients with this covariance (…, U, U).

    The coefficients of one coordinate of a joint, B of them, stand together.
    """
    size = covariance.shape[-1] // blocks
    split = covariance.reshape(*covariance.shape[:-2], size, blocks, size, blocks)
    own = np.moveaxis(np.diagonal(split, axis1=-4, axis2=-2), -1, -3)  # (…, U / B, B, B)
    basis = fourier.cycle_basis(fourier.equal_phases(phases), blocks)
    return np.sqrt(((own @ basis.T) * basis.T).sum(axis=-2))


def multipliers_without(
    z: np.ndarray, groups: np.ndarray, levels: np.ndarray, *, alike: np.ndarray | None = None
) -> np.ndarray:
    """Multipliers (P, G, L) of the bars of each person, from |z| of all other people.

    Parameters
    ----------
    z : (P, N, …, G')
        |error| over standard deviation; numbers of one group share their multipliers.
    groups : (G',) int
        Group of each entry of the last axis.
    levels : (L,)
        Between 0 and 1.
    alike : (P,), optional
        People with the same value, as of one laboratory, leave together.

    Notes
    -----
    The person's own errors never reach the multipliers.
    """
    people = len(z)
    alike = np.arange(people) if alike is None else np.unique(alike, return_inverse=True)[1]
    count = groups.max() + 1
    found = np.empty((people, count, len(levels)))
    for group in range(count):
        values = z[..., groups == group].reshape(people, -1)
        order = np.argsort(values, axis=None)
        ranked, label = values.ravel()[order], alike[order // values.shape[1]]
        for left_out in range(alike.max() + 1):
            own = np.flatnonzero(label == left_out)
            place = levels * (len(ranked) - len(own) - 1)
            # The k-th of the others comes after so many of those left out.
            before = own - np.arange(len(own))
            low, high = (
                ranked[k + np.searchsorted(before, k, side="right")]
                for k in (np.floor(place).astype(int), np.ceil(place).astype(int))
            )
            found[alike == left_out, group] = low + place % 1.0 * (high - low)
    return found
