"""Experiment 1: every walker reconstructed from every known view by the model that has not seen it.

Section 4.2 of both papers.  Folds, view angles and sigma² are axes of arrays here; folds run on threads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pipeline.clips.walks import Walks
from pipeline.core import errors
from pipeline.studies.study import Grid, Sweep, SweepInputs, scaled
from pipeline.studies.walks.dataset import FourierSamples
from pipeline.studies.walks.methods import Method, PhaseSource, validate_methods
from pipeline.studies.walks.model import Eigenwalkers
from pipeline.studies.walks.phase_sources import Motion3d, Observed2d
from pipeline.threads import map_threads
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
    view_angle_deg : (A,)
    sigma2_mm2 : (S,)
    absolute_error_mm2, relative_error : (M, R, A, 15)
    missing_variance_mm2 : (R, A)
    demonstration_view_deg : (V,)
    demonstration_error_mm2 : (M, R, V, 15)
    missing : (M, R, V, 5, 15)
        Fourier coefficients of the missing dimension at the demonstration views, at phase zero.
    path_walker_mm2, path_view_mm2 : (R, S) and (A, S)
        Error of MAP for every sigma², mean over views and mean over walkers; no rows if MAP was not tried.
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
    view_angle_deg: np.ndarray
    sigma2_mm2: np.ndarray
    absolute_error_mm2: np.ndarray
    relative_error: np.ndarray
    missing_variance_mm2: np.ndarray
    demonstration_view_deg: np.ndarray
    demonstration_error_mm2: np.ndarray
    missing: np.ndarray
    path_walker_mm2: np.ndarray
    path_view_mm2: np.ndarray
    noise_variance_mm2: float
    unmeasured: np.ndarray
    original: np.ndarray
    stride_hz: np.ndarray
    frequency_hz: np.ndarray | None = None
    phase_rad: np.ndarray | None = None
    phase_error_rad: np.ndarray | None = None


@dataclass(kw_only=True)
class KnownView(Sweep):
    """Reconstruction at a known view angle."""

    view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")
    sigma2_mm2: Grid = scaled(start=1, stop=625, step="sigma2_step_mm2")
    methods: list[Method] = field(default_factory=lambda: list(Method))
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
        validate_methods(self.methods, self.noise_variance_mm2)
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
            return Motion3d(model.fold(r), model.samples[r], data.residual_covariance[r], angles)

        def one(r: int) -> dict[str, np.ndarray]:
            everywhere, demonstration = source(r, view), source(r, shown)
            power, shown_power = (s.residual_power * of_motion for s in (everywhere, demonstration))
            absolute, demonstrated, missing, extras = [], [], [], []
            for method in self.methods:
                noise = method.noise_variance(self.noise_variance_mm2)
                delta, _, extra = everywhere.reconstruct(noise)
                absolute.append(errors.absolute_error(delta, power))
                extras.append(extra)
                delta, seen, _ = demonstration.reconstruct(noise)
                demonstrated.append(errors.absolute_error(delta, shown_power))
                missing.append(seen)
            found = {
                "absolute_error_mm2": np.stack(absolute),
                "demonstration_error_mm2": np.stack(demonstrated),
                "missing": np.stack(missing),
                "missing_variance_mm2": everywhere.missing_variance(
                    data.temporal_covariance[r],
                    data.coefficients[r, 0],
                    self.missing_variance.value,
                    of_motion,
                ),
                **{name: np.stack([extra[name] for extra in extras]) for name in extras[0]},
            }
            if isinstance(everywhere, Observed2d):
                found["frequency_hz"] = everywhere.clip.frequency_hz
            if Method.map in self.methods:
                found["path"] = everywhere.error_path(sigma2) + errors.walker_error(power)[:, None]
            return found

        folds = map_threads(one, range(len(model.samples)), inputs.workers)

        def stack(name: str, axis: int = 0) -> np.ndarray | None:
            return np.stack([found[name] for found in folds], axis=axis) if name in folds[0] else None

        absolute = np.stack([found["absolute_error_mm2"] for found in folds], axis=1)
        demonstrated = np.stack([found["demonstration_error_mm2"] for found in folds], axis=1)
        for errors_of_joints in (absolute, demonstrated):  # nothing was measured that they could be errors of
            errors_of_joints.swapaxes(2, 3)[:, data.unmeasured] = np.nan
        variance = np.stack([found["missing_variance_mm2"] for found in folds])
        paths = [found["path"] for found in folds if "path" in found]
        untried = np.empty((0, len(sigma2)))
        return KnownViewErrors(
            methods=np.array([method.value for method in self.methods]),
            view_angle_deg=view_deg,
            sigma2_mm2=sigma2,
            absolute_error_mm2=absolute,
            relative_error=errors.relative_error(absolute, variance[None, :, :, None]),
            missing_variance_mm2=variance,
            demonstration_view_deg=np.array(self.demonstration_views_deg),
            demonstration_error_mm2=demonstrated,
            missing=np.stack([found["missing"] for found in folds], axis=1),
            noise_variance_mm2=self.noise_variance_mm2,
            unmeasured=data.unmeasured,
            original=data.coefficients,
            stride_hz=data.frequency_hz,
            path_walker_mm2=np.stack([path.mean(axis=0) for path in paths]) if paths else untried,
            path_view_mm2=np.asarray(sum(paths) / len(paths)) if paths else untried,
            frequency_hz=stack("frequency_hz"),
            phase_rad=stack("phase_rad", axis=1),
            phase_error_rad=stack("phase_error_rad", axis=1),
        )
