"""Joint angles of every walker reconstructed from every known view, over one cycle: zhang2007 4.2, read in degrees.

What is compared is the Fourier part of the walk, which is periodic; what two harmonics leave of it is in the errors
of `known_view`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import camera, fourier
from pipeline.core.joint_angles import JOINT_ANGLES, angle_errors, flexion, joints_of
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import PUBLISHED, Method, Null
from pipeline.studies.walks.seen_walker import SeenWalker
from pipeline.validation import Distinct, Positive, bounded


@dataclass(frozen=True)
class JointAngleErrors:
    """How far joint angles of reconstructed walks are off, by view, and the angles of one walker to look at.

    Attributes
    ----------
    methods : (M,) text
        Those of the sweep, and last the average walker's depth with the image kept.
    view_angle_deg : (A,)
    error_rad, offset_free_rad : (M, R, A, 4)
        Root mean square over a cycle, as `JOINT_ANGLES`, mean of left and right; the second without the constant offset
        of each angle.
    measured : (R, 4) bool
        Whether all joints of the angle were measured.
    shown : (1,) int
        Walker of median error.
    shown_angle_rad : (M + 1, T, 4, 2)
        Over a cycle, the walker's own first.
    shown_joints_mm : (M + 1, T, 15, 3)
        From the front.
    stride_hz : float
        Of the walker shown.
    """

    methods: np.ndarray
    view_angle_deg: np.ndarray
    error_rad: np.ndarray
    offset_free_rad: np.ndarray
    measured: np.ndarray
    shown: np.ndarray
    shown_angle_rad: np.ndarray
    shown_joints_mm: np.ndarray
    stride_hz: float


@dataclass(kw_only=True)
class JointAngles(Sweep):
    """Joint angles of reconstructions at a known view angle."""

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="structure_step_deg")
    methods: Distinct[Method] = field(default_factory=lambda: list(Method))
    noise_variance_mm2: Positive = 70.0
    instants: Annotated[int, bounded(at_least=5)] = 40  # of a cycle: twenty times the highest harmonic

    def of_populations(self) -> JointAngles:
        """Return the sweep of the papers' approaches alone."""
        methods = [method for method in self.methods if method in PUBLISHED]
        return replace(self, methods=methods or self.methods)

    def measure(self, inputs: SweepInputs[Walks, FourierSamples, Eigenwalkers]) -> JointAngleErrors:
        """Return how far joint angles are off from every view."""
        data, model = inputs.dataset, inputs.model
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        times = np.arange(self.instants) / self.instants
        design = fourier.design(1.0, times, (data.coefficients.shape[1] - 1) // 2)
        third = AnatomicalApproach(data) if Method.anatomical in self.methods else None

        def motions(r: int, angles_deg: np.ndarray) -> np.ndarray:
            """Reconstructed joints (M, A, T, 15, 3) of a walker."""
            view = np.radians(angles_deg)
            source = SeenWalker(model.fold(r), model.samples[r], data, r, view)
            found = [
                third.missing(third.fold(r), r, view)
                if method is Method.anatomical and third
                else source.reconstruct(method.noise_variance(self.noise_variance_mm2)).missing
                for method in self.methods
            ]
            missing = np.stack([*found, source.average_walker().missing])
            turned = view[:, None, None]
            across = camera.horizontal(data.coefficients[r], turned)
            height = np.broadcast_to(camera.vertical(data.coefficients[r]), across.shape)
            seen = np.broadcast_to(np.stack([across, height], axis=-1), (*missing.shape, 2))
            series = camera.combine(seen, missing, turned)
            return np.asarray(np.einsum("tk,mvkjs->mvtjs", design, series, optimize=True))

        def true(r: int) -> np.ndarray:
            return fourier.synthesise(data.coefficients[r], 1.0, times)

        def one(r: int) -> tuple[np.ndarray, np.ndarray]:
            own = np.moveaxis(flexion(true(r)), 0, -1)
            found = np.moveaxis(flexion(motions(r, view_deg)), 2, -1)
            return tuple(e.mean(axis=-1) for e in angle_errors(found, own))

        walkers = range(len(data.coefficients))
        error, offset_free = (
            np.stack(each, axis=1) for each in zip(*map_processes(one, walkers, inputs.workers), strict=True)
        )
        measured = np.stack(
            [~data.unmeasured[:, list(joints_of(angle))].any(axis=1) for angle in JOINT_ANGLES], axis=1
        )
        error, offset_free = (np.where(measured[:, None], e, np.nan) for e in (error, offset_free))
        whole = np.flatnonzero(measured.all(axis=1))
        chosen = whole if len(whole) else np.arange(len(measured))
        off = error[0, chosen].mean(axis=(1, 2))
        shown = int(chosen[np.argsort(off, kind="stable")[len(off) // 2]])
        joints = np.concatenate([true(shown)[None], motions(shown, np.zeros(1))[:, 0]])
        return JointAngleErrors(
            methods=np.array([*(method.value for method in self.methods), Null.average_walker.value]),
            view_angle_deg=view_deg,
            error_rad=error,
            offset_free_rad=offset_free,
            measured=measured,
            shown=np.array([shown]),
            shown_angle_rad=flexion(joints),
            shown_joints_mm=joints,
            stride_hz=float(data.frequency_hz[shown]),
        )
