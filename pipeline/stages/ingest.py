"""Ingest stage: from recordings, or synthetic motion, to usable clips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.clips.kinds import Clips
from pipeline.clips.usable import NoUsableClips
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.validation import InvalidInput


def run(experiment: Experiment, store: Store) -> Stored[Clips]:
    """Return the usable clips of the kind that the experiment's dataset asks for, and the report on each clip.

    If there are none, the report is written all the same: ``refused_clips.csv`` beside the figures of the data set.
    """
    corpus = experiment.dataset.corpus
    request = experiment.data.request(corpus, experiment.skeleton, experiment.seed, experiment.workers)
    try:
        return stored(
            store,
            "ingest",
            request.options,
            [],
            request.make,
            result=corpus.result,
            sources=[request.source],
        )
    except NoUsableClips as refusal:
        path = experiment.published_in / "refused_clips.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        tables.write(path, report_table(refusal.report, refusal.columns), sort_by=["clip"])
        rows = "; ".join(f"{row['clip']}: {row['reason']}" for row in refusal.report[:50] if row["reason"])
        raise InvalidInput(
            f"{refusal.what} (every reason is in {path})", expected=refusal.expected, received=rows
        ) from None


def report_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the report on all clips as columns."""
    return {name: _column([row[name] for row in rows]) for name in columns}


def _column(values: list[Any]) -> np.ndarray:
    """Return a column of the report: numbers, NaN where a refused clip has none, or text."""
    if any(isinstance(value, int | float) for value in values):
        return np.array([np.nan if value == "" else float(value) for value in values])
    return np.array([str(value) for value in values])
