"""The same simulated clips under several conditions: a worse film, or less to reconstruct it with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.studies.keypoints.conditions import CONDITIONS, Changes, Condition
from pipeline.studies.keypoints.dataset import FilmedWalkers
from pipeline.studies.keypoints.headings import side
from pipeline.studies.keypoints.measured import Case, FilmedClips
from pipeline.studies.study import scaled
from pipeline.validation import CountOrAll, Several


@dataclass(kw_only=True)
class KeypointChanges(FilmedClips):
    """Simulated clips, each under every condition with the same random numbers."""

    changes: Changes  # kind of changes: degradations, or parts taken away
    takes: Several = scaled(value="takes")  # clips of the usual condition
    levels: CountOrAll = scaled(value="levels")  # of each kind of change, the last so many; 0: all

    @property
    def conditions(self) -> list[Condition]:
        """Return the conditions with the levels that are wanted."""
        every = CONDITIONS[self.changes]
        kept = []
        for kind in dict.fromkeys(condition.kind for condition in every):
            kept += [condition for condition in every if condition.kind == kind][-self.levels :]
        return kept

    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips: as many people as there are takes, or all, and each take from another side.

        Where too few people of other sources are left to learn from, that condition is left out.
        """
        people = dataset.people
        found: list[Case] = []
        for number, condition in enumerate(self.conditions):
            if condition.knowledge.other_sources and not dataset.sources_left_out:
                continue
            for take in range(self.takes):
                person = take * len(people) // self.takes if self.takes < len(people) else take % len(people)
                mine = np.flatnonzero(dataset.person == people[person])
                walk = int(mine[take // len(people) % len(mine)])
                found.append(Case(len(found), take, person, walk, *side(take), number))
        return found
