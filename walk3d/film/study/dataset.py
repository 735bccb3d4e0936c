"""Walks on which the model of walkers is trained: four harmonics, all scaled to one height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.clips.kinds import WALKS, Walks
from pipeline.studies.study import Dataset, part, stack
from pipeline.validation import InvalidInput
from walk3d.film.simulation.filmed import training_walks
from walk3d.film.walk import TrainingWalk

MIN_PEOPLE = 4


@dataclass(frozen=True)
class FilmedWalkers:
    """Walks for training and for filming.

    Attributes
    ----------
    walks : TrainingWalk
        W training walks, stacked.
    person, clip, source : (W,) text
    words : str
    """

    walks: TrainingWalk
    person: np.ndarray
    clip: np.ndarray
    source: np.ndarray
    words: str

    @property
    def people(self) -> list[str]:
        """Names of all people, in the order of the walks."""
        return list(dict.fromkeys(self.person.tolist()))

    @property
    def sources(self) -> np.ndarray:
        """Source of each of `people`, (P,) text."""
        person = self.person.tolist()
        return self.source[[person.index(name) for name in self.people]]

    @property
    def sources_left_out(self) -> list[str]:
        """Sources, if enough people remain without any one of them; else none."""
        of_people = self.sources
        names = list(dict.fromkeys(of_people.tolist()))
        return names if all((of_people != name).sum() >= MIN_PEOPLE for name in names) else []

    def training_walk(self, number: int) -> TrainingWalk:
        """Return one training walk."""
        return part(self.walks, number)


class FilmedWalkersDataset(Dataset):
    """Dataset of all steady walks of all people."""

    corpus = WALKS

    def build(self, clips: Walks, *, workers: int) -> FilmedWalkers:
        """Return the walks with four harmonics.  Raises InvalidInput if there are too few people."""
        people = len(set(clips.person))
        if people < MIN_PEOPLE:
            raise InvalidInput(
                "too few people to film some who are left out of the model", expected=f"{MIN_PEOPLE} people or more",
                received=people, code="too_few_people", count=people,
            )  # fmt: skip
        walks = training_walks(clips)
        return FilmedWalkers(
            walks=stack(walks),
            person=clips.person,
            clip=clips.clip,
            source=clips.source,
            words=f"{len(walks)} walks of {people} people",
        )
