"""Trellis of disparities for the dynamic programming, and its path of lowest cost (mozerov2006 section 3, figure 2).

Symbols
-------
``p``    sample, 0 … P - 1
``d``    disparity: sample p of one sequence is matched with sample p + d of the other
``k``    step of the recurrence, ``d(p-1) = d(p) + k``
``mu``   smoothness, in the unit of the misfit
``E``    misfit (disparity space image), ``S`` least cost of arriving at (p, d)

Why computed differently from how it is printed: many pairs of sequences go through one trellis together, with
pairs as the last axis and disparity before it.  A step of the recurrence is then a shift along the first axis, so
four passes over contiguous memory advance all pairs by one sample.  Nodes that no path can use are never
visited: with both ends pinned that leaves a rhombus.  Steps are not stored on the way; the way back compares the
stored costs again for the nodes of the path alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.core.choice import first_lowest
from pipeline.validation import InvalidInput, require_choice, require_count, require_range

PENALTIES = ("change", "as_printed")
STARTS = ("fixed", "free")
STEPS = (-1, 0, 1)

_TIE = 1e-12
"""Relative difference below which two accumulated costs count as equal."""


@dataclass(frozen=True)
class Trellis:
    """Trellis of the dynamic programming: the allowed disparities at each sample, and the costs of their changes.

    Attributes
    ----------
    low, high : (P,) int
        Least and largest disparity at a sample from which both ends can be reached.
    smoothness : float
        mu, in the unit of the misfit.
    penalty : str
        ``change`` or ``as_printed``.
    steps : tuple of int
        Values of k in order of preference: the smallest first, negative before positive.
    """

    low: np.ndarray
    high: np.ndarray
    smoothness: float
    penalty: str
    steps: tuple[int, ...]

    @property
    def margin(self) -> int:
        """Number of padding nodes on each side of a sample's disparities, so that all changes stay inside the array."""
        return max(self.steps) - min(self.steps)

    @property
    def widths(self) -> np.ndarray:
        """Number of nodes (P,) that the trellis has at each sample, including the padding on both sides."""
        return self.high - self.low + 1 + 2 * self.margin

    def penalties(self, disparity: np.ndarray, step: np.ndarray | int) -> np.ndarray:
        """Return the cost of changing the disparity by k between two consecutive samples [mozerov2006 12].

        The arguments are broadcast.

        mu |k| by default; mu |d + k|, the size of the former disparity, as [mozerov2006 16] is printed.

        Parameters
        ----------
        disparity : (…) int
            At sample p - 1, the printed d + k.
        step : (…) int
            k.
        """
        return self.smoothness * np.abs(step if self.penalty == "change" else disparity)

    def distances_so_far(self, misfit: np.ndarray, paths: np.ndarray) -> np.ndarray:
        """Return the synchronization distance accumulated up to each sample (…, P) along disparity paths
        [mozerov2006 12].

        Parameters
        ----------
        misfit : (…, P)
            E at the nodes of each path.
        paths : (…, P) int
            Disparities.

        Notes
        -----
        Squared misfits and absolute changes; the norm printed in 11 is not squared, and the first sum of 12 runs
        one past the last sample.
        """
        before = paths[..., :-1]
        costs = np.array(misfit, float)
        costs[..., 1:] += self.penalties(before, before - paths[..., 1:])
        return np.cumsum(costs, axis=-1)


def allowed_disparities(
    frames: int,
    *,
    max_disparity: int,
    smoothness: float,
    penalty: str = "change",
    start: str = "fixed",
    steps: Sequence[int] = STEPS,
) -> Trellis:
    """Return the trellis of the allowed disparities at each sample, for the dynamic programming [mozerov2006 13].

    Parameters
    ----------
    frames : int
        P, at least one.
    max_disparity : int
        D, in samples; zero allows no disparity at all.  A band wider than the sequence is as good as none:
        every disparity that leads outside of it is left out anyway.
    smoothness : float
        mu.  Must not be negative; zero is dynamic time warping without a penalty.
    penalty : {"change", "as_printed"}
        mu |k|, or mu |d + k|, of a step.
    start : {"fixed", "free"}
        Whether the disparity of the first sample is pinned to zero, as that of the last one always is.
    steps : sequence of int
        Allowed k.  A step makes time run at the rate 1 - k, so the default means rates from 0 to 2, and
        ``(-2, -1, 0, 1)`` rates up to 3.

    Raises
    ------
    InvalidInput
        If a value is not as described, or a step would run time backwards.
    """
    require_choice("penalty", penalty, PENALTIES)
    require_choice("start", start, STARTS)
    require_range("the smoothness (mu)", smoothness, at_least=0)
    band = require_count("the largest disparity", max_disparity, at_least=0)
    unique = {int(require_range("a step", k, whole=True)) for k in steps}
    # Longer ones lead out of the sequence, but would need memory all the same.
    ordered = tuple(sorted((k for k in unique if k > -max(frames, 2)), key=lambda k: (abs(k), k)))
    if 0 not in ordered:
        raise InvalidInput(
            "the steps must include 0, which leaves the disparity unchanged",
            expected="0 among them",
            received=ordered,
            code="no_zero_step",
        )
    if max(ordered) > 1:
        raise InvalidInput(
            f"the step {max(ordered)} makes time run backwards",
            expected="steps of at most 1, because the rate is 1 - step",
            received=ordered,
            code="step_runs_backwards",
        )
    down, up = min(ordered), max(ordered)
    before = np.arange(frames)
    after = before[::-1]
    low = np.maximum(np.maximum(-band, -before), down * after)
    high = np.minimum(band, up * after)  # inside of the sequence: `up` is 1 or 0
    if start == "fixed":
        low, high = np.maximum(low, -up * before), np.minimum(high, -down * before)
    return Trellis(low, high, float(smoothness), penalty, ordered)


