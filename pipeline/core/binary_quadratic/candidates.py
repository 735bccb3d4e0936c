"""Binary quadratic programme of one limb, from its candidate positions and a trajectory basis (park2011 section 3.2).

Symbols
-------
``F``  frames, ``K`` components of the trajectory basis
``B``  basis (F, K), of spectral norm at most one: orthonormal columns, or those of a soft or restricted basis
``m``  middle (F, 3), ``u`` half chord (F, 3): the candidates of a frame are m - u and m + u
``s``  signs (F,), and ``c = m + s u`` the points that they choose
``z``  B^T c, one row for each coordinate (3, K)
``r``  c - B z (F, 3), what the basis does not explain
``G``  I - B^T B (K, K), zero for orthonormal columns

Why computed differently from how it is printed: with ``J(s) = ||c||² - ||B^T c||²`` the projector onto the null
space never appears as an F x F matrix, and a flip costs O(K).  As a difference of two large numbers it would lose
everything when a limb lies in the basis, so J is summed as ``||r||² + tr(z G z^T)``: the same, and no term is
negative.  Half its derivative by s_i is ``u_i · r_i``.

Searches ask for little else than derivatives, ``A s + u · r(0)``, for signs that differ in a frame or two.  So for
programmes of up to `TABLE` frames A is kept, and a step costs a row of it; costs that decide are those above.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.core.binary_quadratic import kernels
from pipeline.validation import InvalidInput, require_range, require_shape

TABLE = 256
"""Largest number of frames for which the matrix of the quadratic form is stored; for longer clips storing is slower."""

_ORTHONORMAL = 1e-12
"""Magnitude of the entries of I - B^T B below which the basis B counts as orthonormal."""

_NORM = 1e-9
"""Tolerance by which the squared spectral norm of a basis may exceed one."""


class Programme(NamedTuple):
    """Binary quadratic programme of one limb as validated, contiguous, read-only arrays for the compiled kernels.

    Attributes
    ----------
    basis : (F, K)
        B.
    excess : (K, K)
        G, exactly zero where the columns are orthonormal to rounding.
    middle, half_chord : (F, 3)
        m and u, mm.
    kind : (F,) int8
        0 for a sign to be found; `kernels.FORCED` where both candidates are one, `kernels.RELAXED` for any value
        between them.
    bent : (F,)
        Half the second derivative of J by each value, mm².
    table : (F, F) or (0, 0)
        A, ``(I - B B^T)_ij u_i · u_j`` mm²; none for more than `TABLE` frames.
    pull : (F,)
        Half the derivative of J by each value where all are zero, mm².
    still : float
        J there, mm².
    size : float
        The largest ||c||² of any choice, mm²: the scale of rounding.
    """

    basis: np.ndarray
    excess: np.ndarray
    middle: np.ndarray
    half_chord: np.ndarray
    kind: np.ndarray
    bent: np.ndarray
    table: np.ndarray
    pull: np.ndarray
    still: float
    size: float

    @property
    def frames(self) -> int:
        """Number of frames F."""
        return len(self.basis)

    @property
    def weight(self) -> np.ndarray:
        """Squared half distance (F,) between the two candidates, mm²; zero in frames whose sign is not free."""
        return np.where(self.kind == 0, np.square(self.half_chord).sum(axis=1), 0.0)

    def objective(self, values: np.ndarray) -> float:
        """Return the cost J, mm², of signs (F,), or of relaxed values between -1 and +1 [park2011 12]."""
        z = np.empty((3, self.basis.shape[1]))
        return kernels.cost(self, np.asarray(values, float), z)

    def allowance(self, objective: float) -> float:
        """Return the largest possible rounding error, mm², of a cost J, or of its lower bound, near `objective`.

        Notes
        -----
        Each r is a sum of F + K products, wrong by a fraction 4 (F + K) eps of the size of c at most, and J is
        the sum of their squares.  Columns that are orthonormal only to rounding add some eps of ||c||².
        """
        return kernels.allowance_of(sum(self.basis.shape), self.size, objective)

    def with_relaxed(self, values: np.ndarray) -> np.ndarray:
        """Optimise the continuous values, between -1 and +1, of the relaxed frames; return the values of all frames
        (F,).
        """
        best = np.array(values, float)
        relaxed = self.kind == kernels.RELAXED
        if relaxed.any():
            fixed_signs = np.where(relaxed, 0, np.where(best < 0, -1, 1)).astype(np.int8)
            z, half = np.empty((3, self.basis.shape[1])), np.empty(len(best))
            trail = np.empty(len(best), np.int64)
            most = kernels.LAST_SWEEPS
            point, allowance = (best, z, half), self.allowance(0.0)
            kernels.relax(self, fixed_signs, point, np.nan, np.inf, (0, most), allowance, trail, 0)
        return best


def programme_of(
    basis: np.ndarray, middle: np.ndarray, half_chord: np.ndarray, *, relax_below: float = 0.0
) -> Programme:
    """Return the binary quadratic programme of candidate positions, after checking and copying all arrays.

    Parameters
    ----------
    basis : (F, K)
        B.
    middle, half_chord : (F, 3)
        m and u, mm.
    relax_below : float
        Frames whose half chord is shorter, mm, are relaxed.

    Raises
    ------
    InvalidInput
        If shapes disagree, a number is not finite, or the basis has a spectral norm above one.
    """
    basis, middle, half_chord = (np.array(value, float, order="C") for value in (basis, middle, half_chord))
    if basis.ndim != 2 or not 1 <= basis.shape[1] <= len(basis):
        raise InvalidInput(
            "the trajectory basis has the wrong shape",
            expected="shape (F, K), K <= F",
            received=basis.shape,
            code="wrong_shape",
            shape=basis.shape,
        )
    frames, components = basis.shape
    arrays = {"basis": basis, "middle": middle, "half_chord": half_chord}
    for name, array in arrays.items():
        require_shape(name, array, (frames, components if name == "basis" else 3))
        if (missing := ~np.isfinite(array).all(axis=1)).any():
            raise InvalidInput(
                f"the array {name} is not finite",
                "all frames" if missing.all() else f"frame {np.argmax(missing)}",
                "finite numbers; leave out frames without data, and their rows of the basis",
                code="not_finite",
                array=name,
            )
    require_range("relax_below", relax_below, at_least=0.0, unit="mm")
    excess = np.eye(components) - basis.T @ basis
    if np.abs(excess).max() < _ORTHONORMAL:
        excess = np.zeros_like(excess)
    elif not _positive(excess + _NORM * np.eye(components)):
        norm = np.linalg.norm(basis, ord=2)
        raise InvalidInput(
            "the spectral norm of the trajectory basis is above 1",
            expected="a spectral norm of at most 1",
            received=f"{norm:.6g}",
            code="not_orthonormal",
            norm=norm,
        )
    lengths = np.linalg.norm(half_chord, axis=1)
    kind = np.zeros(frames, np.int8)
    kind[lengths < relax_below] = kernels.RELAXED
    kind[lengths == 0] = kernels.FORCED
    outside = middle - basis @ (basis.T @ middle)
    pull = (half_chord * outside).sum(axis=1)
    still = np.square(outside).sum() + ((basis.T @ middle) * (excess @ (basis.T @ middle))).sum()
    coupling = np.zeros((0, 0))
    if frames <= TABLE:
        coupling = (np.eye(frames) - basis @ basis.T) * (half_chord @ half_chord.T)
    bent = kernels.curvature(basis, half_chord)
    size = np.square(np.abs(middle) + np.abs(half_chord)).sum()
    return Programme(basis, excess, middle, half_chord, kind, bent, coupling, pull, still, size)


def _positive(matrix: np.ndarray) -> bool:
    """Return True if a symmetric matrix is positive definite, as shown by a Cholesky factorization."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True
