"""What the refinement of a whole body is given: its arrays checked against each other, and where it starts.

Symbols
-------
``F``   frames; ``J`` joints, the root first; ``L = J - 1`` limbs; ``K`` components of the trajectory basis
``k0``  cutoff: coefficient at which a soft basis doubts the motion as much as what was seen speaks for it
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.refinement.reprojection import LOSSES
from pipeline.core.refinement.spherical import SphericalTrajectory, continuous_angles, cosines_at, fit
from pipeline.validation import InvalidInput, require_range

_START_PENALTY = 1e-4
"""Penalty of the highest coefficient at the start, against frames of weight one: keeps gaps from swinging."""


def frames_and_limbs(
    images: np.ndarray, root: np.ndarray, directions: np.ndarray, lengths: np.ndarray
) -> tuple[int, int]:
    """F and L of arrays whose shapes agree.

    Parameters
    ----------
    images : (F, J, 2)
    root : (F, 3)
    directions : (F, L, 3)
    lengths : (L,)

    Raises
    ------
    InvalidInput
        If they do not agree, or there is no frame or no limb.
    """
    shape = np.shape(images)
    if len(shape) != 3 or shape[0] < 1 or shape[1] < 2 or shape[2] != 2:
        raise InvalidInput(
            "the images have the wrong shape", expected="(F, J, 2), J > 1", received=str(shape)
        )
    frames, limbs = shape[0], shape[1] - 1
    for what, array, wanted in (
        ("root", root, (frames, 3)),
        ("directions", directions, (frames, limbs, 3)),
        ("lengths", lengths, (limbs,)),
    ):
        if np.shape(array) != wanted:
            raise InvalidInput(
                f"the {what} and the images do not agree",
                expected=str(wanted),
                received=str(np.shape(array)),
            )
    return frames, limbs


def tree_in_order(parents: Sequence[int] | np.ndarray, joints: int) -> tuple[int, ...]:
    """Parents (J,) of joints of which the first is the root and every other comes after its parent.

    Raises
    ------
    InvalidInput
        If they are not so.
    """
    tree = tuple(int(require_range("a parent", parent, at_least=-1, whole=True)) for parent in parents)
    rooted = len(tree) == joints and tree[0] == -1
    if not rooted or not all(0 <= parent < joint for joint, parent in enumerate(tree) if joint):
        raise InvalidInput(
            "the parents are not those of a tree in order",
            expected=f"{joints} numbers: -1 for the root, then each parent before its children",
            received=str(tree),
        )
    return tree


def basis_rows(basis: np.ndarray | int, frames: int) -> np.ndarray:
    """Trajectory basis (F, K), given or made of the first K cosines.

    Raises
    ------
    InvalidInput
        If it has another number of frames, no component, more cosines than frames or a value that is not finite.
    """
    if isinstance(basis, int | np.integer):
        if not 1 <= basis <= frames:
            raise InvalidInput(
                "the number of components cannot be so", expected=f"1 to {frames}", received=str(basis)
            )
        return cosines_at(np.arange(frames), frames, int(basis))
    rows = np.array(basis, dtype=float)
    if rows.ndim != 2 or len(rows) != frames or not rows.shape[1] or not np.isfinite(rows).all():
        raise InvalidInput(
            "the basis cannot be used", expected=f"finite numbers ({frames}, K)", received=str(rows.shape)
        )
    return rows


def check_lengths(lengths: np.ndarray, called: Sequence[str]) -> None:
    """Nothing, if every length (L,) is a number above zero and every joint has a name.

    Raises
    ------
    InvalidInput
        Otherwise.
    """
    if len(called) != len(lengths) + 1:
        raise InvalidInput(
            "joints and their names differ in number",
            expected=str(len(lengths) + 1),
            received=str(len(called)),
        )
    for name, length in zip(called[1:], lengths, strict=True):
        if not 0 < length < np.inf:
            raise InvalidInput(
                "the length of a limb cannot be so",
                where=f"joint {name}",
                expected="mm > 0",
                received=f"{length:g}",
            )


def check_options(loss: str, positive: dict[str, float | None], max_iterations: int) -> None:
    """Nothing, if the loss is known, numbers that must be positive are, and an iteration is allowed.

    Raises
    ------
    InvalidInput
        Otherwise.
    """
    if loss not in LOSSES:
        raise InvalidInput("the loss is unknown", expected=" or ".join(LOSSES), received=str(loss))
    for what, value in positive.items():
        if value is not None and not 0 < value < np.inf:
            raise InvalidInput(f"the {what} cannot be so", expected="a number above 0", received=f"{value:g}")
    require_range("the largest number of iterations", max_iterations, at_least=1, whole=True)


def softness(components: int, cutoff: float) -> np.ndarray:
    """Weights (K,) of the squares of coefficients in a soft basis, (k / k0)^6.

    Examples
    --------
    >>> softness(4, 1.0)
    array([  0.,   1.,  64., 729.])
    """
    return np.asarray((np.arange(components) / cutoff) ** 6)


def starting_paths(
    directions: np.ndarray,
    rows: np.ndarray,
    *,
    weights: np.ndarray | None,
    charts: np.ndarray | None,
    cutoff: float | None,
    called: Sequence[str],
) -> list[SphericalTrajectory]:
    """Trajectories in the basis, one to a limb, nearest to given directions.

    Parameters
    ----------
    directions : (F, L, 3)
        Of any length; NaN where not known.
    rows : (F, K)
        Trajectory basis.
    weights : (F, L), optional
        How much each direction counts.
    charts : (L, 3, 3), optional
        Rotations from the world to the axes of the angles.
    cutoff : float, optional
        k0 of a soft basis.
    called : sequence of str
        Names of the J joints.

    Raises
    ------
    InvalidInput
        If a shape is wrong, or for a limb no direction is known, or one has no length.
    """
    directions = np.asarray(directions, dtype=float)
    frames, limbs, _ = directions.shape
    counts = np.ones((frames, limbs)) if weights is None else np.asarray(weights, dtype=float)
    turns = np.empty((limbs, 3, 3)) if charts is None else np.asarray(charts, dtype=float)
    for what, array, wanted in (("weights", counts, (frames, limbs)), ("charts", turns, (limbs, 3, 3))):
        if array.shape != wanted:
            raise InvalidInput(
                f"the {what} have the wrong shape", expected=str(wanted), received=str(array.shape)
            )
    components = rows.shape[1]
    penalty = _START_PENALTY * softness(components, max(components - 1, 1))
    if cutoff is not None:
        penalty = penalty + softness(components, cutoff)
    paths = []
    for limb in range(limbs):
        try:
            angles = continuous_angles(directions[:, limb], chart=None if charts is None else turns[limb])
            paths.append(fit(angles, rows, weights=counts[:, limb], penalty=penalty))
        except InvalidInput as refusal:
            raise InvalidInput(
                refusal.what,
                where=f"the start of joint {called[limb + 1]}",
                expected=refusal.expected,
                received=refusal.received,
            ) from None
    return paths
