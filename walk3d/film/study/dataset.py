"""Walks on which the model of walkers is trained, with four harmonics and scaled to one height."""

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
    """Walks for training the model and for simulated films.

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
        """Names of all people, in the order of their first walks."""
        return list(dict.fromkeys(self.person.tolist()))

    @property
    def sources(self) -> np.ndarray:
        """Source (P,) of each person in `people`, as strings."""
        person = self.person.tolist()
        return self.source[[person.index(name) for name in self.people]]

    @property
    def sources_left_out(self) -> list[str]:
        """Names of the data sources that are left out one after another.

        The list is empty if too few people would remain without one of the sources.
        """
        of_people = self.sources
        names = list(dict.fromkeys(of_people.tolist()))
        return names if all((of_people != name).sum() >= MIN_PEOPLE for name in names) else []

    def training_walk(self, number: int) -> TrainingWalk:
        """Return the training walk with this index."""
        return part(self.walks, number)


class FilmedWalkersDataset(Dataset):
    """Dataset of all steady walks of all people, for training the model and for simulated films."""

    corpus = WALKS

    def build(self, clips: Walks, *, workers: int) -> FilmedWalkers:
        """Return the walks, represented by four harmonics.  Raises InvalidInput if there are too few people."""
        people = len(set(clips.person))
        if people < MIN_PEOPLE:
            raise InvalidInput(
                "there are too few people to leave some out of the model and simulate films of them",
                expected=f"{MIN_PEOPLE} people or more", received=people, code="too_few_people", count=people,
            )  # fmt: skip
        walks = training_walks(clips)
        return FilmedWalkers(
            walks=stack(walks),
            person=clips.person,
            clip=clips.clip,
            source=clips.source,
            words=f"{len(walks)} walks of {people} people",
        )
