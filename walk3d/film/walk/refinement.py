"""Refinement of one start: Gauss-Newton steps, with noise and exchanged labels found on the way.

A step solves the Gauss-Newton equations at the current noise; it is shortened so that heading, phase and pitch turn
by little at once, and halved until the cost falls.
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

MOST_STEPS = 12
MOST_FOCAL_STEPS = 24
"""With an unknown focal length, which goes the way of distance and pitch, more steps are needed."""
LEAST_STEPS = 7
MOST_HALVINGS = 6
ENOUGH = 0.05
"""A step that lowers the cost by less is the last."""
RELABEL_STEPS = (2, 4, 6)
"""Steps before which exchanged labels are looked for."""
SIGMA_PX = (1.0, 40.0)
MOST_CORRELATION = 0.9
FASTEST_NEWS_HZ = 60.0
"""Frames that are nearer in time than at this rate say the same again: errors of a detector are slower."""
STEP_LIMITS = ((HEADING, 0.5), (PHASE, 0.7), (PITCH, 0.15))
FOCAL_STEP = 0.3
"""Most that the logarithm of an unknown focal length changes in one step."""


@dataclass(frozen=True)
class Fit:
    """A refined walker.

    Attributes
    ----------
    x : (417 + 3 n,)
        Unknowns, as `objective` orders them.
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
        """Seconds (T,) of the frames, 0 in the middle."""
        return self.objective.setting.times

    @property
    def frequency_hz(self) -> float:
        """Strides a second."""
        return np.exp(self.x[LOG_F])

    @property
    def phases_rad(self) -> np.ndarray:
        """Phases (T,) of the frames."""
        return 2.0 * np.pi * self.frequency_hz * self.times + self.x[PHASE]


def estimate_noise(residual: np.ndarray, seen: np.ndarray, later: int) -> Noise:
    """Scale of residuals (2, 15, T) of what is seen (15, T), and how often the same error is seen again.

    kappa is (1 + rho) / (1 - rho) times `later`, rho the pooled correlation of a residual with that of so many frames
    later.
    """
    sigma = SIGMA_PX[0]
    if seen.any():
        sizes = np.abs(residual)[:, seen].ravel()
        half = len(sizes) // 2  # of two axes: an even number
        middle = np.partition(sizes, (half - 1, half))[half - 1 : half + 1]
        sigma = min(max(middle.mean() / 0.6745, SIGMA_PX[0]), SIGMA_PX[1])
    square = residual[0] ** 2 + residual[1] ** 2
    share = seen * np.minimum(1.0, 3.0 * sigma / np.sqrt(np.maximum(square, 1e-18)))
    clipped, square = share * residual, share**2 * square
    power = 0.5 * (square[:, later:] * seen[:, :-later] + square[:, :-later] * seen[:, later:]).sum()
    rho = (clipped[..., later:] * clipped[..., :-later]).sum() / power if power > 0 else 0.0
    rho = min(max(rho, 0.0), MOST_CORRELATION)
    return Noise(sigma, later * (1.0 + rho) / (1.0 - rho))


def initial_unknowns(prior: Prior, start: Start, path: Path, focal_px: float, trunk: list[int]) -> np.ndarray:
    """Unknowns (417,) at a start: the average walker on the path found in the image."""
    x = np.zeros(UNKNOWNS)
    x[:SIZE] = prior.mean.ravel()
    x[X0] = path.place_mm[0]
    x[Y0] = path.place_mm[1] + prior.mean[trunk, 2, 0].mean()
    x[Z0] = focal_px * path.distance[0]
    x[VX], x[VZ] = path.velocity_mm_s
    x[HEADING], x[PHASE], x[LOG_F] = start.heading_rad, start.phase_rad, np.log(start.frequency_hz)
    return x


def trunk_of(keypoints: Keypoints) -> list[int]:
    """Joints of the trunk that are seen, or all joints if there is none: the path is that of their middle."""
    seen = often_seen(keypoints.weights)
    return [j for j in TRUNK if seen[j]] or list(range(JOINTS))


