"""Tasks of several figures: each figure, each stage that several figures share, and blocks of populations.

A task writes artefacts to the store, and later tasks find them there by their keys.  A task may therefore run on any
machine with access to the store.  It may also run twice, or be skipped: later tasks compute missing artefacts.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from pipeline.clips.options import SyntheticPeople
from pipeline.processes import map_processes
from pipeline.stages import chain, ingest, populations
from pipeline.storage.sealed_folders import compact, digest
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import NoSweep

SAMPLES, SWEPT, FIGURE = "population", "population_sweep", "figure"
_SAMPLES_S = 0.012
"""Approximate processor time of the samples of one synthetic walker."""


@dataclass(frozen=True)
class Task:
    """Part of the work of one or several figures.

    Attributes
    ----------
    name : str
        Name of the figure; or stage, digest of the inputs and first population of the block.
    experiment : Experiment
        Experiment of the first figure that needs the task.
    through : str
        Last stage of the chain; or `SAMPLES` or `SWEPT` for further populations; or `FIGURE`.
    populations : tuple of int
        Numbers of the further populations.
    needs : tuple of str
        Tasks whose artefacts this task reads.
    cost_s : float
        Approximate processor time.
    """

    name: str
    experiment: Experiment
    through: str
    populations: tuple[int, ...]
    needs: tuple[str, ...]
    cost_s: float

    def run(self, store: Store) -> bool:
        """Run a task other than a figure; return whether an artefact was computed, or in a dry run would be."""
        if self.through in chain.STAGES:
            results = chain.run(self.experiment, store, through=self.through)
            return any(result.artefact.computed for result in results)

        def computed(number: int) -> bool:
            experiment = self.experiment
            if self.through == SAMPLES:
                return ingest.run(experiment, store, number).artefact.computed
            return populations.sweep_population(experiment, number, store).artefact.computed

        return any(map_processes(computed, self.populations, self.experiment.workers))


def plan(experiments: Sequence[Experiment], *, task_s: float) -> list[Task]:
    """Return the tasks of several figures, each after the tasks that it needs.

    Parameters
    ----------
    experiments : sequence of Experiment
    task_s : float
        Approximate processor time of a block of populations.
    """
    keys = [_keys(experiment) for experiment in experiments]
    users: dict[str, list[int]] = defaultdict(list)
    for number, of_figure in enumerate(keys):
        for key in of_figure.values():
            users[key].append(number)
    tasks: dict[str, Task] = {}

    def add(
        experiment: Experiment,
        through: str,
        key: str,
        needs: tuple[str, ...],
        *,
        populations: tuple[int, ...] = (),
    ) -> str:
        """Add the task of a stage, or of a block of populations, and return its name."""
        name = f"{through}_{key[:8]}" + (f"_{populations[0] + 1}" if populations else "")
        cost_s = max(len(populations), 1) * _each_s(experiment, through)
        tasks.setdefault(name, Task(name, experiment, through, populations, needs, cost_s))
        return name

    figures = []
    for experiment, of_figure in zip(experiments, keys, strict=True):
        needs: tuple[str, ...] = ()
        samples: tuple[str, ...] = ()
        following = dict(pairwise(name for name in of_figure if name in chain.STAGES))
        for through, key in of_figure.items():
            shared = len(users[key]) > 1
            if through in chain.STAGES:
                last = through not in following or users[key] != users[of_figure[following[through]]]
                if shared and last:
                    needs = (add(experiment, through, key, needs),)
                continue
            blocks = _blocks(populations.count(experiment), _each_s(experiment, through), task_s)
            if shared or len(blocks) > 1:
                names = tuple(add(experiment, through, key, samples, populations=block) for block in blocks)
                samples = names if through == SAMPLES else samples
                needs = (*needs, *names)
        figures.append(Task(experiment.name, experiment, FIGURE, (), needs, _cost_s(experiment)))
    return [*tasks.values(), *figures]


def _keys(experiment: Experiment) -> dict[str, str]:
    """Return the digest of the inputs of each stage of a figure and its further populations."""
    store = Store(Path(experiment.results), dry_run=True)
    sweeps = not isinstance(experiment.sweep, NoSweep)
    chain.run(experiment, store, through="sweep" if sweeps else "model")
    if populations.count(experiment):
        if sweeps:
            populations.sweep_population(experiment, 0, store)
        else:
            ingest.run(experiment, store, 0)
    keys: dict[str, str] = {}
    for step in store.steps:
        made_from = [step, *(keys[stage] for stage in step["reads"])]
        keys[step["stage"]] = digest(compact(made_from))
    return keys


def _people(experiment: Experiment) -> int:
    return experiment.data.population if isinstance(experiment.data, SyntheticPeople) else 0


def _cost_s(experiment: Experiment) -> float:
    """Return the processor time of a figure; it grows with the number of people above the papers' number."""
    return experiment.cost_s * max(1.0, _people(experiment) / SyntheticPeople.population)


def _each_s(experiment: Experiment, through: str) -> float:
    """Return the processor time of a stage for one population."""
    if through in (SAMPLES, "ingest"):
        return max(_people(experiment), 1) * _SAMPLES_S
    return _cost_s(experiment) / (populations.count(experiment) + 1)


def _blocks(count: int, each_s: float, task_s: float) -> list[tuple[int, ...]]:
    """Return the numbers of the populations, in blocks of about equal processor time."""
    size = max(1, min(count, math.floor(task_s / each_s)))
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]
