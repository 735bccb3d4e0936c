"""Held-out performances tracked in 2D: with the action model as prior, without it, and the mean performance alone.

mozerov2006 learns the action model for this and leaves the tracker to the reader (its sections 1 and 4).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from pipeline.core.choice import evenly
from pipeline.core.tracking import joint_error
from pipeline.processes import map_processes
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.held_out import LeaveOut, learn_without, left_out, performances_of
from pipeline.studies.actions.model import Action
from pipeline.studies.actions.observed_joints import CameraKind, camera_of
from pipeline.studies.actions.tracking_conditions import Condition, conditions
from pipeline.studies.actions.tracking_trial import METHODS, Tracked, Trial
from pipeline.studies.occlusion import require_occlusion
from pipeline.studies.study import Sweep, SweepInputs, scaled
from pipeline.validation import CountOrAll, Distinct, Finite, InvalidInput, NonNegative, Positive, bounded

_STREAM = 20060  # keeps these draws apart from those of other stages with the same seed


@dataclass(frozen=True)
class TrackingErrors:
    """Errors of every method, on performances that the model has not seen, and one performance to look at.

    L ways of leaving out, C conditions, N performances, K methods, of which f are filters.

    Attributes
    ----------
    varied : (C,) text
    particles, noise_mm, occluded : (C,)
        The conditions.
    leave_out, methods : (L,), (K,) text
    tracked : (N,) int
        Performances.
    error_mm : (L, C, N, K)
        Mean over frames and joints, relative to the pelvis.
    aspace_error_mm : (L, N)
        Of the true postures in the aSpace.
    lost_fraction, pruned_fraction, effective_sample_size : (L, C, N, f)
        Means over frames.
    shown : (1,) int
        The performance that is shown, and under which condition:
    shown_particles, shown_noise_mm, shown_occluded : int, float, float
    shown_true, shown_joints, shown_image : (T, 15, 3), (K, T, 15, 3), (T, 15, 2)
        Millimetres.
    shown_time_s, shown_error_mm : (T,), (K, T)
    remarks : list of str
    """

    varied: np.ndarray
    particles: np.ndarray
    noise_mm: np.ndarray
    occluded: np.ndarray
    leave_out: np.ndarray
    methods: np.ndarray
    tracked: np.ndarray
    error_mm: np.ndarray
    aspace_error_mm: np.ndarray
    lost_fraction: np.ndarray
    pruned_fraction: np.ndarray
    effective_sample_size: np.ndarray
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


@dataclass(kw_only=True)
class HeldOutTracking(Sweep):
    """Held-out performances tracked in 2D with the action model as prior."""

    draws_random_numbers = True

    particles: Distinct[Annotated[int, bounded(at_least=1, at_most=1_000_000)]] = scaled(value="particles")
    tracked: CountOrAll = scaled(value="tracked")  # performances, evenly over all; 0: all
    leave_out: Distinct[LeaveOut] = field(default_factory=lambda: list(LeaveOut))
    noise_mm: Distinct[NonNegative] = field(
        default_factory=lambda: [0.0, 10.0, 30.0]
    )  # of the observed joints
    occluded: Distinct[Finite] = field(
        default_factory=lambda: [0.0, 0.25, 0.5]
    )  # share of joints unseen, in runs
    occlusion_frames: float = 10.0  # mean length of such a run
    baseline_noise_mm: NonNegative = 10.0  # where noise is not what varies
    view_angle_deg: Finite = 45.0
    camera: CameraKind = CameraKind.orthographic
    distance_mm: Positive = 4000.0  # of a perspective camera
    moves: CountOrAll = 0  # Metropolis moves of each particle at each frame

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_occlusion(self.occluded, self.occlusion_frames)

    @property
    def conditions(self) -> list[tuple[str, Condition]]:
        """What is varied, and the condition, for every point of the sweep."""
        return conditions(self.particles, self.noise_mm, self.occluded, self.baseline_noise_mm)

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
                where="sweep.leave_out",
                expected="several people",
                received="1",
            )
        return [LeaveOut.performance], ["tracking: one person alone, so no person is left out"]

    def measure(self, inputs: SweepInputs[None, Postures, Action]) -> TrackingErrors:
        """Return the errors; of the model only the options are used: everything is learnt again.

        Raises
        ------
        InvalidInput
            If too few performances are left to learn from.
        """
        varied, wanted = zip(*self.conditions, strict=True)
        performances, people = performances_of(inputs.dataset), inputs.dataset.person
        chosen = evenly(self.tracked, len(performances))
        ways, remarks = self.ways(people)
        shown, distinct = self.demonstrated, sorted(set(wanted))
        camera = camera_of(self.camera, view_angle_deg=self.view_angle_deg, distance_mm=self.distance_mm)

        def one(item: tuple[LeaveOut, int]) -> Tracked:
            way, m = item
            held_out = learn_without(inputs.model_options, performances, left_out(people, m, way))
            trial = Trial(
                held_out,
                performances[m],
                camera,
                seed=(inputs.seed, _STREAM, m),
                way=(list(LeaveOut).index(way),),
                occlusion_frames=self.occlusion_frames,
                moves=self.moves,
            )
            return trial.all(distinct, shown)

        items = [(way, int(m)) for way in ways for m in chosen]
        found = map_processes(one, items, inputs.workers)
        grid = (len(ways), len(chosen))
        row = [distinct.index(condition) for condition in wanted]

        def stacked(name: str) -> np.ndarray:
            """(L, C, N, …) of every item's (distinct, …)."""
            values = np.stack([getattr(f, name)[row] for f in found])
            return np.moveaxis(values.reshape(*grid, *values.shape[1:]), 1, 2)

        # The performance whose error with the prior is the median one, of the first way of leaving out.
        errors = np.array([f.errors[distinct.index(shown), 0] for f in found[: len(chosen)]])
        middle = int(np.argsort(errors, kind="stable")[len(errors) // 2])
        picked, true = found[middle], performances[chosen[middle]].joints_mm
        rate_hz = float(inputs.dataset.frame_rate_hz[chosen[middle]])
        return TrackingErrors(
            varied=np.array(varied),
            particles=np.array([c.particles for c in wanted]),
            noise_mm=np.array([c.noise_mm for c in wanted]),
            occluded=np.array([c.occluded for c in wanted]),
            leave_out=np.array([way.value for way in ways]),
            methods=np.array(METHODS),
            tracked=chosen,
            error_mm=stacked("errors"),
            aspace_error_mm=np.array([f.aspace_error for f in found]).reshape(grid),
            lost_fraction=stacked("lost"),
            pruned_fraction=stacked("pruned"),
            effective_sample_size=stacked("size"),
            shown=chosen[[middle]],
            shown_particles=shown.particles,
            shown_noise_mm=shown.noise_mm,
            shown_occluded=shown.occluded,
            shown_true=true,
            shown_joints=picked.joints,
            shown_image=camera.upright_mm(picked.image),
            shown_time_s=np.arange(len(picked.image)) / rate_hz,
            shown_error_mm=np.stack([joint_error(j, true) for j in picked.joints]),
            remarks=remarks,
        )
