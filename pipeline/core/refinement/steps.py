"""Refinement of the trajectories of a whole body by its reprojection error (park2011 section 3.1).

Symbols
-------
``L``      limbs, one to each joint but the root; ``J = L + 1`` joints, the root first
``Theta``  trajectory basis, F x K
``lam``    damping of a step, in units of the diagonal of the curvature
``k0``     cutoff: coefficient at which a soft basis doubts the motion as much as the images speak for it

The problem is nonlinear least squares in 2 K unknowns for each limb, all limbs at once, because the image of a wrist
speaks for the upper arm too.  It is solved by Levenberg and Marquardt's method, with the structure of the tree used in
`refinement.equations`.  A step after which a joint stands behind its camera is rejected, like one after which
the cost is higher.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.core.pinhole import Pinhole
from pipeline.core.refinement import reprojection
from pipeline.core.refinement.equations import minimise
from pipeline.core.refinement.inputs import (
    basis_rows,
    frames_and_limbs,
    named_lengths,
    starting_path,
    tree_in_order,
)
from pipeline.core.refinement.reprojection import Observations
from pipeline.core.refinement.spherical import SphericalTrajectory
from pipeline.core.trajectory_basis import soft_ridge
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_count, require_range, require_shape

LENGTH_FACTOR = 2.0
"""Largest factor by which a free limb length may differ from its initial value, by default."""


@dataclass(frozen=True, kw_only=True)
class RefinementOptions:
    """Options for the refinement of trajectories.

    Attributes
    ----------
    free_lengths : bool
        Whether the logarithms of lengths are unknowns too.
    length_factor : float
        How far a free length may go from the given one, up or down.
    cutoff : float, optional
        k0 of a soft basis: each coefficient k is drawn to zero with weight (k / k0)^6, in units of the square of
        pixels to the radian; a hard basis by default.
    charts : (L, 3, 3), optional
        Rotations from the world to the axes of each limb's angles, as an earlier refinement returns them; by default
        the pole of each is farthest from the limb's path.
    max_iterations : int
        Steps to try, at least one.
    tolerance : float
        Largest move of an unknown, rad, in the last step, see the notes of `refine`.
    """

    free_lengths: bool = False
    length_factor: float = LENGTH_FACTOR
    cutoff: float | None = None
    charts: np.ndarray | None = None
    max_iterations: int = 500
    tolerance: float = 1e-8


@shortened
class Refinement:
    """Refined trajectories of all joints, with the remaining reprojection error and convergence of the solution.

    Attributes
    ----------
    positions : (F, J, 3)
        mm, the root first; NaN in frames where the root is not known.
    relative : (F, L, 3)
        Relative trajectories, mm: every one has its limb's length in every frame.
    coefficients_theta, coefficients_phi : (L, K)
        rad.
    lengths : (L,)
        mm.
    chart : (L, 3, 3)
        Rotations from the world to the axes in which each limb's angles are measured.
    reprojection_error_px : float
        Root mean square distance of reprojection and image.
    cost : float
        Half the sum of squared distances and penalties, px².
    converged : bool
    n_iterations : int
        Steps that were tried, the refused ones included.
    """

    positions: np.ndarray
    relative: np.ndarray
    coefficients_theta: np.ndarray
    coefficients_phi: np.ndarray
    lengths: np.ndarray
    chart: np.ndarray
    reprojection_error_px: float
    cost: float
    converged: bool
    n_iterations: int

    def relative_at(self, basis: np.ndarray) -> np.ndarray:
        """Return the relative trajectories (T, L, 3), mm, at the times of the basis rows (T, K).

        The rows may belong to times between frames.
        """
        paths = zip(self.coefficients_theta, self.coefficients_phi, self.chart, strict=True)
        units = np.stack([SphericalTrajectory(*path).directions(basis) for path in paths], axis=1)
        return self.lengths[:, None] * units


def refine(
    images: np.ndarray,
    camera: Pinhole,
    root: np.ndarray,
    parents: Sequence[int] | np.ndarray,
    directions: np.ndarray | Sequence[SphericalTrajectory],
    lengths: np.ndarray,
    *,
    basis: np.ndarray | int,
    options: RefinementOptions = RefinementOptions(),
    names: Sequence[str] | None = None,
) -> Refinement:
    """Refine the trajectories of all joints: minimise the reprojection error of the whole skeleton [park2011 5].

    Parameters
    ----------
    images : (F, J, 2)
        px; NaN where a joint was not seen.  Those of the root are not used.
    camera : Pinhole
        One, or one for each frame; frames in which it is not known drop out.
    root : (F, 3)
        mm; frames of NaN drop out.
    parents : (J,) int
        Index of each joint's parent; the root first with -1, and every parent before its children.
    directions : (F, L, 3), or sequence of SphericalTrajectory
        Where to start: relative trajectories of the joints after the root, or their directions, NaN where not known;
        or each limb's path in the basis, as `inputs.starting_path` returns it.
    lengths : (L,)
        mm.
    basis : (F, K) or int
        Trajectory basis, or K for the first K cosines.
    options : RefinementOptions
    names : sequence of str, optional
        Names of the J joints, for messages.

    Raises
    ------
    InvalidInput
        If shapes disagree, a parent comes after its child, a length is not positive, an option is unknown, a limb's
        direction is known in no frame, nothing was seen, or a joint that was seen starts behind its camera.

    Notes
    -----
    Printed with the distance itself, which is not smooth where it matters; its square is summed.  It has converged
    when a step next to undamped moves no unknown by more than `tolerance`, and has been taken, or when the residuals
    are rounding.  Such a step is one of Newton's method, whose error is of the order of its square.
    """
    frames, limbs = frames_and_limbs(images, root, directions, lengths)
    tree = tree_in_order(parents, limbs + 1)
    called = [str(joint) for joint in range(limbs + 1)] if names is None else list(names)
    lengths = named_lengths(lengths, called)
    require_range("tolerance", options.tolerance, above=0.0)
    require_count("max_iterations", options.max_iterations)
    require_range("length_factor", options.length_factor, above=1.0)
    rows = basis_rows(basis, frames)
    paths = _starting_paths(directions, rows, options, called)
    start = np.stack([np.concatenate([path.coefficients_theta, path.coefficients_phi]) for path in paths])
    unknowns = np.column_stack([start, np.zeros(limbs)]) if options.free_lengths else start
    observations = reprojection.observe(
        np.asarray(images, float)[:, 1:],
        camera,
        np.asarray(root, float),
        parents=tuple(parent - 1 for parent in tree[1:]),
        lengths=lengths,
        charts=np.stack([path.chart for path in paths]),
        basis=rows,
        penalty=np.zeros_like(unknowns),
    )
    _check_start(observations, unknowns, called)
    if options.cutoff is not None:
        observations = _softened(observations, unknowns, options.cutoff)
    bound = np.full_like(unknowns, np.inf)
    bound[:, 2 * rows.shape[1] :] = np.log(options.length_factor)
    solution = minimise(
        observations, unknowns, bound, max_iterations=options.max_iterations, tolerance=options.tolerance
    )
    return _refinement(observations, np.asarray(root, float), *solution)


def _starting_paths(
    directions: np.ndarray | Sequence[SphericalTrajectory],
    rows: np.ndarray,
    options: RefinementOptions,
    called: Sequence[str],
) -> list[SphericalTrajectory]:
    """Return the initial trajectory of each limb in the basis (F, K)."""
    limbs, charts = len(called) - 1, options.charts
    if paths := [path for path in directions if isinstance(path, SphericalTrajectory)]:
        return paths
    turns = [None] * limbs if charts is None else require_shape("charts", charts, (limbs, 3, 3))
    starts = zip(np.moveaxis(np.asarray(directions, float), 1, 0), turns, called[1:], strict=True)
    return [
        starting_path(path, rows, chart=chart, cutoff=options.cutoff, called=name)
        for path, chart, name in starts
    ]


def _refinement(
    given: Observations,
    root: np.ndarray,
    unknowns: np.ndarray,
    lowest: float,
    converged: bool,
    iterations: int,
) -> Refinement:
    """Return the refined motion at the final values of the unknowns (L, 2 K or 2 K + 1)."""
    moved = reprojection.relative(given, unknowns)
    ends = reprojection.forward(given, moved)
    distance = np.linalg.norm(reprojection.residuals(given, ends), axis=-1)
    joints = np.concatenate([root[None], ends]).swapaxes(0, 1)
    most = given.basis.shape[1]
    return Refinement(
        positions=np.where(np.isfinite(root).all(axis=1)[:, None, None], joints, np.nan),
        relative=moved.swapaxes(0, 1).copy(),
        coefficients_theta=unknowns[:, :most].copy(),
        coefficients_phi=unknowns[:, most : 2 * most].copy(),
        lengths=reprojection.lengths_mm(given, unknowns).copy(),
        chart=given.charts,
        reprojection_error_px=np.sqrt(np.nanmean(np.where(given.visible, distance, np.nan) ** 2)),
        cost=lowest,
        converged=converged,
        n_iterations=iterations,
    )


def _softened(given: Observations, unknowns: np.ndarray, cutoff: float) -> Observations:
    """Return the observations with a penalty on high-frequency coefficients, as for a soft basis.

    The penalty is scaled by the mean square image motion of each limb in pixels per radian.
    """
    by_position, movement = reprojection.linearise(given, unknowns)
    by_angle = by_position @ movement.swapaxes(2, 3)
    count = given.visible.sum(axis=1)
    squares = 0.5 * (by_angle**2).sum(axis=(1, 2, 3)) / np.maximum(count, 1)
    # A limb whose end is never seen has no pixels of its own.
    squares = np.where(count > 0, squares, squares[count > 0].mean())
    doubts = np.tile(soft_ridge(given.basis.shape[1], cutoff), 2)
    penalty = np.zeros_like(unknowns)
    penalty[:, : len(doubts)] = squares[:, None] * doubts
    return replace(given, penalty=penalty)


def _check_start(given: Observations, unknowns: np.ndarray, called: Sequence[str]) -> None:
    if not given.visible.any():
        raise InvalidInput(
            "no joint was observed",
            expected="at least one image of a joint other than the root, with camera and root position",
            code="nothing_seen",
        )
    positions = reprojection.forward(given, reprojection.relative(given, unknowns))
    wrong = np.argwhere(reprojection.behind(given, positions).T)
    if len(wrong):
        frame, limb = wrong[0]
        raise InvalidInput(
            f"the initial trajectory lies behind the camera in frame {frame}",
            f"joint {called[limb + 1]}",
            "all observed joints in front of the camera",
            code="behind_camera",
            frame=frame,
        )
