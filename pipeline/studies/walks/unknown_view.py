"""Experiment 2: the view angle of every walker estimated from every view by the model that has not seen it.

zhang2007 4.5, 4.6, zhang2004 14.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial

import numpy as np

from pipeline.core import camera, linear_model, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Sweep, SweepInputs, Swept, scaled
from pipeline.studies.walks.anatomical_method import AnatomicalApproach
from pipeline.studies.walks.methods import (
    PUBLISHED,
    Method,
    Null,
    middles_of_strips,
)
from pipeline.validation import Distinct, InvalidInput, Positive

Solver = StrEnum("Solver", {"global": "global", "published": "published"})
Solver.__doc__ = """How the view angle is found: over the whole range, or as appendix B has it."""


ESTIMATED = ("angle_rad", "cost", "runner_up_cost", "converged", "n_iterations")
"""What is kept of a `ViewEstimate`."""

RANDOM_VIEW = "random_view"
"""A view drawn on the whole circle, one for every walker and view: no estimator, which knows nothing."""


@dataclass(frozen=True)
class ViewAngles:
    """The view angles that both approaches find, and the costs behind them.

    Attributes
    ----------
    methods : (M,) text
    nulls : (K,) text
        Estimates that know next to nothing of the walker.
    view_angle_deg : (A,)
        True ones.
    angle_deg, cost, runner_up_cost : (M, R, A)
        Estimated angle; cost of its fit, and of the best fit at another local minimum.  Of the anatomical method: 1,
        and by how much the angle is likelier than that of the next mode.
    null_angle_deg : (K, R, A)
        The last is drawn at random.
    converged : (M, R, A) bool
    n_iterations : (M, R, A) int
    failure_deg : float
        An estimate that is further off is a failure.
    published_view_deg : (P,)
        True views that the solver of appendix B is tried on as well; none if it is not.
    published_angle_deg : (M + K, R, P)
        What it finds, by the methods and by the nulls.
    remarks : list of str
    """

    methods: np.ndarray
    nulls: np.ndarray
    view_angle_deg: np.ndarray
    angle_deg: np.ndarray
    null_angle_deg: np.ndarray
    cost: np.ndarray
    runner_up_cost: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray
    failure_deg: float
    published_view_deg: np.ndarray
    published_angle_deg: np.ndarray
    remarks: list[str]


@dataclass(kw_only=True)
class UnknownView(Sweep):
    """The view angle estimated together with the motion."""

    draws_random_numbers = True

    view_angle_deg: Swept = scaled(start=-90, stop=90, step="view_step_deg")
    methods: Distinct[Method] = field(default_factory=lambda: list(PUBLISHED))
    noise_variance_mm2: Positive = 70.0
    solver: Solver = Solver["global"]
    angle_range_deg: list[float] = field(default_factory=lambda: [-180.0, 180.0])
    published_views_deg: list[float] = field(
        default_factory=lambda: [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]
    )  # on which it is tried beside the global one
    failure_deg: Positive = 30.0

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        if len(self.angle_range_deg) != 2:
            raise InvalidInput(
                "must be [low, high]", where="sweep.angle_range_deg", received=str(self.angle_range_deg)
            )
        if Method.anatomical in self.methods and self.angle_range_deg != [-180.0, 180.0]:
            raise InvalidInput(
                "the anatomical method looks at the whole circle",
                where="sweep.angle_range_deg",
                expected="[-180, 180]",
                received=str(self.angle_range_deg),
            )

    def of_populations(self) -> UnknownView:
        """Return the sweep at the middles of strips of views, and without the published solver beside it.

        Its tables have a row for every walker and view.
        """
        return replace(self, view_angle_deg=middles_of_strips(self.view_angle_deg), published_views_deg=[])

    def measure(self, inputs: SweepInputs[object, FourierSamples, Eigenwalkers]) -> ViewAngles:
        """Return the view angles that both approaches find, and the costs behind them."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        view = np.radians(view_deg)
        low, high = np.radians(self.angle_range_deg)
        data, model = inputs.dataset, inputs.model
        third = AnatomicalApproach(data) if Method.anatomical in self.methods else None
        nulls = Null.beside(self.methods)
        estimate = partial(
            viewpoint.estimate,
            angle_range_rad=(float(low), float(high)),
        )
        published_deg = np.array(self.published_views_deg, dtype=float)

        def one(r: int) -> dict[str, np.ndarray]:
            fold = linear_model.of_measured(model.fold(r), ~data.unmeasured[r])
            seen = _observed(linear_model.without_joints(model.samples[r], ~data.unmeasured[r]), view)
            single = linear_model.truncated(fold, 1)
            tries = [
                (fold, m.value, m.noise_variance(self.noise_variance_mm2))
                for m in self.methods
                if m in PUBLISHED
            ]
            known = len(tries)
            for null in nulls:
                noise = null.noise_variance(self.noise_variance_mm2)
                tries.append((single, "least_squares" if noise is None else "map", noise))
            estimates = [
                estimate(given, seen, method=method, noise_variance=noise, solver=self.solver.value)
                for given, method, noise in tries
            ]
            approaches, others = estimates[:known], estimates[known:]
            if third:
                approaches.insert(self.methods.index(Method.anatomical), third.estimate(r, view))
            found = {name: np.stack([getattr(e, name) for e in approaches]) for name in ESTIMATED}
            found["null_angle_rad"] = np.stack([e.angle_rad for e in others])
            found["published_angle_rad"] = np.empty((len(tries), 0))
            if len(published_deg):
                seen = _observed(model.samples[r], np.radians(published_deg))
                found["published_angle_rad"] = np.stack(
                    [
                        estimate(
                            given, seen, method=method, noise_variance=noise, solver="published"
                        ).angle_rad
                        for given, method, noise in tries
                    ]
                )
            return found

        folds = map_processes(one, range(len(model.samples)), inputs.workers)
        found = {name: np.stack([fold[name] for fold in folds], axis=1) for name in folds[0]}
        degrees = {
            name.replace("_rad", "_deg"): np.degrees(found.pop(name))
            for name in ("angle_rad", "null_angle_rad", "published_angle_rad")
        }
        generator = inputs.generator("random view")
        for name, views in (("null_angle_deg", view_deg), ("published_angle_deg", published_deg)):
            drawn = generator.uniform(-180.0, 180.0, (1, len(folds), len(views)))
            degrees[name] = np.concatenate([degrees[name], drawn])
        unconverged = int((~found["converged"]).sum())
        return ViewAngles(
            methods=np.array([method.value for method in self.methods]),
            nulls=np.array([*(null.value for null in nulls), RANDOM_VIEW]),
            view_angle_deg=view_deg,
            **found,
            **degrees,
            failure_deg=self.failure_deg,
            published_view_deg=published_deg,
            remarks=[f"{unconverged} view angles did not converge"] if unconverged else [],
        )


def _observed(sample: np.ndarray, view: np.ndarray) -> np.ndarray:
    """Return what A views (A,) show of a walker (D,), (A, 150), or (A, 151) with the frequency of zhang2004."""
    walker = unflatten(sample)
    across = camera.horizontal(walker, view[:, None, None])
    up = np.broadcast_to(camera.vertical(walker), across.shape)
    observed = np.stack([across, up], axis=-1).reshape(len(view), -1)
    if len(sample) > walker.size:
        observed = np.column_stack([observed, np.full(len(view), sample[-1])])
    return observed
