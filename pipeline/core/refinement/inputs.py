"""What the refinement of a whole body is given: lengths, and where it starts.

Symbols
-------
``F``   frames; ``J`` joints, the root first; ``L = J - 1`` limbs; ``K`` components of the trajectory basis
``k0``  cutoff: coefficient at which a soft basis doubts the motion as much as what was seen speaks for it
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.refinement.spherical import SphericalTrajectory, continuous_angles, fit
from pipeline.core.trajectory_basis import soft_ridge
from pipeline.validation import InvalidInput, require_range

_START_PENALTY = 1e-4
"""Penalty of the highest coefficient at the start, against frames of weight one: keeps gaps from swinging."""


def named_lengths(lengths: np.ndarray, called: Sequence[str]) -> np.ndarray:
    """Lengths (L,), each a number above zero; every joint (L + 1,) has a name."""
    lengths = np.array(lengths, dtype=float)
    for name, length in zip(called[1:], lengths, strict=True):
        require_range(f"length of joint {name}", length, above=0.0, unit="mm")
    return lengths


def starting_path(
    directions: np.ndarray,
    rows: np.ndarray,
    *,
    cutoff: float | None,
    called: str,
    chart: np.ndarray | None = None,
) -> SphericalTrajectory:
    """The trajectory in the basis that is nearest to given directions of a limb.

    Parameters
    ----------
    directions : (F, 3)
        Of any length; NaN where not known.
    rows : (F, K)
        Trajectory basis.
    cutoff : float, optional
        k0 of a soft basis.
    called : str
        Name of the limb's joint.
    chart : (3, 3), optional
        Rotation from the world to the axes of the angles.

    Raises
    ------
    InvalidInput
        If a shape is wrong, or no direction is known, or one has no length.
    """
    components = rows.shape[1]
    penalty = _START_PENALTY * soft_ridge(components, max(components - 1, 1))
    if cutoff is not None:
        penalty = penalty + soft_ridge(components, cutoff)
    try:
        return fit(continuous_angles(directions, chart=chart), rows, penalty=penalty)
    except InvalidInput as refusal:
        raise InvalidInput(
            refusal.what,
            where=f"the start of joint {called}",
            expected=refusal.expected,
            received=refusal.received,
        ) from None
