"""Which programmes are proved to be solved, and what it costs, by frames, components and noise; ours."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import Smoothness
from pipeline.core.binary_quadratic import compile_kernels
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.limbs.scores import distance
from pipeline.studies.limbs.trials import choose, limb_trial, smoothness
from pipeline.studies.options import ProofSweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import check_sweep, check_values
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

LONG = 100
"""Frames above which a programme may take its whole limit, so that fewer are tried."""


def measure(
    options: ProofSweep, dataset: Artefact, model_options: TrajectoryBasisModel, workers: int, seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Proofs of the programmes of limbs that are cut to fewer frames.

    Parameters
    ----------
    options : ProofSweep
    dataset : Artefact
        Limbs, of as many frames as the longest programmes.
    model_options : TrajectoryBasisModel
        For the kind of basis; its components are swept.
    workers : int
    seed : int

    Returns
    -------
    arrays : dict
        One row to a programme: ``frames``, ``components``, ``noise_px``, ``trial``, ``stretch``, ``limb``, ``camera``,
        ``proved``, ``objective``, ``lower_bound``, ``gap`` relative, ``seconds`` until the search ended,
        ``first_seconds`` and ``first_objective`` of the signs that are found at once, ``limb_error``, ``boxes``,
        ``steps``.
    notes : dict

    Raises
    ------
    InvalidInput
        Options that cannot be, stretches that are too short, or nothing left to try.
    """
    check_sweep(options, adjusts=[options.adjust])
    check_values("frames", options.frames, 3)
    check_values("components", options.components, 1)
    check_values("noises_px", options.noises_px, 0.0)
    if not 0.0 <= options.long_share <= 1.0:
        raise InvalidInput(
            "a share of the trials is none",
            where="sweep.long_share",
            expected="0 to 1",
            received=f"{options.long_share:g}",
        )
    longest = dataset.arrays["positions"].shape[1]
    if max(options.frames) > longest:
        raise InvalidInput(
            "the stretches are shorter than the programmes",
            where="dataset.frames",
            expected=f"{max(options.frames)} or more",
            received=f"{longest}",
        )
    cutoff = smoothness(model_options).cutoff
    # A basis of as many cosines as frames leaves nothing to be measured.
    items = [
        (frames, components, noise, number)
        for frames in options.frames
        for components in options.components
        if components < frames
        for noise in options.noises_px
        for number in range(options.trials if frames <= LONG else int(options.long_share * options.trials))
    ]
    if not items:
        raise InvalidInput(
            "no programme is left",
            where="sweep.components",
            expected="fewer than the frames, and a trial at least",
            received=", ".join(map(str, options.components)),
        )

    compile_kernels()

    def one(item: tuple[int, int, float, int]) -> dict[str, Any]:
        frames, components, noise, number = item
        camera = options.cameras[number % len(options.cameras)]
        whole = limb_trial(options, dataset, number, camera, seed)
        start = int(derive_generator(seed, f"sweep:part:{number}").random() * (longest - frames + 1))
        trial = whole.part(start, frames)
        smooth = Smoothness(components, cutoff)
        seconds, solutions = [], []
        for limit in (0.0, options.time_limit_s):
            started = perf_counter()
            choice = choose(
                trial, smooth, replace(options, time_limit_s=limit), adjust=options.adjust, noise_px=noise
            )
            seconds.append(perf_counter() - started)
            solutions.append(choice.solution)
        first, last = solutions
        gap = 0.0 if last.proved else 1.0 - max(last.lower_bound, 0.0) / last.objective
        return {
            "frames": frames,
            "components": components,
            "noise_px": noise,
            "trial": number,
            "stretch": trial.stretch,
            "limb": trial.limb,
            "camera": camera,
            "proved": last.proved,
            "objective": last.objective,
            "lower_bound": last.lower_bound,
            "gap": gap,
            "seconds": seconds[1],
            "first_seconds": seconds[0],
            "first_objective": first.objective,
            "limb_error": distance(choice.relative, trial.relative) / trial.length,
            "boxes": last.boxes,
            "steps": last.steps,
        }

    rows = map_threads(one, items, workers)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, {
        "unproved": float(1.0 - np.mean([row["proved"] for row in rows])),
        "time_limit_s": options.time_limit_s,
        "threads": workers,
    }
