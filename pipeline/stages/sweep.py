"""Sweep stage: measurements on every fold for every value of the sweep."""

from __future__ import annotations

from typing import Any

from pipeline.clips.kinds import Clips
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import SweepInputs


def run(
    experiment: Experiment, clips: Stored[Clips], dataset: Stored[Any], model: Stored[Any], store: Store
) -> Stored[Any]:
    """Return the measurements of the sweep."""
    options = experiment.sweep
    inputs = SweepInputs(
        clips=clips.value,
        dataset=dataset.value,
        model=model.value,
        dataset_options=experiment.dataset,
        model_options=experiment.model,
        workers=experiment.workers,
        seed=experiment.seed,
    )
    return stored(
        store,
        "sweep",
        {"sweep": options, "seed": experiment.seed} if options.draws_random_numbers else options,
        [*([clips] if options.reads_clips else []), dataset, model],
        lambda: options.measure(inputs),
        result=result_type(options.measure),
        sources=[type(options).__module__],
    )
