"""Errors of a detector in the observed dimensions: where constant bones stop helping, told of the errors or not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pipeline.core import anatomical, errors
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Grid, Sweep, SweepInputs, scaled
from pipeline.studies.walks.anatomical_model import AnatomicalWalkers
from pipeline.studies.walks.sweeps.held_out import NORMAL_95, PHASES, Fold, People, require_choosers
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
    """Errors and coverage under each condition.

    Attributes
    ----------
    conditions, methods : (S,), (M,) text
    white_mm, bias_mm, slow_mm : (S,)
    view_angle_deg : (A,)
    absolute_error_mm2, covered, half_width_mm : (M, S, P, A)
        E_abs; share that 95 % bars cover as computed; their mean half width.
    """

    conditions: np.ndarray
    methods: np.ndarray
    white_mm: np.ndarray
    bias_mm: np.ndarray
    slow_mm: np.ndarray
    view_angle_deg: np.ndarray
    absolute_error_mm2: np.ndarray
    covered: np.ndarray
    half_width_mm: np.ndarray


@dataclass(kw_only=True)
class ObservedNoise(Sweep):
    """Errors in the observed dimensions."""

    draws_random_numbers = True

    seen_from_deg: Grid = scaled(start=0, stop=90, step="few_views_step_deg")
    partners: int = scaled(value="partners")  # people who choose sigma² of MAP for each person
    noise_variances_mm2: list[float] = field(default_factory=lambda: [150, 300, 500, 700, 1000])

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        self.seen_from_deg.values("sweep.seen_from_deg")
        require_choosers(self.partners, self.noise_variances_mm2)

    def measure(self, inputs: SweepInputs[object, FourierSamples, AnatomicalWalkers]) -> NoiseErrors:
        """Return errors and coverage of every method under each condition."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        whole = anatomical_setting(inputs.model_options, people.harmonics)
        tuned = people.tuned_map(self.noise_variances_mm2, self.partners, inputs.workers)
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
            told = [
                replace(
                    whole,
                    noise=replace(
                        whole.noise,
                        bias=float(np.hypot(bias, of_frame * share[0])),
                        slow=float(np.hypot(slow, of_frame * share[-1] * np.sqrt(people.harmonics))),
                    ),
                )
                for of_frame, bias, slow in CONDITIONS.values()
            ]
            of_method: dict[str, list[Setting]] = {
                "map_tuned": [tuned[person]] * len(told),
                "linear_told": [replace(setting, within=np.inf, pairs=np.inf) for setting in told],
                "anatomical_told": told,
                "anatomical_untold": [whole] * len(told),
            }
            found = np.empty((len(METHODS), len(told), 3, len(view)))
            for m, method in enumerate(METHODS):
                settings = of_method[method]
                for setting in dict.fromkeys(settings):
                    alike = [s for s, other in enumerate(settings) if other == setting]
                    found[m, alike] = _measured(fold, people, person, setting, view, off[:, alike])
            return found

        found = np.stack(map_processes(one, range(people.count), inputs.workers))  # (P, M, S, 3, A)
        found = np.moveaxis(found, (3, 1, 2, 0), (0, 1, 2, 3))
        white_mm, bias_mm, slow_mm = np.array(list(CONDITIONS.values())).T
        return NoiseErrors(
            conditions=np.array(list(CONDITIONS)),
            methods=np.array(METHODS),
            white_mm=white_mm,
            bias_mm=bias_mm,
            slow_mm=slow_mm,
            view_angle_deg=view_deg,
            absolute_error_mm2=found[0],
            covered=found[1],
            half_width_mm=found[2],
        )


def _measured(
    fold: Fold, people: People, person: int, setting: Setting, view: np.ndarray, off: np.ndarray
) -> np.ndarray:
    """Error, share covered and half width (S, 3, A) of one setting, with S errors (A, S, 15, 3, B) of what is seen."""
    size = 1 + 2 * setting.harmonics
    walkers = np.repeat(people.walker(person)[None], off.shape[1], axis=0)
    found = fold.reconstruct(setting, walkers, view, observation_error=off[..., :size], with_covariance=True)
    wrong = (found.true - found.estimated).reshape(*off.shape[:3], size)
    beyond = people.beyond(person, view, setting.harmonics)
    square = (wrong**2 @ errors.parseval_weights(size)).mean(axis=-1) + beyond.mean(axis=-1)[:, None]
    more = np.repeat(people.missing(person, view)[:, None, :, size:], off.shape[1], axis=1)
    at = anatomical.at_instants(np.concatenate([wrong, more], axis=-1), PHASES)
    half = NORMAL_95 * anatomical.deviation_at_instants(found.covariance, size, PHASES)
    covered = (np.abs(at) <= half).mean(axis=(-2, -1))
    return np.stack([square, covered, half.mean(axis=(-2, -1))]).transpose(2, 0, 1)
