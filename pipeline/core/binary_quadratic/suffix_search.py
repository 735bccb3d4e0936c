"""Search depth first in time, with the cost of the rest known beforehand: park2011 section 3.2.

Symbols are those of `sign_programme`, and

``a``      coefficients (3, K): ``J(s) = min over a of sum_i f_i(a)``, ``f_i = |c_i - B_i a|² + |C_i a|²``
``C_i``    the share of frame i in ``a^T G a``: rows whose squares add up to G
``S_t``    a lower bound of what the frames t, t + 1, … cost by themselves, whatever their signs
``kappa``  weight of ``|a|²``

Recursive least squares give the least cost of the frames t … k - 1 in O(K) a frame, since the gains depend on no
sign; with ``S_k`` for the frames after them that is a bound, and the ``S_k`` are found by the same search, from the
last frame back ("Russian dolls").  A few frames would fit any signs with coefficients of any size, but the best
coefficients are ``B^T c`` and no longer than c: ``kappa (|a|² - size)`` is never positive for them, so adding it
leaves a bound and rules wild ones out.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic.programme import Programme, compiled, cost, curvature, relax

TAMED = 0.01
"""Fraction of the best J known that is given up to rule wild coefficients out."""

LOOSE = 1e-3
"""Fraction by which an S_t may be below the least cost."""

PATIENCE = 30_000
"""Nodes after which an S_t that is not found is put at S_(t+1), which also bounds it."""

_START, _DEPTH, _PREPARED, _NODES, _DONE, _TRIED = range(6)


class SuffixSearch:
    """The search with all it remembers, which stops after any chunk of work.

    Parameters
    ----------
    programme : Programme
    objective : float
        J of the best signs known, mm².
    """

    def __init__(self, programme: Programme, objective: float) -> None:
        frames, components = programme.basis.shape
        size = programme.size
        spread = float(np.abs(programme.linear).sum())
        kappa = max(TAMED * (objective + spread) / size, 1e-9) if size > 0 else 1.0
        self._fixed = (*programme.arrays, curvature(programme.basis, programme.half_chord))
        self._rows = _shares(programme.excess, frames)
        self._numbers = np.array([kappa, size, spread])
        self._gains = np.empty((2, frames, components)), np.empty((2, frames))
        self._path = (
            np.zeros((frames + 1, 3, components)),
            np.zeros(frames + 1),
            np.zeros((frames, 2), dtype=np.int8),
        )
        self._rest = np.zeros(frames + 1)  # S_t, zero where not yet known
        self._ends = np.array([np.inf, np.inf])  # least cost of the frames from t on; leaves left open
        self._counts = np.array([frames - 1, 0, 0, 0, 0, 0], dtype=np.int64)

    @property
    def finished(self) -> bool:
        """Whether all signs have been ruled out but those found."""
        return bool(self._counts[_DONE])

    @property
    def nodes(self) -> int:
        """Frames entered so far."""
        return int(self._counts[_NODES])

    def lower_bound(self) -> float:
        """The least J that what is still open can hold, inf once nothing is."""
        if self.finished:
            return float(self._ends[1])
        return float(min(self._rest[self._counts[_START] + 1] - self._numbers[2], self._ends[1]))

    def run(self, best: np.ndarray, values: np.ndarray, gap: float, allowance: float, nodes: int) -> None:
        """Go on for about so many nodes; what is found goes into `best` and `values`.

        Parameters
        ----------
        best : (1,)
            J of the best values known, mm².
        values : (F,)
            They themselves.
        gap : float
            What is worth less than this fraction of J is not looked for,
        allowance : float
            nor what is worth less than twice the rounding, mm².
        nodes : int
        """
        tree = (*self._gains, *self._path, self._rest, self._ends, self._counts)
        _search(*self._fixed, self._rows, self._numbers, *tree, best, values, gap, allowance, nodes)


def _shares(excess: np.ndarray, frames: int) -> np.ndarray:
    """C (F, K), with ``C^T C`` at most G: each eigenvector of G in turn, as often as its turn comes."""
    components = len(excess)
    values, vectors = np.linalg.eigh(excess)
    # Rounding may have put the eigenvalues this much too high.
    values = np.maximum(values - 1e-13 * np.abs(values).max(initial=0.0), 0.0)
    turn = np.arange(frames) % components
    times = np.bincount(turn, minlength=components)
    return np.ascontiguousarray((np.sqrt(values / np.maximum(times, 1)) * vectors).T[turn])


@compiled
def _prepare(basis, rows, kind, kappa, start, gains, norms):  # type: ignore[no-untyped-def]
    """Gains of recursive least squares from frame `start` on, which no sign enters."""
    components = basis.shape[1]
    spread = np.zeros((components, components))
    for k in range(components):
        spread[k, k] = 1.0 / kappa
    for i in range(start, len(basis)):
        for kind_of_row in range(2):
            row = rows[i] if kind_of_row else basis[i]
            gain = gains[kind_of_row, i]
            norm = 1.0
            for k in range(components):
                inner = 0.0
                for j in range(components):
                    inner += spread[k, j] * row[j]
                gain[k] = inner
                norm += inner * row[k]
            norms[kind_of_row, i] = norm
            if kind_of_row == 0 and kind[i] == 2:
                continue  # a relaxed frame is left out: it could only add
            for k in range(components):
                for j in range(components):
                    spread[k, j] -= gain[k] * gain[j] / norm
            for k in range(components):
                gain[k] /= norm


@compiled
def _step(basis, middle, half_chord, kind, rows, gains, norms, i, sign, before, after):  # type: ignore[no-untyped-def]
    """Cost that frame `i` adds with this sign, given the coefficients `before`; those with it into `after`."""
    added = 0.0
    components = basis.shape[1]
    for d in range(3):
        if kind[i] == 2:
            after[d] = before[d]
        else:
            off = middle[i, d] + sign * half_chord[i, d]
            for k in range(components):
                off -= basis[i, k] * before[d, k]
            added += off * off / norms[0, i]
            for k in range(components):
                after[d, k] = before[d, k] + gains[0, i, k] * off
        if norms[1, i] > 1.0:
            off = 0.0
            for k in range(components):
                off -= rows[i, k] * after[d, k]
            added += off * off / norms[1, i]
            for k in range(components):
                after[d, k] += gains[1, i, k] * off
    return added


@compiled
def _search(  # type: ignore[no-untyped-def]
    basis, excess, middle, half_chord, linear, kind, bent, rows, numbers, gains, norms, state, spent, signs, rest,
    ends, counts, best, found, gap, allowance, budget,
):  # fmt: skip
    """`signs`: the sign of a frame, and how many of its signs are still to be tried."""
    frames = len(basis)
    kappa = numbers[0]
    lost = kappa * numbers[1]
    z = np.empty((3, basis.shape[1]))
    while budget > 0 and counts[_DONE] == 0:
        start = counts[_START]
        if counts[_PREPARED] == 0:
            _prepare(basis, rows, kind, kappa, start, gains, norms)
            budget -= 1 + (frames - start) * basis.shape[1] // 4
            spent[start] = 0.0
            state[start] = 0.0
            for i in range(start, frames):
                sign = -1.0 if found[i] < 0.0 else 1.0
                added = _step(
                    basis, middle, half_chord, kind, rows, gains, norms, i, sign, state[i], state[i + 1]
                )
                spent[i + 1] = spent[i] + added + (0.0 if kind[i] == 2 else linear[i] * sign + abs(linear[i]))
            ends[0] = max(spent[frames] - lost, 0.0)
            counts[_DEPTH] = start
            counts[_PREPARED] = 1
            counts[_TRIED] = 0
            signs[start, 1] = -1
        if start == 0:
            limit = best[0] - max(gap * abs(best[0]), 2.0 * allowance) + numbers[2]
        else:
            limit = ends[0] * (1.0 - LOOSE)
        i = counts[_DEPTH]
        given_up = start > 0 and counts[_TRIED] >= PATIENCE
        if i < start or given_up or (start > 0 and rest[start + 1] >= limit):
            # Everything from `start` on costs at least as much as was looked for, unless that was given up.
            if start > 0:
                rest[start] = rest[start + 1] if given_up else max(rest[start + 1], limit)
            else:
                counts[_DONE] = 1
            counts[_START] = start - 1
            counts[_PREPARED] = 0
            continue
        if signs[i, 1] == -1:  # first time here: the sign of the best known first
            if kind[i] == -1 or kind[i] == 1:
                signs[i, 0] = kind[i]
                signs[i, 1] = 1
            else:
                signs[i, 0] = -1 if found[i] < 0.0 else 1
                signs[i, 1] = 1 if kind[i] == 2 else 2
        elif signs[i, 1] == 1 and kind[i] == 0:
            signs[i, 0] = -signs[i, 0]
        if signs[i, 1] == 0:
            counts[_DEPTH] = i - 1
            continue
        signs[i, 1] -= 1
        budget -= 1
        counts[_NODES] += 1
        counts[_TRIED] += 1
        added = _step(
            basis, middle, half_chord, kind, rows, gains, norms, i, float(signs[i, 0]), state[i], state[i + 1]
        )
        if kind[i] != 2:
            added += linear[i] * signs[i, 0] + abs(linear[i])
        spent[i + 1] = spent[i] + added
        bound = max(spent[i + 1] - lost, 0.0) + rest[i + 1]
        if start == 0:
            bound -= allowance
        if bound >= limit:
            continue
        if i + 1 < frames:
            counts[_DEPTH] = i + 1
            signs[i + 1, 1] = -1
        elif start > 0:
            ends[0] = max(spent[frames] - lost, 0.0)
        else:
            _leaf(
                basis,
                excess,
                middle,
                half_chord,
                linear,
                kind,
                bent,
                signs,
                z,
                best,
                found,
                gap,
                allowance,
                ends,
            )
            budget -= frames


@compiled
def _leaf(  # type: ignore[no-untyped-def]
    basis, excess, middle, half_chord, linear, kind, bent, signs, z, best, found, gap, allowance, ends
):  # fmt: skip
    """All signs are chosen: J itself, with the relaxed frames at their best."""
    frames = len(basis)
    held = np.empty(frames, dtype=np.int8)
    values = np.empty(frames)
    relaxed = False
    for i in range(frames):
        held[i] = 0 if kind[i] == 2 else signs[i, 0]
        values[i] = found[i] if kind[i] == 2 else signs[i, 0]
        relaxed = relaxed or kind[i] == 2
    half = np.empty(frames)
    bound = np.inf
    if relaxed:
        cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
        trail = np.empty(frames, dtype=np.int64)
        bound = relax(
            basis, excess, middle, half_chord, linear, kind, bent, held, values, z, half, cutoff, 2000, 2000,
            allowance, trail, 0,
        )[1]  # fmt: skip
    here = cost(basis, excess, middle, half_chord, linear, values, z)
    # Half of what is not looked for: what is better by less may be rounding, and choose nothing.
    if here < best[0] - 0.5 * max(gap * abs(best[0]), 2.0 * allowance):
        best[0] = here
        found[:] = values
    if bound < best[0] - max(gap * abs(best[0]), 2.0 * allowance):
        ends[1] = min(ends[1], bound)
