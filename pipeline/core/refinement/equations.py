"""Normal equations of the refinement of a tree of limbs, and their solution along the tree (park2011 section 3.1).

Symbols
-------
``e``      residuals, ``J`` their derivative by all unknowns
``H``      J^T J + penalty, the Gauss-Newton approximation of the curvature, or the curvature; ``g`` the gradient
``S``      sum of A^T A over all joints that a limb carries, 3 x 3 in each frame; A the derivative of the
           reprojection; of the exact curvature, the sum of second derivatives of the joints' squared distances
``t``      derivative of a limb by one of its angles in a frame; ``Theta`` the trajectory basis

Why J is never formed: the image of a joint depends only on the limbs between it and the root, and a frame's angle only
on that frame's row of Theta.  So the block of H between a limb and one of those that carry it is
``Theta^T diag(t^T S t') Theta``, and it is zero between two limbs if neither carries the other.  Eliminating limbs
from the ends of the tree towards the root keeps these zeros.  Against the dense product and the dense factorisation
that is a tenth of the work for a skeleton of fourteen limbs.  And products of two cosines are sums of two cosines,
so that all blocks are filled from 2 K - 1 sums over frames (`trajectory_basis.products`), not K².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.refinement import kernels
from pipeline.core.refinement.reprojection import Observations, angles, cost, lengths_mm

_FREE_STEP = 1e-7
"""Damping below which a Levenberg-Marquardt step counts as undamped, so that its size measures the distance to the
minimum.
"""

_RIDGE = 1e-10
"""Smallest damping of a Levenberg-Marquardt step; it stabilises unknowns that the images hardly determine."""

_APPROXIMATE = 15
"""Number of Levenberg-Marquardt steps with the Gauss-Newton approximation before exact second derivatives are used."""

_ROUNDING_PX = 64 * np.finfo(float).eps
"""Residual, relative to the largest image coordinate, below which the refinement has converged to rounding error."""


@dataclass(frozen=True)
class LimbEquations:
    """Gradient and second derivatives of the refinement's cost, arranged by limbs.

    Attributes
    ----------
    gradient : (L, N)
        g.
    scale : (L, N)
        Diagonal of J^T J + penalty, which is never negative.
    rows : (L, N, M, N)
        For each limb its blocks of H with the limbs of its line.
    lines : (L, M) int
        Those limbs: itself, its parent, and so on, then -1.
    """

    gradient: np.ndarray
    scale: np.ndarray
    rows: np.ndarray
    lines: np.ndarray

    def curvature_along(self, step: np.ndarray) -> float:
        """Return the quadratic form step^T H step, where H contains the second derivatives of the refinement's cost."""
        return kernels.curvature_along(self.rows, self.lines, step)


def normal_equations(given: Observations, unknowns: np.ndarray, *, exact: bool = False) -> LimbEquations:
    """Return gradient and second derivatives of the refinement's cost at unknowns (L, N).

    With `exact`, H includes the second derivatives that the Gauss-Newton approximation omits.
    """
    limbs, size = unknowns.shape
    frames, components = given.basis.shape
    lines, products = given.lines, given.products
    numbers = 2 + (size > 2 * components)
    theta, phi = angles(given, unknowns)
    along, diagonal = np.empty((2, limbs, numbers, frames))
    couplings = np.zeros((limbs, lines.shape[1], numbers, numbers, frames))
    tree = (given.carriers, lengths_mm(given, unknowns), given.charts)
    sums = along, diagonal, couplings
    kernels.frame_by_frame(given.seen_by, tree, lines, theta, phi, numbers > 2, exact, sums)
    gradient, scale = given.penalty * unknowns, given.penalty.copy()
    rows = np.zeros((limbs, size, lines.shape[1], size))
    kernels.fill_gradient(along @ given.sums[0], diagonal @ given.sums[1], gradient, scale)
    columns = given.sums[2] if numbers > 2 else products.columns
    kernels.fill_rows(
        couplings @ columns, products.first, products.second, products.scale, lines, given.penalty, rows
    )
    return LimbEquations(gradient, scale, rows, lines)


