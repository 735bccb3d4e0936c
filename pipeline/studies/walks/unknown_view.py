"""Experiment 2: the view angle of every walker estimated from every view by the model that has not seen it.

zhang2007 4.5, 4.6, zhang2004 14.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import camera, linear_model, viewpoint
from pipeline.core.linear_model import unflatten
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
    middles_of_strips,
    validate_methods,
)
from pipeline.studies.walks.phase_sources import PHASES, Observed2d
from pipeline.validation import InvalidInput, require_range

Solver = StrEnum("Solver", {"global": "global", "published": "published"})
Solver.__doc__ = """How the view angle is found: over the whole range, or as appendix B has it."""


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
    frequency_hz, phase_rad, phase_error_rad : (R, A), (M, R, A), (M, R, A), optional
        As `KnownViewErrors` has them.
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
    frequency_hz: np.ndarray | None
    phase_rad: np.ndarray | None
    phase_error_rad: np.ndarray | None
    published_view_deg: np.ndarray
    published_angle_deg: np.ndarray
    remarks: list[str]


@dataclass(kw_only=True)
class UnknownView(Sweep):
    """The view angle estimated together with the motion."""

    draws_random_numbers = True

    view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")
    methods: list[Method] = field(default_factory=lambda: list(PUBLISHED))
    noise_variance_mm2: float = 70.0
    phase_source: PhaseSource = PhaseSource.motion3d
    solver: Solver = Solver["global"]
    angle_range_deg: list[float] = field(default_factory=lambda: [-180.0, 180.0])
    start_deg: float = 0.0  # of the published solver
    published_views_deg: list[float] = field(
        default_factory=lambda: [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]
    )  # on which it is tried beside the global one
    failure_deg: float = 30.0

    @property
    def reads_clips(self) -> bool:
        """Whether the views themselves are looked at, for their phase."""
        return self.phase_source is PhaseSource.observed2d

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        validate_methods(self.methods, self.noise_variance_mm2, self.phase_source)
        self.view_angle_deg.values("sweep.view_angle_deg")
        require_range("sweep.failure_deg", self.failure_deg, above=0)
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
        if self.reads_clips and self.solver is not Solver["global"]:
            raise InvalidInput(
                "only the global solver finds a phase",
                where="sweep.solver",
                expected="global with sweep.phase_source=observed2d",
                received=self.solver.value,
            )

    def of_populations(self) -> UnknownView:
        """Return the sweep at the middles of strips of views, and without the published solver beside it.

        Its tables have a row for every walker and view.
        """
        return replace(self, view_angle_deg=middles_of_strips(self.view_angle_deg), published_views_deg=[])

    def measure(self, inputs: SweepInputs[Walks, FourierSamples, Eigenwalkers]) -> ViewAngles:
        """Return the view angles that both approaches find, and the costs behind them."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        view = np.radians(view_deg)
        low, high = np.radians(self.angle_range_deg)
        data, model = inputs.dataset, inputs.model
        names = ("angle_rad", "cost", "runner_up_cost", "converged", "n_iterations")
        third = AnatomicalApproach(inputs.dataset) if Method.anatomical in self.methods else None
        published = [method for method in self.methods if method in PUBLISHED]

        nulls = Null.beside(self.methods)
        angle_range = (float(low), float(high))
        start = float(np.radians(self.start_deg))
        published_deg = np.array([] if self.reads_clips else self.published_views_deg, dtype=float)
        published_view = np.radians(published_deg)

        def as_published(
            tries: list[tuple[linear_model.LinearModel, str, float | None]], sample: np.ndarray
        ) -> np.ndarray:
            if not len(published_view):
                return np.empty((len(tries), 0))
            seen = _observed(sample, published_view)
            estimates = [
                viewpoint.estimate(
                    given,
                    seen,
                    method=method,
                    noise_variance=noise,
                    solver="published",
                    angle_range_rad=angle_range,
                    start_rad=start,
                )
                for given, method, noise in tries
            ]
            return np.stack([estimate.angle_rad for estimate in estimates])

        def one(r: int) -> dict[str, np.ndarray]:
            measured = ~data.unmeasured[r]
            fold = linear_model.of_measured(model.fold(r), measured)
            sample = linear_model.without_joints(model.samples[r], measured)
            single = linear_model.truncated(fold, 1)
            tries = [(fold, m.value, m.noise_variance(self.noise_variance_mm2)) for m in published]
            for null in nulls:
                noise = null.noise_variance(self.noise_variance_mm2)
                tries.append((single, "least_squares" if noise is None else "map", noise))
            if self.reads_clips:
                seen = Observed2d(fold, inputs.clips, data, r, view)
                estimates: list[Any] = [
                    viewpoint.estimate_unknown_phase(
                        given,
                        seen.clip.image,
                        noise_variance=noise,
                        frequency_hz=seen.clip.frequency_hz,
                        angle_range_rad=angle_range,
                    )
                    for given, _, noise in tries
                ]
            else:
                estimates = [
                    viewpoint.estimate(
                        given,
                        _observed(sample, view),
                        method=method,
                        noise_variance=noise,
                        solver=self.solver.value,
                        angle_range_rad=angle_range,
                        start_rad=start,
                    )
                    for given, method, noise in tries
                ]
            approaches, others = estimates[: len(published)], estimates[len(published) :]
            if third:
                place = self.methods.index(Method.anatomical)
                approaches.insert(place, third.estimate(r, view))
            found = {name: np.stack([getattr(e, name) for e in approaches]) for name in names}
            found["null_angle_rad"] = np.stack([e.angle_rad for e in others])
            found["published_angle_rad"] = as_published(tries, model.samples[r])
            if self.reads_clips:
                phases = [seen.found(e.phase_rad) for e in approaches]
                found |= {name: np.stack([phase[name] for phase in phases]) for name in PHASES}
                found["frequency_hz"] = seen.clip.frequency_hz
            return found

        folds = map_processes(one, range(len(model.samples)), inputs.workers)
        generator = inputs.generator("random view")
        random_deg, random_published_deg = (
            generator.uniform(-180.0, 180.0, (1, len(folds), len(views)))
            for views in (view_deg, published_deg)
        )

        def stack(name: str, axis: int = 1) -> np.ndarray:
            return np.stack([found[name] for found in folds], axis=axis)

        observed2d = self.reads_clips
        unconverged = int((~stack("converged")).sum())
        return ViewAngles(
            methods=np.array([method.value for method in self.methods]),
            nulls=np.array([*(null.value for null in nulls), RANDOM_VIEW]),
            view_angle_deg=view_deg,
            angle_deg=np.degrees(stack("angle_rad")),
            null_angle_deg=np.concatenate([np.degrees(stack("null_angle_rad")), random_deg]),
            cost=stack("cost"),
            runner_up_cost=stack("runner_up_cost"),
            converged=stack("converged"),
            n_iterations=stack("n_iterations"),
            failure_deg=self.failure_deg,
            frequency_hz=stack("frequency_hz", axis=0) if observed2d else None,
            phase_rad=stack("phase_rad") if observed2d else None,
            phase_error_rad=stack("phase_error_rad") if observed2d else None,
            published_view_deg=published_deg,
            published_angle_deg=np.concatenate(
                [np.degrees(stack("published_angle_rad")), random_published_deg]
            ),
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
