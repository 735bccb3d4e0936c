"""Ingest stage: from recordings, or synthetic motion, to usable clips."""

from __future__ import annotations

from pipeline.clips.kinds import Clips
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment


def run(experiment: Experiment, store: Store) -> Stored[Clips]:
    """Return the usable clips of the kind that the experiment's dataset asks for, and the report on each clip."""
    corpus = experiment.dataset.corpus
    request = experiment.data.request(corpus, experiment.skeleton, experiment.seed, experiment.workers)
    return stored(
        store,
        "ingest",
        request.options,
        [],
        request.make,
        result=corpus.result,
        source=type(corpus).__module__,
    )
