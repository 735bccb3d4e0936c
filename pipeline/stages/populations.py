"""Further synthetic populations, whose results show how much a figure varies with the sample of people."""

from __future__ import annotations

from functools import cache, partial
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
from pipeline.studies.study import NoSweep, Sweep, SweepInputs, Tables


def count(experiment: Experiment) -> int:
    """Return the number of further populations of a figure; 0 if its sweep reads clips, which are not stored."""
    data, figure = experiment.data, experiment.figure
    if not isinstance(data, SyntheticPeople) or not figure.traits.over_people or experiment.sweep.reads_clips:
        return 0
    return data.populations


def tables(experiment: Experiment, store: Store) -> Tables:
    """Return the tables of all further populations, such as ``table_populations``; empty if there are none.

    Training and test people vary together.  The figure's sweep is replaced by `Sweep.of_populations`.
    """
    figure, total = experiment.figure, count(experiment)
    if not total:
        return {}

    empty = store.forgetful()  # which other machines receive

    def population_tables(number: int) -> Tables:
        inputs = inputs_of(experiment, number, empty.forgetful())
        with without_intervals():
            figure_tables = figure.tables(inputs)
        return {name: _without_intervals(figure_tables[name], number) for name in figure.traits.over_people}

    def sample(number: int) -> None:
        ingest.run(experiment, empty.forgetful(), number)

    # Figures that run at the same time share the work: one begins with the first population, others in the middle.
    begin = 0 if isinstance(experiment.sweep, NoSweep) else total // 2
    order = [*range(begin, total), *range(begin)]
    if begin:  # shared clips first, so that no figure waits for the sweep of another
        map_processes(sample, order, experiment.workers)
    by_population = dict(zip(order, map_processes(population_tables, order, experiment.workers), strict=True))
    return {
        name.removesuffix("_people") + "_populations": pd.concat(
            [by_population[number][name] for number in range(total)], ignore_index=True
        )
        for name in figure.traits.over_people
    }


def _without_intervals(table: pd.DataFrame, number: int) -> pd.DataFrame:
    columns = [name for name in table if not str(name).endswith(("_low", "_high"))]
    table = table[columns].copy()
    table.insert(0, POPULATION, number + 1)
    return table


def sweep_population(
    experiment: Experiment, store: Store, number: int, *, shown: bool = False
) -> list[Stored[Any]]:
    """Return the sweep's results on one population: those that the tables need, or all results if `shown`."""
    model, clips = experiment.model, ingest.run(experiment, store, number)

    @cache
    def inputs() -> SweepInputs[Any, Any, Any]:
        samples = experiment.dataset.build(clips.value, workers=1)
        learnt = model.learn(samples, workers=1)
        return SweepInputs(None, samples, learnt, model, 1, ingest.seed_of(experiment, number))

    def measure(sweep: Sweep) -> Any:
        return sweep.measure(inputs())

    parts = experiment.sweep.population_parts()[
        : None if shown else experiment.figure.traits.population_parts
    ]
    return [
        stored(
            store,
            f"population_sweep{part + 1 if part else ''}",
            {"dataset": experiment.dataset, "model": model, "sweep": sweep},
            [clips],
            partial(measure, sweep),
            result=result_type(sweep.measure),
            sources=[type(model).__module__, type(sweep).__module__, *sweep.modules()],
        )
        for part, sweep in enumerate(parts)
    ]


def inputs_of(
    experiment: Experiment, number: int, store: Store, *, shown: bool = False
) -> FigureInputs[Any, Any, Any]:
    """Return the inputs of a figure for one population; a model that no table needs is learnt only if `shown`."""
    model, sweep, workers = experiment.model, experiment.sweep, experiment.workers if shown else 1
    clips = ingest.run(experiment, store, number).value
    samples = experiment.dataset.build(clips, workers=workers)
    alone = isinstance(sweep, NoSweep)
    learnt = model.learn(samples, workers=workers) if shown or alone else None
    if alone or (shown and sweep.of_populations() != sweep):
        seed = ingest.seed_of(experiment, number)
        measured = sweep.measure(SweepInputs(clips, samples, learnt, model, workers, seed))
    else:  # the sweep that all populations share
        parts = sweep_population(experiment, store, number, shown=shown)
        measured = sweep.joined([part.value for part in parts])
    return FigureInputs(experiment, clips, samples, learnt, measured, number + 1 if shown else 0)
