"""Experiment 2: the view angle of every walker estimated from every view by the model that has not seen it.

zhang2007 4.5, 4.6, zhang2004 14.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pipeline.clips.walks import Walks
from pipeline.core import camera, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.processes import map_processes
from pipeline.studies.study import Grid, Sweep, SweepInputs, scaled
from pipeline.studies.walks.dataset import FourierSamples
from pipeline.studies.walks.methods import Method, PhaseSource, validate_methods
from pipeline.studies.walks.model import Eigenwalkers
from pipeline.studies.walks.phase_sources import PHASES, Observed2d
from pipeline.validation import InvalidInput, require_range

Solver = StrEnum("Solver", {"global": "global", "published": "published"})
Solver.__doc__ = """How the view angle is found: over the whole range, or as appendix B has it."""


@dataclass(frozen=True)
class ViewAngles:
    """The view angles that both approaches find, and the costs behind them.

    Attributes
    ----------
    methods : (M,) text
    view_angle_deg : (A,)
        True ones.
    angle_deg, cost, runner_up_cost : (M, R, A)
        Estimated angle; cost of its fit, and of the best fit at another local minimum.
    converged : (M, R, A) bool
    n_iterations : (M, R, A) int
    failure_deg : float
        An estimate that is further off is a failure.
    frequency_hz, phase_rad, phase_error_rad : (R, A), (M, R, A), (M, R, A), optional
        As `KnownViewErrors` has them.
    remarks : list of str
    """

    methods: np.ndarray
    view_angle_deg: np.ndarray
    angle_deg: np.ndarray
    cost: np.ndarray
    runner_up_cost: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray
    failure_deg: float
    frequency_hz: np.ndarray | None
    phase_rad: np.ndarray | None
    phase_error_rad: np.ndarray | None
    remarks: list[str]


@dataclass(kw_only=True)
class UnknownView(Sweep):
    """The view angle estimated together with the motion."""

    view_angle_deg: Grid = scaled(start=-90, stop=90, step="view_step_deg")
    methods: list[Method] = field(default_factory=lambda: list(Method))
    noise_variance_mm2: float = 70.0
    phase_source: PhaseSource = PhaseSource.motion3d
    solver: Solver = Solver["global"]
    angle_range_deg: list[float] = field(default_factory=lambda: [-180.0, 180.0])
    start_deg: float = 0.0  # of the published solver
    failure_deg: float = 30.0

    @property
    def reads_clips(self) -> bool:
        """Whether the views themselves are looked at, for their phase."""
        return self.phase_source is PhaseSource.observed2d

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        validate_methods(self.methods, self.noise_variance_mm2)
        self.view_angle_deg.values("sweep.view_angle_deg")
        require_range("sweep.failure_deg", self.failure_deg, above=0)
        if len(self.angle_range_deg) != 2:
            raise InvalidInput(
                "must be [low, high]", where="sweep.angle_range_deg", received=str(self.angle_range_deg)
            )
        if self.reads_clips and self.solver is not Solver["global"]:
            raise InvalidInput(
                "only the global solver finds a phase",
                where="sweep.solver",
                expected="global with sweep.phase_source=observed2d",
                received=self.solver.value,
            )

    def measure(self, inputs: SweepInputs[Walks, FourierSamples, Eigenwalkers]) -> ViewAngles:
        """Return the view angles that both approaches find, and the costs behind them."""
        view_deg = self.view_angle_deg.values("sweep.view_angle_deg")
        view = np.radians(view_deg)
        low, high = np.radians(self.angle_range_deg)
        model = inputs.model
        names = ("angle_rad", "cost", "runner_up_cost", "converged", "n_iterations")

        def from_2d(r: int) -> dict[str, np.ndarray]:
            seen = Observed2d(model.fold(r), inputs.clips, inputs.dataset, r, view)
            estimates = [
                viewpoint.estimate_unknown_phase(
                    seen.fold,
                    seen.clip.image,
                    noise_variance=method.noise_variance(self.noise_variance_mm2),
                    frequency_hz=seen.clip.frequency_hz,
                    angle_range_rad=(float(low), float(high)),
                )
                for method in self.methods
            ]
            phases = [seen.found(e.phase_rad) for e in estimates]
            return {
                **{name: np.stack([getattr(e, name) for e in estimates]) for name in names},
                **{name: np.stack([phase[name] for phase in phases]) for name in PHASES},
                "frequency_hz": seen.clip.frequency_hz,
            }

        def one(r: int) -> dict[str, np.ndarray]:
            if self.reads_clips:
                return from_2d(r)
            walker = unflatten(model.samples[r])
            across = camera.horizontal(walker, view[:, None, None])
            up = np.broadcast_to(camera.vertical(walker), across.shape)
            observed = np.stack([across, up], axis=-1).reshape(len(view), -1)
            if model.samples.shape[1] > walker.size:  # zhang2004: the frequency is observed, too
                observed = np.column_stack([observed, np.full(len(view), model.samples[r, -1])])
            estimates = [
                viewpoint.estimate(
                    model.fold(r),
                    observed,
                    method=method.value,
                    noise_variance=method.noise_variance(self.noise_variance_mm2),
                    solver=self.solver.value,
                    angle_range_rad=(float(low), float(high)),
                    start_rad=float(np.radians(self.start_deg)),
                )
                for method in self.methods
            ]
            return {name: np.stack([getattr(e, name) for e in estimates]) for name in names}

        folds = map_processes(one, range(len(model.samples)), inputs.workers)

        def stack(name: str, axis: int = 1) -> np.ndarray:
            return np.stack([found[name] for found in folds], axis=axis)

        observed2d = self.reads_clips
        unconverged = int((~stack("converged")).sum())
        return ViewAngles(
            methods=np.array([method.value for method in self.methods]),
            view_angle_deg=view_deg,
            angle_deg=np.degrees(stack("angle_rad")),
            cost=stack("cost"),
            runner_up_cost=stack("runner_up_cost"),
            converged=stack("converged"),
            n_iterations=stack("n_iterations"),
            failure_deg=self.failure_deg,
            frequency_hz=stack("frequency_hz", axis=0) if observed2d else None,
            phase_rad=stack("phase_rad") if observed2d else None,
            phase_error_rad=stack("phase_error_rad") if observed2d else None,
            remarks=[f"{unconverged} view angles did not converge"] if unconverged else [],
        )
