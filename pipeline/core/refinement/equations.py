"""Normal equations of a tree of limbs, and their solution along the tree: the inside of park2011's refinement.

Symbols
-------
``e``      residuals, ``J`` their derivative by all unknowns
``H``      J^T J + penalty, the Gauss-Newton approximation of the curvature, or the curvature; ``g`` the gradient
``S``      sum of A^T A over all joints that a limb carries, 3 x 3 in each frame; A the derivative of the
           reprojection; of the exact curvature, the sum of second derivatives of the joints' squared distances
``t``      derivative of a limb by one of its angles in a frame; ``Theta`` the trajectory basis

Why J is never formed: the image of a joint depends only on the limbs between it and the root, and a frame's angle only
on that frame's row of Theta.  So the block of H between a limb and one of those that carry it is
``Theta^T diag(t^T S t') Theta``, and between limbs of which neither carries the other it is zero.  Eliminating limbs
from the ends of the tree towards the root keeps these zeros.  Against the dense product and the dense factorisation
that is a tenth of the work for a skeleton of fourteen limbs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, solve_triangular

from pipeline.core.refinement.reprojection import Observations, cost, linearise

_FREE_STEP = 1e-7
"""Damping below which a step is taken for an undamped one: only such a step says how far the minimum is."""

_RIDGE = 1e-10
"""Least damping: what the images hardly determine stays where it is, instead of where rounding would put it."""

_APPROXIMATE = 15
"""Steps with the curvature of Gauss and Newton, before the exact one is used."""

_ROUNDING_PX = 64 * np.finfo(float).eps
"""Root mean square residual, in units of the largest image coordinate, below which it is rounding."""


@dataclass(frozen=True)
class LimbEquations:
    """Gradient and approximate curvature of the cost, by limbs.

    Attributes
    ----------
    gradient : (L, N)
        g.
    scale : (L, N)
        Diagonal of J^T J + penalty, which is never negative.
    rows : tuple of (N, n, N)
        For each limb its blocks of H with itself and with the n - 1 limbs that carry it, the nearest first.
    lines : tuple of tuple of int
        Those limbs: itself, its parent, and so on.
    """

    gradient: np.ndarray
    scale: np.ndarray
    rows: tuple[np.ndarray, ...]
    lines: tuple[tuple[int, ...], ...]

    def curvature_along(self, step: np.ndarray) -> float:
        """The square step^T H step of a step (L, N)."""
        total = 0.0
        for limb, (row, line) in enumerate(zip(self.rows, self.lines, strict=True)):
            here = np.tensordot(step[limb], row, axes=1)
            total += float(here[0] @ step[limb]) + 2.0 * float((here[1:] * step[list(line[1:])]).sum())
        return total


def normal_equations(given: Observations, unknowns: np.ndarray, *, exact: bool = False) -> LimbEquations:
    """g and the blocks of H at unknowns (L, N); `exact` with the second derivatives that Gauss and Newton leave out."""
    first = linearise(given, unknowns)
    pulls = first.pull.copy()
    # After Gauss and Newton, and, where that is asked for, exactly.
    squares = [first.square.copy(), *([first.bend.copy()] if exact else [])]
    for limb in range(len(given.parents) - 1, -1, -1):
        if (parent := given.parents[limb]) >= 0:
            for carried in (pulls, *squares):
                carried[parent] += carried[limb]
    size = unknowns.shape[1]
    along = np.einsum("lfcx,lfx->lcf", first.movement, pulls)
    by_angle = (along[:, :2] @ given.basis).reshape(len(along), -1)
    gradient = np.concatenate([by_angle, along[:, 2:].sum(axis=2)], axis=1) + given.penalty * unknowns
    own = np.einsum("lfax,lfxy,lfay->laf", first.movement, squares[0], first.movement)
    by_angle = (own[:, :2] @ given.basis**2).reshape(len(own), -1)
    scale = np.concatenate([by_angle, own[:, 2:].sum(axis=2)], axis=1) + given.penalty
    lines: list[tuple[int, ...]] = []
    rows: list[np.ndarray] = []
    for limb, parent in enumerate(given.parents):
        line = (limb, *(lines[parent] if parent >= 0 else ()))
        carried = first.movement[limb] @ squares[-1][limb]
        couplings = np.einsum("fax,mfbx->ambf", carried, first.movement[list(line)])
        if exact:
            couplings[:, 0] += np.einsum("fabx,fx->abf", first.turning[limb], pulls[limb])
        row = _blocks(couplings, given.basis, np.empty((size, len(line), size)))
        row[np.arange(size), 0, np.arange(size)] += given.penalty[limb]
        lines.append(line)
        rows.append(row)
    return LimbEquations(gradient, scale, tuple(rows), tuple(lines))


def _blocks(couplings: np.ndarray, basis: np.ndarray, out: np.ndarray) -> np.ndarray:
    """`out` (N, n, N) filled from couplings (C, n, C, F) of angles and length in each frame."""
    components, others = basis.shape[1], couplings.shape[1]
    angles = couplings[:2, :, :2]
    products = (angles[..., None, :] * basis.T) @ basis
    inside = out[: 2 * components, :, : 2 * components]
    inside[:] = products.transpose(0, 3, 1, 2, 4).reshape(inside.shape)
    if len(couplings) > 2:
        by_own, by_other = couplings[:2, :, 2] @ basis, couplings[2, :, :2] @ basis
        out[:-1, :, -1] = by_own.transpose(0, 2, 1).reshape(2 * components, others)
        out[-1, :, :-1] = by_other.reshape(others, 2 * components)
        out[-1, :, -1] = couplings[2, :, 2].sum(axis=1)
    return out


def damped_step(equations: LimbEquations, damping: np.ndarray) -> np.ndarray:
    """The step (L, N) that solves (H + diag(damping)) step = -g.

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
    size = equations.gradient.shape[1]
    rows = [row.reshape(size, -1).copy() for row in equations.rows]
    right = -equations.gradient
    factors: list[np.ndarray] = []
    for limb in range(len(rows) - 1, -1, -1):
        row = rows[limb]
        own = row[:, :size]
        own[np.arange(size), np.arange(size)] += damping[limb]
        factor = cho_factor(own, lower=True, check_finite=False)[0]
        solved = solve_triangular(
            factor, np.column_stack([right[limb], row[:, size:]]), lower=True, check_finite=False
        )
        right[limb], others = solved[:, 0], solved[:, 1:]
        factors.insert(0, factor)
        row[:, size:] = others
        fill, pull = others.T @ others, others.T @ right[limb]
        for place, carrier in enumerate(equations.lines[limb][1:]):
            start = place * size
            rows[carrier] -= fill[start : start + size, start:]
            right[carrier] -= pull[start : start + size]
    step = np.empty_like(right)
    for limb, line in enumerate(equations.lines):
        known = right[limb] - rows[limb][:, size:] @ step[list(line[1:])].ravel()
        step[limb] = solve_triangular(factors[limb], known, lower=True, trans="T", check_finite=False)
    return step


