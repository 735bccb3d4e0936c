"""Errors of joint angles, degrees, of every walker from every known view over one cycle: zhang2007 4.2.

The comparison uses the periodic Fourier part of the walk; the rest is part of the errors of `known_view`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pandas as pd

from pipeline.clips.kinds import Walks
from pipeline.core import camera, fourier
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import AVERAGE_WALKER, PUBLISHED, Methods
from pipeline.validation import Positive, bounded
from walk3d.anatomy.joint_angles import JOINT_ANGLES, angle_errors, flexion, joints_of


@dataclass(frozen=True)
class JointAngleErrors:
    """Errors of the joint angles of reconstructed walks by view, and the joint angles of one walker for display.

    Attributes
    ----------
    rows : DataFrame
        Root mean square errors over a cycle by walker, method, angle and view, with and without the constant offset;
        mean of left and right.  Angles with an unmeasured joint have no row.
    methods : (M,) text
        Methods of the sweep; the last one combines the image with the average walker's depth.
    shown : (1,) int
        Number of the walker with the median error.
    shown_angle_rad : (M + 1, T, 4, 2)
        Angles over a cycle; the first are the true ones.
    shown_joints_mm : (M + 1, T, 15, 3)
        Joints, reconstructed from the frontal view; the first are the true ones.
    stride_hz : float
        Stride frequency of the displayed walker.
    """

    rows: pd.DataFrame
    methods: np.ndarray
    shown: np.ndarray
    shown_angle_rad: np.ndarray
    shown_joints_mm: np.ndarray
    stride_hz: float


class JointAngles(Sweep):
    """Joint angles of walks that are reconstructed at a known view angle."""

    view_angle_deg: Swept = scaled(start=-90, stop=90, step={"full": 6, "smoke": 90})  # true views
    methods: Methods = [*PUBLISHED, "anatomical"]  # methods to compare
    noise_variance_mm2: Positive = 70.0  # sigma² of approach II
    instants: Annotated[int, bounded(at_least=5, at_most=1000)] = (
        40  # instants of a cycle: twenty times the highest harmonic
    )

    def of_populations(self) -> JointAngles:
        """Return a copy of the sweep with only the methods that the papers describe."""
        published = [name for name in self.methods if name in PUBLISHED]
        return replace(self, methods=published or self.methods)

    def with_methods(self, names: Sequence[str]) -> JointAngles:
        """Return a copy of the sweep that also includes the named methods."""
        return replace(self, methods=list(dict.fromkeys([*self.methods, *names])))

    def modules(self) -> list[str]:
        """Return the modules that implement the methods of the sweep."""
        return methods.modules(self.methods)

    def measure(self, inputs: SweepInputs[Walks, FourierSamples, Eigenwalkers]) -> JointAngleErrors:
        """Return the errors of joint angles from every view."""
        data, model = inputs.dataset, inputs.model
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        times = np.arange(self.instants) / self.instants
        design = fourier.design(1.0, times, (data.coefficients.shape[1] - 1) // 2)
        compared = [*methods.chosen(self.methods), AVERAGE_WALKER]
        prepared = {method.name: method.prepared(data) for method in compared}

        def motions(r: int, angles_deg: np.ndarray) -> np.ndarray:
            """Return the reconstructed joints (M, A, T, 15, 3) of a walker: M methods, A views, T instants."""
            view = np.radians(angles_deg)
            fold, walk = methods.held_out(data, model, r, self.noise_variance_mm2)
            missing = np.stack(
                [
                    each.apply(replace(fold, prepared=prepared[each.name]), walk, view).missing
                    for each in compared
                ]
            )
            turned = view[:, None, None]
            series = camera.combine(camera.project(data.coefficients[r], turned), missing, turned)
            return np.einsum("tk,mvkjs->mvtjs", design, series, optimize=True)

        def true(r: int) -> np.ndarray:
            return fourier.synthesise(data.coefficients[r], 1.0, times)

        names = [*self.methods, AVERAGE_WALKER.name]
        measured = np.stack(
            [~data.unmeasured[:, list(joints_of(a))].any(axis=1) for a in JOINT_ANGLES], axis=1
        )

        def walker_rows(r: int) -> pd.DataFrame:
            true_angles = np.moveaxis(flexion(true(r)), 0, -1)
            estimates = np.moveaxis(flexion(motions(r, view_deg)), 2, -1)
            error, offset_free = (
                np.degrees(e.mean(axis=-1)) for e in angle_errors(estimates, true_angles)
            )  # (M, A, 4)
            some = np.ix_(np.arange(len(names)), np.arange(len(view_deg)), np.flatnonzero(measured[r]))
            m, a, k = (axis.swapaxes(1, 2).ravel() for axis in np.broadcast_arrays(*some))
            return pd.DataFrame(
                {
                    "method": np.array(names)[m],
                    "angle": np.array(list(JOINT_ANGLES))[k],
                    "person": data.person[r],
                    "walker": data.clip[r],
                    "view_angle_deg": view_deg[a],
                    "rmse_deg": error[m, a, k],
                    "offset_free_rmse_deg": offset_free[m, a, k],
                }
            )

        rows = pd.concat(
            map_processes(walker_rows, range(len(data.coefficients)), inputs.workers), ignore_index=True
        )
        complete = np.flatnonzero(measured.all(axis=1))
        candidates = complete if len(complete) else np.arange(len(measured))
        off = (
            rows[rows["method"] == names[0]]
            .groupby("walker")["rmse_deg"]
            .mean()[data.clip[candidates]]
            .to_numpy()
        )
        typical = candidates[np.argsort(off, kind="stable")[len(off) // 2]]
        joints = np.concatenate([true(typical)[None], motions(typical, np.zeros(1))[:, 0]])
        return JointAngleErrors(
            rows=rows,
            methods=np.array(names),
            shown=np.array([typical]),
            shown_angle_rad=flexion(joints),
            shown_joints_mm=joints,
            stride_hz=data.frequency_hz[typical],
        )
