"""Timing of two implementations that compute the same result, and exponents of growth."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from tests.benchmarks.tables import Row


def cpu_seconds(function: Callable[[], object]) -> float:
    """Return the CPU time of one call, s, which other processes on the machine hardly change."""
    started = time.process_time()
    function()
    return time.process_time() - started


def in_turns(
    job: str,
    peer: str,
    ours: Callable[[], object],
    theirs: Callable[[], object],
    *,
    rounds: int,
    scaled: float = 1.0,
    agreement: float,
    note: str,
) -> Row:
    """Run two implementations alternately, and return a row with the ratio of their CPU times, median and range.

    Parameters
    ----------
    job, peer : str
    ours, theirs : callable
        Called in turns, after one call of each that is not counted.
    rounds : int
    scaled : float
        How many times the peer's work is the whole: its time is multiplied by this.
    agreement : float
        Largest relative difference of the two answers, measured by the caller beforehand.
    note : str
    """
    ours()
    theirs()
    ratios = []
    for _ in range(rounds):
        mine = cpu_seconds(ours)
        ratios.append(scaled * cpu_seconds(theirs) / mine)
    return {
        "job": job,
        "peer": peer,
        "times_ours": float(np.median(ratios)),
        "least": min(ratios),
        "most": max(ratios),
        "rounds": rounds,
        "largest_difference": f"{agreement:.0e}",
        "note": note,
    }


def relative_difference(ours: np.ndarray, theirs: np.ndarray, *, at_most: float) -> float:
    """Return the largest difference of two arrays, relative to the largest magnitude.

    Raises
    ------
    SystemExit
        If it is above `at_most`: a ratio of times to different answers says nothing.
    """
    difference = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    if not difference <= at_most:
        raise SystemExit(
            f"the results differ by {difference:.2g} of the largest magnitude, more than {at_most:g}"
        )
    return difference


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Return the exponent b of the power law seconds = a · size^b, by least squares on logarithms.

    Examples
    --------
    >>> round(exponent([1, 2, 4], [3.0, 12.0, 48.0]), 6)
    2.0
    """
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
