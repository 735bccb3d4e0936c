"""Constraint that all people have the proportions of the average walker but may differ in size.

The constraint becomes a part of the prior.

Symbols
-------
``l``    mean lengths of the bones over the cycle, (16,); ``l_0`` those of the average walker
``P``    ``I - l_0 l_0^T / |l_0|²``: projection that removes size from lengths
``R``    rows (16, 45 B): the derivative of ``P l`` at the average walker

The new prior has the precision ``C^-1 + R^T R / s²``: proportions vary by s, to first order.  The mean does not change,
since it has the average proportions.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import fourier
from walk3d.anatomy.prior.prior import BONES, JOINTS, PHASES, Prior, conditioned_on_rows


def proportion_rows(mean: np.ndarray) -> np.ndarray:
    """Return the derivatives R (16, 45 B) of the body proportions by the coefficients of a walker.

    Parameters
    ----------
    mean : (15, 3, 1 + 2H)
        The average walker.
    """
    basis = fourier.cycle_basis(fourier.equal_phases(PHASES), mean.shape[-1])
    along = (mean[BONES[:, 1]] - mean[BONES[:, 0]]) @ basis.T  # (16, 3, K)
    length = np.linalg.norm(along, axis=1)
    slope = (along / length[:, None]) @ basis / PHASES  # (16, 3, B)
    rows = np.zeros((len(BONES), JOINTS, *mean.shape[1:]))
    bone = np.arange(len(BONES))
    rows[bone, BONES[:, 1]] += slope
    rows[bone, BONES[:, 0]] -= slope
    flat = rows.reshape(len(BONES), -1)
    size = length.mean(axis=1)
    return flat - np.outer(size, size @ flat) / (size @ size)


def with_proportions(prior: Prior, *, tolerance: float) -> Prior:
    """Return a prior whose walkers have the average walker's proportions, up to a tolerance in mm."""
    return conditioned_on_rows(prior, proportion_rows(prior.mean), np.full(len(BONES), tolerance**2))