def minimise(
    given: Observations, unknowns: np.ndarray, bound: np.ndarray, *, max_iterations: int, tolerance: float
) -> tuple[np.ndarray, float, bool, int]:
    """Unknowns (L, N) of least cost that a start leads to, that cost in px², whether it converged, and steps tried.

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
    here = cost(given, unknowns)
    floor = _rounding(given)
    lam, growth, exact = 1e-3, 2.0, False
    equations: LimbEquations | None = None
    for tried in range(max_iterations):
        if here <= floor:
            return unknowns, here, True, tried
        if equations is None:
            exact = exact or tried >= _APPROXIMATE
            # Of the damping, what a good step leaves: an exact model may be believed sooner.
            least = 0.1 if exact else 1.0 / 3.0
            equations = normal_equations(given, unknowns, exact=exact)
            # What no image speaks for has no curvature: it stays where it is instead of dividing by zero.
            diagonal = np.maximum(equations.scale, 1e-12 * equations.scale.max() or 1.0)
            # At its bound and pulled outwards, an unknown is held.
            held = (np.abs(unknowns) >= bound) & (equations.gradient * unknowns < 0)
        try:
            step = damped_step(equations, diagonal * np.where(held, 1e12, max(lam, _RIDGE)))
        except np.linalg.LinAlgError:
            lam, growth = max(lam, _FREE_STEP) * growth, growth * 2.0
            continue
        trial = np.clip(unknowns + step, -bound, bound)
        step = trial - unknowns
        promised = -float((equations.gradient * step).sum()) - 0.5 * equations.curvature_along(step)
        there = cost(given, trial)
        # A change of the cost below this is rounding, and does not say whether the step was good.
        rounding = np.sqrt(here * floor)
        small = np.abs(step).max() <= tolerance and lam <= _FREE_STEP
        if there < here or max(promised, there - here) <= rounding:
            gain = 1.0 if promised <= rounding else (here - there) / promised
            unknowns, here, equations = trial, there, None
            lam, growth = lam * max(least, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
            if small and exact:
                return unknowns, here, True, tried + 1
            exact = exact or bool(small)
        else:
            lam, growth = max(lam, _RIDGE) * growth, growth * 2.0
    return unknowns, here, False, max_iterations


def _rounding(given: Observations) -> float:
    """Cost at which residuals are rounding, px²."""
    largest = max(np.abs(given.images).max(), np.abs(given.projection[:, :2]).max())
    return 0.5 * float(given.seen.sum()) * (_ROUNDING_PX * float(largest)) ** 2
