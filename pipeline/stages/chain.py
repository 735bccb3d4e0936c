"""The four stages before the figure, in order: clips, samples, model and measurements."""

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
    """Run the stages up to `through` and return their results: clips, samples, model and measurements.

    Parameters
    ----------
    experiment : Experiment
    store : Store
    through : str
        Last stage to run.
    at : callable
        Returns the context manager in which a stage runs, from the stage's name.
    """
    done: list[Stored[Any]] = []
    for stage in STAGES[: STAGES.index(through) + 1]:
        with at(stage):
            done.append(_after(done, stage, experiment, store) if done else ingest.run(experiment, store))
        return_memory()  # of the stage's small arrays, which the allocator would keep
    return tuple(done)


def _after(before: Sequence[Stored[Any]], stage: str, experiment: Experiment, store: Store) -> Stored[Any]:
    """Return the result of a stage, computed from its options and the results of earlier stages."""
    options = getattr(experiment, stage)
    key_options, inputs, modules = options, before[-1:], [type(options).__module__]
    if stage == "sweep":
        inputs = before if options.reads_clips else before[1:]
        modules += options.modules()
        if options.draws_random_numbers:
            key_options = {"sweep": options, "seed": experiment.seed}
        files = options.further_files(experiment.data)
        if files:
            key_options = {
                "sweep": key_options,
                "files": {name: file_digest(path) for name, path in files.items()},
            }
        clips, dataset, model = (stage_result.value for stage_result in before)
        sweep_inputs = SweepInputs(
            clips, dataset, model, experiment.model, experiment.workers, experiment.seed, files
        )
        method, compute = options.measure, partial(options.measure, sweep_inputs)
    else:
        method = options.build if stage == "dataset" else options.learn
        compute = partial(method, before[-1].value, workers=experiment.workers)
    return stored(
        store,
        stage,
        key_options,
        inputs,
        compute,
        result=result_type(method),
        sources=modules,
    )
