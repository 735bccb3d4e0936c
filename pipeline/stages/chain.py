"""The four stages before the figure, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from pipeline.stages import dataset, ingest, model, sweep
from pipeline.stages.artefacts import Stored
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment

STAGES: Mapping[str, tuple[Callable[..., Stored[Any]], tuple[int, ...]]] = {
    "ingest": (ingest.run, ()),
    "dataset": (dataset.run, (0,)),
    "model": (model.run, (1,)),
    "sweep": (sweep.run, (0, 1, 2)),
}
"""Each stage, and the places of those whose results it reads."""


def run(
    experiment: Experiment,
    store: Store,
    *,
    through: str = "sweep",
    at: Callable[[str], AbstractContextManager[None]] = lambda stage: nullcontext(),
) -> tuple[Stored[Any], ...]:
    """Return clips, samples, model and measurements, or the first of them.

    Parameters
    ----------
    experiment : Experiment
    store : Store
    through : str
        The last stage that is run.
    at : callable
        Makes the context in which a stage, given its name, runs.
    """
    done: list[Stored[Any]] = []
    for name, (stage, reads) in STAGES.items():
        with at(name):
            done.append(stage(experiment, *(done[place] for place in reads), store))
        if name == through:
            break
    return tuple(done)
