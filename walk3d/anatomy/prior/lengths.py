"""Most probable unknown coefficients of a walker whose bones have constant and symmetric length.

Symbols
-------
``u``         unknown coefficients of a view; ``mu``, ``Sigma`` their conditional mean and covariance
``l_b(k)``    length of bone b at phase k of K; its square is the sum of its squared visible and missing parts
``l_b``       mean of ``l_b(k)`` over phases
``s_b, s_p``  tolerances of a bone within the cycle, and of a pair of left and right bones, mm
``J(u)``      ``(u - mu)^T Sigma^-1 (u - mu)
              + (2H/K) sum_b,k ((l_b(k) - l_b) / s_b)² + sum_p ((l_left - l_right) / s_p)²``

The factor 2H/K counts 2H independent phases, since a length has about 2H degrees of freedom per cycle.  J is minimised
from mu by Gauss-Newton steps, then Newton steps; each step is halved until J decreases.  The Gauss-Newton matrix at the
minimum is the inverse covariance of Laplace's approximation.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import Any

import numpy as np
from scipy.linalg import lapack

from pipeline.core import fourier
from walk3d.anatomy.prior.conditional import Conditional, inverse
from walk3d.anatomy.prior.prior import BONES, JOINTS, PAIRS, PHASES, Prior

MIN_VARIANCE = 1.0
"""Minimum variance of a bone's length, mm², for recordings in which bones have exactly constant length."""
TURNING = 0.1
"""Variance of a bone's length within the cycle that offsets of its two joints cause, relative to the offsets' variance.

The bone turns by about 25 degrees either way; the value is twice the variance of the cosine between offset and bone.
"""
STEP_MM = 5e-3
"""Change of the Fourier coefficients, mm, below which the Newton iteration has converged.

The remaining error is of the order of the square of this change.
"""
GAUSS_NEWTON_STEPS = 3
"""Number of Gauss-Newton steps before the Newton steps with exact second derivatives."""
MAX_STEPS = 60
MAX_HALVINGS = 12
"""Maximum number of times that a Newton step is halved until the cost falls.

`MAX_STEPS` is the maximum number of steps.
"""
_ROUNDING_TOLERANCE = 1e-12
"""Relative increase of the cost J that counts as rounding error."""


ENDS = np.eye(JOINTS)[BONES[:, 1]] - np.eye(JOINTS)[BONES[:, 0]]
"""Matrix (16, 15) from joint positions to bone vectors: end minus start."""
SIDES = np.eye(len(BONES))[PAIRS[:, 0]] - np.eye(len(BONES))[PAIRS[:, 1]]
"""Matrix (P, 16) that subtracts the length of the right bone from that of the left bone, for each of P pairs."""
_LEVERS = np.stack([np.outer(ENDS[a], np.eye(len(BONES))[a]) for a in range(len(BONES))])
_LEVERS = (_LEVERS[PAIRS[:, 0]] - _LEVERS[PAIRS[:, 1]]).reshape(-1, len(BONES))
"""Matrix (15 P, 16) that maps gradients of bone lengths to gradients of the left-right differences of P pairs."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances, mm, of changes of bone lengths within the cycle, and of left-right differences of bone lengths.

    Attributes
    ----------
    within : (16,) or (M, 16)
        s_b, mm, for all walkers or for each; infinite for a bone without this constraint.
    pairs : (P,) or (M, P)
        s_p, mm.
    """

    within: np.ndarray
    pairs: np.ndarray


def tolerances(
    prior: Prior, *, within: float = 1.5, pairs: float = 2.0, bias: float = 0.0, slow: float = 0.0
) -> Tolerances:
    """Return the tolerances of bone lengths from a prior's variances, widened by factors and by detector errors.

    Parameters
    ----------
    prior : Prior
    within, pairs : float
        Factors on the standard deviations of training walks; infinite for no constraint.
    bias, slow : float
        Errors of a detector, mm, as in `Noise`; the errors of two joints add up in a bone.
    """
    fixed = bias**2 + prior.definition_variance
    s_b = np.sqrt(within**2 * prior.length_variance + MIN_VARIANCE + 2.0 * slow**2 + TURNING * fixed)
    s_p = np.sqrt(pairs**2 * prior.pair_variance + MIN_VARIANCE + 4.0 * fixed)
    return Tolerances(within=s_b, pairs=s_p)


@dataclass(frozen=True)
class Posterior:
    """Estimated unknown coefficients of M walkers in A views.

    Attributes
    ----------
    unknown : (A, M, U)
        Coefficients, mm.
    covariance : (A, M, U, U)
        Covariance of Laplace's approximation, mm²; empty unless requested.
    cost : (A, M)
        J at the minimum.
    converged : (A, M) bool
    """

    unknown: np.ndarray
    covariance: np.ndarray
    cost: np.ndarray
    converged: np.ndarray


