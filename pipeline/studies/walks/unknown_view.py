"""Experiment 2: estimation of the view angle of every walker, by a model learnt without the walker.

zhang2007 4.5, 4.6, zhang2004 14.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.clips.options import Data
from pipeline.core import linear_model, statistics, viewpoint
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled, stacked
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import (
    AVERAGE_WALKER,
    MAP,
    PUBLISHED,
    Fold,
    Method,
    Methods,
    Walk,
    middles_of_strips,
)
from pipeline.validation import InvalidInput, Positive

Solver = StrEnum("Solver", {"global": "global", "published": "published"})
Solver.__doc__ = """Search for the view angle: over the whole range, or as in appendix B."""


RANDOM_VIEW = "random_view"
"""Name of the baseline that ignores the image and draws a random view angle for each walker and true view."""


WHOLE_CIRCLE_DEG = [-180.0, 180.0]
IMAGE_IGNORED_MM2 = 1e15
"""Noise variance, mm², so large that approach II ignores the image and returns the average walker."""


@dataclass(frozen=True)
class ViewAngles:
    """View angles that both approaches and the baselines estimate, with the costs of the estimates.

    Attributes
    ----------
    rows : DataFrame
        A row for each walker, method or baseline, and true view: estimate minus truth, cost of the fit, and cost of the
        best fit at another local minimum.  The anatomical method has 1 and the factor by which the angle is likelier
        than the next mode; a random view has no costs.
    published : DataFrame
        The same for the solver of appendix B at some views; no rows if it is not used.
    methods : (M,) text
    failure_deg : float
        Error above which an estimate is a failure.
    remarks : list of str
    """

    rows: pd.DataFrame
    published: pd.DataFrame
    methods: np.ndarray
    failure_deg: float
    remarks: list[str]


class UnknownView(Sweep):
    """Options of the estimation of the view angle together with the motion."""

    draws_random_numbers = True

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")  # true views
    methods: Methods = list(PUBLISHED)  # methods to compare
    noise_variance_mm2: Positive = 70.0  # sigma² of approach II
    solver: Solver = Solver["global"]
    angle_range_deg: list[float] = WHOLE_CIRCLE_DEG  # range of the search
    published_views_deg: list[float] = [  # views at which the solver of appendix B is used as well
        -90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0,
    ]  # fmt: skip
    failure_deg: Positive = 30.0  # error above which an estimate is a failure

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        if len(self.angle_range_deg) != 2:
            raise InvalidInput(
                "must be [low, high]",
                "sweep.angle_range_deg",
                received=self.angle_range_deg,
                code="not_a_range",
            )
        for method in methods.chosen(self.methods):
            if method.name in PUBLISHED:
                continue
            if method.estimate is None:
                raise InvalidInput(
                    f"the method {method.name} needs a known view, but this sweep estimates the view",
                    "sweep.methods",
                    "a method with a function `estimate`",
                    code="needs_known_view",
                    method=method.name,
                )
            if self.angle_range_deg != WHOLE_CIRCLE_DEG:
                raise InvalidInput(
                    f"the method {method.name} always searches the whole circle",
                    "sweep.angle_range_deg",
                    WHOLE_CIRCLE_DEG,
                    self.angle_range_deg,
                    code="whole_circle_only",
                    typed=True,
                )

    def with_methods(self, names: Sequence[str]) -> UnknownView:
        """Return a copy of the sweep that also compares those of the named methods that estimate a view angle."""
        able = [each.name for each in methods.chosen(names) if each.estimate]
        return replace(self, methods=list(dict.fromkeys([*self.methods, *able])))

    def modules(self) -> list[str]:
        """Return the names of the modules that implement the selected methods."""
        return methods.modules(self.methods)

    def further_files(self, data: Data) -> dict[str, Path]:
        """Return the data files that the selected methods read."""
        return methods.files(self.methods)

    def of_populations(self) -> UnknownView:
        """Return a copy of the sweep with fewer view angles, and without the solver of the paper's appendix B.

        Fewer views limit the size of its tables, which have a row for every walker and view.
        """
        return replace(self, view_angle_deg=middles_of_strips(self.view_angle_deg), published_views_deg=[])

    def measure(self, inputs: SweepInputs[object, FourierSamples, Eigenwalkers]) -> ViewAngles:
        """Return the view angles that all methods estimate, with the costs of the estimates."""
        data, model = inputs.dataset, inputs.model
        compared = methods.with_baselines(methods.chosen(self.methods))
        prepared = {method.name: method.prepared(data) for method in compared}
        views = (
            self.view_angle_deg.values("sweep.view_angle_deg"),
            np.array(self.published_views_deg, float),
        )
        walkers, generator = range(len(model.samples)), inputs.generator("random view")
        drawn = [generator.uniform(-180.0, 180.0, (len(walkers), len(view_deg))) for view_deg in views]

        def rows_of_walker(r: int) -> list[list[dict[str, Any]]]:
            fold, walk = methods.held_out(data, model, r, self.noise_variance_mm2)
            folds = {name: replace(fold, prepared=shared) for name, shared in prepared.items()}

            rows_by_solver = []
            for view_deg, at_random, solver in zip(
                views, drawn, (self.solver, Solver["published"]), strict=True
            ):
                estimates = [
                    (method, self._estimate(method, folds[method.name], walk, np.radians(view_deg), solver))
                    for method in compared
                    if len(view_deg) and not (view_deg is views[1] and method.estimate)
                ]
                rows = [
                    {
                        "method": method.name,
                        "angle_deg": np.degrees(each.angle_rad),
                        "cost": each.cost,
                        "runner_up_cost": each.runner_up_cost,
                        "converged": each.converged,
                    }
                    for method, each in estimates
                ]
                unknown = {"cost": np.nan, "runner_up_cost": np.nan, "converged": True}
                rows.append({"method": RANDOM_VIEW, "angle_deg": at_random[r], **unknown})
                labels = {"person": data.person[r], "walker": data.clip[r], "view_angle_deg": view_deg}
                rows_by_solver.append([{**labels, **row} for row in rows])
            return rows_by_solver

        of_walkers = zip(*map_processes(rows_of_walker, walkers, inputs.workers), strict=True)
        rows, published = (stacked([row for walker in each for row in walker]) for each in of_walkers)
        for frame in (rows, published):
            off = statistics.angle_difference_deg(frame.pop("angle_deg"), frame["view_angle_deg"])
            frame["error_deg"] = off
            frame["failed"] = (np.abs(off) > self.failure_deg).astype(int)
        unconverged = (~rows["converged"]).sum()
        return ViewAngles(
            rows=rows,
            published=published,
            methods=np.array(self.methods, str),
            failure_deg=self.failure_deg,
            remarks=[f"{unconverged} view angles did not converge"] if unconverged else [],
        )

    def _estimate(
        self, method: Method, fold: Fold, walk: Walk, views: np.ndarray, solver: Solver
    ) -> viewpoint.ViewEstimate:
        """Return the view angle that fits each image best [zhang2007 4.5] [zhang2004 14].

        A plug-in uses a search of its own.
        """
        if method.estimate:
            estimate: viewpoint.ViewEstimate = method.estimate(fold, walk, views)
            return estimate
        if method.name not in PUBLISHED:
            fold = fold.with_one_eigenwalker
        noise = {
            AVERAGE_WALKER.name: IMAGE_IGNORED_MM2,
            MAP.name: fold.noise_variance_mm2,
            MAP.baseline: fold.noise_variance_mm2,
        }.get(method.name)
        observed = walk.observed(views).reshape(len(views), -1)
        if (
            walk.sample.size > 3 * observed.shape[1] // 2
        ):  # the frequency of zhang2004, which every view shows
            observed = np.column_stack([observed, np.full(len(views), walk.sample[-1])])
        low, high = np.radians(self.angle_range_deg)
        return viewpoint.estimate(
            linear_model.of_measured(fold.model, walk.measured),
            observed,
            method="least_squares" if noise is None else "map",
            noise_variance=noise,
            solver=solver.value,
            angle_range_rad=(float(low), float(high)),
        )
