"""Inputs of the refinement of a whole body: checks of the arrays, and initial trajectories.

Symbols
-------
``F``   frames; ``J`` joints, the root first; ``L = J - 1`` limbs; ``K`` components of the trajectory basis
``k0``  cutoff: coefficient at which a soft basis doubts the motion as much as what was seen speaks for it
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.refinement.spherical import SphericalTrajectory, continuous_angles, fit
from pipeline.core.trajectory_basis import cosine_basis, soft_ridge
from pipeline.validation import InvalidInput, require_finite, require_range, require_shape

_START_PENALTY = 1e-4
"""Penalty on the highest coefficient of an initial trajectory, which prevents oscillation in gaps.

A measured frame has weight one.
"""


def frames_and_limbs(
    images: np.ndarray,
    root: np.ndarray,
    directions: np.ndarray | Sequence[SphericalTrajectory],
    lengths: np.ndarray,
) -> tuple[int, int]:
    """Return the numbers of frames F and limbs L, after checking that the shapes of the arrays agree.

    Parameters
    ----------
    images : (F, J, 2)
    root : (F, 3)
    directions : (F, L, 3), or a sequence of L SphericalTrajectory
    lengths : (L,)

    Raises
    ------
    InvalidInput
        If they do not agree, or there is no frame or no limb.
    """
    frames, joints, _ = require_shape("images", images, ("F", "J", 2)).shape
    limbs = int(require_range("joints", joints, at_least=2)) - 1
    require_range("frames", frames, at_least=1)
    paths = len(directions) > 0 and isinstance(directions[0], SphericalTrajectory)
    for name, array, shape in (
        ("root", root, (frames, 3)),
        ("directions", directions, (limbs,) if paths else (frames, limbs, 3)),
        ("lengths", lengths, (limbs,)),
    ):
        require_shape(name, array, shape)
    return frames, limbs


def tree_in_order(parents: Sequence[int] | np.ndarray, joints: int) -> tuple[int, ...]:
    """Return the index of each joint's parent (J,), after checking that parents come before their children.

    The first joint is the root, and every other joint comes after its parent.

    Raises
    ------
    InvalidInput
        If they are not so.
    """
    tree = tuple(int(require_range("parent", parent, at_least=-1, whole=True)) for parent in parents)
    rooted = len(tree) == joints and tree[0] == -1
    if not rooted or not all(0 <= parent < joint for joint, parent in enumerate(tree) if joint):
        raise InvalidInput(
            "the parents do not form a tree in which each parent precedes its children",
            expected=f"{joints} indices: -1 for the root first, and each parent before its children",
            received=tree,
            code="not_a_tree",
        )
    return tree


def basis_rows(basis: np.ndarray | int, frames: int) -> np.ndarray:
    """Return the trajectory basis (F, K): the given array, or the first K cosines.

    Raises
    ------
    InvalidInput
        If it has another number of frames, no component, more cosines than frames or a value that is not finite.
    """
    if isinstance(basis, int | np.integer):
        return cosine_basis(frames, int(basis))
    rows = require_finite("basis", require_shape("basis", np.array(basis, float), (frames, "K")))
    require_range("components", rows.shape[1], at_least=1)
    return rows


def named_lengths(lengths: np.ndarray, called: Sequence[str]) -> np.ndarray:
    """Return the limb lengths (L,), after checking that each is positive and that every joint has a name."""
    lengths = np.array(lengths, float)
    require_shape("names", called, (len(lengths) + 1,))
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
    """Return the initial trajectory of a limb: the one in the basis that is nearest to given directions.

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
            f"initial trajectory of joint {called}",
            refusal.expected,
            refusal.received,
            code=refusal.code,
            **refusal.values,
        ) from None
