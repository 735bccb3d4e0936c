"""Inputs for tests of limbs: motion stretches from synthetic clips, and results of sweeps over these stretches."""

from __future__ import annotations

from typing import Any

from pipeline.cli.compose import compose
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.study import Sweep, SweepInputs


def stretches_of(name: str) -> LimbStretches:
    """Return the motion stretches of a preset at smoke scale."""
    experiment = compose(["scale=smoke", f"experiment={name}"])
    corpus = experiment.dataset.corpus
    clips = experiment.data.request(corpus, experiment.skeleton, experiment.seed, 1).make()
    result: LimbStretches = experiment.dataset.build(clips, workers=1)
    return result


def measure(
    sweep: Sweep, stretches: LimbStretches, model: TrajectoryBasisModel, *, workers: int = 1, seed: int = 7
) -> Any:
    """Return the result of a sweep over limbs, which needs the options of the model but no learnt model."""
    return sweep.measure(SweepInputs(None, stretches, None, model, workers, seed))
