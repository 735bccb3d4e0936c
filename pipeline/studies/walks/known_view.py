"""Experiment 1: every walker reconstructed from every known view by the model that has not seen it.

Section 4.2 of both papers.  Folds, view angles and sigma² are axes of arrays here; folds run in processes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import errors, linear_model
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Grid, Sweep, SweepInputs, scaled
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import (
    PUBLISHED,
    Method,
    Null,
    PhaseSource,
    validate_methods,
)
from pipeline.studies.walks.nested import nested_choice
from pipeline.studies.walks.other_sources import other_source_errors
from pipeline.studies.walks.phase_sources import Motion3d, Observed2d
from pipeline.validation import InvalidInput


class Truth(StrEnum):
    """What a reconstruction is compared with."""

    motion = "motion"
    """The recorded motion, what two harmonics leave of it included."""
    fourier = "fourier"


class MissingVariance(StrEnum):
    """What the relative error is relative to."""

    temporal = "temporal"
    """The variance over time of each joint, averaged over joints."""
    overall = "overall"
    """The variance of all joints and instants about their common mean."""


@dataclass(frozen=True)
class KnownViewErrors:
    """What both approaches reconstruct from every view, and how far it is off.

    Attributes
    ----------
    methods : (M,) text
    nulls : (K,) text
        Reconstructions that do next to nothing.
    view_angle_deg : (A,)
    sigma2_mm2 : (S,)
    absolute_error_mm2, relative_error : (M, R, A, 15)
    null_error_mm2, null_relative_error : (K, R, A, 15)
    missing_variance_mm2 : (R, A)
    demonstration_view_deg : (V,)
    demonstration_error_mm2 : (M, R, V, 15)
    missing : (M, R, V, 5, 15)
        Fourier coefficients of the missing dimension at the demonstration views, at phase zero.
    null_demonstration_error_mm2 : (K, R, V, 15)
    null_missing : (K, R, V, 5, 15)
    path_walker_mm2, path_view_mm2 : (R, S) and (A, S)
        Error of MAP for every sigma², mean over views and mean over walkers; no rows if MAP was not tried.
    nested : (R,) int
        Which sigma² others choose for each walker, on models without that walker; empty if MAP was not tried.
    coefficients_beyond, views_far_beyond : (M, R)
        Share of a walker's coefficients, over views and eigenwalkers, that exceed the largest of training; share of the
        views at which one exceeds it twofold.
    own_coefficients_beyond, own_far_beyond : (R,)
        The same of the coefficients of the walker seen whole.
    other_source_error_mm2 : (M + 1, R), optional
        Of each method, and of the average walker, learnt from people of other sources.
    noise_variance_mm2 : float
    unmeasured : (R, 15) bool
        Joints that are estimated or dropped; their errors are NaN.
    original : (R, 5, 15, 3)
        Fourier representations of the walks that the demonstrations reconstruct.
    stride_hz : (R,)
        Their fundamental frequencies.
    frequency_hz, phase_rad, phase_error_rad : (R, A), (M, R, A), (M, R, A), optional
        As each view gives them, with ``sweep.phase_source=observed2d``: the frequency, the phase of the first frame,
        and how far that is from the 3D motion's.
    """

    methods: np.ndarray
    nulls: np.ndarray
    view_angle_deg: np.ndarray
    sigma2_mm2: np.ndarray
    absolute_error_mm2: np.ndarray
    relative_error: np.ndarray
    null_error_mm2: np.ndarray
    null_relative_error: np.ndarray
    missing_variance_mm2: np.ndarray
    demonstration_view_deg: np.ndarray
    demonstration_error_mm2: np.ndarray
    missing: np.ndarray
    null_demonstration_error_mm2: np.ndarray
    null_missing: np.ndarray
    path_walker_mm2: np.ndarray
    path_view_mm2: np.ndarray
    nested: np.ndarray
    coefficients_beyond: np.ndarray
    views_far_beyond: np.ndarray
    own_coefficients_beyond: np.ndarray
    own_far_beyond: np.ndarray
    noise_variance_mm2: float
    unmeasured: np.ndarray
    original: np.ndarray
    stride_hz: np.ndarray
    other_source_error_mm2: np.ndarray | None = None
    frequency_hz: np.ndarray | None = None
    phase_rad: np.ndarray | None = None
    phase_error_rad: np.ndarray | None = None


@dataclass(kw_only=True)
class KnownView(Sweep):
    """Reconstruction at a known view angle."""

    view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")
    sigma2_mm2: Grid = scaled(start=1, stop=625, step="sigma2_step_mm2")
    methods: list[Method] = field(default_factory=lambda: list(PUBLISHED))
    noise_variance_mm2: float = 70.0
    phase_source: PhaseSource = PhaseSource.motion3d
    truth: Truth = Truth.motion
    missing_variance: MissingVariance = MissingVariance.temporal
    demonstration_views_deg: list[float] = field(default_factory=lambda: [0.0, 30.0, 90.0])

    @property
    def reads_clips(self) -> bool:
        """Whether the views themselves are looked at, for their phase."""
        return self.phase_source is PhaseSource.observed2d

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        validate_methods(self.methods, self.noise_variance_mm2, self.phase_source)
        self.view_angle_deg.values("sweep.view_angle_deg")
        self.sigma2_mm2.values("sweep.sigma2_mm2")
        if not self.demonstration_views_deg:
            raise InvalidInput(
                "must name one view or more, e.g. [0,30,90]",
                where="sweep.demonstration_views_deg",
                received="none",
            )

    def measure(self, inputs: SweepInputs[Walks, FourierSamples, Eigenwalkers]) -> KnownViewErrors:
        """Return what both approaches reconstruct from every view, and how far it is off."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        sigma2 = self.sigma2_mm2.values("sweep.sigma2_mm2")
        view, shown = np.radians(view_deg), np.radians(self.demonstration_views_deg)
        data, model = inputs.dataset, inputs.model
        of_motion = self.truth is Truth.motion
        observed = self.phase_source is PhaseSource.observed2d

        def source(r: int, angles: np.ndarray) -> Motion3d | Observed2d:
            if observed:
                return Observed2d(model.fold(r), inputs.clips, data, r, angles)
            return Motion3d(
                model.fold(r),
                model.samples[r],
                data.residual_covariance[r],
                angles,
                measured=~data.unmeasured[r],
            )

        nulls = Null.beside(self.methods)
        third = AnatomicalApproach(data) if Method.anatomical in self.methods else None

        def one(r: int) -> dict[str, np.ndarray]:
            everywhere, demonstration = source(r, view), source(r, shown)
            power, shown_power = (s.residual_power * of_motion for s in (everywhere, demonstration))
            fold = model.fold(r)
            training = model.samples[data.person != data.person[r]]
            limit = linear_model.largest_coefficients(fold, training)
            single = linear_model.truncated(fold, 1)
            found: dict[str, list[np.ndarray]] = {}

            def keep(**arrays: np.ndarray) -> None:
                for name, array in arrays.items():
                    found.setdefault(name, []).append(array)

            for method in self.methods:
                if method is Method.anatomical and third:
                    here, there = (third.reconstruct(r, angles, fold) for angles in (view, shown))
                else:
                    noise = method.noise_variance(self.noise_variance_mm2)
                    here, there = everywhere.reconstruct(noise), demonstration.reconstruct(noise)
                over = np.abs(here.coefficients) / limit
                keep(
                    absolute_error_mm2=errors.absolute_error(here.delta, power),
                    demonstration_error_mm2=errors.absolute_error(there.delta, shown_power),
                    missing=there.missing,
                    coefficients_beyond=(over > 1).mean(),
                    views_far_beyond=(over > 2).any(axis=1).mean(),
                    **here.phases,
                )
            for null in nulls:
                here, there = (
                    s.average_walker()
                    if null is Null.average_walker
                    else s.given(single).reconstruct(null.noise_variance(self.noise_variance_mm2))
                    for s in (everywhere, demonstration)
                )
                keep(
                    null_error_mm2=errors.absolute_error(here.delta, power),
                    null_demonstration_error_mm2=errors.absolute_error(there.delta, shown_power),
                    null_missing=there.missing,
                )
            own = linear_model.coefficients(fold, model.samples[r : r + 1], measured=~data.unmeasured[r])
            own = np.abs(own[0]) / limit
            stacked: dict[str, Any] = {name: np.stack(arrays) for name, arrays in found.items()}
            stacked |= {
                "own_coefficients_beyond": np.float64((own > 1).mean()),
                "own_far_beyond": np.float64((own > 2).any()),
                "missing_variance_mm2": everywhere.missing_variance(
                    data.temporal_covariance[r],
                    data.coefficients[r, 0],
                    self.missing_variance.value,
                    of_motion,
                ),
            }
            if isinstance(everywhere, Observed2d):
                stacked["frequency_hz"] = everywhere.clip.frequency_hz
            if Method.map in self.methods:
                stacked["path"] = everywhere.error_path(sigma2) + errors.walker_error(power)[:, None]
            return stacked

        folds = map_processes(one, range(len(model.samples)), inputs.workers)

        def stack(name: str, axis: int = 1) -> np.ndarray:
            return np.stack([found[name] for found in folds], axis=axis)

        absolute, null_error = stack("absolute_error_mm2"), stack("null_error_mm2")
        variance = stack("missing_variance_mm2", axis=0)
        paths = [found["path"] for found in folds if "path" in found]
        untried = np.empty((0, len(sigma2)))
        options = inputs.model_options
        return KnownViewErrors(
            methods=np.array([method.value for method in self.methods]),
            nulls=np.array([null.value for null in nulls]),
            view_angle_deg=view_deg,
            sigma2_mm2=sigma2,
            absolute_error_mm2=absolute,
            relative_error=errors.relative_error(absolute, variance[None, :, :, None]),
            null_error_mm2=null_error,
            null_relative_error=errors.relative_error(null_error, variance[None, :, :, None]),
            missing_variance_mm2=variance,
            demonstration_view_deg=np.array(self.demonstration_views_deg),
            demonstration_error_mm2=stack("demonstration_error_mm2"),
            missing=stack("missing"),
            null_demonstration_error_mm2=stack("null_demonstration_error_mm2"),
            null_missing=stack("null_missing"),
            coefficients_beyond=stack("coefficients_beyond"),
            views_far_beyond=stack("views_far_beyond"),
            own_coefficients_beyond=stack("own_coefficients_beyond", axis=0),
            own_far_beyond=stack("own_far_beyond", axis=0),
            other_source_error_mm2=other_source_errors(
                data, options, self.methods, self.noise_variance_mm2, view, third, inputs.workers
            ),
            noise_variance_mm2=self.noise_variance_mm2,
            unmeasured=data.unmeasured,
            original=data.coefficients,
            stride_hz=data.frequency_hz,
            path_walker_mm2=np.stack([path.mean(axis=0) for path in paths]) if paths else untried,
            path_view_mm2=np.asarray(sum(paths) / len(paths)) if paths else untried,
            nested=nested_choice(data, options, view, sigma2, inputs.workers) if paths else np.empty(0, int),
            frequency_hz=stack("frequency_hz", axis=0) if observed else None,
            phase_rad=stack("phase_rad") if observed else None,
            phase_error_rad=stack("phase_error_rad") if observed else None,
        )
