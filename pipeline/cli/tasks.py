"""The work of several figures as tasks: what several of them need, or is long, is a task of its own.

A task leaves artefacts in the store, and the tasks that need it find them there by their keys: it may run in any
process of any machine that sees the store, more than once, or not at all.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from pipeline.clips.options import SyntheticPeople
from pipeline.processes import map_processes
from pipeline.stages import chain, populations
from pipeline.storage.sealed_folders import canonical, compact, digest
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.study import NoSweep

SAMPLES, SWEPT, FIGURE = "samples", "populations", "figure"
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
        """Run a task that is no figure's own; return whether something was, or with a `Plan` is to be, computed."""
        if self.through in chain.STAGES:
            made = chain.run(self.experiment, store, through=self.through)
            return any(kept.artefact.computed for kept in made)
        one = populations.sampled if self.through == SAMPLES else populations.swept

        def computed(number: int) -> bool:
            return one(self.experiment, number, store).artefact.computed

        return any(map_processes(computed, self.populations, self.experiment.workers))


def plan(experiments: Sequence[Experiment], *, task_s: float) -> list[Task]:
    """Return the tasks of some figures, each after those that it needs.

    Parameters
    ----------
    experiments : sequence of Experiment
    task_s : float
        Processor time of a block of populations, about.
    """
    chains = [_chain(one) for one in experiments]
    users: dict[str, list[int]] = defaultdict(list)
    for number, of_figure in enumerate(chains):
        for _, key in of_figure:
            users[key].append(number)
    tasks: dict[str, Task] = {}

    def add(one: Experiment, through: str, key: str, numbers: tuple[int, ...], needs: tuple[str, ...]) -> str:
        first = f"_{numbers[0] + 1}" if numbers else ""
        name = f"{through}_{key[:8]}{first}"
        cost = max(len(numbers), 1) * (_cost_s(one) / (populations.count(one) + 1))
        cost = len(numbers) * _people(one) * _SAMPLES_S if through == SAMPLES else cost
        tasks.setdefault(name, Task(name, one, through, numbers, needs, cost))
        return name

    figures = []
    for one, of_figure in zip(experiments, chains, strict=True):
        needs: tuple[str, ...] = ()
        samples: tuple[str, ...] = ()
        last = [name for name, _ in of_figure if name in chain.STAGES][-1]
        for (through, key), (_, following) in zip(of_figure, [*of_figure[1:], ("", "")], strict=True):
            shared = len(users[key]) > 1
            if through in chain.STAGES:
                if shared and (through == last or users[key] != users[following]):
                    needs = (add(one, through, key, (), needs),)
                continue
            each = (
                _people(one) * _SAMPLES_S
                if through == SAMPLES
                else _cost_s(one) / (populations.count(one) + 1)
            )
            blocks = _blocks(populations.count(one), each, task_s)
            if shared or len(blocks) > 1:
                made = tuple(add(one, through, key, block, samples) for block in blocks)
                samples = made if through == SAMPLES else samples
                needs = (*needs, *made)
        figures.append(Task(one.name, one, FIGURE, (), needs, _cost_s(one)))
    return [*tasks.values(), *figures]


def _chain(one: Experiment) -> list[tuple[str, str]]:
    """Return the stages of a figure, and of its further populations, with digests of what each is made of."""
    none = isinstance(one.sweep, NoSweep)
    corpus = one.dataset.corpus.name
    keys = [
        ("ingest", [one.data, one.skeleton, one.seed, corpus]),
        ("dataset", one.dataset),
        ("model", one.model),
    ]
    further = []
    if populations.count(one):
        further = [(SAMPLES, [keys[0][1], one.dataset.shared()])]
        further += [] if none else [(SWEPT, [one.dataset, one.model, one.sweep.of_populations()])]
    found = []
    for parts in (keys if none else [*keys, ("sweep", one.sweep)]), further:
        reached = ""
        for name, options in parts:
            reached = digest(compact([reached, canonical({name: options})]))
            found.append((name, reached))
    return found


def _people(one: Experiment) -> int:
    return one.data.population if isinstance(one.data, SyntheticPeople) else 0


def _cost_s(one: Experiment) -> float:
    """Return the processor time of a figure, which grows with its people beyond those of the papers."""
    return one.cost_s * max(1.0, _people(one) / SyntheticPeople.population)


def _blocks(count: int, each_s: float, task_s: float) -> list[tuple[int, ...]]:
    """Return the numbers of populations in blocks of about the same time."""
    size = max(1, min(count, math.floor(task_s / each_s)))
    return [tuple(range(start, min(start + size, count))) for start in range(0, count, size)]
