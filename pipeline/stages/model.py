"""Model stage: learning from the samples."""

from __future__ import annotations

from typing import Any

from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment


def run(experiment: Experiment, dataset: Stored[Any], store: Store) -> Stored[Any]:
    """Return the model that is learnt from the samples."""
    options = experiment.model
    return stored(
        store,
        "model",
        options,
        [dataset],
        lambda: options.learn(dataset.value, workers=experiment.workers),
        result=result_type(options.learn),
        sources=[type(options).__module__],
    )
