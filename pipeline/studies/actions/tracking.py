"""Tracking of held-out performances from 2D images, with the action model as prior and with baselines.

mozerov2006 learns the action model for this purpose but describes no tracker (sections 1 and 4).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.core.choice import evenly
from pipeline.core.tracking import joint_error
from pipeline.processes import map_processes
from pipeline.studies.actions.held_out import LeaveOut, learn_without, left_out, performances_of
from pipeline.studies.actions.model import ActionInputs
from pipeline.studies.actions.tracking_trial import METHODS, Condition, Tracked, Trial
from pipeline.studies.occlusion import require_occlusion
from pipeline.studies.study import Sweep, scaled
from pipeline.validation import CountOrAll, Distinct, Finite, InvalidInput, NonNegative, bounded

USUAL_PARTICLES = 500
"""Number of particles while noise or occlusion varies, if the sweep over particles includes this number."""
_STREAM = 20060  # separates these draws from those of other stages with the same seed


@dataclass(frozen=True)
class TrackingErrors:
    """Errors of every method on the held-out performances, and one performance for display.

    Attributes
    ----------
    rows : DataFrame
        A row for each kind of leaving out, performance, condition and method: error relative to the pelvis, mean over
        frames and joints; the same of the true postures in the aSpace; fractions of lost frames and of pruned
        predictions.
    leave_out, methods : (L,), (K,) text
    tracked : (N,) int
        Numbers of the tracked performances.
    shown : (1,) int
        Number of the displayed performance; its condition follows.
    shown_particles, shown_noise_mm, shown_occluded : int, float, float
    shown_true, shown_joints, shown_image : (T, 15, 3), (K, T, 15, 3), (T, 15, 2)
        Millimetres.
    shown_time_s, shown_error_mm : (T,), (K, T)
    remarks : list of str
    """

    rows: pd.DataFrame
    leave_out: np.ndarray
    methods: np.ndarray
    tracked: np.ndarray
    shown: np.ndarray
    shown_particles: int
    shown_noise_mm: float
    shown_occluded: float
    shown_true: np.ndarray
    shown_joints: np.ndarray
    shown_image: np.ndarray
    shown_time_s: np.ndarray
    shown_error_mm: np.ndarray
    remarks: list[str]


class HeldOutTracking(Sweep):
    """Options of tracking held-out performances from 2D images with the action model as prior."""

    draws_random_numbers = True

    particles: Distinct[Annotated[int, bounded(at_least=1, at_most=1_000_000)]] = scaled(
        value="particles"
    )  # particles of each filter
    tracked: CountOrAll = scaled(value="tracked")  # number of performances, spread evenly; 0: all
    leave_out: Distinct[LeaveOut] = list(LeaveOut)  # performances left out of the model
    noise_mm: Distinct[NonNegative] = [0.0, 10.0, 30.0]  # noise of the observed joints
    occluded: Distinct[Finite] = [0.0, 0.25, 0.5]  # share of hidden joints, in runs
    occlusion_frames: float = 10.0  # mean length of a run
    baseline_noise_mm: NonNegative = 10.0  # noise while another quantity varies
    view_angle_deg: Finite = 45.0  # view angle of the camera

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_occlusion(self.occluded, self.occlusion_frames)

    @property
    def conditions(self) -> list[tuple[str, Condition]]:
        """Name of the varied quantity and values of all quantities, for every point of the sweep."""
        ordered, noise_mm = sorted(self.particles), self.baseline_noise_mm
        usual = USUAL_PARTICLES if USUAL_PARTICLES in ordered else ordered[len(ordered) // 2]
        return [
            *(("particles", Condition(n, noise_mm, 0.0)) for n in ordered),
            *(("noise", Condition(usual, v, 0.0)) for v in sorted(self.noise_mm)),
            *(("occlusion", Condition(usual, noise_mm, v)) for v in sorted(self.occluded)),
        ]

    @property
    def demonstrated(self) -> Condition:
        """Condition of tracking that is displayed, which has the middle one of the swept shares of hidden joints."""
        of_occlusion = [condition for varied, condition in self.conditions if varied == "occlusion"]
        return of_occlusion[len(of_occlusion) // 2]

    def ways(self, people: np.ndarray) -> tuple[list[LeaveOut], list[str]]:
        """Return the choices of held-out data that are possible in this data set, and remarks on impossible ones."""
        if LeaveOut.person not in self.leave_out or len(np.unique(people)) > 1:
            return list(self.leave_out), []
        if self.leave_out == [LeaveOut.person]:
            raise InvalidInput(
                "leaving a person out needs several people",
                "sweep.leave_out",
                "several people",
                "1",
                code="too_few_people",
                count=1,
            )
        return [LeaveOut.performance], ["tracking: there is only one person, so no person is left out"]

    def measure(self, inputs: ActionInputs) -> TrackingErrors:
        """Return the tracking errors of every method, with models that are learnt without the tracked performance.

        Raises
        ------
        InvalidInput
            If too few performances are left to learn from.
        """
        conditions = pd.DataFrame(
            {"varied": varied, **asdict(condition)} for varied, condition in self.conditions
        )
        performances, people = performances_of(inputs.dataset), inputs.dataset.person
        numbers = evenly(self.tracked, len(performances))
        ways, remarks = self.ways(people)
        displayed = self.demonstrated
        distinct = sorted({condition for _, condition in self.conditions})

        def tracked(item: tuple[LeaveOut, int]) -> Tracked:
            way, m = item
            held_out = learn_without(inputs.model_options, performances, left_out(people, m, way))
            trial = Trial(
                held_out,
                performances[m],
                np.radians(self.view_angle_deg),
                seed=(inputs.seed, _STREAM, m),
                way=(list(LeaveOut).index(way),),
                occlusion_frames=self.occlusion_frames,
            )
            return trial.all(distinct, displayed)

        items = [(way, int(m)) for way in ways for m in numbers]
        results = map_processes(tracked, items, inputs.workers)
        rows = pd.concat(
            result.rows.assign(leave_out=str(way), performance=inputs.dataset.clip[m], person=people[m])
            for (way, m), result in zip(items, results, strict=True)
        )
        # The performance with the median error with the prior, for the first kind of leaving out.
        errors = [
            joint_error(result.joints[0], performances[m].joints_mm).mean()
            for m, result in zip(numbers, results, strict=False)
        ]
        middle = np.argsort(errors, kind="stable")[len(errors) // 2]
        picked, true = results[middle], performances[numbers[middle]].joints_mm
        rate_hz = inputs.dataset.frame_rate_hz[numbers[middle]]
        return TrackingErrors(
            rows=conditions.merge(
                rows, on=list(asdict(displayed))
            ),  # several varied quantities may share a condition
            leave_out=np.array(ways, str),
            methods=np.array(METHODS),
            tracked=numbers,
            shown=numbers[[middle]],
            shown_particles=displayed.particles,
            shown_noise_mm=displayed.noise_mm,
            shown_occluded=displayed.occluded,
            shown_true=true,
            shown_joints=picked.joints,
            shown_image=picked.image,
            shown_time_s=np.arange(len(picked.image)) / rate_hz,
            shown_error_mm=np.stack([joint_error(j, true) for j in picked.joints]),
            remarks=remarks,
        )
