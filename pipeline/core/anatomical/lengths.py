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
from typing import Any

import numpy as np
from scipy.linalg import lapack

from pipeline.core import fourier
from pipeline.core.anatomical.conditional import Conditional, inverse
from pipeline.core.anatomical.prior import BONES, JOINTS, PAIRS, PHASES, Prior
from pipeline.validation import require_range, require_shape

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


_ENDS = np.eye(JOINTS)[BONES[:, 1]] - np.eye(JOINTS)[BONES[:, 0]]
"""(16, 15): what a bone is of the joints, its end less its start."""
_LEVERS = np.stack([np.outer(_ENDS[a], np.eye(len(BONES))[a]) for a in range(len(BONES))])
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
    for name, value in (("within", within), ("pairs", pairs)):
        if value != np.inf:
            require_range(f"the factor on the tolerance of {name}", value, above=0)
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
    n_iterations : (A, M) int
    """

    unknown: np.ndarray
    covariance: np.ndarray
    cost: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray


class Lengths:
    """The length terms of J for observations that show the same joints, with their derivatives.

    Parameters
    ----------
    unknown : (45 B,) bool
        As `Conditional.unknown`.
    within : (16,) or (n, 16)
        s_b, mm, for all observations or for each.
    pairs : (P,) or (n, P)
        s_p, mm.
    """

    def __init__(self, unknown: np.ndarray, within: np.ndarray, pairs: np.ndarray) -> None:
        of = unknown.reshape(JOINTS, 3, -1)
        self.blocks = of.shape[-1]
        self.axes = np.flatnonzero(of.any(axis=(0, 2)))
        rows = of[:, self.axes].ravel()
        self.rows = np.flatnonzero(rows)
        self.all_rows = bool(rows.all())
        self.basis = fourier.cycle_basis(fourier.equal_phases(PHASES), self.blocks)
        self.weight = (self.blocks - 1) / PHASES / np.atleast_2d(within) ** 2
        self.pair_weight = 1.0 / np.atleast_2d(pairs) ** 2
        require_shape("s_b", self.weight, ("n", len(BONES)))
        require_shape("s_p", self.pair_weight, ("n", len(PAIRS)))
        self.starts, self.ends = BONES.T
        self.left, self.right = PAIRS.T

    def _measured(self, walkers: np.ndarray) -> tuple[np.ndarray, ...]:
        of = walkers.reshape(len(walkers), JOINTS, 3, self.blocks)
        across = of[:, self.ends] - of[:, self.starts]
        along = across @ self.basis.T  # (n, 16, 3, K)
        length = np.sqrt((along**2).sum(axis=2))
        mean = length.mean(axis=-1)
        return along, length, length - mean[..., None], mean[:, self.left] - mean[:, self.right]

    def _weights(self, which: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Weights (n or 1, 16) of bones and (n or 1, P) of pairs, for some of the observations."""
        if which is None or len(self.weight) == 1:
            return self.weight, self.pair_weight
        return self.weight[which], self.pair_weight[which]

    def cost(self, walkers: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """Length terms (n,) of coefficients (n, 45 B), which are those of all or of some of the observations."""
        _, _, off, apart = self._measured(walkers)
        weight, pair_weight = self._weights(which)
        return np.asarray(
            ((off**2).sum(axis=-1) * weight).sum(axis=-1) + (apart**2 * pair_weight).sum(axis=-1)
        )

    def derivatives(
        self, walkers: np.ndarray, which: np.ndarray | None = None, *, exact: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Length terms (n,), half their gradient (n, U) and half their matrix (n, U, U).

        The matrix is that of Gauss and Newton, or the exact one: with the curvature of lengths.
        """
        along, length, off, apart = self._measured(walkers)
        weight, pair_weight = self._weights(which)
        n, size = len(walkers), len(self.axes) * self.blocks
        direction = along[:, :, self.axes] / length[:, :, None]
        slope = (direction[:, :, :, None] * self.basis.T).reshape(n, len(BONES), size, PHASES)
        mean = slope.mean(axis=-1)
        gradient_b = weight[..., None] * (slope @ off[..., None])[..., 0]
        matrix_b = slope @ np.swapaxes(slope, -1, -2) - PHASES * (mean[..., None] * mean[..., None, :])
        matrix_b *= weight[..., None, None]
        if exact:
            matrix_b += self._curvature(direction, length, off * weight[..., None], apart * pair_weight)
        levers = (_LEVERS @ mean).reshape(n, len(PAIRS), -1)
        weighted = levers * pair_weight[..., None]
        whole_gradient = (_ENDS.T @ gradient_b).reshape(n, -1) + (apart[:, None] @ weighted)[:, 0]
        whole = np.swapaxes(levers, 1, 2) @ weighted
        of_joints = (np.abs(_ENDS).T @ matrix_b.reshape(n, len(BONES), -1)).reshape(n, JOINTS, size, size)
        blocks, joint = whole.reshape(n, JOINTS, size, JOINTS, size), np.arange(JOINTS)
        blocks[:, joint, :, joint] += np.swapaxes(of_joints, 0, 1)
        for one, other in ((self.starts, self.ends), (self.ends, self.starts)):
            blocks[:, one, :, other] -= np.swapaxes(matrix_b, 0, 1)
        cost = ((off**2).sum(axis=-1) * weight).sum(axis=-1) + (apart**2 * pair_weight).sum(axis=-1)
        if self.all_rows:
            return cost, whole_gradient, whole
        return cost, whole_gradient[:, self.rows], whole[:, self.rows[:, None], self.rows]

    def _curvature(
        self, direction: np.ndarray, length: np.ndarray, pull: np.ndarray, apart: np.ndarray
    ) -> np.ndarray:
        """What the second derivatives of lengths add to the matrix of each bone, (n, 16, aB, aB)."""
        force = apart / PHASES
        pull[:, self.left] += force[..., None]
        pull[:, self.right] -= force[..., None]
        axes = np.arange(direction.shape[2])
        tensor = -direction[:, :, :, None] * direction[:, :, None]
        tensor[:, :, axes, axes] += 1.0
        tensor *= (pull / length)[:, :, None, None]
        outer = (self.basis[:, :, None] * self.basis[:, None]).reshape(PHASES, -1)
        blocks = (tensor @ outer).reshape(*tensor.shape[:4], self.blocks, self.blocks)
        size = len(axes) * self.blocks
        return np.asarray(np.swapaxes(blocks, 3, 4).reshape(*tensor.shape[:2], size, size))


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
    unknown = conditional.unknown
    within, pairs = (
        np.tile(each, (views, 1)) if each.ndim == 2 else each
        for each in (tolerances.within, tolerances.pairs)
    )
    lengths = Lengths(unknown, within, pairs)
    expected = conditional.expect(observed).reshape(views * walkers, -1)
    n, size = expected.shape
    state = np.empty((n, len(unknown)))
    state[:, ~unknown] = observed.reshape(n, -1)
    state[:, unknown] = expected
    converged, iterations, cost = np.zeros(n, dtype=bool), np.zeros(n, dtype=int), np.zeros(n)

    def pulled(rows: np.ndarray, off: np.ndarray) -> np.ndarray:
        found = np.empty_like(off)
        ends = np.searchsorted(of_view[rows], np.arange(views + 1))  # rows of a view stand together
        for view in range(views):
            part = slice(ends[view], ends[view + 1])
            found[part] = off[part] @ precision[view]
        return found

    left = np.arange(n)
    for iteration in range(MOST_STEPS):
        off = state[left][:, unknown] - expected[left]
        pull = pulled(left, off)
        exact = iteration >= GAUSS_NEWTON_STEPS
        terms, gradient, matrix = lengths.derivatives(state[left], left, exact=exact)
        cost[left] = (off * pull).sum(axis=1) + terms
        iterations[left] += 1
        step = np.empty_like(off)
        for row, which in enumerate(left):
            prior = precision[of_view[which]]
            matrix[row] += prior
            solved = _solve(matrix[row], gradient[row] + pull[row])
            if solved is None:  # far from the minimum the exact matrix may have no Cholesky factor
                plain = lengths.derivatives(state[which : which + 1], left[row : row + 1])[2][0]
                solved = _solve(plain + prior, gradient[row] + pull[row])
            step[row] = -solved
        small = (np.abs(step).max(axis=1) < STEP_MM) & exact
        converged[left[small]] = True
        state[np.ix_(left[small], np.flatnonzero(unknown))] += step[small]
        trying, factor = np.flatnonzero(~small), 1.0
        for _ in range(MOST_HALVINGS):
            if not len(trying):
                break
            rows = left[trying]
            proposal = state[rows]
            proposal[:, unknown] += factor * step[trying]
            off = proposal[:, unknown] - expected[rows]
            here = (off * pulled(rows, off)).sum(axis=1) + lengths.cost(proposal, rows)
            falls = here <= cost[rows] * (1.0 + _ROUNDING)
            state[rows[falls]] = proposal[falls]
            trying, factor = trying[~falls], factor / 2.0
        small[trying] = True  # no step falls
        left = left[~small]
        if not len(left):
            break
    covariance = np.empty((views, walkers, 0, 0))
    if with_covariance:
        matrix = lengths.derivatives(state)[2] + precision[of_view]
        covariance = np.stack([inverse(m) for m in matrix]).reshape(views, walkers, size, size)

    def shaped(values: np.ndarray) -> np.ndarray:
        return values.reshape(views, walkers, *values.shape[1:])

    return Posterior(
        shaped(state[:, unknown]), covariance, shaped(cost), shaped(converged), shaped(iterations)
    )


def _solve(matrix: np.ndarray, right: np.ndarray) -> Any:
    """The solution of a positive definite system, whose matrix is overwritten; None if it is not positive definite."""
    _, solution, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
    return None if failed else solution
