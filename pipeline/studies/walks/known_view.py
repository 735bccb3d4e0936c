"""Experiment 1: reconstruction of every walker from known views, with a model learnt from other people.

Section 4.2 of both papers.  Folds, view angles and sigma² are axes of arrays; folds run in parallel processes.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from pipeline.clips.options import Data
from pipeline.core import errors, linear_model, reconstruction
from pipeline.processes import map_processes
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled, stacked
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import AVERAGE_WALKER, MAP, PUBLISHED, Fold, Method, Methods, Walk
from pipeline.studies.walks.nested import nested_choice
from pipeline.validation import Distinct, Finite, Positive

Inputs = SweepInputs[object, FourierSamples, Eigenwalkers]
BLOCKS = 250
"""Largest number of blocks into which the walkers are divided for parallel computation.

The result of a block, its summed errors at every view and sigma², has a size of one megabyte.
"""


class Truth(StrEnum):
    """Ground truth with which reconstructions are compared."""

    motion = "motion"
    """Recorded motion, including the residual of the fit by two harmonics."""
    fourier = "fourier"


class MissingVariance(StrEnum):
    """Variance by which absolute errors are divided to obtain relative errors."""

    temporal = "temporal"
    """Variance over time of each joint, averaged over the joints."""
    overall = "overall"
    """Variance of all joints at all instants about their common mean."""


@dataclass(frozen=True)
class MapErrors:
    """Errors of approach II (MAP) for every noise variance sigma².

    Attributes
    ----------
    walker_mm2 : (R, S)
        Error of each walker, mean over views; no columns without MAP.
    view_mm2 : (A, S)
        Error at each view, mean over walkers.
    nested : (R,) or (0,) int
        Index of the sigma² that other people choose for each walker, with models without that walker; empty if people
        are too few.
    """

    walker_mm2: np.ndarray
    view_mm2: np.ndarray
    nested: np.ndarray


@dataclass(frozen=True)
class KnownViewErrors:
    """Errors of the two approaches and of baselines from every view, with the reconstructions from some views.

    Attributes
    ----------
    rows, joints, demonstrations : DataFrame
        Errors of each walker by method or baseline, and by view (`rows`), joint (`joints`: mean over views, NaN if the
        joint was not measured) and demonstration view (`demonstrations`).
    coefficients : DataFrame
        A row for each walker and method: share of coefficients, over views and eigenwalkers, that exceed the largest of
        training; share of views with a coefficient above twice the largest; both again for the full 3D walk.
    person : (R,) text
    map_errors : MapErrors
    methods : (M,) text
    view_angle_deg : (A,)
    sigma2_mm2 : (S,)
    demonstration_view_deg : (V,)
    missing : (M, R, V, 1 + 2H, 15)
        Fourier coefficients of the missing dimension at the demonstration views, at phase zero.
    average_walker : (R, V, 1 + 2H, 15)
        The same for the average walker.
    unmeasured : (R, 15) bool
        Joints that are estimated or dropped; they have no errors.
    original : (R, 1 + 2H, 15, 3)
        Fourier representations of the walks that the demonstrations reconstruct.
    stride_hz : (R,)
        Fundamental frequencies of the walks.
    """

    rows: pd.DataFrame
    joints: pd.DataFrame
    demonstrations: pd.DataFrame
    coefficients: pd.DataFrame
    person: np.ndarray
    map_errors: MapErrors
    methods: np.ndarray
    view_angle_deg: np.ndarray
    sigma2_mm2: np.ndarray
    demonstration_view_deg: np.ndarray
    missing: np.ndarray
    average_walker: np.ndarray
    unmeasured: np.ndarray
    original: np.ndarray
    stride_hz: np.ndarray

    def sigma2(self, walker: Sequence[str]) -> pd.DataFrame:
        """Return a table of the error of approach II, averaged over views, for each walker and sigma²."""
        walkers, values = self.map_errors.walker_mm2.shape
        return pd.DataFrame(
            {
                "person": np.repeat(self.person, values),
                "walker": np.repeat(np.asarray(walker), values),
                "method": MAP.name,
                "sigma2_mm2": np.tile(self.sigma2_mm2, walkers)[: walkers * values],
                "absolute_error_mm2": self.map_errors.walker_mm2.ravel(),
            }
        )

    def chosen(self, walker: Sequence[str]) -> pd.DataFrame:
        """Return the errors of approach II with the sigma² that is best for other people, for each walker."""
        nested = self.map_errors.nested
        return self.sigma2(walker).iloc[np.arange(len(nested)) * len(self.sigma2_mm2) + nested]


class _WalkErrors:
    """Errors of the reconstructions of one walk from A known views.

    Joints that were not measured are neither observed nor compared: errors that contain them are NaN.

    Parameters
    ----------
    data : FourierSamples
    walk : Walk
    view : (A,)
        View angles, rad.
    """

    def __init__(self, data: FourierSamples, walk: Walk, view: np.ndarray) -> None:
        self._walk, self._view, self._residual = walk, view, data.residual_covariance[walk.number]
        along = errors.along_missing(self._residual, view)
        self.residual_power = np.where(walk.measured, along, np.nan)

    def missing_variance(
        self, temporal: np.ndarray, average: np.ndarray, kind: str, of_motion: bool
    ) -> np.ndarray:
        """Variance (A,), mm², of the missing dimension of measured joints, for the motion or its Fourier part."""
        covariance, measured = temporal if of_motion else temporal - self._residual, self._walk.measured
        return errors.missing_variance(covariance[measured], average[measured], self._view, kind=kind)

    def error_path(self, fold: Fold, noise_variances: np.ndarray) -> np.ndarray:
        """Error E_a of approach II for every view and sigma² (A, S), mm², averaged over measured joints.

        The residual of the Fourier series is not included.
        """
        measured = self._walk.measured
        model = linear_model.of_measured(fold.model, measured)
        path = reconstruction.NoisePath(model, self._view, noise_variances).error(self._walk.sample)
        return path * (len(measured) / measured.sum())


class KnownView(Sweep):
    """Options of the reconstruction from known views."""

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")  # true views
    sigma2_mm2: Swept = scaled(start=1, stop=625, step="sigma2_step_mm2")  # noise variances of approach II
    methods: Methods = list(PUBLISHED)  # methods to compare
    noise_variance_mm2: Positive = 70.0  # sigma² of approach II
    truth: Truth = Truth.motion
    missing_variance: MissingVariance = MissingVariance.temporal
    demonstration_views_deg: Distinct[Finite] = [0.0, 30.0, 90.0]  # views whose reconstructions are stored

    with_paths: ClassVar[bool] = True
    """True if the sweep measures the errors of approach II for every sigma², too."""

    def population_parts(self) -> list[Sweep]:
        """Return two sweeps: one without the errors of approach II for every sigma², and one for these errors only."""
        paths = _Paths(view_angle_deg=self.view_angle_deg, sigma2_mm2=self.sigma2_mm2, truth=self.truth)
        return [_WithoutPaths(**vars(self)), paths]

    def joined(self, parts: Sequence[Any]) -> KnownViewErrors:
        """Return the errors of both sweeps as one result; the errors for every sigma² may be absent."""
        errors_by_view: KnownViewErrors = parts[0]
        return replace(errors_by_view, map_errors=parts[1]) if len(parts) > 1 else errors_by_view

    def with_methods(self, names: Sequence[str]) -> KnownView:
        """Return a copy of the sweep in which the named methods are compared too."""
        added = [method.name for method in methods.chosen(names)]
        return replace(self, methods=list(dict.fromkeys([*self.methods, *added])))

    def modules(self) -> list[str]:
        """Return the names of the modules that implement the selected methods."""
        return methods.modules(self.methods)

    def further_files(self, data: Data) -> dict[str, Path]:
        """Return the data files that the selected methods read."""
        return methods.files(self.methods)

    def measure(self, inputs: Inputs) -> KnownViewErrors:
        """Return the errors of all methods from every view, and reconstructions from the demonstration views."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        sigma2 = self.sigma2_mm2.values("sweep.sigma2_mm2")
        data, options = inputs.dataset, inputs.model_options
        compared = methods.chosen(self.methods)
        prepared = {method.name: method.prepared(data) for method in compared}
        count = len(inputs.model.samples)
        parts: dict[str, list[dict[str, Any]]] = defaultdict(list)
        missing, average, of_walkers = [], [], []
        total: np.ndarray = np.zeros((1, 1))

        def block(walkers: range) -> list[Any]:
            """Return the results for a block of walkers, each with the model learnt from other people.

            The errors for every sigma² are averaged over views for each walker and summed over walkers for each view.
            """
            folds = [self._fold(inputs, r, compared, prepared, (view_deg, sigma2)) for r in walkers]
            *others, paths = zip(*folds, strict=True)
            return [*others, [path.mean(axis=0) for path in paths], sum(paths)]

        for frames, depths, mean, of_walker, path in map_processes(block, _blocks(count), inputs.workers):
            for of_frames in frames:
                for name, rows in of_frames.items():
                    parts[name] += rows
            missing += depths
            average += mean
            of_walkers += of_walker
            total = total + path  # (A, S); S is 0 without MAP
        nested = np.empty(0, int)
        if total.shape[1]:
            nested = nested_choice(data, options, np.radians(view_deg), sigma2, inputs.workers)
        return KnownViewErrors(
            **{name: stacked(rows) for name, rows in parts.items()},
            person=data.person,
            map_errors=MapErrors(
                walker_mm2=np.stack(of_walkers),
                view_mm2=total / count,
                nested=nested,
            ),
            methods=np.array(self.methods, str),
            view_angle_deg=view_deg,
            sigma2_mm2=sigma2,
            demonstration_view_deg=np.array(self.demonstration_views_deg),
            missing=np.stack(missing, axis=1),
            average_walker=np.stack(average),
            unmeasured=data.unmeasured,
            original=data.coefficients,
            stride_hz=data.frequency_hz,
        )

    def _fold(
        self,
        inputs: Inputs,
        r: int,
        compared: Sequence[Method],
        prepared: Mapping[str, Any],
        grids: tuple[np.ndarray, np.ndarray],
    ) -> tuple[dict[str, list[dict[str, Any]]], np.ndarray, np.ndarray, np.ndarray]:
        """Return the results for one walker: table rows, reconstructed depths, average walker and errors by sigma²."""
        data, model, of_motion = inputs.dataset, inputs.model, self.truth is Truth.motion
        view_deg, sigma2 = grids
        fold, walk = methods.held_out(data, model, r, self.noise_variance_mm2)
        views = [np.radians(angles) for angles in (view_deg, self.demonstration_views_deg)]
        everywhere, demonstration = (_WalkErrors(data, walk, view) for view in views)
        power, demonstration_power = (s.residual_power * of_motion for s in (everywhere, demonstration))
        variance = everywhere.missing_variance(
            data.temporal_covariance[r], data.coefficients[r, 0], self.missing_variance.value, of_motion
        )
        limit = linear_model.largest_coefficients(fold.model, model.samples[data.person != data.person[r]])
        reference = linear_model.coefficients(fold.model, model.samples[r : r + 1], measured=walk.measured)
        reference = np.abs(reference[0]) / limit
        walker = {"person": data.person[r], "walker": data.clip[r]}
        rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
        missing: dict[str, np.ndarray] = {}
        for method in sorted(
            methods.with_baselines(compared), key=lambda each: each.name
        ):  # in the order of the tables
            prepared_fold = replace(fold, prepared=prepared.get(method.name))
            reconstruction, demonstrated = (method.apply(prepared_fold, walk, angles) for angles in views)
            missing[method.name] = demonstrated.missing
            of_joints = errors.absolute_error(reconstruction.delta, power)
            absolute = errors.walker_error(of_joints)
            relative = errors.relative_error(of_joints, variance[:, None])
            demonstration_error = errors.walker_error(
                errors.absolute_error(demonstrated.delta, demonstration_power)
            )
            measured: dict[str, dict[str, Any]] = {
                "rows": {
                    "view_angle_deg": view_deg,
                    "absolute_error_mm2": absolute,
                    "rms_error_mm": np.sqrt(absolute),
                    "relative_error": errors.walker_error(relative),
                    "missing_variance_mm2": variance,
                },
                "joints": {"joint": WALKER15.joints, "absolute_error_mm2": of_joints.mean(axis=0)},
                "demonstrations": {
                    "view_angle_deg": self.demonstration_views_deg,
                    "rms_error_mm": np.sqrt(demonstration_error),
                },
            }
            if method in compared:
                over = np.abs(reconstruction.coefficients) / limit
                measured["coefficients"] = {
                    "coefficients_beyond": [(over > 1).mean()],
                    "own_coefficients_beyond": (reference > 1).mean(),
                    "views_far_beyond": (over > 2).any(axis=1).mean(),
                    "own_far_beyond": float((reference > 2).any()),
                }
            for name, columns in measured.items():
                rows[name].append({**walker, "method": method.name, **columns})
        path = np.empty((len(view_deg), 0))
        if MAP in compared and self.with_paths:
            path = everywhere.error_path(fold, sigma2) + errors.walker_error(power)[:, None]
        average = missing[AVERAGE_WALKER.name]
        return dict(rows), np.stack([missing[name] for name in self.methods]), average, path