class Lengths:
    """Bone-length terms of the cost J, and their derivatives, for n observed walks with the same visible joints.

    Parameters
    ----------
    unknown : (45 B,) bool
        Mask of unknown coefficients, as in `Conditional`.
    observed : (n, O)
        Observed coefficients, mm, in the order of ``~unknown``.
    limits : Tolerances
        Tolerances for all observations or for each.
    """

    def __init__(self, unknown: np.ndarray, observed: np.ndarray, limits: Tolerances) -> None:
        mask = unknown.reshape(JOINTS, 3, -1)
        n, self._blocks = len(observed), mask.shape[-1]
        axes = mask.any(axis=(0, 2))
        self._rows = np.flatnonzero(mask[:, axes])
        size, ends = axes.sum() * self._blocks, np.cumsum([0, *mask.sum(axis=(1, 2))])
        # For each joint: its slice of the unknown coefficients, and its unknown axes (the last one, or all).
        self._places = [
            (slice(start, end), slice(size - (end - start), size)) for start, end in pairwise(ends.tolist())
        ]
        self._basis = fourier.cycle_basis(fourier.equal_phases(PHASES), self._blocks)
        self._products = (self._basis[:, :, None] * self._basis[:, None]).reshape(PHASES, -1)
        walkers = np.zeros((n, len(unknown)))
        walkers[:, ~unknown] = observed
        split = walkers.reshape(n, JOINTS, 3, self._blocks)
        # Squared lengths along fully observed axes are constant.
        self._seen = (self._along(split[:, :, ~axes]) ** 2).sum(axis=2)
        self._start = np.ascontiguousarray(split[:, :, axes])
        self._weight = np.broadcast_to(
            ((self._blocks - 1) / PHASES / limits.within**2)[..., None], (n, len(BONES), 1)
        )
        self._pair_weight = np.broadcast_to(1.0 / limits.pairs**2, (n, len(PAIRS)))

    def _along(self, walkers: np.ndarray) -> np.ndarray:
        """Return bone vectors (n, 16, a, K) along `a` axes at K phases, from coefficients (n, 15, a, B) of joints."""
        bones = ENDS @ walkers.reshape(len(walkers), JOINTS, -1)
        return bones.reshape(len(walkers), len(BONES), -1, self._blocks) @ self._basis.T

    def _length_terms(self, u: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the bone-length terms (m,) of the cost J, bone directions, bone lengths, and half the derivatives.

        The directions are (m, 16, a, K), and the lengths are (m, 16, K).  The derivatives (m, 16, K) are those of the
        terms with respect to the bone lengths.

        The derivatives (m, 16, K) are those of the terms with respect to the bone lengths.
        """
        walkers = self._start[which]
        walkers.reshape(len(u), -1)[:, self._rows] = u
        along = self._along(walkers)
        length = np.sqrt(self._seen[which] + (along**2).sum(axis=2))
        mean = length.sum(axis=-1) / PHASES
        off, asymmetry = length - mean[..., None], mean @ SIDES.T
        pull, force = self._weight[which] * off, self._pair_weight[which] * asymmetry
        cost = (pull * off).sum(axis=(1, 2)) + (force * asymmetry).sum(axis=1)
        pull += (force @ SIDES / PHASES)[..., None]
        return cost, along / length[:, :, None], length, pull

    def slope(self, u: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the bone-length terms (m,) of the cost J for m selected walks, and half their gradient (m, U).

        `which` has the indices (m,) of the observations; the gradient has the shape (m, U).
        """
        cost, direction, _, pull = self._length_terms(u, which)
        of_bones = (pull[:, :, None] * direction) @ self._basis
        return cost, (ENDS.T @ of_bones.reshape(len(u), len(BONES), -1)).reshape(len(u), -1)[:, self._rows]

    def matrix(self, u: np.ndarray, which: np.ndarray, *, exact: bool = False) -> np.ndarray:
        """Return half the second derivatives (m, U, U) of the bone-length terms of the cost J, for m selected walks.

        They are those of Gauss-Newton, or exact, with the curvature of the lengths.
        """
        _, direction, length, pull = self._length_terms(u, which)
        n, a = len(u), direction.shape[2]
        size, weight = a * self._blocks, self._weight[which]
        tensor = direction[:, :, :, None] * direction[:, :, None]  # (n, 16, a, a, K)
        if exact:
            bend = pull / length
            tensor *= (weight - bend)[:, :, None, None]
            tensor[:, :, np.arange(a), np.arange(a)] += bend[:, :, None]
        else:
            tensor *= weight[:, :, None, None]
        blocks = (tensor @ self._products).reshape(*tensor.shape[:4], self._blocks, self._blocks)
        of_bones = np.swapaxes(blocks, 3, 4).reshape(n, len(BONES), size, size)
        mean = (direction @ self._basis).reshape(n, len(BONES), size) / PHASES
        of_bones -= (PHASES * weight * mean)[..., None] * mean[..., None, :]
        levers = (_LEVERS @ mean).reshape(n, len(PAIRS), -1)[..., self._rows]
        whole = np.swapaxes(levers, 1, 2) @ (levers * self._pair_weight[which][..., None])
        of_joints = (np.abs(ENDS).T @ of_bones.reshape(n, len(BONES), -1)).reshape(n, JOINTS, size, size)
        if whole.shape[1] == JOINTS * size:
            by_joint, every = whole.reshape(n, JOINTS, size, JOINTS, size), np.arange(JOINTS)
            by_joint[:, every, :, every] += np.swapaxes(of_joints, 0, 1)
            for start, other in (BONES.T, BONES.T[::-1]):
                by_joint[:, start, :, other] -= np.swapaxes(of_bones, 0, 1)
            return whole
        for joint, (at, entries) in enumerate(self._places):
            whole[:, at, at] += of_joints[:, joint, entries, entries]
        for bone, ends in enumerate(BONES.tolist()):
            for (at, entries), (to, other_entries) in permutations([self._places[joint] for joint in ends]):
                whole[:, at, to] -= of_bones[:, bone, entries, other_entries]
        return whole


def fit_lengths(
    conditional: Conditional,
    observed: np.ndarray,
    tolerances: Tolerances,
    *,
    with_covariance: bool = False,
) -> Posterior:
    """Return the most probable unknown coefficients of M walkers in A views each.

    Parameters
    ----------
    conditional : Conditional
        Conditional for A views.
    observed : (A, M, O)
        Observed coefficients, mm, in the order of ``~conditional.unknown``.
    tolerances : Tolerances
    with_covariance : bool
        Compute the covariance of Laplace's approximation.
    """
    views, walkers = observed.shape[:2]
    of_view = np.repeat(np.arange(views), walkers)
    precision = conditional.precision
    within, pairs = (
        np.tile(each, (views, 1)) if each.ndim == 2 else each
        for each in (tolerances.within, tolerances.pairs)
    )
    n = views * walkers
    lengths = Lengths(conditional.unknown, observed.reshape(n, -1), Tolerances(within=within, pairs=pairs))
    expected = conditional.expect(observed).reshape(n, -1)

    def slope(u: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the cost J of the selected walks, and half its gradient with respect to the unknown coefficients."""
        off = u - expected[which]
        pull = np.empty_like(off)
        ends = np.searchsorted(of_view[which], np.arange(views + 1))  # rows of a view are adjacent
        for view in range(views):
            part = slice(ends[view], ends[view + 1])
            pull[part] = off[part] @ precision[view]
        cost, gradient = lengths.slope(u, which)
        return (off * pull).sum(axis=1) + cost, gradient + pull

    state, left = expected.copy(), np.arange(n)
    cost, gradient = slope(state, left)
    converged = np.zeros(n, bool)
    for iteration in range(MAX_STEPS):
        exact = iteration >= GAUSS_NEWTON_STEPS
        step, indefinite = np.empty((len(left), state.shape[1])), []
        for row, matrix in enumerate(lengths.matrix(state[left], left, exact=exact)):
            matrix += precision[of_view[left[row]]]
            solved = _solve(matrix, gradient[left[row]])
            if solved is None:  # the exact matrix may be indefinite far from the minimum
                indefinite.append(row)
            else:
                step[row] = -solved
        if indefinite:
            rows = left[indefinite]
            for row, matrix, which in zip(indefinite, lengths.matrix(state[rows], rows), rows, strict=True):
                step[row] = -_solve(matrix + precision[of_view[which]], gradient[which])
        small = (np.abs(step).max(axis=1) < STEP_MM) & exact
        converged[left[small]] = True
        state[left[small]] += step[small]
        trying, factor = np.flatnonzero(~small), 1.0
        for _ in range(MAX_HALVINGS):
            if not len(trying):
                break
            rows = left[trying]
            proposal = state[rows] + factor * step[trying]
            new_cost, slopes = slope(proposal, rows)
            falls = new_cost <= cost[rows] * (1.0 + _ROUNDING_TOLERANCE)
            accepted = rows[falls]
            state[accepted], cost[accepted], gradient[accepted] = (
                proposal[falls],
                new_cost[falls],
                slopes[falls],
            )
            trying, factor = trying[~falls], factor / 2.0
        small[trying] = True  # no step decreases J
        left = left[~small]
        if not len(left):
            break
    covariance = np.empty((views, walkers, 0, 0))
    if with_covariance:
        matrix = lengths.matrix(state, np.arange(n)) + precision[of_view]
        covariance = np.stack([inverse(m) for m in matrix]).reshape(views, walkers, *precision.shape[1:])

    def shaped(values: np.ndarray) -> np.ndarray:
        return values.reshape(views, walkers, *values.shape[1:])

    return Posterior(shaped(state), covariance, shaped(cost), shaped(converged))


def _solve(matrix: np.ndarray, right: np.ndarray) -> Any:
    """Return the solution x of ``matrix @ x = right``, or None if the matrix is not positive definite.

    The matrix is overwritten.
    """
    _, solution, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
    return None if failed else solution
