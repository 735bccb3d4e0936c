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
STEP_MM = 1e-7
"""Largest change of a coefficient at which the minimum is reached."""
GAUSS_NEWTON_STEPS = 3
"""First steps, which may be far from the minimum; the ones after them know the curvature of lengths too."""
MOST_STEPS = 60
MOST_HALVINGS = 12
_ROUNDING = 1e-12
"""Relative increase of J that is rounding."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """How constant and how symmetric bones are.

    Attributes
    ----------
    within : (16,)
        s_b, mm; infinite for a bone that says nothing.
    pairs : (P,)
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
    s_b = np.sqrt(within**2 * prior.length_variance + LEAST_VARIANCE + 2.0 * slow**2 + TURNING * bias**2)
    s_p = np.sqrt(pairs**2 * prior.pair_variance + LEAST_VARIANCE + 4.0 * bias**2)
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
    tolerances : Tolerances
    """

    def __init__(self, unknown: np.ndarray, tolerances: Tolerances) -> None:
        of = unknown.reshape(JOINTS, 3, -1)
        self.blocks = of.shape[-1]
        self.axes = np.flatnonzero(of.any(axis=(0, 2)))
        rows = of[:, self.axes].ravel()
        self.rows = np.flatnonzero(rows)
        self.all_rows = bool(rows.all())
        self.basis = fourier.cycle_basis(fourier.equal_phases(PHASES), self.blocks)
        self.weight = (self.blocks - 1) / PHASES / require_shape("s_b", tolerances.within, (len(BONES),)) ** 2
        self.pair_weight = 1.0 / require_shape("s_p", tolerances.pairs, (len(PAIRS),)) ** 2
        self.starts, self.ends = BONES.T
        self.left, self.right = PAIRS.T

    def _measured(self, walkers: np.ndarray) -> tuple[np.ndarray, ...]:
        of = walkers.reshape(len(walkers), JOINTS, 3, self.blocks)
        across = of[:, self.ends] - of[:, self.starts]
        along = across @ self.basis.T  # (n, 16, 3, K)
        length = np.sqrt((along**2).sum(axis=2))
        mean = length.mean(axis=-1)
        return along, length, length - mean[..., None], mean[:, self.left] - mean[:, self.right]

    def cost(self, walkers: np.ndarray) -> np.ndarray:
        """Length terms (n,) of coefficients (n, 45 B)."""
        _, _, off, apart = self._measured(walkers)
        return np.asarray((off**2).sum(axis=-1) @ self.weight + apart**2 @ self.pair_weight)

    def derivatives(
        self, walkers: np.ndarray, *, exact: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Length terms (n,), half their gradient (n, U) and half their matrix (n, U, U).

        The matrix is that of Gauss and Newton, or the exact one: with the curvature of lengths.
        """
        along, length, off, apart = self._measured(walkers)
        n, size = len(walkers), len(self.axes) * self.blocks
        direction = along[:, :, self.axes] / length[:, :, None]
        slope = (direction[:, :, :, None] * self.basis.T).reshape(n, len(BONES), size, PHASES)
        mean = slope.mean(axis=-1)
        scaled = slope * self.weight[:, None, None]
        gradient_b = (scaled @ off[..., None])[..., 0]
        centred = slope - mean[..., None]
        matrix_b = (centred * self.weight[:, None, None]) @ np.swapaxes(slope, -1, -2)
        if exact:
            matrix_b += self._curvature(direction, length, off, apart)
        gradient = np.zeros((n, JOINTS, size))
        matrix = np.zeros((n, JOINTS, size, JOINTS, size))
        for bone, (start, end) in enumerate(BONES):
            gradient[:, end] += gradient_b[:, bone]
            gradient[:, start] -= gradient_b[:, bone]
            block = matrix_b[:, bone]
            matrix[:, end, :, end] += block
            matrix[:, start, :, start] += block
            matrix[:, end, :, start] -= block
            matrix[:, start, :, end] -= block
        lever = np.zeros((n, len(PAIRS), JOINTS, size))
        for pair, (left, right) in enumerate(PAIRS):
            for bone, sign in ((left, 1.0), (right, -1.0)):
                start, end = BONES[bone]
                lever[:, pair, end] += sign * mean[:, bone]
                lever[:, pair, start] -= sign * mean[:, bone]
        levers = lever.reshape(n, len(PAIRS), -1)
        weighted = levers * self.pair_weight[:, None]
        whole_gradient = gradient.reshape(n, -1) + (apart[:, None] @ weighted)[:, 0]
        whole = matrix.reshape(n, JOINTS * size, -1) + np.swapaxes(levers, 1, 2) @ weighted
        cost = (off**2).sum(axis=-1) @ self.weight + apart**2 @ self.pair_weight
        if self.all_rows:
            return cost, whole_gradient, whole
        return cost, whole_gradient[:, self.rows], whole[:, self.rows[:, None], self.rows]

    def _curvature(
        self, direction: np.ndarray, length: np.ndarray, off: np.ndarray, apart: np.ndarray
    ) -> np.ndarray:
        """What the second derivatives of lengths add to the matrix of each bone, (n, 16, aB, aB)."""
        pull = off * self.weight[:, None]
        force = apart * self.pair_weight / PHASES
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
    lengths = Lengths(unknown, tolerances)
    expected = conditional.expect(observed).reshape(views * walkers, -1)
    n, size = expected.shape
    state = np.empty((n, len(unknown)))
    state[:, ~unknown] = observed.reshape(n, -1)
    state[:, unknown] = expected
    converged, iterations, cost = np.zeros(n, dtype=bool), np.zeros(n, dtype=int), np.zeros(n)

    def pulled(rows: np.ndarray, off: np.ndarray) -> np.ndarray:
        return (precision[of_view[rows]] @ off[..., None])[..., 0]

    left = np.arange(n)
    for iteration in range(MOST_STEPS):
        off = state[left][:, unknown] - expected[left]
        pull = pulled(left, off)
        exact = iteration >= GAUSS_NEWTON_STEPS
        terms, gradient, matrix = lengths.derivatives(state[left], exact=exact)
        cost[left] = (off * pull).sum(axis=1) + terms
        iterations[left] += 1
        step = np.empty_like(off)
        for row, which in enumerate(left):
            prior = precision[of_view[which]]
            solved = _solve(matrix[row] + prior, gradient[row] + pull[row])
            if solved is None:  # far from the minimum the exact matrix may have no Cholesky factor
                plain = lengths.derivatives(state[which : which + 1])[2][0]
                solved = _solve(plain + prior, gradient[row] + pull[row])
            step[row] = -solved
        small = np.abs(step).max(axis=1) < STEP_MM
        converged[left[small]] = True
        trying, factor = np.flatnonzero(~small), 1.0
        for _ in range(MOST_HALVINGS):
            if not len(trying):
                break
            rows = left[trying]
            proposal = state[rows]
            proposal[:, unknown] += factor * step[trying]
            off = proposal[:, unknown] - expected[rows]
            here = (off * pulled(rows, off)).sum(axis=1) + lengths.cost(proposal)
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
    """The solution of a positive definite system, None if the matrix is not positive definite."""
    _, solution, failed = lapack.dposv(matrix, right, lower=1)
    return None if failed else solution
