"""The binary quadratic programme of a limb, and what every search over it computes: park2011 section 3.2.

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

The kernels are compiled.  The compiler may take the terms of a sum in another order, which `Programme.allowance`
covers; it may not assume anything about NaN or infinity.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

TO_FIND, RELAXED = 0, 2
"""Kinds of frames beside the forced -1 and +1: a sign to be found, or any value from -1 to +1."""

_OVER = 1.3
"""Over-relaxation of coordinate descent: neighbouring frames pull at the same coefficients."""

_SETTLED = 1000
"""Sweeps at most for the relaxed frames alone."""


def compiled(kernel: Callable) -> Callable:
    """The kernel, compiled when it is first called, and kept on disk where there is room for it.

    The compiler may reorder and fuse the terms of sums, and assume nothing else.  Where neither the package's folder
    nor the user's cache can be written to, every process compiles for itself: some seconds, the same results.

    What is kept goes by the file of the kernel alone: who edits a kernel that others call, edits or touches theirs too.
    """
    sums = {"reassoc", "contract"}
    try:
        return njit(cache=True, nogil=True, fastmath=sums)(kernel)
    except RuntimeError:  # numba's word for no place to keep it
        return njit(nogil=True, fastmath=sums)(kernel)


@dataclass(frozen=True)
class Programme:
    """One programme in the form that the searches read: checked, contiguous, never written to.

    Attributes
    ----------
    basis : (F, K)
        B.
    excess : (K, K)
        G, exactly zero where the columns are orthonormal to rounding.
    middle, half_chord : (F, 3)
        m and u, mm.
    linear : (F,)
        Added cost of the sign +1, and gain of -1, mm².
    kind : (F,) int8
        0 to be found, -1 or +1 forced, 2 for any value between.
    """

    basis: np.ndarray
    excess: np.ndarray
    middle: np.ndarray
    half_chord: np.ndarray
    linear: np.ndarray
    kind: np.ndarray

    @property
    def frames(self) -> int:
        """F."""
        return len(self.basis)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """All of it, in the order that every kernel takes it."""
        return self.basis, self.excess, self.middle, self.half_chord, self.linear, self.kind

    @property
    def size(self) -> float:
        """The largest ||c||² of any choice, mm²: the scale of rounding."""
        return float(np.square(np.abs(self.middle) + np.abs(self.half_chord)).sum())

    @property
    def weight(self) -> np.ndarray:
        """Squared half chord (F,) where the sign is to be found, zero elsewhere, mm²."""
        return np.where(self.kind == TO_FIND, np.square(self.half_chord).sum(axis=1), 0.0)

    def objective(self, values: np.ndarray) -> float:
        """J of signs, or of values between them, and the linear cost, mm² [park2011 12].

        Parameters
        ----------
        values : (F,)
            s.
        """
        z = np.empty((3, self.basis.shape[1]))
        return float(cost(*self.arrays[:5], np.asarray(values, dtype=float), z))

    def allowance(self, objective: float) -> float:
        """How far rounding can put J, or a bound of it, off where J is about `objective`, mm².

        Parameters
        ----------
        objective : float
            J, mm².

        Notes
        -----
        Each r is a sum of F + K products, wrong by a fraction 4 (F + K) eps of the size of c at most, and J is
        the sum of their squares.  Columns that are orthonormal only to rounding add some eps of ||c||².
        """
        eps = float(np.finfo(float).eps)
        relative = 4.0 * sum(self.basis.shape) * eps
        mixed = 2.0 * relative * np.sqrt(max(objective, 0.0) * self.size)
        return float(mixed + 64.0 * eps * self.size + relative * np.abs(self.linear).sum())

    def settle(self, values: np.ndarray) -> np.ndarray:
        """`values` (F,) with those of the relaxed frames at their best, the others as they are."""
        settled = np.array(values, dtype=float)
        if (self.kind == RELAXED).any():
            held = np.where(self.kind == RELAXED, 0, np.where(settled < 0, -1, 1)).astype(np.int8)
            room = np.empty((3, self.basis.shape[1])), np.empty(len(settled))
            bent = curvature(self.basis, self.half_chord)
            allowance = self.allowance(0.0)
            relax(
                *self.arrays, bent, held, settled, *room, np.inf, 0, _SETTLED, allowance, _trail(settled), 0
            )
        return settled


def _trail(values: np.ndarray) -> np.ndarray:
    """Room for the frames that `relax` holds."""
    return np.empty(len(values), dtype=np.int64)


@compiled
def project(basis, middle, half_chord, values, z):  # type: ignore[no-untyped-def]
    """z = B^T (m + s u), into `z`."""
    z[:] = 0.0
    for i in range(len(basis)):
        x = middle[i, 0] + values[i] * half_chord[i, 0]
        y = middle[i, 1] + values[i] * half_chord[i, 1]
        w = middle[i, 2] + values[i] * half_chord[i, 2]
        for k in range(basis.shape[1]):
            z[0, k] += basis[i, k] * x
            z[1, k] += basis[i, k] * y
            z[2, k] += basis[i, k] * w


@compiled
def residual(basis, middle, half_chord, i, value, z):  # type: ignore[no-untyped-def]
    """The three numbers r of frame `i`."""
    x = y = w = 0.0
    for k in range(basis.shape[1]):
        x += basis[i, k] * z[0, k]
        y += basis[i, k] * z[1, k]
        w += basis[i, k] * z[2, k]
    return (
        middle[i, 0] + value * half_chord[i, 0] - x,
        middle[i, 1] + value * half_chord[i, 1] - y,
        middle[i, 2] + value * half_chord[i, 2] - w,
    )


@compiled
def move(basis, half_chord, i, change, z):  # type: ignore[no-untyped-def]
    """Adds to `z` what a change of the value of frame `i` adds."""
    x, y, w = change * half_chord[i, 0], change * half_chord[i, 1], change * half_chord[i, 2]
    for k in range(basis.shape[1]):
        z[0, k] += basis[i, k] * x
        z[1, k] += basis[i, k] * y
        z[2, k] += basis[i, k] * w


@compiled
def gradient(basis, excess, middle, half_chord, linear, values, z, half):  # type: ignore[no-untyped-def]
    """J where `z` is that of the values, with half its derivative by each of them into `half`."""
    total = 0.0
    if excess.any():
        for d in range(3):
            for k in range(len(excess)):
                inner = 0.0
                for j in range(len(excess)):
                    inner += excess[k, j] * z[d, j]
                total += inner * z[d, k]
    for i in range(len(basis)):
        x, y, w = residual(basis, middle, half_chord, i, values[i], z)
        total += x * x + y * y + w * w + linear[i] * values[i]
        half[i] = half_chord[i, 0] * x + half_chord[i, 1] * y + half_chord[i, 2] * w + 0.5 * linear[i]
    return total


@compiled
def cost(basis, excess, middle, half_chord, linear, values, z):  # type: ignore[no-untyped-def]
    """J, and the linear cost; `z` is overwritten with that of the values."""
    project(basis, middle, half_chord, values, z)
    return gradient(basis, excess, middle, half_chord, linear, values, z, np.empty(len(basis)))


@compiled
def curvature(basis, half_chord):  # type: ignore[no-untyped-def]
    """Half the second derivative of J by each value, (F,): |u|² (1 - |B_i|²)."""
    bent = np.empty(len(basis))
    for i in range(len(basis)):
        leverage = 0.0
        for k in range(basis.shape[1]):
            leverage += basis[i, k] * basis[i, k]
        square = half_chord[i, 0] ** 2 + half_chord[i, 1] ** 2 + half_chord[i, 2] ** 2
        bent[i] = square * max(1.0 - leverage, 0.0)
    return bent


@compiled
def relax(  # type: ignore[no-untyped-def]
    basis, excess, middle, half_chord, linear, kind, bent, held, values, z, half, cutoff, fewest, most, allowance,
    trail, length,
):  # fmt: skip
    """The least J over the box, about: (J there, a lower bound over the whole box, sweeps, frames on the trail).

    Frames whose `held` is 0 range over -1 … +1, the others stay.  Coordinate descent from `values`, which it
    overwrites, with `z` and `half`, half the gradient.  J is convex: from any point, converged or not,
    ``J(t) >= J(s) - 2 sum(|half_i| + half_i s_i)`` over the box, and ``4 |half_i|`` more where t_i has the sign
    of half_i.  A sign that this lifts to `cutoff` is held at the other one, and put on the trail.

    It ends when the bound reaches `cutoff`; after `fewest` sweeps, when J is below it, so that no bound can reach
    it; when nothing moves; or after `most` sweeps.
    """
    project(basis, middle, half_chord, values, z)
    sweeps = 0
    while True:
        here = gradient(basis, excess, middle, half_chord, linear, values, z, half)
        slack = 0.0
        for i in range(len(basis)):
            if held[i] == 0:
                slack += abs(half[i]) + half[i] * values[i]
        bound = here - 2.0 * slack - allowance
        if bound >= cutoff or sweeps >= most or 2.0 * slack <= 0.1 * allowance:
            return here, bound, sweeps, length
        for i in range(len(basis)):
            if held[i] == 0 and kind[i] != 2 and bound + 4.0 * abs(half[i]) >= cutoff:
                held[i] = -1 if half[i] > 0.0 else 1
                trail[length] = i
                length += 1
                move(basis, half_chord, i, held[i] - values[i], z)
                values[i] = held[i]
        if sweeps >= fewest and here < cutoff:
            return here, bound, sweeps, length
        for i in range(len(basis)):
            if held[i] != 0:
                continue
            x, y, w = residual(basis, middle, half_chord, i, values[i], z)
            slope = half_chord[i, 0] * x + half_chord[i, 1] * y + half_chord[i, 2] * w + 0.5 * linear[i]
            if bent[i] > 0.0:
                wanted = min(max(values[i] - _OVER * slope / bent[i], -1.0), 1.0)
            else:
                wanted = -1.0 if slope > 0.0 else 1.0 if slope < 0.0 else values[i]
            if wanted != values[i]:
                move(basis, half_chord, i, wanted - values[i], z)
                values[i] = wanted
        sweeps += 1
