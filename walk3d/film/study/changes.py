"""Sweep over conditions that change the same simulated clips: degraded films, ablations, and kinds of amateur film."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.processes import map_processes
from pipeline.studies.study import scaled
from pipeline.validation import CountOrAll, Several
from walk3d.film.study.conditions import CONDITIONS, Changes, Condition, Knowledge
from walk3d.film.study.dataset import FilmedWalkers
from walk3d.film.study.kinds import FILM_KINDS, crossing, film_as, see
from walk3d.film.study.measured import Case, FilmedClips, FilmedErrors, Inputs, side
from walk3d.film.walk import Prior
from walk3d.film.walk.verdict import Verdict


@dataclass(frozen=True)
class ChangedErrors(FilmedErrors):
    """Errors of simulated clips under every condition, and results for kinds of amateur film.

    Attributes
    ----------
    kinds : DataFrame
        One row per clip of each kind; empty for the ablation.
    """

    kinds: pd.DataFrame


class KeypointChanges(FilmedClips):
    """Sweep over conditions, with the same clips and random numbers under every condition."""

    changes: Changes  # kind of changes: degradations, or ablation
    takes: Several = scaled(value={"full": 16, "smoke": 2})  # number of clips under each condition
    levels: CountOrAll = scaled(
        value={"full": 0, "smoke": 1}
    )  # number of levels of each kind of change, from the largest change; 0: all
    films: Several = scaled(
        value={"full": 40, "smoke": 2}
    )  # number of simulated clips of each kind of amateur film

    @property
    def conditions(self) -> list[Condition]:
        """Return the conditions of the sweep, with at most the requested number of levels of each kind of change."""
        every = CONDITIONS[self.changes]
        selected = []
        for kind in dict.fromkeys(condition.kind for condition in every):
            selected += [condition for condition in every if condition.kind == kind][-self.levels :]
        return selected

    def measure(self, inputs: Inputs) -> ChangedErrors:
        """Return the errors of all clips, and the results for each kind of amateur film."""
        of_kinds = self._kinds(inputs) if self.changes is Changes.degradations else pd.DataFrame()
        return ChangedErrors(**vars(super().measure(inputs)), kinds=of_kinds)

    def _kinds(self, inputs: Inputs) -> pd.DataFrame:
        dataset = inputs.dataset
        cases = self._takes(dataset, self.films)
        models = inputs.model.group[[case.person for case in cases]].tolist()

        def rows_of_model(model: int) -> list[tuple[int, dict[str, object]]]:
            prior = inputs.model.prior(model, Knowledge())
            model_cases = [case for case, of_case in zip(cases, models, strict=True) if of_case == model]
            return [
                (number * len(cases) + case.take, self._seen(number, case, prior, inputs))
                for number in range(len(FILM_KINDS))
                for case in model_cases
            ]

        parts = map_processes(rows_of_model, sorted(set(models)), inputs.workers)
        rows = sorted((row for part in parts for row in part), key=lambda row: row[0])
        return pd.DataFrame([row for _, row in rows])

    def _seen(self, number: int, case: Case, prior: Prior, inputs: Inputs) -> dict[str, object]:
        kind, dataset = FILM_KINDS[number], inputs.dataset
        generator, walk = inputs.generator(f"{kind.name} {case.take}"), dataset.training_walk(case.walk)
        heading = np.radians(case.heading_deg)
        filmed = film_as(kind, generator, inputs.clips, case.walk, walk, heading, case.overground)
        people, walked = [filmed], [walk]
        if kind.crossed:
            other = (case.walk + len(dataset.person) // 2) % len(dataset.person)
            walked.append(dataset.training_walk(other))
            people = crossing(generator, inputs.clips, other, walked[1], filmed)
        outcome = see(people, [walker.frequency_hz for walker in walked], kind.stated, prior)
        return {
            "number": number,
            "person": dataset.people[case.person],
            "take": case.take,
            "heading_deg": float(case.heading_deg),
            "overground": int(case.overground),
            "walks": int(kind.activity is None),
            "wrong_frequency_percent": 100.0 * outcome.wrong_frequency,
            "refused_percent": 100.0 * (outcome.verdict == Verdict.not_a_walk),
            "accepted_percent": 100.0 * (outcome.verdict != Verdict.not_a_walk),
            "error_mm": outcome.error_mm,
            "knee_error_deg": outcome.knee_error_deg,
        }

    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips to simulate, distributed over people and headings.

        A condition that needs other sources is left out if too few people would remain.
        """
        cases: list[Case] = []
        for number, condition in enumerate(self.conditions):
            if not condition.knowledge.other_sources or dataset.sources_left_out:
                cases += self._takes(dataset, self.takes, len(cases), number)
        return cases

    def _takes(self, dataset: FilmedWalkers, takes: int, first: int = 0, condition: int = 0) -> list[Case]:
        people, cases = dataset.people, list[Case]()
        for take in range(takes):
            person = take * len(people) // takes if takes < len(people) else take % len(people)
            walks_of_person = np.flatnonzero(dataset.person == people[person])
            walk = walks_of_person[take // len(people) % len(walks_of_person)]
            cases.append(Case(first + take, take, person, walk, *side(take), condition))
        return cases
