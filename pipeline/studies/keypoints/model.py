"""Models of walkers without each group of people, from whom that group's walks are reconstructed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.keypoint_walk import (
    CompactMoments,
    Detector,
    Moments,
    Prior,
    compact,
    expand,
    model_of,
    moments,
    prepare,
)
from pipeline.processes import map_processes
from pipeline.studies.keypoints.dataset import FilmedWalkers, FilmedWalkersDataset
from pipeline.studies.study import Model
from pipeline.validation import require_range


@dataclass(frozen=True)
class KeypointWalkers:
    """Compact models of walkers, each learnt without one group of people.

    Attributes
    ----------
    group : (P,) int
        Group of each person, in the order of `FilmedWalkers.people`.
    mean : (G, 15, 3, 9)
    components : (G, N, 405)
    eigenvalues : (G, N)
    within : (G, 5, 45, 45)
    bone_variance, pair_variance : (G, …)
    aperiodic_variance : (G, 15, 3)
    log_frequency : (G, 2)
    walkers : (G,) int
    words : str
    """

    group: np.ndarray
    mean: np.ndarray
    components: np.ndarray
    eigenvalues: np.ndarray
    within: np.ndarray
    bone_variance: np.ndarray
    pair_variance: np.ndarray
    aperiodic_variance: np.ndarray
    log_frequency: np.ndarray
    walkers: np.ndarray
    words: str

    def prior(self, group: int, detector: Detector) -> Prior:
        """Return the prior without one group of people."""
        rest = Moments(
            mean=self.mean[group],
            covariance=np.empty((0, 0)),
            bone_variance=self.bone_variance[group],
            pair_variance=self.pair_variance[group],
            aperiodic_variance=self.aperiodic_variance[group],
            log_frequency=self.log_frequency[group],
            walkers=int(self.walkers[group]),
        )
        small = CompactMoments(self.components[group], self.eigenvalues[group], self.within[group], rest)
        return prepare(model_of(expand(small)), detector)


@dataclass(kw_only=True)
class KeypointWalkersModel(Model):
    """Eigenwalkers and the structured rest, as the model that ships has them."""

    dataset = FilmedWalkersDataset

    components: int = 14
    groups: int = 8  # people are left out in so many groups, each with everybody of it

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_range("model.components", self.components, at_least=1, whole=True)
        require_range("model.groups", self.groups, at_least=2, whole=True)

    def learn(self, dataset: FilmedWalkers, *, workers: int) -> KeypointWalkers:
        """Return the models without each group."""
        people = dataset.people
        groups = min(self.groups, len(people))
        group = np.arange(len(people)) % groups
        of_walk = group[[people.index(who) for who in dataset.person.tolist()]]

        def without(left_out: int) -> CompactMoments:
            rest = np.flatnonzero(of_walk != left_out)
            learnt = moments([dataset.training_walk(int(k)) for k in rest], dataset.person[rest])
            # More than half as many eigenwalkers as people would hold the people themselves.
            return compact(learnt, min(self.components, (learnt.walkers - 1) // 2))

        found = map_processes(without, range(groups), workers)
        kept = min(len(small.eigenvalues) for small in found)
        rests = [small.rest for small in found]
        return KeypointWalkers(
            group=group,
            mean=np.stack([rest.mean for rest in rests]),
            components=np.stack([small.components[:kept] for small in found]),
            eigenvalues=np.stack([small.eigenvalues[:kept] for small in found]),
            within=np.stack([small.within for small in found]),
            bone_variance=np.stack([rest.bone_variance for rest in rests]),
            pair_variance=np.stack([rest.pair_variance for rest in rests]),
            aperiodic_variance=np.stack([rest.aperiodic_variance for rest in rests]),
            log_frequency=np.stack([rest.log_frequency for rest in rests]),
            walkers=np.array([rest.walkers for rest in rests]),
            words=f"{kept} eigenwalkers, people left out in {groups} groups",
        )
