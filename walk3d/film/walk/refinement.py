"""Gauss-Newton refinement of one initial estimate, which also estimates the noise and the exchanged labels.

A step solves the Gauss-Newton equations at the current noise.  It is shortened so that heading, phase and pitch change
little at once, and halved until the cost falls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.linalg import lapack

from walk3d.anatomy.prior import JOINTS
from walk3d.film.walk.exchanged import LIMBS, cheapest_labels, exchange
from walk3d.film.walk.objective import (
    HEADING,
    LOG_F,
    PHASE,
    PITCH,
    UNKNOWNS,
    VX,
    VZ,
    X0,
    Y0,
    Z0,
    Keypoints,
    Noise,
    Objective,
    Quadratic,
    Setting,
    point_costs,
)  # fmt: skip
from walk3d.film.walk.path import TRUNK, Path, often_seen
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.start import Start
from walk3d.film.walk.training import SIZE

MAX_STEPS = 12
MAX_FOCAL_STEPS = 24
"""Maximum number of steps with an unknown focal length, which is correlated with distance and pitch."""
MIN_STEPS = 7
MAX_HALVINGS = 6
COST_TOLERANCE = 0.05
"""Decrease of the cost J in one step, below which the refinement has converged."""
RELABEL_STEPS = (2, 4, 6)
"""Numbers of the refinement steps that begin with a search for exchanged left-right labels."""
SIGMA_PX = (1.0, 40.0)
MAX_CORRELATION = 0.9
MAX_INDEPENDENT_HZ = 60.0
"""Maximum rate, Hz, at which the detector errors of successive frames count as independent."""
STEP_LIMITS = ((HEADING, 0.5), (PHASE, 0.7), (PITCH, 0.15))
FOCAL_STEP = 0.3
"""Maximum change, in one step, of the logarithm of an unknown focal length."""


@dataclass(frozen=True)
class Fit:
    """Result of fitting a walker to keypoints.

    Attributes
    ----------
    x : (417 + 3 n,)
        Unknowns in the order of `objective`.
    noise : Noise
    exchanged : dict of str to (T,) bool
        Frames whose labels were exchanged, for legs and arms.
    start : Start
    objective : Objective
    """

    x: np.ndarray
    noise: Noise
    exchanged: dict[str, np.ndarray]
    start: Start
    objective: Objective

    @property
    def times(self) -> np.ndarray:
        """Times (T,) of the frames, s; 0 is the middle of the clip."""
        return self.objective.setting.times

    @property
    def frequency_hz(self) -> float:
        """Stride frequency, Hz."""
        return np.exp(self.x[LOG_F])

    @property
    def phases_rad(self) -> np.ndarray:
        """Phases (T,) of the gait cycle in the frames, rad."""
        return 2.0 * np.pi * self.frequency_hz * self.times + self.x[PHASE]


def estimate_noise(residual: np.ndarray, visible: np.ndarray, later: int) -> Noise:
    """Estimate the scale and the temporal correlation of the residuals (2, 15, T) of visible joints (15, T).

    kappa is (1 + rho) / (1 - rho) times `later`.  rho is the pooled correlation of residuals that are `later` frames
    apart.
    """
    sigma = SIGMA_PX[0]
    if visible.any():
        sizes = np.abs(residual)[:, visible].ravel()
        half = len(sizes) // 2  # of two axes: an even number
        middle = np.partition(sizes, (half - 1, half))[half - 1 : half + 1]
        sigma = min(max(middle.mean() / 0.6745, SIGMA_PX[0]), SIGMA_PX[1])
    square = residual[0] ** 2 + residual[1] ** 2
    share = visible * np.minimum(1.0, 3.0 * sigma / np.sqrt(np.maximum(square, 1e-18)))
    clipped, square = share * residual, share**2 * square
    power = 0.5 * (square[:, later:] * visible[:, :-later] + square[:, :-later] * visible[:, later:]).sum()
    rho = (clipped[..., later:] * clipped[..., :-later]).sum() / power if power > 0 else 0.0
    rho = min(max(rho, 0.0), MAX_CORRELATION)
    return Noise(sigma, later * (1.0 + rho) / (1.0 - rho))


def initial_unknowns(prior: Prior, start: Start, path: Path, focal_px: float, trunk: list[int]) -> np.ndarray:
    """Return the initial unknowns (417,) of a refinement: the average walker on the path seen in the image."""
    x = np.zeros(UNKNOWNS)
    x[:SIZE] = prior.mean.ravel()
    x[X0] = path.place_mm[0]
    x[Y0] = path.place_mm[1] + prior.mean[trunk, 2, 0].mean()
    x[Z0] = focal_px * path.distance[0]
    x[VX], x[VZ] = path.velocity_mm_s
    x[HEADING], x[PHASE], x[LOG_F] = start.heading_rad, start.phase_rad, np.log(start.frequency_hz)
    return x


def trunk_of(keypoints: Keypoints) -> list[int]:
    """Return the visible joints of the trunk, or all joints if none of the trunk is visible.

    The mean of these joints defines the path.
    """
    visible = often_seen(keypoints.weights)
    return [j for j in TRUNK if visible[j]] or list(range(JOINTS))


def _solve(current: Quadratic, again: Callable[[], Quadratic]) -> np.ndarray:
    """Return the solution of the Gauss-Newton equations.

    The matrix of the equations is overwritten.
    """
    _, solution, failed = lapack.dposv(current.matrix, current.gradient, lower=1, overwrite_a=1)
    if failed:  # unknowns that nothing determines, from an ill-conditioned start
        matrix = again().matrix
        matrix = np.tril(matrix) + np.tril(matrix, -1).T
        matrix = matrix + 1e-6 * np.diag(np.diag(matrix)) + 1e-9 * np.eye(len(matrix))
        solution = np.linalg.lstsq(matrix, current.gradient)[0]
    return solution


class Refinement:
    """Refinement of one start, which can be advanced by a number of steps.

    Parameters
    ----------
    prior : Prior
    setting : Setting
    keypoints : Keypoints
        Keypoints with the detector's labels.
    start : Start
    path : Path
        Path in the image.
    relabel : bool
        Search for frames with left and right exchanged.
    exchanged : dict of str to (T,) bool, optional
        Frames that are exchanged initially, for legs and arms; none by default.
    unknowns : (n,), optional
        Unknowns of another fit of the same setting, to continue from; None: begin at the start.
    """

    def __init__(
        self,
        prior: Prior,
        setting: Setting,
        keypoints: Keypoints,
        start: Start,
        path: Path,
        *,
        relabel: bool = True,
        exchanged: dict[str, np.ndarray] | None = None,
        unknowns: np.ndarray | None = None,
    ) -> None:
        self.objective = Objective(prior, setting, start.frequency_hz)
        if unknowns is None:
            unknowns = np.zeros(self.objective.unknowns)
            unknowns[:UNKNOWNS] = initial_unknowns(prior, start, path, setting.focal_px, trunk_of(keypoints))
        self._at = self.objective.at(unknowns.copy())
        self._later = max(round(1.0 / (MAX_INDEPENDENT_HZ * (setting.times[1] - setting.times[0]))), 1)
        self._start, self._given, self._relabel = start, keypoints, relabel
        self._exchanged = exchanged or dict.fromkeys(LIMBS, np.zeros(len(setting.times), bool))
        self.used = relabelled(keypoints, self._exchanged)
        self._step, self._converged = 0, False
        self._estimate_noise()

    @cached_property
    def _swapped(self) -> Keypoints:
        return relabelled(self._given, dict.fromkeys(LIMBS, np.ones(len(self._given.pixels), bool)))

    def advance(self, steps: int | None = None) -> Refinement:
        """Advance the refinement by the given number of steps, or until the cost has converged."""
        focal = self.objective.setting.focal_sd > 0
        most = MAX_FOCAL_STEPS if focal else MAX_STEPS
        limits = (*STEP_LIMITS, (-1, FOCAL_STEP)) if focal else STEP_LIMITS
        last = most if steps is None else min(self._step + steps, most)
        while self._step < last and not (self._converged and self._step >= MIN_STEPS):
            self._step += 1
            if self._relabel and self._step in RELABEL_STEPS:
                self._find_exchanged()
            noise, quadratic = self.noise, partial(self.objective.quadratic, self._at, self.used, self.noise)
            current = quadratic()
            move = -_solve(current, quadratic)
            move /= max(*(abs(move[index]) / limit for index, limit in limits), 1.0)
            cost = current.cost
            for _ in range(MAX_HALVINGS):
                moved = self.objective.at(self.objective.moved(self._at.x, move))
                moved_cost = self.objective.cost(moved, self.used, noise)
                if moved_cost < current.cost:
                    self._at, cost = moved, moved_cost
                    self._estimate_noise()
                    break
                move /= 2.0
            self._converged = current.cost - cost < COST_TOLERANCE
        return self

    def _estimate_noise(self) -> None:
        self.noise = estimate_noise(self._at.image - self.used.by_axis, self.used.seen, self._later)

    def cost(self, noise: Noise) -> float:
        """Return the cost J of the current unknowns for the given noise."""
        return self.objective.cost(self._at, self.used, noise)

    def _find_exchanged(self) -> None:
        sigma_px, nu = self.noise.sigma_px, self.objective.setting.nu
        costs = [
            point_costs(self._at.image - points.by_axis, sigma_px, nu) * points.by_joint
            for points in (self._given, self._swapped)
        ]
        self._exchanged = {
            limb: cheapest_labels(*(of_points[np.ravel(pairs)].sum(axis=0) for of_points in costs))
            for limb, pairs in LIMBS.items()
        }
        self.used = relabelled(self._given, self._exchanged)
        self._estimate_noise()

    def fit(self) -> Fit:
        """Return the result of the refinement after its latest step."""
        x = self._at.x.copy()
        for angle in (HEADING, PHASE):
            x[angle] = (x[angle] + np.pi) % (2.0 * np.pi) - np.pi
        return Fit(x, self.noise, self._exchanged, self._start, self.objective)


def relabelled(keypoints: Keypoints, frames: dict[str, np.ndarray]) -> Keypoints:
    """Return keypoints with left and right exchanged in the given frames (T,) of the legs and of the arms."""
    if not any(limb.any() for limb in frames.values()):
        return keypoints
    return Keypoints(exchange(keypoints.pixels, frames), exchange(keypoints.weights, frames))
