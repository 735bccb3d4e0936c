"""Many simulated clips: filmed, reconstructed by models that do not know the walkers, and compared with the truth."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.filmed import belt_speed_mm_s, film
from pipeline.clips.kinds import Walks
from pipeline.core.keypoint_walk import Prior, Reconstruction, errors
from pipeline.core.keypoint_walk.calibration import (
    GROUP_OF,
    LEVELS,
    NORMAL,
    Calibration,
    joint_half_widths,
    learn,
)
from pipeline.core.keypoint_walk.view import project
from pipeline.processes import map_processes
from pipeline.studies.keypoints.clip import METHODS, ClipErrors, compare, reconstruct_clip
from pipeline.studies.keypoints.conditions import Condition
from pipeline.studies.keypoints.dataset import FilmedWalkers
from pipeline.studies.keypoints.model import KeypointWalkers
from pipeline.studies.study import Sweep, SweepInputs
from pipeline.synthetic.keypoints import Filming, SimulatedKeypoints
from pipeline.validation import require_range

Inputs = SweepInputs[Walks, FilmedWalkers, KeypointWalkers]
_SCORED = GROUP_OF >= 0


@dataclass(frozen=True)
class FilmedErrors:
    """Errors of simulated clips.

    Attributes
    ----------
    condition : (C,) int
        Number of the condition; 0 is the usual one.
    person, clip : (C,) text
    heading_deg : (C,)
    overground : (C,) bool
    methods : (M,) text
    view_error_deg, cadence_error_percent, residual_percent : (C,)
    error_mm : (C, M)
        Mean distance of the joints.
    angle_error_deg : (C, M, 4)
        Root mean square error of knees, hips, shanks and elbows.
    covered, covered_raw : (C, 3)
        Share of joint coordinates that bars of 50, 80 and 95 % hold: calibrated on other people under the usual
        condition, and as computed.
    verdict : (C,) text
    labels_right, labels_unsure : (C,) bool
        Whether left and right are the walker's; whether both labellings would be returned.
    shown : int
        The clip of median error, whose motion follows.
    shown_rate_hz : float
    shown_image_px, shown_reprojection_px : (T, 15, 2)
        About the principal point; NaN where missing.
    shown_true_mm, shown_estimate_mm, shown_average_mm, shown_half_mm : (T, 15, 3)
        About the pelvis, level camera axes; half widths of calibrated 95 % bars.
    """

    condition: np.ndarray
    person: np.ndarray
    clip: np.ndarray
    heading_deg: np.ndarray
    overground: np.ndarray
    methods: np.ndarray
    view_error_deg: np.ndarray
    cadence_error_percent: np.ndarray
    residual_percent: np.ndarray
    error_mm: np.ndarray
    angle_error_deg: np.ndarray
    covered: np.ndarray
    covered_raw: np.ndarray
    verdict: np.ndarray
    labels_right: np.ndarray
    labels_unsure: np.ndarray
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
    """One clip to be filmed: whose, from where, and whether the walker moves through space.

    Clips of one `take` are filmed with the same random numbers under several conditions.
    """

    number: int
    take: int
    person: int
    walk: int
    heading_deg: int
    overground: bool
    condition: int = 0


@dataclass(kw_only=True)
class FilmedClips(Sweep):
    """Simulated clips, each reconstructed by a model without the walker."""

    draws_random_numbers = True

    longest_s: float = 3.0

    @property
    def reads_clips(self) -> bool:
        """Whether the clips are read: their motion is filmed."""
        return True

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_range("sweep.longest_s", self.longest_s, at_least=1.0, at_most=20.0)

    @property
    @abstractmethod
    def conditions(self) -> list[Condition]:
        """Return what is changed; the first one is the usual one."""

    @abstractmethod
    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips."""

    def measure(self, inputs: SweepInputs[Walks, FilmedWalkers, KeypointWalkers]) -> FilmedErrors:
        """Return the errors of all clips."""
        dataset = inputs.dataset
        cases = self.cases(dataset)
        models = [self._model(case, inputs) for case in cases]

        def one(model: int) -> list[tuple[int, ClipErrors]]:
            priors: dict[Any, Prior] = {}
            found = []
            for case in (case for case, of_case in zip(cases, models, strict=True) if of_case == model):
                condition = self.conditions[case.condition]
                if condition.knowledge not in priors:
                    priors[condition.knowledge] = inputs.model.prior(model, condition.knowledge)
                simulated = self._filmed(case, inputs)
                walk = reconstruct_clip(simulated, priors[condition.knowledge], condition)
                frequency = float(dataset.frequency_hz[case.walk])
                found.append((case.number, compare(walk, simulated, frequency, condition)))
            return found

        parts = map_processes(one, sorted(set(models)), inputs.workers)
        measured = [item[1] for item in sorted((i for part in parts for i in part), key=lambda item: item[0])]
        person = np.array([dataset.people[case.person] for case in cases])
        condition = np.array([case.condition for case in cases])
        usual = np.flatnonzero(condition == 0)
        calibrations = calibrations_by_person(person[usual], [measured[k] for k in usual])
        distances = np.stack([m.distance_mm for m in measured])
        shown = int(usual[np.argsort(distances[usual, 0], kind="stable")[len(usual) // 2]])
        return FilmedErrors(
            condition=condition,
            person=person,
            clip=np.array([str(dataset.clip[case.walk]) for case in cases]),
            heading_deg=np.array([case.heading_deg for case in cases], dtype=float),
            overground=np.array([case.overground for case in cases]),
            methods=np.array(METHODS),
            view_error_deg=np.array([m.view_error_deg for m in measured]),
            cadence_error_percent=np.array([m.cadence_error_percent for m in measured]),
            residual_percent=np.array([m.residual_percent for m in measured]),
            error_mm=distances,
            angle_error_deg=np.stack([m.angle_deg for m in measured]),
            covered=np.stack([
                covered(m, calibrations[who]) for who, m in zip(person.tolist(), measured, strict=True)
            ]),
            covered_raw=np.stack([covered(m, None) for m in measured]),
            verdict=np.array([m.verdict for m in measured]),
            labels_right=np.array([m.labels_right for m in measured]),
            labels_unsure=np.array([m.labels_unsure for m in measured]),
            shown=shown,
            **self._shown(cases[shown], calibrations[str(person[shown])], inputs),
        )  # fmt: skip

    def _model(self, case: Case, inputs: Inputs) -> int:
        """Return the number of the model that does not know the walker."""
        other_sources = self.conditions[case.condition].knowledge.other_sources
        return int((inputs.model.source if other_sources else inputs.model.group)[case.person])

    def _filmed(self, case: Case, inputs: Inputs) -> SimulatedKeypoints:
        condition = self.conditions[case.condition]
        generator = inputs.generator(f"clip {case.take}")
        walk = inputs.dataset.training_walk(case.walk)
        filming = Filming(
            heading_rad=float(np.radians(case.heading_deg)),
            speed_mm_s=belt_speed_mm_s(walk) if case.overground else 0.0,
            **condition.filming,
        )
        return film(
            generator, inputs.clips, case.walk, condition.error, filming, self.longest_s, condition.strides
        )

    def _shown(self, case: Case, calibration: Calibration, inputs: Inputs) -> dict[str, Any]:
        """The motion of one clip."""
        condition = self.conditions[case.condition]
        simulated = self._filmed(case, inputs)
        prior = inputs.model.prior(self._model(case, inputs), condition.knowledge)
        found: Reconstruction = reconstruct_clip(simulated, prior, condition)
        average = errors.average_walker_mm(found)
        points = found.fit.objective.camera_points(found.fit.x)
        scale = errors.fitted_scale(found.posterior.positions_mm, simulated.positions_mm)
        return {
            "shown_rate_hz": simulated.frame_rate_hz,
            "shown_image_px": simulated.pixels,
            "shown_reprojection_px": project(points, simulated.focal_px),
            "shown_true_mm": simulated.positions_mm,
            "shown_estimate_mm": scale * found.posterior.positions_mm,
            "shown_average_mm": errors.fitted_scale(average, simulated.positions_mm) * average,
            "shown_half_mm": scale * joint_half_widths(calibration, found.posterior.sd_mm, len(LEVELS) - 1),
        }


def calibrations_by_person(person: np.ndarray, measured: list[ClipErrors]) -> dict[str, Calibration]:
    """Multipliers of bars for each person, learnt on all clips of the others."""
    found = {}
    for who in dict.fromkeys(person.tolist()):
        others = [m for name, m in zip(person.tolist(), measured, strict=True) if name != who]
        found[who] = learn(
            np.concatenate([m.joints for m in others]), np.concatenate([m.angles for m in others])
        )
    return found


def covered(measured: ClipErrors, calibration: Calibration | None) -> np.ndarray:
    """Share of joint coordinates within bars, by level, (3,); None: bars as computed."""
    off = np.abs(measured.joints[:, _SCORED])
    unit = np.ones((len(GROUP_OF), 3))
    half = [
        joint_half_widths(calibration, unit, level)[_SCORED]
        if calibration
        else np.full((1, 3), NORMAL[level])
        for level in range(len(LEVELS))
    ]
    return np.array([float((off <= h).mean()) for h in half])
