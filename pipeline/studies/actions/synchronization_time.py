"""Seconds that synchronization takes: one pair, all performances onto one pattern, all ordered pairs.

mozerov2006 section 4 gives 0.015 s for a pair and 0.6 s for forty performances onto a pattern that has been chosen;
choosing it as the median sequence takes all ordered pairs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.storage.store import Artefact
from pipeline.studies.options import TimingSweep
from pipeline.validation import InvalidInput


def measure(options: TimingSweep, model: Artefact) -> tuple[dict[str, Any], dict[str, Any]]:
    """Median seconds of repeated runs: ``what``, ``performances``, ``seconds``, in the order of the docstring."""
    if options.repeats < 1:
        raise InvalidInput(
            "nothing is timed", where="sweep.repeats", expected="1 or more", received=str(options.repeats)
        )
    linear, learnt = model.arrays["linear"], model.notes["options"]
    median = int(model.notes["median"])
    others = [m for m in range(len(linear)) if m != median]
    chosen = {name: learnt[name] for name in ("max_disparity", "penalty", "start", "steps")}
    chosen["smoothness"] = float(model.notes["smoothness"])

    def onto_the_pattern(performances: list[int]) -> None:
        for m in performances:
            found = synchronization.synchronize(linear[median], linear[m], **chosen)
            synchronization.warp(linear[m], found.disparity)

    def all_pairs() -> None:
        found = synchronization.synchronize_all(linear, **chosen)
        n = synchronization.median_sequence(found.cost)
        synchronization.warp(linear, found.disparity[n])

    jobs: dict[str, tuple[int, Callable[[], None]]] = {
        "pair": (2, lambda: onto_the_pattern(others[:1])),
        "onto_pattern": (len(linear), lambda: onto_the_pattern(others)),
        "all_pairs": (len(linear), all_pairs),
    }
    return {
        "what": np.array(list(jobs)),
        "performances": np.array([count for count, _ in jobs.values()]),
        "seconds": np.array([_median_seconds(job, options.repeats) for _, job in jobs.values()]),
    }, {"samples": linear.shape[1], "dimensions": linear.shape[2], "repeats": options.repeats}


def _median_seconds(job: Callable[[], None], repeats: int) -> float:
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        job()
        seconds.append(time.perf_counter() - started)
    return float(np.median(seconds))
