"""Fast heuristic search for depth signs of low cost, without a proof of optimality (park2011 section 3.2).

Symbols are those of `candidates`.  Smooth paths through the candidates are found by dynamic programming, on first and
on second differences and on both; they and their mirrors -s are then improved by flipping single frames and windows of
frames, which is how a path that took a wrong turn, and another one back, is put right.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.binary_quadratic import kernels
from pipeline.core.binary_quadratic.candidates import Programme

DIFFERENCES = ((1.0, 0.0), (0.0, 1.0), (0.1, 1.0))
"""Weights of the squared first and second differences that define smooth initial trajectories."""

LONGEST = 60
"""Largest number of consecutive frames whose signs are flipped together.

Windows that begin at the first frame or end at the last frame may have any length.
"""

NEARLY = 1.5
"""Largest cost of an initial solution, relative to the cheapest one, at which windows of its signs are also flipped."""


def mirrored(programme: Programme, values: np.ndarray) -> np.ndarray:
    """Return the mirror solution (F,): opposite signs in frames with a free sign, unchanged values in other frames."""
    return np.where(programme.kind == 0, -values, values)


def descend(
    programme: Programme, values: np.ndarray, *, longest: int, away_from: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """Return signs (F,) that flipping one frame or a window of frames cannot improve, and their cost J, mm².

    Parameters
    ----------
    programme : Programme
    values : (F,)
        Where the descent starts.
    longest : int
        Frames of the longest window, at least one.
    away_from : (F,), optional
        Signs that the descent must not come near: the squared half chords of the frames that agree with them may
        never be more than those of the frames that do not.  The start has to be so.
    """
    signs = np.array(values, float)
    other = signs if away_from is None else np.asarray(away_from, float)
    best = kernels.descend(
        programme, signs, longest, other, programme.weight, away_from is not None, programme.allowance(0.0)
    )
    return signs, float(best)


def search(programme: Programme) -> np.ndarray:
    """Return the cheapest signs (F,) that local search finds from several initial solutions.

    A later start counts only if it is better by `kernels.MARGIN`, so that rounding does not choose between equals.
    """
    differences = np.array(DIFFERENCES)
    starts = kernels.first_signs(programme, programme.weight, differences, LONGEST, NEARLY, programme.size)
    return starts[0]