class _WithoutPaths(KnownView):
    with_paths: ClassVar[bool] = False


class _Paths(Sweep):
    """Options of the sweep that measures only the errors of approach II for every sigma²."""

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")
    sigma2_mm2: Swept = scaled(start=1, stop=625, step="sigma2_step_mm2")
    truth: Truth = Truth.motion

    def measure(self, inputs: Inputs) -> MapErrors:
        """Return the errors of approach II for every walker and every sigma²."""
        view = np.radians(self.view_angle_deg.values("sweep.view_angle_deg"))
        sigma2, data = self.sigma2_mm2.values("sweep.sigma2_mm2"), inputs.dataset
        count = len(inputs.model.samples)
        means, total = [], np.zeros((1, 1))
        for walkers in _blocks(count):
            paths = []
            for r in walkers:
                fold, walk = methods.held_out(data, inputs.model, r, sigma2[0])
                everywhere = _WalkErrors(data, walk, view)
                power = everywhere.residual_power * (self.truth is Truth.motion)
                paths.append(everywhere.error_path(fold, sigma2) + errors.walker_error(power)[:, None])
            means += [path.mean(axis=0) for path in paths]
            total = total + sum(paths)
        nested = nested_choice(data, inputs.model_options, view, sigma2, inputs.workers)
        return MapErrors(np.stack(means), total / count, nested)


def _blocks(count: int) -> list[range]:
    """Return the ranges of walker indices into which the walkers are divided for parallel computation."""
    size = max(4, -(-count // BLOCKS))
    return [range(start, min(start + size, count)) for start in range(0, count, size)]
