"""Simulated clips from all sides with everything unknown: errors, and whether bars calibrated on others hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.filmed import belt_speed_mm_s, film
from pipeline.clips.walks import Walks
from pipeline.core.keypoint_walk import Detector, Reconstruction, errors
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
from pipeline.studies.keypoints.dataset import FilmedWalkers
from pipeline.studies.keypoints.model import KeypointWalkers
from pipeline.studies.study import Sweep, SweepInputs, scaled
from pipeline.synthetic.keypoints import DetectorError, Filming, SimulatedKeypoints
from pipeline.validation import require_range

HEADINGS_DEG = (0, 30, 60, 90, 180, -30, -60, -90)
"""0 is towards the camera, +90 to the image's right."""
_SCORED = GROUP_OF >= 0


@dataclass(frozen=True)
class HeadingErrors:
    """Errors of simulated clips.

    Attributes
    ----------
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
        Share of joint coordinates that bars of 50, 80 and 95 % hold: calibrated on other people, and as computed.
    shown : int
        The clip of median error, whose motion follows.
    shown_rate_hz : float
    shown_image_px, shown_reprojection_px : (T, 15, 2)
        About the principal point; NaN where missing.
    shown_true_mm, shown_estimate_mm, shown_average_mm, shown_half_mm : (T, 15, 3)
        About the pelvis, level camera axes; half widths of calibrated 95 % bars.
    """

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
    """One clip to be filmed: whose, from where, and whether the walker moves through space."""

    number: int
    person: int
    walk: int
    heading_deg: int
    overground: bool


@dataclass(kw_only=True)
class KeypointHeadings(Sweep):
    """Simulated clips from all sides."""

    draws_random_numbers = True

    clips: int = scaled(value="filmed")
    longest_s: float = 3.0
    bias_mm: float = 10.0  # of each joint of the simulated detector; what the model believes, too

    @property
    def reads_clips(self) -> bool:
        """Whether the clips are read: their motion is filmed."""
        return True

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_range("sweep.clips", self.clips, at_least=len(HEADINGS_DEG), whole=True)
        require_range("sweep.longest_s", self.longest_s, at_least=1.0, at_most=20.0)
        require_range("sweep.bias_mm", self.bias_mm, at_least=0, at_most=100)

    def cases(self, dataset: FilmedWalkers) -> list[Case]:
        """Return the clips: people take turns, each from as many sides as there are clips for."""
        people = dataset.people
        found = []
        for c in range(self.clips):
            person, turn = c % len(people), c // len(people)
            side = (c + turn) % (2 * len(HEADINGS_DEG))
            mine = np.flatnonzero(dataset.person == people[person])
            heading = HEADINGS_DEG[side % len(HEADINGS_DEG)]
            found.append(
                Case(c, person, int(mine[turn % len(mine)]), heading, overground=side < len(HEADINGS_DEG))
            )
        return found

    def measure(self, inputs: SweepInputs[Walks, FilmedWalkers, KeypointWalkers]) -> HeadingErrors:
        """Return the errors of all clips."""
        dataset = inputs.dataset
        cases = self.cases(dataset)
        groups = sorted({int(inputs.model.group[case.person]) for case in cases})

        def one(group: int) -> list[tuple[int, ClipErrors, float]]:
            prior = inputs.model.prior(group, self._detector)
            found = []
            for case in cases:
                if inputs.model.group[case.person] == group:
                    simulated = self._filmed(case, inputs)
                    walk = reconstruct_clip(simulated, prior)
                    measured = compare(walk, simulated, float(dataset.frequency_hz[case.walk]))
                    found.append((case.number, measured, walk.height_px))
            return found

        every = sorted(
            (item for part in map_processes(one, groups, inputs.workers) for item in part),
            key=lambda item: item[0],
        )
        measured = [item[1] for item in every]
        person = np.array([dataset.people[case.person] for case in cases])
        calibrations = calibrations_by_person(person, measured)
        distances = np.stack([m.distance_mm for m in measured])
        shown = int(np.argsort(distances[:, 0], kind="stable")[len(cases) // 2])
        return HeadingErrors(
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
            shown=shown,
            **self._shown(cases[shown], calibrations[str(person[shown])], inputs),
        )  # fmt: skip

    @property
    def _detector(self) -> Detector:
        return Detector(floor_mm=np.full(len(GROUP_OF), self.bias_mm))

    def _filmed(
        self, case: Case, inputs: SweepInputs[Walks, FilmedWalkers, KeypointWalkers]
    ) -> SimulatedKeypoints:
        generator = inputs.generator(f"clip {case.number}")
        walk = inputs.dataset.training_walk(case.walk)
        speed = belt_speed_mm_s(walk) if case.overground else 0.0
        filming = Filming(heading_rad=float(np.radians(case.heading_deg)), speed_mm_s=speed)
        error = DetectorError(bias_mm=self.bias_mm)
        return film(generator, inputs.clips, case.walk, error, filming, self.longest_s)

    def _shown(
        self,
        case: Case,
        calibration: Calibration,
        inputs: SweepInputs[Walks, FilmedWalkers, KeypointWalkers],
    ) -> dict[str, Any]:
        """The motion of one clip."""
        simulated = self._filmed(case, inputs)
        prior = inputs.model.prior(int(inputs.model.group[case.person]), self._detector)
        found: Reconstruction = reconstruct_clip(simulated, prior)
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