def allocate_costs(nodes: Trellis, pairs: int) -> list[np.ndarray]:
    """Allocate an uninitialised array (width, pairs) of accumulated costs for each sample."""
    ends = np.cumsum(nodes.widths)
    memory = np.empty((ends[-1], pairs))
    return [memory[end - width : end] for end, width in zip(ends, nodes.widths, strict=True)]


def accumulate(
    nodes: Trellis, misfit: Callable[[int, int, int], np.ndarray], out: list[np.ndarray]
) -> np.ndarray:
    """Return the smallest total cost (pairs,) of a disparity path for each pair, by the recurrence [mozerov2006 16].

    The accumulated cost S of every node is written into `out`.

    Parameters
    ----------
    nodes : Trellis
    misfit : callable
        E at sample p for the disparities from low to high, both included: (high - low + 1, pairs), none
        negative.  It may be overwritten by the next call.
    out : list of (width, pairs)
        Made by `allocate_costs`.

    Notes
    -----
    Printed with mu |d + k|, which punishes the size of the disparity, where equations 12 and 15 punish its
    change |k|; `Trellis.penalty` says which of the two is meant.
    """
    margin, pairs = nodes.margin, out[0].shape[1]
    best, other, weighted = np.empty((3, nodes.widths.max(), pairs))
    groups = _groups(nodes)
    low, high = nodes.low.tolist(), nodes.high.tolist()
    for p, row in enumerate(out):
        width = high[p] - low[p] + 1
        row[:margin] = row[margin + width :] = np.inf
        nodes_of_sample = row[margin : margin + width]
        if p == 0:
            nodes_of_sample[:] = misfit(p, low[p], high[p])
            continue
        before = out[p - 1]
        if nodes.penalty == "as_printed":
            disparity = np.arange(low[p - 1] - margin, high[p - 1] + margin + 1)
            before = np.add(before, nodes.penalties(disparity, 0)[:, None], out=weighted[: len(before)])
        first = margin + low[p] - low[p - 1]
        cheapest = _cheapest(before, first, groups, best[:width], other[:width])
        np.add(cheapest, misfit(p, low[p], high[p]), out=nodes_of_sample)
    return out[-1][margin].copy()


def _groups(nodes: Trellis) -> list[tuple[float, list[int]]]:
    """Return the disparity steps grouped by their penalty, largest penalty first.

    The penalty is given if it depends on the step only, otherwise it is 0.
    """
    if nodes.penalty == "as_printed":
        return [(0.0, list(nodes.steps))]
    sizes = sorted({abs(k) for k in nodes.steps}, reverse=True)
    return [
        (float(nodes.penalties(np.zeros(1), size)), [k for k in nodes.steps if abs(k) == size])
        for size in sizes
    ]


def _cheapest(
    before: np.ndarray,
    first: int,
    groups: list[tuple[float, list[int]]],
    best: np.ndarray,
    other: np.ndarray,
) -> np.ndarray:
    """Return the smallest cost (width, pairs) of reaching each node from the nodes of the previous sample."""
    cheapest = None
    for penalty, steps in groups:
        out = best if cheapest is None else other
        cost = before[first + steps[0] :][: len(best)]
        for k in steps[1:]:
            cost = np.minimum(cost, before[first + k :][: len(best)], out=out)
        if penalty > 0:
            # Once for the group: rounding is monotone, so the least sum is the sum of the least.
            cost = np.add(cost, penalty, out=out)
        cheapest = cost if cheapest is None else np.minimum(cheapest, cost, out=best)
    assert cheapest is not None  # there is always the step 0
    return cheapest


def backtrack(nodes: Trellis, rows: list[np.ndarray]) -> np.ndarray:
    """Return the disparity functions (P, pairs) of lowest cost by backtracking from the last sample [mozerov2006 17].

    They are traced back from disparity zero at the last sample.

    Parameters
    ----------
    nodes : Trellis
    rows : list of (width, pairs)
        S, as `accumulate` fills it in with the costs of all samples kept.

    Notes
    -----
    Among steps of equal cost, up to rounding, the first in `Trellis.steps` is taken: 0, then -1, then +1.
    """
    pairs = rows[0].shape[1]
    column = np.arange(pairs)
    steps = np.array(nodes.steps)[:, None]
    path = np.zeros((len(rows), pairs), np.intp)
    origins = (nodes.margin - nodes.low).tolist()
    for p in range(len(rows) - 1, 0, -1):
        before = path[p] + steps
        cost = rows[p - 1].reshape(-1).take((before + origins[p - 1]) * pairs + column)
        cost += nodes.penalties(before, steps)
        path[p - 1] = path[p] + steps[:, 0].take(first_lowest(cost, axis=0, margin=_TIE))
    return path
