"""Clips of further synthetic populations: made from a seed of their own, and kept without their positions."""

from __future__ import annotations

from dataclasses import replace

from pipeline.clips.kinds import Clips, Request
from pipeline.seeding import derive_generator
from pipeline.stages.artefacts import stored
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment


def seed_of(experiment: Experiment, number: int) -> int:
    """Return the seed of one population."""
    return int(derive_generator(experiment.seed, f"population {number + 1}").integers(2**31))


def reported(experiment: Experiment, number: int, store: Store, made: Clips | None = None) -> Clips:
    """Return the clips of one population without their positions, which are not kept."""
    asked = request(experiment, number)

    def without_positions() -> Clips:
        clips = asked.make() if made is None else made
        return replace(clips, positions=clips.positions[:0])

    corpus, sources = experiment.dataset.corpus, [asked.source]
    return stored(
        store,
        "population_clips",
        asked.options,
        [],
        without_positions,
        result=corpus.result,
        sources=sources,
    ).value


def request(experiment: Experiment, number: int) -> Request:
    """Return the request for the clips of one population."""
    seed = seed_of(experiment, number)
    return experiment.data.request(experiment.dataset.corpus, experiment.skeleton, seed, 1)
