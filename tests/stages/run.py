"""Functions for tests that run the four stages of an experiment before the figure."""

from __future__ import annotations

from typing import Any, NamedTuple

from pipeline.cli.compose import compose
from pipeline.clips.options import Data
from pipeline.stages import chain
from pipeline.stages.artefacts import Stored
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment


class Stages(NamedTuple):
    """Results of the four stages of an experiment before the figure."""

    clips: Any
    dataset: Any
    model: Any
    sweep: Any


def smoke(figure: str, *overrides: str, data: Data | None = None) -> Experiment:
    """Return a validated experiment at smoke scale, with another data set if one is given."""
    experiment = compose(["scale=smoke", f"experiment={figure}", *overrides])
    if data is not None:
        experiment.data = data
    experiment.validate()
    return experiment


def stored_stages(experiment: Experiment, store: Store) -> tuple[Stored[Any], ...]:
    """Run the four stages, and return the stored result of each stage with its key."""
    return chain.run(experiment, store)


def stages(experiment: Experiment, store: Store) -> Stages:
    """Run the four stages, and return their results."""
    return Stages(*(retained.value for retained in stored_stages(experiment, store)))
