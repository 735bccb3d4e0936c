"""Dataset stage: from clips to samples."""

from __future__ import annotations

from typing import Any

from pipeline.clips.kinds import Clips
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment


def run(experiment: Experiment, clips: Stored[Clips], store: Store) -> Stored[Any]:
    """Return the samples that the dataset's options build."""
    options = experiment.dataset
    return stored(
        store,
        "dataset",
        options,
        [clips],
        lambda: options.build(clips.value, workers=experiment.workers),
        result=result_type(options.build),
        sources=[type(options).__module__],
    )
