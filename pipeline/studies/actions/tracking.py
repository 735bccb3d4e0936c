"""Held-out performances tracked in 2D: with the action model as prior, without it, and the mean performance alone.

mozerov2006 learns the action model for this and leaves the tracker to the reader (its sections 1 and 4).
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
"""Where particles are not what varies, if they are among those tried."""
_STREAM = 20060  # keeps these draws apart from those of other stages with the same seed


@dataclass(frozen=True)
class TrackingErrors:
    """Errors of every method, on performances that the model has not seen, and one performance to look at.

    Attributes
    ----------
    rows : DataFrame
        A row to each way of leaving out, performance, condition (by what is varied) and method: error, mean over frames
        and joints, relative to the pelvis; that of the true postures in the aSpace; fractions of frames that were lost,
        and of predictions that were pruned.
    leave_out, methods : (L,), (K,) text
    tracked : (N,) int
        Performances.
    shown : (1,) int
        The performance that is shown, and under which condition:
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
    """Held-out performances tracked in 2D with the action model as prior."""

    draws_random_numbers = True

    particles: Distinct[Annotated[int, bounded(at_least=1, at_most=1_000_000)]] = scaled(
        value="particles"
    )  # of each filter
    tracked: CountOrAll = scaled(value="tracked")  # performances, evenly over all; 0: all
    leave_out: Distinct[LeaveOut] = list(LeaveOut)  # what the model is learnt without
    noise_mm: Distinct[NonNegative] = [0.0, 10.0, 30.0]  # of the observed joints
    occluded: Distinct[Finite] = [0.0, 0.25, 0.5]  # share of joints unseen, in runs
    occlusion_frames: float = 10.0  # mean length of such a run
    baseline_noise_mm: NonNegative = 10.0  # where noise is not what varies
    view_angle_deg: Finite = 45.0  # of the camera

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_occlusion(self.occluded, self.occlusion_frames)

    @property
    def conditions(self) -> list[tuple[str, Condition]]:
        """What is varied, and the condition, for every point of the sweep: one quantity at a time."""
        ordered, noise_mm = sorted(self.particles), self.baseline_noise_mm
        usual = USUAL_PARTICLES if USUAL_PARTICLES in ordered else ordered[len(ordered) // 2]
        return [
            *(("particles", Condition(n, noise_mm, 0.0)) for n in ordered),
            *(("noise", Condition(usual, v, 0.0)) for v in sorted(self.noise_mm)),
            *(("occlusion", Condition(usual, noise_mm, v)) for v in sorted(self.occluded)),
        ]

    @property
    def demonstrated(self) -> Condition:
        """The condition that is shown: the middle share of hidden joints."""
        of_occlusion = [condition for varied, condition in self.conditions if varied == "occlusion"]
        return of_occlusion[len(of_occlusion) // 2]

    def ways(self, people: np.ndarray) -> tuple[list[LeaveOut], list[str]]:
        """Return the ways of leaving out that this data has, and remarks on those that it has not."""
        if LeaveOut.person not in self.leave_out or len(np.unique(people)) > 1:
            return list(self.leave_out), []
        if self.leave_out == [LeaveOut.person]:
            raise InvalidInput(
                "one person cannot be left out",
                "sweep.leave_out",
                "several people",
                "1",
                code="too_few_people",
                count=1,
            )
        return [LeaveOut.performance], ["tracking: one person alone, so no person is left out"]

    def measure(self, inputs: ActionInputs) -> TrackingErrors:
        """Return the errors; of the model only the options are used: everything is learnt again.

        Raises
        ------
        InvalidInput
            If too few performances are left to learn from.
        """
        wanted = pd.DataFrame(
            {"varied": varied, **asdict(condition)} for varied, condition in self.conditions
        )
        performances, people = performances_of(inputs.dataset), inputs.dataset.person
        chosen = evenly(self.tracked, len(performances))
        ways, remarks = self.ways(people)
        shown = self.demonstrated
        distinct = sorted({condition for _, condition in self.conditions})

        def one(item: tuple[LeaveOut, int]) -> Tracked:
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
            return trial.all(distinct, shown)

        items = [(way, int(m)) for way in ways for m in chosen]
        found = map_processes(one, items, inputs.workers)
        rows = pd.concat(
            of.rows.assign(leave_out=str(way), performance=inputs.dataset.clip[m], person=people[m])
            for (way, m), of in zip(items, found, strict=True)
        )
        # The performance whose error with the prior is the median one, of the first way of leaving out.
        errors = [
            joint_error(of.joints[0], performances[m].joints_mm).mean()
            for m, of in zip(chosen, found, strict=False)
        ]
        middle = np.argsort(errors, kind="stable")[len(errors) // 2]
        picked, true = found[middle], performances[chosen[middle]].joints_mm
        rate_hz = inputs.dataset.frame_rate_hz[chosen[middle]]
        return TrackingErrors(
            rows=wanted.merge(rows, on=list(asdict(shown))),  # a condition may be met on several ways
            leave_out=np.array(ways, str),
            methods=np.array(METHODS),
            tracked=chosen,
            shown=chosen[[middle]],
            shown_particles=shown.particles,
            shown_noise_mm=shown.noise_mm,
            shown_occluded=shown.occluded,
            shown_true=true,
            shown_joints=picked.joints,
            shown_image=picked.image,
            shown_time_s=np.arange(len(picked.image)) / rate_hz,
            shown_error_mm=np.stack([joint_error(j, true) for j in picked.joints]),
            remarks=remarks,
        )
