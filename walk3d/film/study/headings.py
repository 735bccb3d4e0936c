"""Errors and coverage of error bars by heading, in simulated clips of people who are left out of the model."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np

from pipeline.studies.study import scaled
from pipeline.validation import bounded
from walk3d.film.simulation.keypoints import DetectorError
from walk3d.film.study.conditions import Condition, Knowledge
from walk3d.film.study.dataset import FilmedWalkers
from walk3d.film.study.measured import HEADINGS_DEG, Case, FilmedClips, side


class KeypointHeadings(FilmedClips):
    """Sweep over simulated clips with headings in all directions."""

    clips: Annotated[int, bounded(at_least=len(HEADINGS_DEG))] = scaled(
        value={"full": 800, "smoke": 8}
    )  # number of simulated clips
    # The reconstruction assumes the same bias as the simulated detector has.
    bias_mm: Annotated[float, bounded(at_least=0, at_most=100)] = (
        10.0  # bias of the detector, standard deviation over joints
    )

    @property
    def conditions(self) -> list[Condition]:
        """Return the usual condition alone, with the requested standard deviation of the detector's bias."""
        error = replace(DetectorError(), bias_mm=self.bias_mm)
        return [Condition(error=error, knowledge=Knowledge(floor_mm=self.bias_mm))]

    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips to simulate, with alternating people and with another heading in each clip of a person."""
        people = dataset.people
        cases = []
        for c in range(self.clips):
            person, turn = c % len(people), c // len(people)
            walks_of_person = np.flatnonzero(dataset.person == people[person])
            cases.append(Case(c, c, person, walks_of_person[turn % len(walks_of_person)], *side(c + turn)))
        return cases


class KeypointLaboratories(KeypointHeadings):
    """Sweep over simulated clips of people whose laboratory is left out of the model.

    If all people have the same source, only the filmed person is left out.
    """

    clips: Annotated[int, bounded(at_least=len(HEADINGS_DEG))] = scaled(
        value={"full": 80, "smoke": 8}
    )  # number of simulated clips

    @property
    def conditions(self) -> list[Condition]:
        """Return the usual condition, with a model that is trained without the walker's laboratory."""
        (usual,) = super().conditions
        return [replace(usual, knowledge=replace(usual.knowledge, other_sources=True))]

    def left_out_with(self, dataset: FilmedWalkers) -> list[str]:
        """Return, for each person, the name of the group that is left out: the laboratory, or else the person alone."""
        return dataset.sources.tolist() if dataset.sources_left_out else dataset.people