def _solve(here: Quadratic, again: Callable[[], Quadratic]) -> np.ndarray:
    """Solve the Gauss-Newton equations in the place of their matrix."""
    _, solution, failed = lapack.dposv(here.matrix, here.gradient, lower=1, overwrite_a=1)
    if failed:  # unknowns that nothing determines, from an ill-conditioned start
        matrix = again().matrix
        matrix = np.tril(matrix) + np.tril(matrix, -1).T
        matrix = matrix + 1e-6 * np.diag(np.diag(matrix)) + 1e-9 * np.eye(len(matrix))
        solution = np.linalg.lstsq(matrix, here.gradient)[0]
    return solution


class Refinement:
    """One start on its way.

    Parameters
    ----------
    prior : Prior
    setting : Setting
    keypoints : Keypoints
        As the detector labelled them.
    start : Start
    path : Path
        Found in the image.
    relabel : bool
        Whether to look for frames with left and right exchanged.
    exchanged : dict of str to (T,) bool, optional
        Frames that are taken for exchanged at first, for legs and arms; none by default.
    unknowns : (n,), optional
        Of another fit of the same setting, from which the search goes on; None: it begins at the start.
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
        self._later = max(round(1.0 / (FASTEST_NEWS_HZ * (setting.times[1] - setting.times[0]))), 1)
        self._start, self._given, self._relabel = start, keypoints, relabel
        self._exchanged = exchanged or dict.fromkeys(LIMBS, np.zeros(len(setting.times), bool))
        self.used = relabelled(keypoints, self._exchanged)
        self._step, self._converged = 0, False
        self._look_again()

    @cached_property
    def _swapped(self) -> Keypoints:
        return relabelled(self._given, dict.fromkeys(LIMBS, np.ones(len(self._given.pixels), bool)))

    def advance(self, steps: int | None = None) -> Refinement:
        """Go so many steps further, or until the cost hardly falls."""
        focal = self.objective.setting.focal_sd > 0
        most = MOST_FOCAL_STEPS if focal else MOST_STEPS
        limits = (*STEP_LIMITS, (-1, FOCAL_STEP)) if focal else STEP_LIMITS
        last = most if steps is None else min(self._step + steps, most)
        while self._step < last and not (self._converged and self._step >= LEAST_STEPS):
            self._step += 1
            if self._relabel and self._step in RELABEL_STEPS:
                self._look_for_exchanged()
            noise, quadratic = self.noise, partial(self.objective.quadratic, self._at, self.used, self.noise)
            here = quadratic()
            move = -_solve(here, quadratic)
            move /= max(*(abs(move[index]) / limit for index, limit in limits), 1.0)
            cost = here.cost
            for _ in range(MOST_HALVINGS):
                moved = self.objective.at(self.objective.moved(self._at.x, move))
                there = self.objective.cost(moved, self.used, noise)
                if there < here.cost:
                    self._at, cost = moved, there
                    self._look_again()
                    break
                move /= 2.0
            self._converged = here.cost - cost < ENOUGH
        return self

    def _look_again(self) -> None:
        self.noise = estimate_noise(self._at.image - self.used.by_axis, self.used.seen, self._later)

    def cost(self, noise: Noise) -> float:
        """J where this start has come to, at this noise."""
        return self.objective.cost(self._at, self.used, noise)

    def _look_for_exchanged(self) -> None:
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
        self._look_again()

    def fit(self) -> Fit:
        """Return the walker so far."""
        x = self._at.x.copy()
        for angle in (HEADING, PHASE):
            x[angle] = (x[angle] + np.pi) % (2.0 * np.pi) - np.pi
        return Fit(x, self.noise, self._exchanged, self._start, self.objective)


def relabelled(keypoints: Keypoints, frames: dict[str, np.ndarray]) -> Keypoints:
    """Return keypoints with left and right exchanged in the frames (T,) of legs and arms."""
    if not any(limb.any() for limb in frames.values()):
        return keypoints
    return Keypoints(exchange(keypoints.pixels, frames), exchange(keypoints.weights, frames))
