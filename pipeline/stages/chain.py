"""The four stages before the figure, one after the other: clips, samples, model and measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

from pipeline.processes import return_memory
from pipeline.stages import ingest
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.sealed_folders import file_digest
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import SweepInputs

STAGES = ("ingest", "dataset", "model", "sweep")


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
    for stage in STAGES[: STAGES.index(through) + 1]:
        with at(stage):
            done.append(_after(done, stage, experiment, store) if done else ingest.run(experiment, store))
        return_memory()  # of small arrays that a stage made and let go, which would otherwise stay
    return tuple(done)


def _after(before: Sequence[Stored[Any]], stage: str, experiment: Experiment, store: Store) -> Stored[Any]:
    """Return what a stage makes, by its options, of the results of the stages before it."""
    options = getattr(experiment, stage)
    made_from, inputs, modules = options, before[-1:], [type(options).__module__]
    if stage == "sweep":
        inputs = before if options.reads_clips else before[1:]
        modules += options.modules()
        if options.draws_random_numbers:
            made_from = {"sweep": options, "seed": experiment.seed}
        files = options.further_files(experiment.data)
        if files:
            made_from = {
                "sweep": made_from,
                "files": {name: file_digest(path) for name, path in files.items()},
            }
        clips, dataset, model = (kept.value for kept in before)
        given = SweepInputs(
            clips, dataset, model, experiment.model, experiment.workers, experiment.seed, files
        )
        method, compute = options.measure, partial(options.measure, given)
    else:
        method = options.build if stage == "dataset" else options.learn
        compute = partial(method, before[-1].value, workers=experiment.workers)
    return stored(
        store,
        stage,
        made_from,
        inputs,
        compute,
        result=result_type(method),
        sources=modules,
    )