def damped_step(equations: LimbEquations, damping: np.ndarray) -> np.ndarray:
    """Return the damped Newton step (L, N), the solution of (H + diag(damping)) step = -g.

    Parameters
    ----------
    equations : LimbEquations
    damping : (L, N)
        Not negative.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the damped matrix is not positive definite to working accuracy.
    """
    step = np.empty_like(equations.gradient)
    if not kernels.solve_along_tree(
        equations.rows.copy(), equations.lines, equations.gradient, damping, step
    ):
        raise np.linalg.LinAlgError("the damped matrix is not positive definite")
    return step


def minimise(
    given: Observations, unknowns: np.ndarray, bound: np.ndarray, *, max_iterations: int, tolerance: float
) -> tuple[np.ndarray, float, bool, int]:
    """Minimise the refinement's cost; return unknowns (L, N), cost in px², convergence flag and number of steps.

    Parameters
    ----------
    given : Observations
    unknowns : (L, N)
        The start, of finite cost.
    bound : (L, N)
        Largest magnitude of each unknown; infinite for those without.
    max_iterations : int
    tolerance : float
        As in `refine`.

    Notes
    -----
    Levenberg and Marquardt's method, in its first steps with the curvature of Gauss and Newton, which finds the way
    from a bad start, then with the exact one: residuals of limbs that were taken for their mirrors do not vanish, and
    without their second derivatives hundreds of steps end far from the minimum.
    """
    current = cost(given, unknowns)
    floor = _rounding(given)
    lam, growth, exact = 1e-3, 2.0, False
    equations: LimbEquations | None = None
    for iteration in range(max_iterations):
        if current <= floor:
            return unknowns, current, True, iteration
        if equations is None:
            exact = exact or iteration >= _APPROXIMATE
            # Of the damping, what a good step leaves: an exact model may be believed sooner.
            least = 0.1 if exact else 1.0 / 3.0
            equations = normal_equations(given, unknowns, exact=exact)
            # What no image speaks for has no curvature: it stays where it is instead of dividing by zero.
            diagonal = np.maximum(equations.scale, 1e-12 * equations.scale.max() or 1.0)
            # At its bound and pulled outwards, an unknown is held.
            at_bound = (np.abs(unknowns) >= bound) & (equations.gradient * unknowns < 0)
        try:
            step = damped_step(equations, diagonal * np.where(at_bound, 1e12, max(lam, _RIDGE)))
        except np.linalg.LinAlgError:
            lam, growth = max(lam, _FREE_STEP) * growth, growth * 2.0
            continue
        trial = np.clip(unknowns + step, -bound, bound)
        step = trial - unknowns
        promised = -(equations.gradient * step).sum() - 0.5 * equations.curvature_along(step)
        proposed = cost(given, trial)
        # A change of the cost below this is rounding, and does not say whether the step was good.
        rounding = np.sqrt(current * floor)
        small = np.abs(step).max() <= tolerance and lam <= _FREE_STEP
        if proposed < current or max(promised, proposed - current) <= rounding:
            gain = 1.0 if promised <= rounding else (current - proposed) / promised
            unknowns, current, equations = trial, proposed, None
            lam, growth = lam * max(least, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
            if small and exact:
                return unknowns, current, True, iteration + 1
            exact = exact or bool(small)
        else:
            lam, growth = max(lam, _RIDGE) * growth, growth * 2.0
    return unknowns, current, False, max_iterations


def _rounding(given: Observations) -> float:
    """Return the cost, px², below which the residuals of the refinement are rounding errors."""
    largest = max(np.abs(given.images).max(), np.abs(given.projection[:, :2]).max())
    return 0.5 * given.visible.sum() * (_ROUNDING_PX * float(largest)) ** 2
