"""Experiment 1: every walker reconstructed from every known view by the model that has not seen it.

Section 4.2 of both papers.  Folds, view angles and sigma² are axes of arrays here; folds run in processes.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pipeline.core import errors, linear_model
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import (
    PUBLISHED,
    Method,
    Null,
)
from pipeline.studies.walks.nested import nested_choice
from pipeline.studies.walks.other_sources import other_source_errors
from pipeline.studies.walks.seen_walker import Reconstruction, SeenWalker
from pipeline.validation import Distinct, Finite, Positive


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


OF_WALKERS = ("missing_variance_mm2", "own_coefficients_beyond", "own_far_beyond")
"""Of a walker, whatever the method."""


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


@dataclass(kw_only=True)
class KnownView(Sweep):
    """Reconstruction at a known view angle."""

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")
    sigma2_mm2: Swept = scaled(start=1, stop=625, step="sigma2_step_mm2")
    methods: Distinct[Method] = field(default_factory=lambda: list(PUBLISHED))
    noise_variance_mm2: Positive = 70.0
    truth: Truth = Truth.motion
    missing_variance: MissingVariance = MissingVariance.temporal
    demonstration_views_deg: Distinct[Finite] = field(default_factory=lambda: [0.0, 30.0, 90.0])

    def measure(self, inputs: SweepInputs[object, FourierSamples, Eigenwalkers]) -> KnownViewErrors:
        """Return what both approaches reconstruct from every view, and how far it is off."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        sigma2 = self.sigma2_mm2.values("sweep.sigma2_mm2")
        data, model, options = inputs.dataset, inputs.model, inputs.model_options
        view, nulls = np.radians(view_deg), Null.beside(self.methods)
        third = AnatomicalApproach(data) if Method.anatomical in self.methods else None
        folds = map_processes(
            lambda r: self._errors(inputs, r, third), range(len(model.samples)), inputs.workers
        )
        # Those of a walker come first, those of a method before them.
        found = {
            name: np.stack([fold[name] for fold in folds], axis=int(name not in OF_WALKERS))
            for name in folds[0]
            if name != "path"
        }
        variance = found["missing_variance_mm2"][..., None]
        paths = [fold["path"] for fold in folds if "path" in fold]
        untried = np.empty((0, len(sigma2)))
        return KnownViewErrors(
            methods=np.array([method.value for method in self.methods]),
            nulls=np.array([null.value for null in nulls]),
            view_angle_deg=view_deg,
            sigma2_mm2=sigma2,
            **found,
            relative_error=errors.relative_error(found["absolute_error_mm2"], variance),
            null_relative_error=errors.relative_error(found["null_error_mm2"], variance),
            demonstration_view_deg=np.array(self.demonstration_views_deg),
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
        )

    def _errors(
        self,
        inputs: SweepInputs[object, FourierSamples, Eigenwalkers],
        r: int,
        third: AnatomicalApproach | None,
    ) -> dict[str, np.ndarray]:
        """Return what `KnownViewErrors` holds of one walker, and the error of MAP (A, S) for every sigma²."""
        data, model, of_motion = inputs.dataset, inputs.model, self.truth is Truth.motion
        fold = model.fold(r)
        views = [
            np.radians(angles)
            for angles in (self.view_angle_deg.values("sweep.view_angle_deg"), self.demonstration_views_deg)
        ]
        everywhere, demonstration = (SeenWalker(fold, model.samples[r], data, r, view) for view in views)
        power, shown_power = (s.residual_power * of_motion for s in (everywhere, demonstration))
        limit = linear_model.largest_coefficients(fold, model.samples[data.person != data.person[r]])
        single = linear_model.truncated(fold, 1)
        found: dict[str, list[np.ndarray]] = defaultdict(list)

        def keep(here: Reconstruction, there: Reconstruction, prefix: str, error: str) -> None:
            found[error].append(errors.absolute_error(here.delta, power))
            found[f"{prefix}demonstration_error_mm2"].append(errors.absolute_error(there.delta, shown_power))
            found[f"{prefix}missing"].append(there.missing)

        for method in self.methods:
            noise = method.noise_variance(self.noise_variance_mm2)
            if method is Method.anatomical and third:
                here, there = (third.reconstruct(r, angles, fold) for angles in views)
            else:
                here, there = everywhere.reconstruct(noise), demonstration.reconstruct(noise)
            keep(here, there, "", "absolute_error_mm2")
            over = np.abs(here.coefficients) / limit
            found["coefficients_beyond"].append((over > 1).mean())
            found["views_far_beyond"].append((over > 2).any(axis=1).mean())
        for null in Null.beside(self.methods):
            here, there = (
                s.average_walker()
                if null is Null.average_walker
                else s.given(single).reconstruct(null.noise_variance(self.noise_variance_mm2))
                for s in (everywhere, demonstration)
            )
            keep(here, there, "null_", "null_error_mm2")
        own = linear_model.coefficients(fold, model.samples[r : r + 1], measured=~data.unmeasured[r])
        own = np.abs(own[0]) / limit
        of_walker: dict[str, np.ndarray] = {
            "own_coefficients_beyond": np.asarray((own > 1).mean()),
            "own_far_beyond": np.asarray((own > 2).any(), dtype=float),
            "missing_variance_mm2": everywhere.missing_variance(
                data.temporal_covariance[r], data.coefficients[r, 0], self.missing_variance.value, of_motion
            ),
        }
        if Method.map in self.methods:
            path = everywhere.error_path(self.sigma2_mm2.values("sweep.sigma2_mm2"))
            of_walker["path"] = path + errors.walker_error(power)[:, None]
        return {**{name: np.stack(arrays) for name, arrays in found.items()}, **of_walker}
