"""Errors of a detector in the observed dimensions: where constant bones stop helping, told of the errors or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipeline.core import anatomical, errors
from pipeline.processes import map_processes
from pipeline.studies.study import Sweep, Swept, scaled
from pipeline.studies.walks.anatomical_model import AnatomicalInputs
from pipeline.studies.walks.sweeps.held_out import (
    NOISE_VARIANCES_MM2,
    NORMAL_95,
    PHASES,
    Choosers,
    Fold,
    People,
)
from pipeline.studies.walks.sweeps.setting import Setting, anatomical_setting

CONDITIONS = {
    "none": (0.0, 0.0, 0.0),
    "white_10": (10.0, 0.0, 0.0),
    "bias_10": (0.0, 10.0, 0.0),
    "bias_20": (0.0, 20.0, 0.0),
    "slow_3": (0.0, 0.0, 3.0),
    "bias_10_slow_3": (0.0, 10.0, 3.0),
}
"""White noise of a frame, constant offset of a joint, and error that repeats with the cycle: rms, mm."""

METHODS = ("map_tuned", "linear_told", "anatomical_told", "anatomical_untold")
FRAMES = 100
"""Over which white noise is averaged: about two cycles."""


@dataclass(frozen=True)
class NoiseErrors:
    """Errors under each condition, a row to each person, condition and method; means over views.

    Share that 95 % bars cover as computed, and their mean half width.
    """

    rows: pd.DataFrame


class ObservedNoise(Sweep):
    """Errors in the observed dimensions."""

    draws_random_numbers = True

    seen_from_deg: Swept = scaled(start=0, stop=90, step="few_views_step_deg")  # true views
    partners: Choosers = scaled(value="partners")  # people who choose sigma² of MAP for each person

    def measure(self, inputs: AnatomicalInputs) -> NoiseErrors:
        """Return errors and coverage of every method under each condition."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(NOISE_VARIANCES_MM2[1:-1], self.partners, inputs.workers)
        blocks = 1 + 2 * people.harmonics
        rng = inputs.generator("detector")
        shape = (people.count, len(view), anatomical.JOINTS, 3, blocks)
        constant, periodic, white = (rng.standard_normal(shape) for _ in range(3))
        # White noise of each frame leaves this much in a coefficient of the regression.
        share = np.sqrt(np.concatenate([[1.0], np.full(blocks - 1, 2.0)]) / FRAMES)

        def one(person: int) -> np.ndarray:
            fold = people.fold(person)
            error = []
            for of_frame, bias, slow in CONDITIONS.values():
                added = of_frame * share * white[person]
                added[..., 0] += bias * constant[person][..., 0]
                added[..., 1:] += slow / np.sqrt(people.harmonics) * periodic[person][..., 1:]
                error.append(added)
            off = np.stack(error, axis=1)  # (A, S, 15, 3, B)
            informed = [
                replace(
                    whole,
                    noise=replace(
                        whole.noise,
                        bias=np.hypot(bias, of_frame * share[0]),
                        slow=np.hypot(slow, of_frame * share[-1] * np.sqrt(people.harmonics)),
                    ),
                )
                for of_frame, bias, slow in CONDITIONS.values()
            ]
            uninformed = [whole] * len(informed)
            settings = (
                [tuned[person]] * len(informed),
                [setting.linear for setting in informed],
                informed,
                uninformed,
            )
            found = np.empty((len(METHODS), len(informed), 3, len(view)))
            alike: dict[Setting, dict[tuple[int, Setting], list[int]]] = {}  # by what has its linear part
            for m, of_method in enumerate(settings):  # in the order of the methods
                for s, setting in enumerate(of_method):
                    alike.setdefault(setting.linear, {}).setdefault((m, setting), []).append(s)
            for (m, setting), some in (item for of in alike.values() for item in of.items()):
                found[m, some] = _measured(fold, people, person, setting, view, off[:, some])
            return found.mean(axis=-1)

        found = map_processes(one, range(people.count), inputs.workers)
        return NoiseErrors(
            pd.DataFrame(
                {
                    "person": who,
                    "condition": condition,
                    "method": method,
                    **dict(zip(("white_mm", "bias_mm", "slow_mm"), sizes, strict=True)),
                    "absolute_error_mm2": error,
                    "covered_percent": 100.0 * covered,
                    "half_width_mm": half,
                }
                for who, of_person in zip(inputs.model.people, found, strict=True)
                for s, (condition, sizes) in enumerate(CONDITIONS.items())
                for method, (error, covered, half) in zip(METHODS, of_person[:, s], strict=True)
            )
        )


def _measured(
    fold: Fold, people: People, person: int, setting: Setting, view: np.ndarray, off: np.ndarray
) -> np.ndarray:
    """Error, share covered and half width (S, 3, A) of one setting, with S errors (A, S, 15, 3, B) of what is seen."""
    size = 1 + 2 * setting.harmonics
    walkers = np.repeat(people.walker(person)[None], off.shape[1], axis=0)
    (found,) = fold.reconstruct(
        [setting], walkers, view, observation_error=off[..., :size], with_covariance=True
    )
    wrong = (found.true - found.estimated).reshape(*off.shape[:3], size)
    beyond = people.beyond(person, view, setting.harmonics)
    square = (wrong**2 @ errors.parseval_weights(size)).mean(axis=-1) + beyond.mean(axis=-1)[:, None]
    more = np.repeat(people.missing(person, view)[:, None, :, size:], off.shape[1], axis=1)
    at = anatomical.at_instants(np.concatenate([wrong, more], axis=-1), PHASES)
    half = NORMAL_95 * anatomical.deviation_at_instants(found.covariance, size, PHASES)
    covered = (np.abs(at) <= half).mean(axis=(-2, -1))
    return np.stack([square, covered, half.mean(axis=(-2, -1))]).transpose(2, 0, 1)
