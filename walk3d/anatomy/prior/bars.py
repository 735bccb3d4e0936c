"""Standard deviations of reconstructed positions, and multipliers of error bars learnt from the errors of other people.

Symbols
-------
``z``  error of a number over its standard deviation
``m``  multiplier of a level: the quantile of |z| of other people, instead of the normal distribution's
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
"""Groups of joints with similar errors; the joints of a group share the multipliers of their error bars."""

GROUP_OF_JOINT = np.array(
    [next(n for n, names in enumerate(GROUPS.values()) if joint in names) for joint in WALKER15.joints]
)
"""Index (15,) of each joint's group in `GROUPS`."""


def at_instants(coefficients: np.ndarray, phases: int) -> np.ndarray:
    """Return coordinates (…, K) at K equally spaced phases of the cycle, from Fourier coefficients (…, 1 + 2H)."""
    basis = fourier.cycle_basis(fourier.equal_phases(phases), coefficients.shape[-1])
    return coefficients @ basis.T


def deviation_at_instants(covariance: np.ndarray, blocks: int, phases: int) -> np.ndarray:
    """Return standard deviations (…, U / B, K) of coordinates at K phases, from the coefficients' covariance (…, U, U).

    The B coefficients of a coordinate are adjacent.
    """
    size = covariance.shape[-1] // blocks
    split = covariance.reshape(*covariance.shape[:-2], size, blocks, size, blocks)
    of_coordinates = np.moveaxis(np.diagonal(split, axis1=-4, axis2=-2), -1, -3)  # (…, U / B, B, B)
    basis = fourier.cycle_basis(fourier.equal_phases(phases), blocks)
    return np.sqrt(((of_coordinates @ basis.T) * basis.T).sum(axis=-2))


def multipliers_without(
    z: np.ndarray, groups: np.ndarray, levels: np.ndarray, *, alike: np.ndarray | None = None
) -> np.ndarray:
    """Return multipliers (P, G, L) of error bars for each of P people, G groups of joints and L levels.

    The factors are learnt from the absolute standardised errors |z| of all other people.

    Parameters
    ----------
    z : (P, N, …, G')
        |error| over standard deviation; numbers of a group share their multipliers.
    groups : (G',) int
        Group of each entry of the last axis.
    levels : (L,)
        Levels between 0 and 1.
    alike : (P,), optional
        People with the same value, e.g. the same laboratory, are left out together.

    Notes
    -----
    A person's errors have no influence on that person's multipliers.
    """
    people = len(z)
    alike = np.arange(people) if alike is None else np.unique(alike, return_inverse=True)[1]
    count = groups.max() + 1
    multipliers = np.empty((people, count, len(levels)))
    for group in range(count):
        values = z[..., groups == group].reshape(people, -1)
        order = np.argsort(values, axis=None)
        ranked, label = values.ravel()[order], alike[order // values.shape[1]]
        for left_out in range(alike.max() + 1):
            removed = np.flatnonzero(label == left_out)
            position = levels * (len(ranked) - len(removed) - 1)
            # Number of removed values before each remaining rank.
            removed_before = removed - np.arange(len(removed))
            low, high = (
                ranked[k + np.searchsorted(removed_before, k, side="right")]
                for k in (np.floor(position).astype(int), np.ceil(position).astype(int))
            )
            multipliers[alike == left_out, group] = low + position % 1.0 * (high - low)
    return multipliers
