"""Ablation of the anatomical reconstruction: parts added one by one, parts removed, and other variations.

The other variations do not reduce the error.

Settings of each person are selected on other people, by models that are trained without that person and without the
people in the test.  Selected are sigma² of MAP and the tolerance of lengths; one row selects all settings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import errors
from pipeline.core.choice import first_lowest
from pipeline.processes import map_processes
from pipeline.studies.study import Sweep, scaled, stacked
from pipeline.validation import require_range
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.study.model import AnatomicalInputs
from walk3d.anatomy.study.sweeps.held_out import (
    NOISE_VARIANCES_MM2,
    PARTNERS,
    Choosers,
    Fold,
    MirroredViews,
    People,
)
from walk3d.anatomy.study.sweeps.ladder import MAX_HARMONICS, METHODS, of_part
from walk3d.anatomy.study.sweeps.setting import PLAIN, Setting, anatomical_setting, approach_two

DIAGONAL = 0.5
"""Weight of the shrinkage towards the covariance's diagonal, relative to the shrinkage within harmonics."""
PARTS_EVERY = 3
"""Step between the views of methods with a removed or varied part: only every third view is used."""
SHRUNKEN_NOISE_VARIANCES_MM2 = (50.0, 100.0, 200.0)
LENGTH_FACTORS = (1.0, 1.5, 2.0, 3.0)
PAIR_FACTORS = (1.0, 2.0, 4.0)
NOISE_FACTORS = (0.5, 1.0, 2.0)
"""Candidate factors for the noise variance sigma² and the prior variance tau, which are multiplied together."""
SHRINKAGES = (0.1, 0.2, 0.4)
"""Candidate shares for the noise, and for the shrinkage of the covariance within harmonics."""


@dataclass(frozen=True)
class StructureErrors:
    """Reconstruction errors by method, person and view.

    Methods with a removed or varied part have fewer views.
    """

    rows: pd.DataFrame


class Structure(Sweep):
    """Ablation of the anatomical reconstruction at known view angles."""

    seen_from_deg: MirroredViews = scaled(start=-90, stop=90, step={"full": 6, "smoke": 90})  # true views
    partners: Choosers = scaled(value=PARTNERS)  # number of other people for the selection of settings

    def measure(self, inputs: AnatomicalInputs) -> StructureErrors:
        """Return the errors of every method."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        require_range("dataset.harmonics", people.harmonics, at_least=MAX_HARMONICS)
        specified = anatomical_setting(inputs.model_options, Setting().harmonics)
        settings = self._settings(people, specified, inputs.workers)

        middle = len(view) // 2
        few = np.flatnonzero((np.arange(len(view)) - middle) % PARTS_EVERY == 0)
        parts, everywhere = of_part("taken away", "varied"), of_part("added", "settings")

        def person_rows(person: int) -> list[dict[str, Any]]:
            fold = people.fold(person)
            of_parts = {tuple(everywhere): np.arange(len(view)), tuple(parts): few}
            return [
                {
                    "method": method,
                    "person": inputs.model.people[person],
                    "view_angle_deg": view_deg[at],
                    "absolute_error_mm2": error.mean(axis=-1),
                }
                for methods, at in of_parts.items()
                for method, error in zip(
                    methods,
                    errors_of(people, fold, {m: settings[m][person] for m in methods}, person, view[at]),
                    strict=True,
                )
            ]

        folds = map_processes(person_rows, range(people.count), inputs.workers)
        return StructureErrors(stacked([row for rows in folds for row in rows]))

    def _settings(self, people: People, whole: Setting, workers: int) -> dict[str, list[Setting]]:
        """Return the settings of every method, one setting for each person."""

        published = approach_two(70.0)
        mirror = replace(published, shrinkage=replace(PLAIN, mirror=True))
        harmonics = replace(mirror, harmonics=whole.harmonics)
        tuned = {"map_tuned": published, "mirror": mirror, "harmonics": harmonics}
        candidates = {
            **{
                name: [setting.with_noise(value) for value in NOISE_VARIANCES_MM2]
                for name, setting in tuned.items()
            },
            "shrinkage": [whole.linear.with_noise(value) for value in SHRUNKEN_NOISE_VARIANCES_MM2],
            "anatomical": [replace(whole, within=factor) for factor in LENGTH_FACTORS],
        }
        all_candidates = list(dict.fromkeys(setting for group in candidates.values() for setting in group))
        score = people.errors_on_others(all_candidates, self.partners, workers)
        settings = {}
        for name, group in candidates.items():
            best = first_lowest(score[:, [all_candidates.index(setting) for setting in group]], axis=1)
            settings[name] = [group[number] for number in best]
        settings["average_walker"] = settings["map_70"] = [published] * people.count
        settings["as_specified"] = [whole] * people.count
        settings["all_chosen"] = people.select_in_turn(
            settings["anatomical"], self._alternatives(whole), max(self.partners // 2, 2), workers
        )
        for name, method in METHODS.items():
            if method.change:
                settings[name] = [method.change(setting) for setting in settings["anatomical"]]
        return settings

    def _alternatives(self, whole: Setting) -> list[Callable[[Setting], list[Setting]]]:
        """Return, for each option that is selected after the bone tolerance, a function that lists its candidates."""

        def noisier(setting: Setting) -> list[Setting]:
            return [
                replace(
                    setting.with_noise(factor * whole.noise.variance),
                    shrinkage=replace(
                        setting.shrinkage, extra_variance=factor * whole.shrinkage.extra_variance
                    ),
                )
                for factor in NOISE_FACTORS
            ]

        def shrunken(setting: Setting) -> list[Setting]:
            return [
                replace(
                    setting,
                    noise=replace(setting.noise, share=share),
                    shrinkage=replace(setting.shrinkage, within_harmonic=share, diagonal=DIAGONAL * share),
                )
                for share in SHRINKAGES
            ]

        return [
            lambda setting: [replace(setting, pairs=factor) for factor in PAIR_FACTORS],
            noisier,
            shrunken,
            lambda setting: [replace(setting, harmonics=number) for number in (3, whole.harmonics)],
        ]


def errors_of(
    people: People, fold: Fold, settings: Mapping[str, Setting], person: int, view: np.ndarray
) -> np.ndarray:
    """Return E_abs (M, A, 15), mm², of several methods for one person."""
    fitted = {method: setting for method, setting in settings.items() if method != "average_walker"}
    error_of = dict(zip(fitted, fold.errors(list(fitted.values()), person, view), strict=True))
    if "average_walker" in settings:
        setting = settings["average_walker"]
        mean = fold.prior(setting).mean
        average = np.einsum("aj,kjb->akb", anatomical.image_axes(view)[:, 2], mean)
        off = people.missing(person, view)[..., : mean.shape[-1]] - average
        fourier_part = off**2 @ errors.parseval_weights(mean.shape[-1])
        error_of["average_walker"] = fourier_part + people.beyond(person, view, setting.harmonics)
    return np.stack([error_of[method] for method in settings])
