"""How far the recovered time is from the true one, for every smoothness, both penalties and both starts.

mozerov2006 section 3, on performances whose true course is known.  The pattern stays the median sequence that the
model chose.  An error is the distance, in frames of the performance, of the frame that is matched with a sample of
the pattern from the frame that truly shows the same phase; where the pattern stands still nobody can tell the phase,
so errors are also given for the samples at which it moves alone.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.core.action_model import mean_squared_deviation
from pipeline.core.synchronization import STARTS
from pipeline.storage.store import Artefact
from pipeline.studies.actions.learning import split
from pipeline.studies.options import SmoothnessSweep
from pipeline.synthetic.bending import correspondence
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput


def measure(
    options: SmoothnessSweep, dataset: Artefact, model: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of the time that synchronization recovers, and the truth that they are measured by.

    ``error_frames``, ``error_moving_frames`` (starts, penalties, smoothness, M), zero at the pattern, whose time is
    its own; ``true_frames`` (M, P) the frame of each performance, fractional, that shows the phase of each sample of
    the pattern; ``moving`` (P,) where the pattern moves.
    """
    _check(options, dataset)
    linear, learnt, median = model.arrays["linear"], model.notes["options"], int(model.notes["median"])
    mu = np.array(options.smoothness, dtype=float) * mean_squared_deviation(linear)
    true, moving = _truth(dataset, median, linear.shape[1])
    frames_per_sample = (np.diff(dataset.arrays["first"]) - 1) / (linear.shape[1] - 1)

    def one(m: int) -> np.ndarray:
        errors = []
        for start, penalty, smoothness in product(STARTS, options.penalties, mu):
            found = synchronization.synchronize(
                linear[median],
                linear[m],
                max_disparity=learnt["max_disparity"],
                smoothness=float(smoothness),
                penalty=penalty,
                start=start,
                steps=learnt["steps"],
            )
            off = np.abs(synchronization.rate_to_rate(found.disparity) * frames_per_sample[m] - true[m])
            errors.append((off.mean(), off[moving].mean()))
        return np.array(errors).reshape(len(STARTS), len(options.penalties), len(mu), 2)

    error = np.stack(map_threads(one, range(len(linear)), workers), axis=3)
    return {
        "starts": np.array(STARTS),
        "penalties": np.array(options.penalties),
        "smoothness": np.array(options.smoothness, dtype=float),
        "error_frames": error[..., 0],
        "error_moving_frames": error[..., 1],
        "true_frames": true,
        "moving": moving,
    }, {}


def _truth(dataset: Artefact, median: int, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Frames (M, P) that truly match the pattern's samples, and whether it moves at each (P,)."""
    phases = split(dataset.arrays["phase"], dataset.arrays["first"])
    pattern = phases[median]
    at = np.linspace(0.0, len(pattern) - 1.0, samples)
    there = np.interp(at, np.arange(len(pattern)), pattern)
    begins, ends = dataset.arrays["moving_phase"]
    return np.stack([correspondence(there, p) for p in phases]), (there >= begins) & (there <= ends)


def _check(options: SmoothnessSweep, dataset: Artefact) -> None:
    if "phase" not in dataset.arrays:
        raise InvalidInput(
            "the true course of an action is known of synthetic performances alone",
            where="data",
            expected="data=synthetic",
        )
    for name, wanted in (("smoothness", options.smoothness), ("penalties", options.penalties)):
        if not wanted or len(set(wanted)) < len(wanted):
            raise InvalidInput(
                "nothing to try, or something twice", where=f"sweep.{name}", received=str(list(wanted))
            )
