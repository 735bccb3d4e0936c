"""Bones keep their lengths: unknown coefficients that agree with the conditional and with constant, symmetric bones.

Symbols
-------
``u``         unknown coefficients of a view; ``mu``, ``Sigma`` their conditional mean and covariance
``l_b(k)``    length of bone b at phase k of K; its square is seen squared plus missing squared
``l_b``       its mean over phases
``s_b, s_p``  tolerances of a bone within the cycle, and of a pair of left and right bones, mm
``J(u)``      ``(u - mu)^T Sigma^-1 (u - mu)
              + (2H/K) sum_b,k ((l_b(k) - l_b) / s_b)² + sum_p ((l_left - l_right) / s_p)²``

2H of K phases are independent, since a length has about 2H numbers to a cycle.  Minimised from mu by Gauss-Newton
steps, then Newton's, each halved until J falls.  The Gauss-Newton matrix at the minimum is the inverse covariance of
Laplace's approximation.
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

LEAST_VARIANCE = 1.0
"""Of a tolerance, mm²: bones of a model may be exactly constant."""
TURNING = 0.1
"""What fixed offsets of two joints do to the variance of a length within the cycle, since the bone turns by some 25
degrees either way: twice the variance of the cosine between offset and bone."""
STEP_MM = 5e-3
"""Newton's last step changes no coefficient by more; what is left is of the order of its square."""
GAUSS_NEWTON_STEPS = 3
"""First steps, which may be far from the minimum; the ones after them know the curvature of lengths too."""
MOST_STEPS = 60
MOST_HALVINGS = 12
_ROUNDING = 1e-12
"""Relative increase of J that is rounding."""


