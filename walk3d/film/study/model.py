"""Models of walkers; each is learnt without the people whose walks it reconstructs."""

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

LOOSE_BONE_FACTOR = 1e3
"""Factor on the tolerances of bone lengths that is so large that bone lengths are not constrained."""
MIN_VARIANCE = 1e-6
"""Variance, mm², that the coefficients of an omitted harmonic keep in the model."""


@dataclass(frozen=True)
class KeypointWalkers:
    """Compact models of walkers, each trained without one group of people or without one data source.

    Attributes
    ----------
    group, source : (P,) int
        Number of the model without each person's group, in the order of `FilmedWalkers.people`, and without the
        person's source; -1 if there is no other source.
    moments : CompactMoments
        Moments of the G models, stacked.
    unfamiliar : (G,)
        Share of the variance between laboratories that each model lacks; 0 for those without a group.
    words : str
    """

    group: np.ndarray
    source: np.ndarray
    moments: CompactMoments
    unfamiliar: np.ndarray
    words: str

    def prior(self, left_out: int, knowledge: Knowledge) -> Prior:
        """Return the prior of the model that was trained without one group of people or one data source."""
        return prepare(
            with_harmonics(model_of(expand(part(self.moments, left_out))), knowledge.harmonics),
            Detector(floor_mm=np.full(JOINTS, knowledge.floor_mm)),
            bone_factor=BONE_FACTOR if knowledge.bones else LOOSE_BONE_FACTOR,
            unfamiliar=self.unfamiliar[left_out],
        )


def with_harmonics(model: WalkerModel, harmonics: int) -> WalkerModel:
    """Return the model with the coefficients of all harmonics above `harmonics` set to zero."""
    present = np.arange(BLOCKS) < 1 + 2 * harmonics
    every = np.tile(present, JOINTS * 3)
    covariance = np.where(np.outer(every, every), model.covariance, 0.0)
    covariance[~every, ~every] = MIN_VARIANCE
    return replace(model, mean=model.mean * present, covariance=covariance)


class KeypointWalkersModel(Model):
    """Models in the form of the shipped model, with eigenwalkers and a structured covariance of the remainder."""

    dataset = FilmedWalkersDataset

    components: Count = 14  # number of eigenwalkers
    groups: Several = 8  # number of groups of people; each group is left out as a whole

    def learn(self, dataset: FilmedWalkers, *, workers: int) -> KeypointWalkers:
        """Train one model without each group of people and, if enough people remain, one without each data source."""
        people = dataset.people
        groups = min(self.groups, len(people))
        group = np.arange(len(people)) % groups
        at = np.array([people.index(person) for person in dataset.person])
        source, names = dataset.sources, dataset.sources_left_out
        left_out = [group == number for number in range(groups)] + [source == name for name in names]

        def without(number: int) -> CompactMoments:
            rest = np.flatnonzero(~left_out[number][at])
            learnt = moments([dataset.training_walk(int(k)) for k in rest], dataset.person[rest])
            # With more eigenwalkers than half the people, people could be reconstructed from their span.
            return compact(learnt, min(self.components, (learnt.walkers - 1) // 2))

        def lacking(name: str) -> float:
            others = dataset.source != name
            return concentration(person_weights(dataset.person[others]), dataset.source[others])

        models = map_processes(without, range(len(left_out)), workers)
        components = min(len(small.eigenvalues) for small in models[:groups])

        def padded(values: np.ndarray) -> np.ndarray:
            # A model may have fewer components: it is padded with zeros.
            return np.pad(
                values[:components], [(0, max(components - len(values), 0)), *[(0, 0)] * (values.ndim - 1)]
            )

        models = [
            replace(small, components=padded(small.components), eigenvalues=padded(small.eigenvalues))
            for small in models
        ]
        return KeypointWalkers(
            group=group,
            source=np.array([groups + names.index(name) if name in names else -1 for name in source]),
            moments=stack(models),
            unfamiliar=np.array([0.0] * groups + [lacking(name) for name in names]),
            words=f"{components} eigenwalkers, people left out in {groups} groups",
        )
