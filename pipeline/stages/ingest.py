"""Ingest stage: usable clips from recordings or from synthetic motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from pipeline.clips.kinds import Clips
from pipeline.clips.usable import NoUsableClips
from pipeline.seeding import derive_generator
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput


def run(experiment: Experiment, store: Store, population: int | None = None) -> Stored[Clips]:
    """Return the usable clips of the kind that the experiment's dataset needs, with the report on all clips.

    Synthetic walks that only the dataset reads are streamed: each is represented, then discarded.  Without usable clips
    the report is still written, next to the figures of the data set: ``refused_walks.csv``,
    ``refused_performances.csv`` or ``refused_clips.csv``.

    Parameters
    ----------
    experiment : Experiment
    store : Store
    population : int, optional
        Number of a further synthetic population, from 0; None for the population of the preset.
    """
    corpus, dataset = experiment.dataset.corpus, experiment.dataset.shared()
    stage, seed, workers = "ingest", experiment.seed, experiment.workers
    if population is not None:
        stage, seed, workers = "population", seed_of(experiment, population), 1
    request = experiment.data.request(corpus, experiment.skeleton, seed, workers)
    options, make, result, sources = request.options, request.make, corpus.result, [request.source]
    if dataset and request.streaming and not experiment.sweep.reads_clips:
        options, make = {"clips": options, "dataset": dataset}, partial(dataset.represent, request.streaming)
        result, sources = result_type(dataset.represent), [*sources, type(dataset).__module__]
    try:
        return stored(store, stage, options, [], make, result=result, sources=sources)
    except NoUsableClips as refusal:
        path = experiment.published_in / f"refused_{corpus.name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        tables.write(path, report_table(refusal.report, refusal.columns), sort_by=["clip"])
        raise InvalidInput(
            f"{refusal.what} (every reason is in {path})",
            expected=refusal.expected,
            received=refusal.received,
            code=refusal.code,
            **refusal.values,
        ) from None


def seed_of(experiment: Experiment, population: int) -> int:
    """Return the random seed of a further synthetic population, given by its index."""
    return int(derive_generator(experiment.seed, f"population {population + 1}").integers(2**31))


def report_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the report on all clips as a table (columns by name)."""
    return {name: _column([row[name] for row in rows]) for name in columns}


def _column(values: list[Any]) -> np.ndarray:
    """Return a column of the report as numbers (NaN for empty cells) or strings."""
    if any(isinstance(value, int | float) for value in values):
        return np.array([np.nan if value == "" else float(value) for value in values])
    return np.array([str(value) for value in values])
