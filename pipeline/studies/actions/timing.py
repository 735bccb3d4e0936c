"""Computing time of synchronization for one pair of performances, for one pattern, and for all ordered pairs.

mozerov2006 section 4 gives 0.015 s for a pair and 0.6 s for forty performances onto a chosen pattern.  The
choice of the median sequence needs all ordered pairs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.core import synchronization
from pipeline.studies.actions.model import ActionInputs
from pipeline.studies.study import Sweep
from pipeline.validation import Count


@dataclass(frozen=True)
class Timings:
    """Median computing times of synchronization, s, over repeated runs.

    Attributes
    ----------
    table : DataFrame
        ``what`` (``pair``, ``onto_pattern``, ``all_pairs``), ``performances``, ``samples`` P, ``dimensions`` b, and
        ``seconds``.  A data frame is not in ``arrays.npz``, so that two runs differ in ``table_timing.csv`` alone.
    """

    table: pd.DataFrame


class Timing(Sweep):
    """Options of the measurement of the computing time of synchronization."""

    repeats: Count = 5  # number of runs, whose median is reported

    def measure(self, inputs: ActionInputs) -> Timings:
        """Return the computing times of synchronization on this machine."""
        linear, median = inputs.model.linear, inputs.model.median
        others = [m for m in range(len(linear)) if m != median]
        options = {**inputs.model_options.path_options, "smoothness": inputs.model.smoothness}

        def onto_the_pattern(performances: list[int]) -> None:
            for m in performances:
                result = synchronization.synchronize(linear[median], linear[m], **options)
                synchronization.warp(linear[m], result.disparity)

        def all_pairs() -> None:
            result = synchronization.synchronize_all(linear, **options)
            synchronization.warp(linear, result.disparity[synchronization.median_sequence(result.cost)])

        jobs: dict[str, tuple[int, Callable[[], None]]] = {
            "pair": (2, lambda: onto_the_pattern(others[:1])),
            "onto_pattern": (len(linear), lambda: onto_the_pattern(others)),
            "all_pairs": (len(linear), all_pairs),
        }
        columns = {
            "what": list(jobs),
            "performances": [count for count, _ in jobs.values()],
            "samples": linear.shape[1],
            "dimensions": linear.shape[2],
            "seconds": [_median_seconds(job, self.repeats) for _, job in jobs.values()],
        }
        return Timings(pd.DataFrame(columns))


def _median_seconds(job: Callable[[], None], repeats: int) -> float:
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        job()
        seconds.append(time.perf_counter() - started)
    return np.median(seconds)
