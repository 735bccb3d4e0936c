"""Branch and bound over boxes of signs, the paper's way to a certificate: park2011 section 3.2.

Symbols are those of `sign_programme`.  A node holds some signs and lets the others range over -1 … +1; J is convex
there, and `relax` bounds it from below whether or not its descent has converged.  Depth first, the child nearer to
the relaxed value first, on the frame whose sign would cost most if it were wrong:
``|u_i|² (1 - |B_i|²) (1 - s_i²)``.  Signs whose other value the bound rules out are held on the way.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic.programme import Programme, compiled, cost, curvature, relax

FEWEST_SWEEPS, MOST_SWEEPS = 2, 20
"""Sweeps of a node that cannot be ruled out any more, and of one that might."""

LAST_SWEEPS = 2000
"""Where only relaxed frames are left there is nothing to branch on: they are descended to the end."""

_DEPTH, _STATE, _TRAIL, _NODES = range(4)
_ENTER, _LEAVE, _DONE = range(3)


class BoxSearch:
    """A branch and bound that stops after any chunk of work, and can be asked for its bound.

    Parameters
    ----------
    programme : Programme
    """

    def __init__(self, programme: Programme) -> None:
        frames, components = programme.basis.shape
        self._fixed = (*programme.arrays, curvature(programme.basis, programme.half_chord))
        held = np.where(np.abs(programme.kind) == 1, programme.kind, 0).astype(np.int8)
        self._moving = (
            held,
            held.astype(float),
            np.empty((3, components)),
            np.empty(frames),
            np.empty(frames, dtype=np.int64),
        )
        self._levels = np.zeros((frames + 1, 3), dtype=np.int64)
        self._bounds = np.full(
            frames + 2, -np.inf
        )  # of each level, and of leaves that stayed open at the end
        self._bounds[-1] = np.inf
        self._counts = np.zeros(4, dtype=np.int64)

    @property
    def finished(self) -> bool:
        """Whether all signs have been ruled out but those found."""
        return bool(self._counts[_STATE] == _DONE)

    @property
    def nodes(self) -> int:
        """Boxes bounded so far."""
        return int(self._counts[_NODES])

    def lower_bound(self) -> float:
        """The least J that what is still open can hold, inf once nothing is."""
        depth = int(self._counts[_DEPTH])
        if not self.finished and self._counts[_STATE] == _ENTER and depth == 0:
            return -np.inf
        # The node about to be entered lies below the last level; so does what is left of each level.
        untried = self._levels[:depth, 1] == 0
        if self._counts[_STATE] == _ENTER and depth:
            untried[-1] = True
        return float(min(self._bounds[-1], self._bounds[:depth][untried].min(initial=np.inf)))

    def run(self, best: np.ndarray, values: np.ndarray, gap: float, allowance: float, sweeps: int) -> None:
        """Go on for about so many sweeps; what is found goes into `best` and `values`.

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
        sweeps : int
        """
        tree = (self._levels, self._bounds, self._counts)
        _search(*self._fixed, *self._moving, *tree, best, values, gap, allowance, sweeps)


@compiled
def _search(  # type: ignore[no-untyped-def]
    basis, excess, middle, half_chord, linear, kind, bent, held, values, z, half, trail, levels, bounds, counts,
    best, found, gap, allowance, budget,
):  # fmt: skip
    """`levels`: the frame branched on, whether its second child has been entered, the trail's length before it."""
    frames = len(basis)
    trial = np.empty(frames)
    while budget > 0 and counts[_STATE] != _DONE:
        depth = counts[_DEPTH]
        if counts[_STATE] == _LEAVE:
            if depth == 0:
                counts[_STATE] = _DONE
                continue
            depth -= 1
            chosen = levels[depth, 0]
            for j in range(levels[depth, 2], counts[_TRAIL]):
                held[trail[j]] = 0
            counts[_TRAIL] = levels[depth, 2]
            if levels[depth, 1] == 0:
                levels[depth, 1] = 1
                held[chosen] = -held[chosen]
                counts[_STATE] = _ENTER
            else:
                held[chosen] = 0
                counts[_DEPTH] = depth
            continue
        counts[_NODES] += 1
        cutoff = best[0] - max(gap * abs(best[0]), 2.0 * allowance)
        left = False
        for i in range(frames):
            if held[i] != 0:
                values[i] = held[i]
            elif kind[i] != 2:
                left = True
        here, bound, sweeps, counts[_TRAIL] = relax(
            basis, excess, middle, half_chord, linear, kind, bent, held, values, z, half, cutoff,
            FEWEST_SWEEPS if left else LAST_SWEEPS, MOST_SWEEPS if left else LAST_SWEEPS, allowance,
            trail, counts[_TRAIL],
        )  # fmt: skip
        budget -= sweeps + 1
        if depth > 0:
            bound = max(bound, bounds[depth - 1])
        counts[_STATE] = _LEAVE
        if bound >= cutoff:
            continue
        for i in range(frames):
            trial[i] = values[i] if kind[i] == 2 else -1.0 if values[i] < 0.0 else 1.0
        here = cost(basis, excess, middle, half_chord, linear, trial, z)
        # Half of what is not looked for: what is better by less may be rounding, and choose nothing.
        if here < 0.5 * (best[0] + cutoff):
            best[0] = here
            found[:] = trial
            cutoff = here - max(gap * abs(here), 2.0 * allowance)
            if bound >= cutoff:
                continue
        chosen = -1
        most = -1.0
        for i in range(frames):
            if held[i] == 0 and kind[i] != 2:
                score = bent[i] * (1.0 - values[i] * values[i] + 1e-9)
                if score > most:
                    most = score
                    chosen = i
        if chosen < 0:
            if left:
                counts[_STATE] = _ENTER  # all the rest was held on the way: once more, to the end
            else:
                bounds[-1] = min(bounds[-1], bound)
            continue
        levels[depth, 0] = chosen
        levels[depth, 1] = 0
        levels[depth, 2] = counts[_TRAIL]
        bounds[depth] = bound
        held[chosen] = -1 if values[chosen] < 0.0 else 1
        counts[_DEPTH] = depth + 1
        counts[_STATE] = _ENTER
