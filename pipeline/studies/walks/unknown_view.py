"""Experiment 2: the view angle of every walker estimated from every view by the model that has not seen it.

zhang2007 4.5, 4.6, zhang2004 14.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import camera, linear_model, statistics, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import PUBLISHED, Baseline, Method, middles_of_strips
from pipeline.studies.walks.stacked import stacked
from pipeline.validation import Distinct, InvalidInput, Positive

Solver = StrEnum("Solver", {"global": "global", "published": "published"})
Solver.__doc__ = """How the view angle is found: over the whole range, or as appendix B has it."""


RANDOM_VIEW = "random_view"
"""A view drawn on the whole circle, one for every walker and view: no estimator, which knows nothing."""


@dataclass(frozen=True)
class ViewAngles:
    """The view angles that both approaches and baselines find, and the costs behind them.

    Attributes
    ----------
    rows : DataFrame
        A row to each walker, method or baseline, and true view: estimate less truth; cost of the fit, and of the best
        fit at another local minimum (of the anatomical method: 1, and by how much the angle is likelier than that of
        the next mode; of a view drawn at random none).
    published : DataFrame
        The same by the solver of appendix B, on some views; no rows if it is not tried.
    methods : (M,) text
    failure_deg : float
        An estimate that is further off is a failure.
    remarks : list of str
    """

    rows: pd.DataFrame
    published: pd.DataFrame
    methods: np.ndarray
    failure_deg: float
    remarks: list[str]


class UnknownView(Sweep):
    """The view angle estimated together with the motion."""

    draws_random_numbers = True

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")  # true views
    methods: Distinct[Method] = list(PUBLISHED)  # that are compared
    noise_variance_mm2: Positive = 70.0  # sigma² of approach II
    solver: Solver = Solver["global"]
    angle_range_deg: list[float] = [-180.0, 180.0]  # in which the angle is sought
    published_views_deg: list[float] = [  # on which it is tried beside the global one
        -90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0,
    ]  # fmt: skip
    failure_deg: Positive = 30.0  # an estimate that is further off is a failure

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        if len(self.angle_range_deg) != 2:
            raise InvalidInput("must be [low, high]", "sweep.angle_range_deg", received=self.angle_range_deg)
        if Method.anatomical in self.methods and self.angle_range_deg != [-180.0, 180.0]:
            raise InvalidInput(
                "the anatomical method looks at the whole circle",
                "sweep.angle_range_deg",
                "[-180, 180]",
                self.angle_range_deg,
            )

    def of_populations(self) -> UnknownView:
        """Return the sweep at the middles of strips of views, and without the published solver beside it.

        Its tables have a row for every walker and view.
        """
        return replace(self, view_angle_deg=middles_of_strips(self.view_angle_deg), published_views_deg=[])

    def measure(self, inputs: SweepInputs[object, FourierSamples, Eigenwalkers]) -> ViewAngles:
        """Return the view angles that both approaches find, and the costs behind them."""
        data, model = inputs.dataset, inputs.model
        third = AnatomicalApproach(data) if Method.anatomical in self.methods else None
        views = (
            self.view_angle_deg.values("sweep.view_angle_deg"),
            np.array(self.published_views_deg, float),
        )
        walkers, generator = range(len(model.samples)), inputs.generator("random view")
        drawn = [generator.uniform(-180.0, 180.0, (len(walkers), len(view_deg))) for view_deg in views]
        low, high = np.radians(self.angle_range_deg)
        tried: list[Method | Baseline] = [*self.methods, *Baseline.beside(self.methods)]

        def one(r: int) -> list[list[dict[str, Any]]]:
            measured = ~data.unmeasured[r]
            fold = linear_model.of_measured(model.fold(r), measured)
            single = linear_model.truncated(fold, 1)
            sample = linear_model.without_joints(model.samples[r], measured)

            def estimate(
                method: Method | Baseline, view: np.ndarray, solver: Solver
            ) -> viewpoint.ViewEstimate:
                if third and method is Method.anatomical:
                    return third.estimate(r, view)
                noise = method.noise_variance(self.noise_variance_mm2)
                return viewpoint.estimate(
                    fold if isinstance(method, Method) else single,
                    _observed(sample, view),
                    method="least_squares" if noise is None else "map",
                    noise_variance=noise,
                    solver=solver.value,
                    angle_range_rad=(float(low), float(high)),
                )

            found = []
            for view_deg, at_random, solver in zip(
                views, drawn, (self.solver, Solver["published"]), strict=True
            ):
                estimates = [
                    (method, estimate(method, np.radians(view_deg), solver))
                    for method in tried
                    if len(view_deg) and not (view_deg is views[1] and method is Method.anatomical)
                ]
                rows = [
                    {
                        "method": str(method),
                        "angle_deg": np.degrees(each.angle_rad),
                        "cost": each.cost,
                        "runner_up_cost": each.runner_up_cost,
                        "converged": each.converged,
                    }
                    for method, each in estimates
                ]
                unknown = {"cost": np.nan, "runner_up_cost": np.nan, "converged": True}
                rows.append({"method": RANDOM_VIEW, "angle_deg": at_random[r], **unknown})
                of = {"person": data.person[r], "walker": data.clip[r], "view_angle_deg": view_deg}
                found.append([{**of, **row} for row in rows])
            return found

        of_walkers = zip(*map_processes(one, walkers, inputs.workers), strict=True)
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


def _observed(sample: np.ndarray, view: np.ndarray) -> np.ndarray:
    """Return what A views (A,) show of a walker (D,), (A, 150), or (A, 151) with the frequency of zhang2004."""
    walker = unflatten(sample)
    observed = camera.project(walker, view[:, None, None]).reshape(len(view), -1)
    if len(sample) > walker.size:
        observed = np.column_stack([observed, np.full(len(view), sample[-1])])
    return observed
