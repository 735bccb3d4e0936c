"""Sweep over simulated clips, reconstructed by models without the walker and compared with the ground truth."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.clips.kinds import Walks
from pipeline.processes import map_processes
from pipeline.studies.study import Sweep, SweepInputs
from walk3d.film.simulation.filmed import belt_speed_mm_s, film
from walk3d.film.simulation.keypoints import Filming, SimulatedKeypoints
from walk3d.film.study.clip import METHODS, ClipErrors, compare, reconstruct_clip
from walk3d.film.study.conditions import Condition
from walk3d.film.study.dataset import FilmedWalkers
from walk3d.film.study.model import KeypointWalkers
from walk3d.film.walk import Prior, Reconstruction, errors
from walk3d.film.walk.calibration import (
    GROUP_OF,
    KIND_OF,
    LEVELS,
    NORMAL,
    Calibration,
    joint_half_widths,
    learn,
)
from walk3d.film.walk.cycle import EVENTS
from walk3d.film.walk.sagittal_angles import KINDS
from walk3d.film.walk.verdict import Verdict
from walk3d.film.walk.view import project

Inputs = SweepInputs[Walks, FilmedWalkers, KeypointWalkers]
MAX_CLIP_S = 3.0
"""Longest duration of a simulated clip, s."""
HEADINGS_DEG = (0, 30, 60, 90, 180, -30, -60, -90)
"""Headings of the clips, degrees: 0 is towards the camera, +90 to the right in the image."""
_SCORED = GROUP_OF >= 0

ERRORS = ["error_mm", *(f"{kind}_error_deg" for kind in KINDS)]
LEVELS_PERCENT = tuple(round(100 * level) for level in LEVELS)
LABELS = ("labels_right_percent", "labels_unsure_percent", "labels_wrong_unsaid_percent")
VERDICTS = [*(f"{verdict}_percent" for verdict in Verdict), *LABELS]
"""Table columns for the verdict and for the left-right labels, with 0 or 100 per cent for each clip."""


@dataclass(frozen=True)
class FilmedErrors:
    """Errors of the reconstructions of all simulated clips, and the motion of one clip for display.

    Attributes
    ----------
    clips : DataFrame
        One row per clip; condition 0 is the usual one.  Coverage is the share of joint coordinates within bars,
        calibrated on
            other people under the usual condition, or as computed (raw).
    people : DataFrame
        One row per clip and method: mean distance of the joints, root mean square errors of angles.
    shown : int
        Number of the clip of median error, whose motion follows.
    shown_rate_hz : float
    shown_image_px, shown_reprojection_px : (T, 15, 2)
        px from the principal point; NaN where missing.
    shown_true_mm, shown_estimate_mm, shown_average_mm, shown_half_mm : (T, 15, 3)
        About the pelvis, level camera axes; half widths of calibrated 95 % bars.
    """

    clips: pd.DataFrame
    people: pd.DataFrame
    shown: int
    shown_rate_hz: float
    shown_image_px: np.ndarray
    shown_reprojection_px: np.ndarray
    shown_true_mm: np.ndarray
    shown_estimate_mm: np.ndarray
    shown_average_mm: np.ndarray
    shown_half_mm: np.ndarray


@dataclass(frozen=True)
class Case:
    """One clip to simulate: person, walk, heading, and overground or treadmill walking.

    Clips of one `take` have the same random numbers under all conditions.
    """

    number: int
    take: int
    person: int
    walk: int
    heading_deg: int
    overground: bool
    condition: int = 0


def side(number: int) -> tuple[int, bool]:
    """Return the heading of the clip with this index, degrees, and True if the walker moves overground."""
    number %= 2 * len(HEADINGS_DEG)
    return HEADINGS_DEG[number % len(HEADINGS_DEG)], number < len(HEADINGS_DEG)


class FilmedClips(Sweep):
    """Sweep over simulated clips, which are reconstructed by models that were trained without the walker."""

    draws_random_numbers = True

    @property
    def reads_clips(self) -> bool:
        """True, because the sweep reads recorded motion to simulate films of it."""
        return True

    @property
    @abstractmethod
    def conditions(self) -> list[Condition]:
        """Return the conditions of the sweep; the usual condition is first."""

    @abstractmethod
    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips that the sweep simulates."""

    def measure(self, inputs: Inputs) -> FilmedErrors:
        """Return the reconstruction errors of all simulated clips."""
        dataset = inputs.dataset
        cases = self.cases(dataset)
        models = [self._model(case, inputs) for case in cases]

        def errors_of_model(model: int) -> list[tuple[int, ClipErrors]]:
            priors: dict[Any, Prior] = {}
            clip_errors = []
            for case in (case for case, of_case in zip(cases, models, strict=True) if of_case == model):
                condition = self.conditions[case.condition]
                if condition.knowledge not in priors:
                    priors[condition.knowledge] = inputs.model.prior(model, condition.knowledge)
                simulated = self._filmed(case, inputs)
                walk = reconstruct_clip(simulated, priors[condition.knowledge], condition)
                truth = dataset.training_walk(case.walk)
                clip_errors.append((case.number, compare(walk, simulated, truth, condition)))
            return clip_errors

        parts = map_processes(errors_of_model, sorted(set(models)), inputs.workers)
        measured = [item[1] for item in sorted((i for part in parts for i in part), key=lambda item: item[0])]
        names = [dataset.people[case.person] for case in cases]
        usual = [number for number, case in enumerate(cases) if case.condition == 0]
        labels = [self.left_out_with(dataset)[case.person] for case in cases]
        by_label = calibrations_by_person(np.array(labels)[usual], [measured[number] for number in usual])
        calibrations = {person: by_label[label] for person, label in zip(names, labels, strict=True)}
        keys = [
            {
                "condition": case.condition,
                "person": person,
                "walk": dataset.clip[case.walk],
                "heading_deg": float(case.heading_deg),
                "overground": int(case.overground),
            }
            for case, person in zip(cases, names, strict=True)
        ]
        clips = [
            {**key, **of_clip(m, calibrations[key["person"]])} for key, m in zip(keys, measured, strict=True)
        ]
        people = [
            {**key, "method": method, "error_mm": distance, **dict(zip(ERRORS[1:], angles, strict=True))}
            for key, m in zip(keys, measured, strict=True)
            for method, distance, angles in zip(METHODS, m.distance_mm, m.angle_deg, strict=True)
        ]
        distances = [measured[number].distance_mm[0] for number in usual]
        median_clip = usual[np.argsort(distances, kind="stable")[len(usual) // 2]]
        return FilmedErrors(
            clips=pd.DataFrame(clips),
            people=pd.DataFrame(people),
            shown=median_clip,
            **self._shown(cases[median_clip], calibrations[names[median_clip]], inputs),
        )

    def left_out_with(self, dataset: FilmedWalkers) -> list[str]:
        """Return, for each person, the name of the group whose clips are left out of the calibration of error bars.

        The error bars of a clip are calibrated on the clips of all other groups.

        The error bars of a clip are calibrated without all clips that have the same label.
        """
        return dataset.people

    def _model(self, case: Case, inputs: Inputs) -> int:
        """Return the index of the model that was trained without the walker's group, or without its data source."""
        other_sources = self.conditions[case.condition].knowledge.other_sources
        source = inputs.model.source[case.person]
        return source if other_sources and source >= 0 else inputs.model.group[case.person]

    def _filmed(self, case: Case, inputs: Inputs) -> SimulatedKeypoints:
        condition = self.conditions[case.condition]
        generator = inputs.generator(f"clip {case.take}")
        walk = inputs.dataset.training_walk(case.walk)
        filming = Filming(
            heading_rad=np.radians(case.heading_deg),
            speed_mm_s=belt_speed_mm_s(walk) if case.overground else 0.0,
            **condition.filming,
        )
        return film(
            generator, inputs.clips, case.walk, condition.error, filming, MAX_CLIP_S, condition.strides
        )

    def _shown(self, case: Case, calibration: Calibration, inputs: Inputs) -> dict[str, Any]:
        """Return the arrays of the clip that the recording shows."""
        condition = self.conditions[case.condition]
        simulated = self._filmed(case, inputs)
        prior = inputs.model.prior(self._model(case, inputs), condition.knowledge)
        reconstruction: Reconstruction = reconstruct_clip(simulated, prior, condition)
        average = errors.average_walker_mm(reconstruction)
        points = reconstruction.fit.objective.camera_points(reconstruction.fit.x)
        scale = errors.fitted_scale(reconstruction.posterior.positions_mm, simulated.positions_mm)
        return {
            "shown_rate_hz": simulated.frame_rate_hz,
            "shown_image_px": simulated.pixels,
            "shown_reprojection_px": project(points, simulated.focal_px),
            "shown_true_mm": simulated.positions_mm,
            "shown_estimate_mm": scale * reconstruction.posterior.positions_mm,
            "shown_average_mm": errors.fitted_scale(average, simulated.positions_mm) * average,
            "shown_half_mm": scale
            * joint_half_widths(calibration, reconstruction.posterior.sd_mm, len(LEVELS) - 1),
        }


def calibrations_by_person(person: np.ndarray, measured: list[ClipErrors]) -> dict[str, Calibration]:
    """Return the multipliers of error bars for each person or laboratory, learnt from the clips of all others."""
    calibrations = {}
    for label in dict.fromkeys(person):
        others = [m for name, m in zip(person, measured, strict=True) if name != label]
        calibrations[label] = learn([m.over_sd for m in others])
    return calibrations


def covered(measured: ClipErrors, calibration: Calibration | None) -> np.ndarray:
    """Return the coverage (3,) of the joints' error bars in one clip, as a share, at each of three levels.

    Without a calibration, the error bars are those of the posterior.
    """
    off = np.abs(measured.over_sd.joints[:, _SCORED])
    unit = np.ones((len(GROUP_OF), 3))
    half = [
        joint_half_widths(calibration, unit, level)[_SCORED]
        if calibration
        else np.full((1, 3), NORMAL[level])
        for level in range(len(LEVELS))
    ]
    return np.array([(off <= h).mean() for h in half])


def covered_cycle(measured: ClipErrors, calibration: Calibration) -> dict[str, float]:
    """Return a clip's errors of gait events, ms, and coverage of error bars for angles and gait-cycle numbers.

    The error bars are those of 95 %.
    """
    half = NORMAL[-1] * calibration.angles[KIND_OF, -1], NORMAL[-1] * calibration.cycle[:, -1]
    cycle = np.concatenate([z <= wide for z, wide in zip(measured.over_sd.cycle, half[1], strict=True)])
    return {
        **{f"{event}_error_ms": off for event, off in zip(EVENTS, measured.event_ms, strict=True)},
        "covered_angles_percent": 100.0 * (np.abs(measured.over_sd.angles) <= half[0]).mean(),
        "covered_cycle_percent": 100.0 * cycle.mean(),
    }


def of_clip(measured: ClipErrors, calibration: Calibration) -> dict[str, float]:
    """Return the table row of one clip: errors of view and cadence, residual, coverage, verdict and labels."""
    labels = (
        measured.labels_right,
        measured.labels_unsure,
        not (measured.labels_right or measured.labels_unsure),
    )
    return {
        "view_error_deg": measured.view_error_deg,
        "view_distance_deg": abs(measured.view_error_deg),
        "cadence_error_percent": measured.cadence_error_percent,
        "residual_percent": measured.residual_percent,
        **{
            f"covered_{percent}{end}": 100 * share
            for end, bars in (("_percent", calibration), ("_raw_percent", None))
            for percent, share in zip(LEVELS_PERCENT, covered(measured, bars), strict=True)
        },
        **covered_cycle(measured, calibration),
        **{f"{verdict}_percent": 100.0 * (measured.verdict == verdict) for verdict in Verdict},
        **{name: 100.0 * bool(true) for name, true in zip(LABELS, labels, strict=True)},
    }
