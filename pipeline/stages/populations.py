"""Further synthetic populations, of which a figure's tables are made again: how far results depend on who was drawn."""

from __future__ import annotations

from typing import Any

import pandas as pd

from pipeline.clips.options import SyntheticPeople
from pipeline.processes import map_processes
from pipeline.stages import ingest
from pipeline.stages.artefacts import Stored, stored
from pipeline.storage.store import Store
from pipeline.storage.typed import result_type
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.replicated import POPULATION, without_intervals
from pipeline.studies.study import NoSweep, SweepInputs, Tables


def count(experiment: Experiment) -> int:
    """Return how many further populations a figure has: none where its sweep reads clips, which are not kept."""
    data, figure = experiment.data, experiment.figure
    if not isinstance(data, SyntheticPeople) or not figure.traits.over_people or experiment.sweep.reads_clips:
        return 0
    return data.populations


def tables(experiment: Experiment, store: Store) -> Tables:
    """Return the tables of all further populations, ``table_populations`` for ``table``; none if there are none.

    Training and test people vary together; the sweep is the figure's (`Sweep.of_populations`).
    """
    figure, total = experiment.figure, count(experiment)
    if not total:
        return {}

    def one(number: int) -> Tables:
        inputs = inputs_of(experiment, number, store.forgetful())
        with without_intervals():
            found = figure.tables(inputs)
        return {name: _without_intervals(found[name], number) for name in figure.traits.over_people}

    # Figures that begin together share the work: one makes populations from the first on, others from the middle.
    begin = 0 if isinstance(experiment.sweep, NoSweep) else total // 2
    order = [*range(begin, total), *range(begin)]
    if begin:  # first what figures share, so that none waits until another has swept it
        map_processes(lambda number: ingest.run(experiment, store, number), order, experiment.workers)
    made = dict(zip(order, map_processes(one, order, experiment.workers), strict=True))
    return {
        name.removesuffix("_people") + "_populations": pd.concat(
            [made[number][name] for number in range(total)], ignore_index=True
        )
        for name in figure.traits.over_people
    }


def _without_intervals(table: pd.DataFrame, number: int) -> pd.DataFrame:
    kept = [name for name in table if not str(name).endswith(("_low", "_high"))]
    table = table[kept].copy()
    table.insert(0, POPULATION, number + 1)
    return table


def swept(experiment: Experiment, number: int, store: Store) -> Stored[Any]:
    """Return what the figure's sweep measures of one population."""
    model, sweep = experiment.model, experiment.sweep.of_populations()
    kept = ingest.run(experiment, store, number)

    def measure() -> Any:
        samples = experiment.dataset.build(kept.value, workers=1)
        learnt = model.learn(samples, workers=1)
        seed = ingest.seed_of(experiment, number)
        return sweep.measure(SweepInputs(None, samples, learnt, model, 1, seed))

    return stored(
        store,
        "population_sweep",
        {"dataset": experiment.dataset, "model": model, "sweep": sweep},
        [kept],
        measure,
        result=result_type(sweep.measure),
        sources=[type(model).__module__, type(sweep).__module__, *sweep.modules()],
    )


def inputs_of(
    experiment: Experiment, number: int, store: Store, *, shown: bool = False
) -> FigureInputs[Any, Any, Any]:
    """Return the inputs of the figure for one population; unless it is `shown`, without a model that no table needs."""
    model, sweep, workers = experiment.model, experiment.sweep, experiment.workers if shown else 1
    clips = ingest.run(experiment, store, number).value
    samples = experiment.dataset.build(clips, workers=workers)
    alone = isinstance(sweep, NoSweep)
    learnt = model.learn(samples, workers=workers) if shown or alone else None
    if alone or (shown and sweep.of_populations() != sweep):
        seed = ingest.seed_of(experiment, number)
        measured = sweep.measure(SweepInputs(clips, samples, learnt, model, workers, seed))
    else:  # of which all are measured
        measured = swept(experiment, number, store).value
    return FigureInputs(experiment, clips, samples, learnt, measured, number + 1 if shown else 0)
