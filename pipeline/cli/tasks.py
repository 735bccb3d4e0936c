"""The work of several figures as tasks: each figure, each stage that several figures share, blocks of populations.

A task leaves artefacts in the store, and the tasks that need it find them there by their keys: it may run in any
process of any machine that sees the store, more than once, or not at all.
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
"""Processor time of the samples of one synthetic walker, about."""


@dataclass(frozen=True)
class Task:
    """A part of the work of some figures.

    Attributes
    ----------
    name : str
        A figure's own, or stage, digest of what it is made of, and first population of its block.
    experiment : Experiment
        Of the first figure that needs it.
    through : str
        Last stage of the chain; or `SAMPLES` or `SWEPT`, of further populations; or `FIGURE`.
    populations : tuple of int
        Their numbers.
    needs : tuple of str
        Tasks whose artefacts it reads.
    cost_s : float
        Processor time, about.
    """

    name: str
    experiment: Experiment
    through: str
    populations: tuple[int, ...]
    needs: tuple[str, ...]
    cost_s: float

    def run(self, store: Store) -> bool:
        """Run a task that is no figure's own; return whether something was, or in a dry run is to be, computed."""
        if self.through in chain.STAGES:
            made = chain.run(self.experiment, store, through=self.through)
            return any(kept.artefact.computed for kept in made)

        def computed(number: int) -> bool:
            one = self.experiment
            if self.through == SAMPLES:
                return ingest.run(one, store, number).artefact.computed
            return populations.sweep_population(one, number, store).artefact.computed

        return any(map_processes(computed, self.populations, self.experiment.workers))


def plan(experiments: Sequence[Experiment], *, task_s: float) -> list[Task]:
    """Return the tasks of some figures, each after those that it needs.

    Parameters
    ----------
    experiments : sequence of Experiment
    task_s : float
        Processor time of a block of populations, about.
    """
    keys = [_keys(one) for one in experiments]
    users: dict[str, list[int]] = defaultdict(list)
    for number, of_figure in enumerate(keys):
        for key in of_figure.values():
            users[key].append(number)
    tasks: dict[str, Task] = {}

    def add(
        one: Experiment, through: str, key: str, needs: tuple[str, ...], *, populations: tuple[int, ...] = ()
    ) -> str:
        """Enter the work on a stage, or on a block of populations, and return the name of its task."""
        name = f"{through}_{key[:8]}" + (f"_{populations[0] + 1}" if populations else "")
        cost_s = max(len(populations), 1) * _each_s(one, through)
        tasks.setdefault(name, Task(name, one, through, populations, needs, cost_s))
        return name

    figures = []
    for one, of_figure in zip(experiments, keys, strict=True):
        needs: tuple[str, ...] = ()
        samples: tuple[str, ...] = ()
        following = dict(pairwise(name for name in of_figure if name in chain.STAGES))
        for through, key in of_figure.items():
            shared = len(users[key]) > 1
            if through in chain.STAGES:
                last = through not in following or users[key] != users[of_figure[following[through]]]
                if shared and last:
                    needs = (add(one, through, key, needs),)
                continue
            blocks = _blocks(populations.count(one), _each_s(one, through), task_s)
            if shared or len(blocks) > 1:
                made = tuple(add(one, through, key, samples, populations=block) for block in blocks)
                samples = made if through == SAMPLES else samples
                needs = (*needs, *made)
        figures.append(Task(one.name, one, FIGURE, (), needs, _cost_s(one)))
    return [*tasks.values(), *figures]


def _keys(one: Experiment) -> dict[str, str]:
    """Return the stages of a figure, and of its further populations, with digests of what each is made of."""
    asked = Store(Path(one.results), dry_run=True)
    sweeps = not isinstance(one.sweep, NoSweep)
    chain.run(one, asked, through="sweep" if sweeps else "model")
    if populations.count(one):
        if sweeps:
            populations.sweep_population(one, 0, asked)
        else:
            ingest.run(one, asked, 0)
    keys: dict[str, str] = {}
    for step in asked.steps:
        made_from = [step, *(keys[stage] for stage in step["reads"])]
        keys[step["stage"]] = digest(compact(made_from))
    return keys


def _people(one: Experiment) -> int:
    return one.data.population if isinstance(one.data, SyntheticPeople) else 0


def _cost_s(one: Experiment) -> float:
    """Return the processor time of a figure, which grows with its people beyond those of the papers."""
    return one.cost_s * max(1.0, _people(one) / SyntheticPeople.population)


def _each_s(one: Experiment, through: str) -> float:
    """Return the processor time of a stage, or of one population."""
    if through in (SAMPLES, "ingest"):
        return max(_people(one), 1) * _SAMPLES_S
    return _cost_s(one) / (populations.count(one) + 1)


def _blocks(count: int, each_s: float, task_s: float) -> list[tuple[int, ...]]:
    """Return the numbers of populations in blocks of about the same time."""
    size = max(1, min(count, math.floor(task_s / each_s)))
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]
