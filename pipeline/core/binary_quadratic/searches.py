"""Two tree searches that prove the signs optimal or improve them, within a limited amount of work (park2011 3.2).

Symbols are those of `candidates`.

*Boxes*, the paper's way to a certificate.  A node holds some signs and lets the others range over -1 … +1; J is convex
there, and `kernels.relax` bounds it from below whether or not its descent has converged.  Depth first, the child nearer
to the relaxed value first, on the frame whose sign would cost most if it were wrong:
``|u_i|² (1 - |B_i|²) (1 - s_i²)``.  Signs whose other value the bound rules out are held on the way.

*Suffixes*, depth first in time, with the cost of the rest known beforehand.

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

from typing import NamedTuple, TypeAlias

import numpy as np

from pipeline.core.binary_quadratic import kernels
from pipeline.core.binary_quadratic.candidates import Programme

TAMED = 0.01
"""Fraction of the best cost by which the lower bound is weakened in order to exclude very large coefficients."""


class BoxTree(NamedTuple):
    """State of the branch-and-bound search over boxes of sign values.

    Attributes
    ----------
    fixed : (F,) int8
    values, half : (F,)
    z : (3, K)
    trail : (F,) int
        Frames whose signs were fixed on the way.
    levels : (F + 1, 3) int
        Of each level the frame branched on, whether its second child has been entered, the trail's length before it.
    bounds : (F + 2,)
        Of each level, mm², and last of leaves that stayed open at the end.
    counts : (4,) int
    """

    fixed: np.ndarray
    values: np.ndarray
    z: np.ndarray
    half: np.ndarray
    trail: np.ndarray
    levels: np.ndarray
    bounds: np.ndarray
    counts: np.ndarray


class BoxSearch:
    """Branch-and-bound search in which some signs are fixed and the others range from -1 to +1.

    Parameters
    ----------
    programme : Programme
    """

    def __init__(self, programme: Programme) -> None:
        frames, components = programme.basis.shape
        fixed = np.where(programme.kind == kernels.FORCED, 1, 0).astype(np.int8)
        self._programme = programme
        self._tree = BoxTree(
            fixed=fixed,
            values=fixed.astype(float),
            z=np.empty((3, components)),
            half=np.empty(frames),
            trail=np.empty(frames, np.int64),
            levels=np.zeros((frames + 1, 3), np.int64),
            bounds=np.full(frames + 2, -np.inf),
            counts=np.zeros(4, np.int64),
        )
        self._tree.bounds[-1] = np.inf

    @property
    def finished(self) -> bool:
        """True if the search has ruled out all signs other than the best ones."""
        return bool(self._tree.counts[kernels.STATE] == kernels.DONE)

    @property
    def nodes(self) -> int:
        """Number of nodes for which the search has computed a lower bound."""
        return int(self._tree.counts[kernels.NODES])

    def lower_bound(self) -> float:
        """Return the lower bound of the cost J over all open nodes, mm²; infinite if no node is open."""
        counts, bounds = self._tree.counts, self._tree.bounds
        depth, entering = int(counts[kernels.DEPTH]), counts[kernels.STATE] == kernels.ENTER
        if entering and depth == 0:
            return -np.inf
        # The node about to be entered lies below the last level; so does what is left of each level.
        untried = self._tree.levels[:depth, 1] == 0
        if entering:
            untried[-1] = True
        return min(bounds[-1], bounds[:depth][untried].min(initial=np.inf))

    def run(self, best: np.ndarray, values: np.ndarray, gap: float, allowance: float, work: int) -> None:
        """Continue the search for about `work` sweeps; better signs are written into `values`, and their cost into
        `best`.

        Parameters
        ----------
        best : (1,)
            J of the best values so far, mm².
        values : (F,)
            The best values so far.
        gap : float
            Relative improvement of J below which the search prunes.
        allowance : float
            Rounding error of J, mm²; improvements below twice this are pruned.
        work : int
            Sweeps over all frames.
        """
        kernels.search_boxes(self._programme, self._tree, best, values, gap, allowance, work)


class SuffixTree(NamedTuple):
    """State of the depth-first search in time over suffixes, where a suffix is the frames from t to the last one.

    Attributes
    ----------
    kappa : float
    lost : float
        kappa times the size of the programme, mm²: what a bound is short of.
    rows : (2, F + 1, K)
        B and C, then zeros.
    gains : (2, F, K)
    worth : (2, F)
        What a square of either row's error costs, given the frames before.
    links : (F, 3, 2)
        What the rows of the next frame make of each gain, and then, of this one, C of the gain of B.
    state : (F, 3, K)
        Coefficients before each frame, mm, where they have been needed.
    ahead, predicted : (F, 2, 3)
        What the rows of the next frame, and of this one, make of them, mm.
    off : (F, 2, 3)
        By how much that misses, mm.
    spent : (F + 1,)
        Cost before each frame, mm².
    signs : (F, 3) int8
        The sign of a frame, how many of its signs are still to be tried, and whether its state is known.
    rest : (F + 1,)
        S_t, mm²; zero where not yet known.
    ends : (2,)
        Least cost of the frames from t on; that of leaves left open.
    counts : (6,) int
    """

    kappa: float
    lost: float
    rows: np.ndarray
    gains: np.ndarray
    worth: np.ndarray
    links: np.ndarray
    state: np.ndarray
    ahead: np.ndarray
    predicted: np.ndarray
    off: np.ndarray
    spent: np.ndarray
    signs: np.ndarray
    rest: np.ndarray
    ends: np.ndarray
    counts: np.ndarray


class SuffixSearch:
    """Depth-first search over the signs in order of time, with lower bounds on the cost of the remaining frames.

    Parameters
    ----------
    programme : Programme
    objective : float
        J of the best signs known, mm².
    """

    def __init__(self, programme: Programme, objective: float) -> None:
        frames, components = programme.basis.shape
        size = programme.size
        kappa = max(TAMED * objective / size, 1e-9) if size > 0 else 1.0
        self._programme = programme
        self._tree = SuffixTree(
            kappa=kappa,
            lost=kappa * size,
            rows=np.pad([programme.basis, _shares(programme.excess, frames)], ((0, 0), (0, 1), (0, 0))),
            gains=np.empty((2, frames, components)),
            worth=np.empty((2, frames)),
            links=np.empty((frames, 3, 2)),
            state=np.empty((frames, 3, components)),
            ahead=np.empty((frames, 2, 3)),
            predicted=np.empty((frames, 2, 3)),
            off=np.empty((frames, 2, 3)),
            spent=np.zeros(frames + 1),
            signs=np.zeros((frames, 3), np.int8),
            rest=np.zeros(frames + 1),
            ends=np.array([np.inf, np.inf]),
            counts=np.array([frames - 1, 0, 0, 0, 0, 0], np.int64),
        )

    @property
    def finished(self) -> bool:
        """True if the search has ruled out all signs other than the best ones."""
        return bool(self._tree.counts[kernels.FINISHED])

    @property
    def nodes(self) -> int:
        """Number of nodes of the search tree, each a frame with its sign, that have been entered."""
        return int(self._tree.counts[kernels.ENTERED])

    def lower_bound(self) -> float:
        """Return the lower bound of the cost J over all open nodes, mm²."""
        if self.finished:
            return self._tree.ends[1]
        return min(self._tree.rest[self._tree.counts[kernels.START] + 1], self._tree.ends[1])

    def run(self, best: np.ndarray, values: np.ndarray, gap: float, allowance: float, work: int) -> None:
        """Continue the search for about `work` nodes; better signs are written into `values`, and their cost into
        `best`.
        """
        kernels.search_suffixes(self._programme, self._tree, best, values, gap, allowance, work)


Search: TypeAlias = BoxSearch | SuffixSearch


def _shares(excess: np.ndarray, frames: int) -> np.ndarray:
    """Return rows C (F, K), one for each frame, such that ``C^T C`` is at most the matrix G."""
    components = len(excess)
    values, vectors = np.linalg.eigh(excess)
    # Rounding may have put the eigenvalues this much too high.
    values = np.maximum(values - 1e-13 * np.abs(values).max(initial=0.0), 0.0)
    turn = np.arange(frames) % components
    times = np.bincount(turn, minlength=components)
    return np.ascontiguousarray((np.sqrt(values / np.maximum(times, 1)) * vectors).T[turn])
