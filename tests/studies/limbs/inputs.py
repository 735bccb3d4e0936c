"""Stretches of synthetic clips, and what a sweep makes of them."""

from __future__ import annotations

from typing import Any

from pipeline.cli.compose import compose
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.study import Sweep, SweepInputs


def stretches_of(name: str) -> LimbStretches:
    """The data set of a preset at smoke scale."""
    experiment = compose(["scale=smoke", f"experiment={name}"])
    corpus = experiment.dataset.corpus
    clips = experiment.data.request(corpus, experiment.skeleton, experiment.seed, 1).make()
    result: LimbStretches = experiment.dataset.build(clips, workers=1)
    return result


def measure(
    sweep: Sweep, stretches: LimbStretches, model: TrajectoryBasisModel, *, workers: int = 1, seed: int = 7
) -> Any:
    """Return the result of a sweep, which needs only the options of the model."""
    return sweep.measure(SweepInputs(None, stretches, None, model, workers, seed))
