"""Choice between the two candidate positions of a joint in each frame: a binary quadratic programme (park2011 3.2).

Symbols are those of `candidates`: candidates ``c_i = m_i + s_i u_i``, and ``J(s) = ||c||² - ||B^T c||²`` over
signs s.  [park2011 10] has b in {0, 1} where this has ``s = 2 b - 1``, and [park2011 12] is J for orthonormal B.

The order of work: good signs at once (`descent`), then two searches that prove them, or find better ones: branch and
bound over boxes (`BoxSearch`), which is the paper's, and depth first in time (`SuffixSearch`), which is often faster
where the box is slow.  They alternate by amounts of work and share the best signs.  A limit of time is a number of
turns, so that what is found and what is proved depends on neither clock nor load.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic.candidates import Programme, programme_of
from pipeline.core.binary_quadratic.descent import LONGEST, descend, mirrored
from pipeline.core.binary_quadratic.descent import search as first_signs
from pipeline.core.binary_quadratic.searches import BoxSearch, Search, SuffixSearch
from pipeline.shortened import shortened
from pipeline.validation import require_range

_WORK = 400_000
"""Work after which one search pauses and the other continues, in multiplications; about two milliseconds."""

OPERATIONS_PER_S = 300_000_000
"""Number of operations that count as one second of a time limit; about the speed of one processor core of 2024."""


@shortened
class BinarySolution:
    """Optimal or best known signs of a limb with their cost, and a lower bound of the cost of all possible signs.

    Attributes
    ----------
    signs : (F,) int
        -1 or +1; +1, the far candidate, where the two are one point.
    values : (F,)
        The signs, but for relaxed frames: there anything from -1 to +1.
    objective : float
        J of the values, mm².
    lower_bound : float
        No values cost less than this, mm²; it is at most the objective.
    proved : bool
        Whether it is the objective less the gap, or less what rounding hides.
    mirror_signs : (F,) int
        The best found by flips of frames and windows from the other signs of all frames, among those that differ
        from `signs` in at least half of the squared half chord of the frames whose sign was to be found.  Where it is
        better than what the searches left, the two change places, and the mirror is as they left it: of proved signs
        a flip may then improve it, but by no more than the gap.
    mirror_objective : float
        J of the mirror, mm²; inf where no frame's sign was to be found.
    margin : float
        J of the mirror over J: 1 or a little more means that the data do not tell the two apart.  Inf where only the
        mirror costs anything.
    boxes, steps : int
        Nodes of the two searches.
    """

    signs: np.ndarray
    values: np.ndarray
    objective: float
    lower_bound: float
    proved: bool
    mirror_signs: np.ndarray
    mirror_objective: float
    margin: float
    boxes: int
    steps: int


def minimise(
    basis: np.ndarray,
    middle: np.ndarray,
    half_chord: np.ndarray,
    *,
    gap: float = 1e-6,
    time_limit_s: float = 1.0,
    relax_below: float = 0.0,
) -> BinarySolution:
    """Return the depth signs s that minimise the cost J(s) = ||c||² - ||B^T c||², where c = m + s u
    [park2011 10, 11, 12].

    A lower bound of J over all signs is returned too.

    Parameters
    ----------
    basis : (F, K)
        B: orthonormal columns, or any of spectral norm at most one, as `trajectory_basis` makes them for a soft
        basis or for the frames that were observed.
    middle, half_chord : (F, 3)
        m and u, mm: the candidates are m - u and m + u.  Frames without them have to be left out.
    gap : float
        Signs that are better by less than this fraction of J are not looked for.
    time_limit_s : float
        Nominal seconds of the search for a proof, each of `OPERATIONS_PER_S` operations, so that the answer is the
        same on every machine and under any load; zero gives the first signs with the bound of one turn.
    relax_below : float
        Frames whose half chord is shorter than this, mm, may take any point between the candidates: where a ray is
        tangent within the noise, the sign means nothing.

    Raises
    ------
    InvalidInput
        If shapes or numbers are not as described.

    Notes
    -----
    Of several optima within the gap the one that the searches come upon first is returned: first those nearest
    the smooth paths of `descent`.  Signs and mirror that cost the same to rounding, as with parallel rays, are
    put in the order in which the first sign to be found is +1.

    Lower bounds are less a generous allowance for rounding, `Programme.allowance`.

    Examples
    --------
    >>> constant = np.full((4, 1), 0.5)
    >>> near = np.array([[1.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    >>> chords = np.array([[0.0, 1, 0], [0, 1, 0], [0, -1, 0], [0, 1, 0]])
    >>> found = minimise(constant, near, chords)
    >>> found.signs
    array([ 1,  1, -1,  1])
    >>> found.objective, found.margin, found.proved
    (0.75, 1.0, True)
    """
    programme = programme_of(basis, middle, half_chord, relax_below=relax_below)
    require_range("gap", gap, at_least=0.0)
    require_range("time_limit_s", time_limit_s, at_least=0.0)
    values = programme.with_relaxed(first_signs(programme))
    best = np.array([programme.objective(values)])
    box, suffix = BoxSearch(programme), None
    sweeps = max(1, _WORK // programme.basis.size)
    turns = max(1, int(time_limit_s * OPERATIONS_PER_S) // _WORK)
    for turn in range(turns):
        searcher: Search = box
        if turn % 2 == 1:
            suffix = suffix or SuffixSearch(programme, best[0])
            searcher = suffix
        # A sweep over all frames costs what entering half as many does.
        work = sweeps if searcher is box else max(1, sweeps * programme.frames // 2)
        searcher.run(best, values, float(gap), programme.allowance(best[0]), work)
        if searcher.finished:
            break
    bounds = [search.lower_bound() for search in (box, suffix) if search is not None]
    return _solution(programme, values, max(bounds), gap, box.nodes, 0 if suffix is None else suffix.nodes)


def _solution(
    programme: Programme, values: np.ndarray, bound: float, gap: float, boxes: int, steps: int
) -> BinarySolution:
    """Return the solution for a limb together with its mirror solution and the ratio of their costs."""
    objective = programme.objective(values)
    other, other_objective = values, np.inf
    rounding = programme.allowance(objective)
    if programme.weight.any():
        other, _ = descend(programme, mirrored(programme, values), longest=LONGEST, away_from=values)
        other = programme.with_relaxed(other)
        other_objective = programme.objective(other)
        leads = values[int(np.argmax(programme.weight > 0))] > 0
        if other_objective < objective - rounding or (other_objective <= objective + rounding and not leads):
            values, other = other, values
            objective, other_objective = other_objective, objective
            rounding = programme.allowance(objective)
    # What the searches left out is worth up to this much.
    proof = objective - max(gap * objective, 2.0 * rounding)
    bound = min(max(bound, 0.0), proof)
    return BinarySolution(
        signs=_signs(values),
        values=values,
        objective=objective,
        lower_bound=bound,
        proved=bound >= proof,
        mirror_signs=_signs(other),
        mirror_objective=other_objective,
        margin=_margin(other_objective, objective, rounding),
        boxes=boxes,
        steps=steps,
    )


def _signs(values: np.ndarray) -> np.ndarray:
    """Return the sign (F,), -1 or +1, of each relaxed value."""
    return np.where(values < 0, -1, 1)


def _margin(other: float, here: float, rounding: float) -> float:
    """Return the mirror margin: the cost of the mirror solution divided by the cost of the best solution.

    1 if both are rounding errors, infinite if only the lesser is zero.
    """
    if other <= rounding:
        return 1.0
    return other / here if here > 0 else np.inf
