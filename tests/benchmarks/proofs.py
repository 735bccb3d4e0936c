"""Fraction of limb programmes with a proved optimum, and time to the proof, by number of frames, K and noise.

Limbs of random stretches of 200 frames, cut to fewer, in front of a still, a moving and a shaky camera in turn, as in
park2011 section 5.1.  ``first`` are the signs without a search; ``gap_median`` is 1 - lower bound / objective.  CPU
seconds of one thread; each search may take 2 nominal seconds.  Only a fifth of the trials have over 100 frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from time import process_time

import pandas as pd

from pipeline.cli.compose import compose
from pipeline.core.pinhole import Pinhole
from pipeline.core.trajectory_basis import TrajectoryBasis
from pipeline.seeding import derive_generator
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.one_limb import RootErrorSweep
from pipeline.studies.limbs.scores import distance
from pipeline.studies.limbs.trials import LimbTrial
from tests.benchmarks.tables import Row

FRAMES, COMPONENTS, NOISES_PX = (25, 50, 100, 200), (10, 20), (0.0, 1.0)
LIMIT_S = 2.0
LONG, LONG_SHARE = 100, 0.2
"""Number of frames above which only a fraction of the trials is solved, and this fraction."""
EQUAL_COSTS = 1e-6
"""Relative difference below which two costs count as equal."""
KEYS = ["frames", "components", "noise_px"]
SWEEP = RootErrorSweep(trials=1, cameras=list(Camera))
"""Sweep that draws the trials and solves their programmes."""


def part(trial: LimbTrial, start: int, frames: int) -> LimbTrial:
    """Return the trial of a limb, restricted to consecutive frames."""
    cut = slice(start, start + frames)
    turned = trial.view.rotation[cut] if trial.view.rotation.ndim > 2 else trial.view.rotation
    centre = trial.view.centre[cut] if trial.view.centre.ndim > 1 else trial.view.centre
    of_frames = {name: getattr(trial, name)[cut] for name in ("images", "noise", "parent", "child")}
    return replace(trial, view=Pinhole(trial.view.intrinsics, turned, centre), **of_frames)


def programmes(trials: int) -> Iterator[tuple[int, int, float, int]]:
    """Yield the number of frames, number of components, noise, px, and trial number of every programme."""
    for frames in FRAMES:
        for components in COMPONENTS:
            for noise_px in NOISES_PX:
                for number in range(trials if frames <= LONG else int(LONG_SHARE * trials)):
                    yield frames, components, noise_px, number


def solve(
    stretches: LimbStretches, seed: int, frames: int, components: int, noise_px: float, number: int
) -> Row:
    """Solve one programme twice, without and with time for a proof of optimality, and return a row."""
    whole = SWEEP.trial(stretches, number, SWEEP.cameras[number % len(SWEEP.cameras)], seed)
    spare = stretches.positions.shape[1] - frames
    start = int(derive_generator(seed, f"sweep:part:{number}").random() * (spare + 1))
    trial, basis = part(whole, start, frames), TrajectoryBasis(components)
    seconds, choices = [], []
    for limit_s in (0.0, LIMIT_S):
        started = process_time()
        choices.append(SWEEP.choose(trial, basis, noise_px=noise_px, time_limit_s=limit_s))
        seconds.append(process_time() - started)
    first, last = (choice.solution for choice in choices)
    return {
        **dict(zip(KEYS, (frames, components, noise_px), strict=True)),
        "trial": number,
        "proved": last.proved,
        "objective": last.objective,
        "gap": 0.0 if last.proved else 1.0 - max(last.lower_bound, 0.0) / last.objective,
        "first_best": first.objective <= last.objective * (1 + EQUAL_COSTS),
        "limb_error": distance(choices[1].relative, trial.relative) / trial.length,
        "first_seconds": seconds[0],
        "seconds": seconds[1],
    }


def run(data: str = "synthetic", trials: str = "100") -> list[Row]:
    """Return one row for each number of frames, number of components and noise level."""
    experiment = compose(["experiment=park2011_fig3a", f"data={data}", f"dataset.frames={max(FRAMES)}"])
    corpus = experiment.dataset.corpus
    clips = experiment.data.request(corpus, experiment.skeleton, experiment.seed, 1).make()
    stretches = experiment.dataset.build(clips, workers=1)
    solve(stretches, experiment.seed, FRAMES[0], COMPONENTS[0], NOISES_PX[0], 0)  # compiles the kernels
    solved = [solve(stretches, experiment.seed, *each) for each in programmes(int(trials))]
    return summary(pd.DataFrame(solved))


def summary(solved: pd.DataFrame) -> list[Row]:
    """Return fractions and medians over the trials of each number of frames, number of components and noise level."""
    solved = solved.assign(seconds_to_proof=solved["seconds"].where(solved["proved"]))
    return (
        solved.groupby(KEYS)
        .agg(
            trials=("trial", "size"),
            proved_share=("proved", "mean"),
            gap_median=("gap", "median"),
            first_best_share=("first_best", "mean"),
            limb_error_median=("limb_error", "median"),
            first_seconds_median=("first_seconds", "median"),
            seconds_median=("seconds", "median"),
            seconds_to_proof_median=("seconds_to_proof", "median"),
            seconds_most=("seconds", "max"),
        )
        .reset_index()
        .to_dict("records")
    )