ENDS = np.eye(JOINTS)[BONES[:, 1]] - np.eye(JOINTS)[BONES[:, 0]]
"""(16, 15): what a bone is of the joints, its end less its start."""
SIDES = np.eye(len(BONES))[PAIRS[:, 0]] - np.eye(len(BONES))[PAIRS[:, 1]]
"""(P, 16): a left bone less the right one."""
_LEVERS = np.stack([np.outer(ENDS[a], np.eye(len(BONES))[a]) for a in range(len(BONES))])
_LEVERS = (_LEVERS[PAIRS[:, 0]] - _LEVERS[PAIRS[:, 1]]).reshape(-1, len(BONES))
"""(15 P, 16): what the mean length of a left bone less that of the right one takes from the slopes of bones."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """How constant and how symmetric bones are.

    Attributes
    ----------
    within : (16,) or (M, 16)
        s_b, mm, for all walkers or for each; infinite for a bone that says nothing.
    pairs : (P,) or (M, P)
        s_p, mm.
    """

    within: np.ndarray
    pairs: np.ndarray


def tolerances(
    prior: Prior, *, within: float = 1.5, pairs: float = 2.0, bias: float = 0.0, slow: float = 0.0
) -> Tolerances:
    """Tolerances learnt with a prior, widened.

    Parameters
    ----------
    prior : Prior
    within, pairs : float
        Factors on the standard deviations of training walks; infinite for no such constraint.
    bias, slow : float
        Of the detector, mm, as `Noise` has them: the error of two joints adds to that of a bone.
    """
    fixed = bias**2 + prior.definition_variance
    s_b = np.sqrt(within**2 * prior.length_variance + LEAST_VARIANCE + 2.0 * slow**2 + TURNING * fixed)
    s_p = np.sqrt(pairs**2 * prior.pair_variance + LEAST_VARIANCE + 4.0 * fixed)
    return Tolerances(within=s_b, pairs=s_p)


@dataclass(frozen=True)
class Posterior:
    """Unknown coefficients of M walkers seen from A views.

    Attributes
    ----------
    unknown : (A, M, U)
        mm.
    covariance : (A, M, U, U)
        Of Laplace's approximation, mm²; empty if not asked for.
    cost : (A, M)
        J at the minimum.
    converged : (A, M) bool
    """

    unknown: np.ndarray
    covariance: np.ndarray
    cost: np.ndarray
    converged: np.ndarray


class Lengths:
    """The length terms of J for n observations that show the same joints, with their derivatives.

    Parameters
    ----------
    unknown : (45 B,) bool
        As `Conditional.unknown`.
    observed : (n, O)
        Observed coefficients, mm, in the order of ``~unknown``.
    limits : Tolerances
        For all observations or for each.
    """

    def __init__(self, unknown: np.ndarray, observed: np.ndarray, limits: Tolerances) -> None:
        of = unknown.reshape(JOINTS, 3, -1)
        n, self._blocks = len(observed), of.shape[-1]
        axes = of.any(axis=(0, 2))
        self._rows = np.flatnonzero(of[:, axes])
        size, ends = axes.sum() * self._blocks, np.cumsum([0, *of.sum(axis=(1, 2))])
        # Of each joint the place among the unknown, and what is unknown of it: the last, or every axis.
        self._places = [
            (slice(start, end), slice(size - (end - start), size)) for start, end in pairwise(ends.tolist())
        ]
        self._basis = fourier.cycle_basis(fourier.equal_phases(PHASES), self._blocks)
        self._products = (self._basis[:, :, None] * self._basis[:, None]).reshape(PHASES, -1)
        walkers = np.zeros((n, len(unknown)))
        walkers[:, ~unknown] = observed
        split = walkers.reshape(n, JOINTS, 3, self._blocks)
        # Squared lengths along the axes of which everything is seen never change.
        self._seen = (self._along(split[:, :, ~axes]) ** 2).sum(axis=2)
        self._start = np.ascontiguousarray(split[:, :, axes])
        self._weight = np.broadcast_to(
            ((self._blocks - 1) / PHASES / limits.within**2)[..., None], (n, len(BONES), 1)
        )
        self._pair_weight = np.broadcast_to(1.0 / limits.pairs**2, (n, len(PAIRS)))

    def _along(self, walkers: np.ndarray) -> np.ndarray:
        """Bones (n, 16, a, K) at the phases, along some axes, of coefficients (n, 15, a, B)."""
        bones = ENDS @ walkers.reshape(len(walkers), JOINTS, -1)
        return bones.reshape(len(walkers), len(BONES), -1, self._blocks) @ self._basis.T

    def _measured(self, u: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, ...]:
        """Length terms, direction (m, 16, a, K) and length (m, 16, K) of bones, half the terms' slopes by lengths."""
        walkers = self._start[which]
        walkers.reshape(len(u), -1)[:, self._rows] = u
        along = self._along(walkers)
        length = np.sqrt(self._seen[which] + (along**2).sum(axis=2))
        mean = length.sum(axis=-1) / PHASES
        off, apart = length - mean[..., None], mean @ SIDES.T
        pull, force = self._weight[which] * off, self._pair_weight[which] * apart
        cost = (pull * off).sum(axis=(1, 2)) + (force * apart).sum(axis=1)
        pull += (force @ SIDES / PHASES)[..., None]
        return cost, along / length[:, :, None], length, pull

    def slope(self, u: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Length terms (m,) of unknowns (m, U) of some observations (m,) int, and half their gradient (m, U)."""
        cost, direction, _, pull = self._measured(u, which)
        of_bones = (pull[:, :, None] * direction) @ self._basis
        return cost, (ENDS.T @ of_bones.reshape(len(u), len(BONES), -1)).reshape(len(u), -1)[:, self._rows]

    def matrix(self, u: np.ndarray, which: np.ndarray, *, exact: bool = False) -> np.ndarray:
        """Half the matrix (m, U, U) of second derivatives: Gauss and Newton's, or with the curvature of lengths."""
        _, direction, length, pull = self._measured(u, which)
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
            for one, other in (BONES.T, BONES.T[::-1]):
                by_joint[:, one, :, other] -= np.swapaxes(of_bones, 0, 1)
            return whole
        for joint, (at, own) in enumerate(self._places):
            whole[:, at, at] += of_joints[:, joint, own, own]
        for bone, ends in enumerate(BONES.tolist()):
            for (at, own), (to, theirs) in permutations([self._places[joint] for joint in ends]):
                whole[:, at, to] -= of_bones[:, bone, own, theirs]
        return whole


def fit_lengths(
    conditional: Conditional,
    observed: np.ndarray,
    tolerances: Tolerances,
    *,
    with_covariance: bool = False,
) -> Posterior:
    """Return the most probable unknown coefficients of M walkers seen from A views each.

    Parameters
    ----------
    conditional : Conditional
        Of A views.
    observed : (A, M, O)
        Observed coefficients, mm, in the order of ``~conditional.unknown``.
    tolerances : Tolerances
    with_covariance : bool
        Whether Laplace's approximation is asked for.
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
        """J and half its gradient."""
        off = u - expected[which]
        pull = np.empty_like(off)
        ends = np.searchsorted(of_view[which], np.arange(views + 1))  # rows of a view stand together
        for view in range(views):
            part = slice(ends[view], ends[view + 1])
            pull[part] = off[part] @ precision[view]
        cost, gradient = lengths.slope(u, which)
        return (off * pull).sum(axis=1) + cost, gradient + pull

    state, left = expected.copy(), np.arange(n)
    cost, gradient = slope(state, left)
    converged = np.zeros(n, bool)
    for iteration in range(MOST_STEPS):
        exact = iteration >= GAUSS_NEWTON_STEPS
        step, indefinite = np.empty((len(left), state.shape[1])), []
        for row, matrix in enumerate(lengths.matrix(state[left], left, exact=exact)):
            matrix += precision[of_view[left[row]]]
            solved = _solve(matrix, gradient[left[row]])
            if solved is None:  # far from the minimum the exact matrix may have no Cholesky factor
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
        for _ in range(MOST_HALVINGS):
            if not len(trying):
                break
            rows = left[trying]
            proposal = state[rows] + factor * step[trying]
            here, slopes = slope(proposal, rows)
            falls = here <= cost[rows] * (1.0 + _ROUNDING)
            took = rows[falls]
            state[took], cost[took], gradient[took] = proposal[falls], here[falls], slopes[falls]
            trying, factor = trying[~falls], factor / 2.0
        small[trying] = True  # no step falls
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
    """The solution of a positive definite system, whose matrix is overwritten; None if it is not positive definite."""
    _, solution, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
    return None if failed else solution
