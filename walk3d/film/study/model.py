"""Models of walkers without each group of people, or without a source, whose walks are reconstructed from them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.processes import map_processes
from pipeline.studies.study import Model, part, stack
from pipeline.validation import Count, Several
from walk3d.anatomy.prior import JOINTS, concentration, person_weights
from walk3d.film.study.conditions import Knowledge
from walk3d.film.study.dataset import FilmedWalkers, FilmedWalkersDataset
from walk3d.film.walk import (
    CompactMoments,
    Detector,
    Prior,
    WalkerModel,
    compact,
    expand,
    model_of,
    moments,
    prepare,
)
from walk3d.film.walk.prior import BONE_FACTOR
from walk3d.film.walk.training import BLOCKS

NO_BONES = 1e3
"""Factor on the tolerances of lengths with which these say nothing."""
LEAST_VARIANCE = 1e-6
"""Of a harmonic that walkers have not, mm²."""


@dataclass(frozen=True)
class KeypointWalkers:
    """Compact models of walkers, each learnt without one group of people or without one source.

    Attributes
    ----------
    group, source : (P,) int
        Model without the group of each person, in the order of `FilmedWalkers.people`, and without his or her source;
        -1 if there is no other source.
    moments : CompactMoments
        G of them, stacked.
    unfamiliar : (G,)
        Share of what sets laboratories apart that the model lacks; 0 of those without a group.
    words : str
    """

    group: np.ndarray
    source: np.ndarray
    moments: CompactMoments
    unfamiliar: np.ndarray
    words: str

    def prior(self, left_out: int, knowledge: Knowledge) -> Prior:
        """Return the prior without a group of people or a source."""
        return prepare(
            with_harmonics(model_of(expand(part(self.moments, left_out))), knowledge.harmonics),
            Detector(floor_mm=np.full(JOINTS, knowledge.floor_mm)),
            bone_factor=BONE_FACTOR if knowledge.bones else NO_BONES,
            unfamiliar=self.unfamiliar[left_out],
        )


def with_harmonics(model: WalkerModel, harmonics: int) -> WalkerModel:
    """The model whose walkers have no harmonics above these."""
    kept = np.arange(BLOCKS) < 1 + 2 * harmonics
    every = np.tile(kept, JOINTS * 3)
    covariance = np.where(np.outer(every, every), model.covariance, 0.0)
    covariance[~every, ~every] = LEAST_VARIANCE
    return replace(model, mean=model.mean * kept, covariance=covariance)


class KeypointWalkersModel(Model):
    """Eigenwalkers and the structured rest, as the model that ships has them."""

    dataset = FilmedWalkersDataset

    components: Count = 14  # number of eigenwalkers
    groups: Several = 8  # people are left out in so many groups, each with everybody of it

    def learn(self, dataset: FilmedWalkers, *, workers: int) -> KeypointWalkers:
        """Return the models without each group, and without each source if there are two or more."""
        people = dataset.people
        groups = min(self.groups, len(people))
        group = np.arange(len(people)) % groups
        at = np.array([people.index(who) for who in dataset.person])
        source, names = dataset.sources, dataset.sources_left_out
        left_out = [group == number for number in range(groups)] + [source == name for name in names]

        def without(number: int) -> CompactMoments:
            rest = np.flatnonzero(~left_out[number][at])
            learnt = moments([dataset.training_walk(int(k)) for k in rest], dataset.person[rest])
            # More than half as many eigenwalkers as people would hold the people themselves.
            return compact(learnt, min(self.components, (learnt.walkers - 1) // 2))

        def lacking(name: str) -> float:
            kept = dataset.source != name
            return concentration(person_weights(dataset.person[kept]), dataset.source[kept])

        found = map_processes(without, range(len(left_out)), workers)
        kept = min(len(small.eigenvalues) for small in found[:groups])

        def whole(values: np.ndarray) -> np.ndarray:
            # Those of a single source may be fewer: the others are nothing.
            return np.pad(values[:kept], [(0, max(kept - len(values), 0)), *[(0, 0)] * (values.ndim - 1)])

        found = [
            replace(small, components=whole(small.components), eigenvalues=whole(small.eigenvalues))
            for small in found
        ]
        return KeypointWalkers(
            group=group,
            source=np.array([groups + names.index(name) if name in names else -1 for name in source]),
            moments=stack(found),
            unfamiliar=np.array([0.0] * groups + [lacking(name) for name in names]),
            words=f"{kept} eigenwalkers, people left out in {groups} groups",
        )
