"""Refinement of one start: Gauss-Newton steps, with noise and exchanged labels found on the way.

A step solves the Gauss-Newton equations at the current noise; it is shortened so that heading, phase and pitch turn
by little at once, and halved until the cost falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from pipeline.core.keypoint_walk.exchanged import LIMBS, cheapest_labels, exchange
from pipeline.core.keypoint_walk.objective import (
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
    Setting,
    point_costs,
)  # fmt: skip
from pipeline.core.keypoint_walk.path import Path
from pipeline.core.keypoint_walk.prior import Prior
from pipeline.core.keypoint_walk.start import Start
from pipeline.core.keypoint_walk.training import SIZE

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
    cost : float
        J at that noise.
    exchanged : dict of str to (T,) bool
        Frames whose labels were exchanged, for legs and arms.
    start : Start
    converged : bool
        Whether the last step hardly lowered the cost.
    objective : Objective
    """

    x: np.ndarray
    noise: Noise
    cost: float
    exchanged: dict[str, np.ndarray]
    start: Start
    converged: bool
    objective: Objective


def estimate_noise(residual: np.ndarray, weights: np.ndarray) -> Noise:
    """Scale of residuals (T, 15, 2) and how often the same error is seen again.

    kappa is (1 + rho) / (1 - rho), rho the pooled correlation of a residual with that of the next frame.
    """
    seen = weights > 0
    size = np.sqrt((residual**2).sum(axis=-1))
    sigma = (
        float(np.clip(np.median(np.abs(residual[seen])) / 0.6745, *SIGMA_PX)) if seen.any() else SIGMA_PX[0]
    )
    clipped = residual * (seen * np.minimum(1.0, 3.0 * sigma / np.maximum(size, 1e-9)))[..., None]
    both = seen[1:] & seen[:-1]
    after, before = clipped[1:] * both[..., None], clipped[:-1] * both[..., None]
    power = 0.5 * float((after**2).sum() + (before**2).sum())
    rho = float((after * before).sum()) / power if power > 0 else 0.0
    rho = float(np.clip(rho, 0.0, MOST_CORRELATION))
    return Noise(sigma, (1.0 + rho) / (1.0 - rho))


def initial_unknowns(prior: Prior, start: Start, path: Path, focal_px: float, trunk: list[int]) -> np.ndarray:
    """Unknowns (417,) at a start: the average walker on the path found in the image."""
    x = np.zeros(UNKNOWNS)
    x[:SIZE] = prior.mean.ravel()
    x[X0] = path.place_mm[0]
    x[Y0] = path.place_mm[1] + float(prior.mean[trunk, 2, 0].mean())
    x[Z0] = focal_px * path.distance[0]
    x[VX], x[VZ] = path.velocity_mm_s
    x[HEADING], x[PHASE], x[LOG_F] = start.heading_rad, start.phase_rad, np.log(start.frequency_hz)
    return x


def _solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    _, solution, failed = lapack.dposv(matrix.T, right, lower=1)  # whose memory Fortran reads as it is
    if failed:  # unknowns that nothing determines, from an ill-conditioned start
        matrix = matrix + 1e-6 * np.diag(np.diag(matrix)) + 1e-9 * np.eye(len(matrix))
        solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return np.asarray(solution)


def find_exchanged(kept: np.ndarray, swapped: np.ndarray) -> dict[str, np.ndarray]:
    """Frames of legs and of arms that are better exchanged, of costs (T, 15) as labelled and exchanged."""
    found = {}
    for limb, pairs in LIMBS.items():
        joints = [joint for pair in pairs for joint in pair]
        found[limb] = cheapest_labels(kept[:, joints].sum(axis=1), swapped[:, joints].sum(axis=1))
    return found


def refine(
    prior: Prior,
    setting: Setting,
    keypoints: Keypoints,
    start: Start,
    path: Path,
    trunk: list[int],
    *,
    relabel: bool = True,
    unknowns: np.ndarray | None = None,
) -> Fit:
    """Refine one start.

    Parameters
    ----------
    prior : Prior
    setting : Setting
    keypoints : Keypoints
        As the detector labelled them.
    start : Start
    path : Path
        Found in the image.
    trunk : list of int
        Joints whose middle the path is.
    relabel : bool
        Whether to look for frames with left and right exchanged.
    unknowns : (n,), optional
        Of another fit of the same setting, from which the search goes on; None: it begins at the start.
    """
    objective = Objective(prior, setting, start.frequency_hz)
    if unknowns is None:
        x = np.zeros(objective.unknowns)
        x[:UNKNOWNS] = initial_unknowns(prior, start, path, setting.focal_px, trunk)
    else:
        x = unknowns
    none = {limb: np.zeros(len(setting.times), dtype=bool) for limb in LIMBS}
    exchanged, used = none, keypoints
    whole = {limb: ~none[limb] for limb in LIMBS}
    swapped = Keypoints(exchange(keypoints.pixels, whole), exchange(keypoints.weights, whole))
    noise = Noise(1.0, 1.0)
    cost = np.inf
    converged = False
    most_steps = MOST_FOCAL_STEPS if setting.focal_sd else MOST_STEPS
    for step in range(1, most_steps + 1):
        residual = objective.residual(x, used)
        noise = estimate_noise(residual, used.weights)
        if relabel and step in RELABEL_STEPS:
            costs = [
                point_costs(objective.residual(x, points), noise.sigma_px, setting.nu) * points.weights
                for points in (keypoints, swapped)
            ]
            exchanged = find_exchanged(costs[0], costs[1])
            if any(frames.any() for frames in exchanged.values()):
                used = Keypoints(
                    exchange(keypoints.pixels, exchanged), exchange(keypoints.weights, exchanged)
                )
            else:
                used = keypoints
            noise = estimate_noise(objective.residual(x, used), used.weights)
        here = objective.quadratic(x, used, noise)
        move = -_solve(here.matrix, here.gradient)
        limits = (*STEP_LIMITS, (-1, FOCAL_STEP)) if setting.focal_sd else STEP_LIMITS
        longest = max(abs(move[index]) / limit for index, limit in limits)
        move /= max(longest, 1.0)
        cost = here.cost
        for _ in range(MOST_HALVINGS):
            moved = objective.moved(x, move)
            there = objective.cost(moved, used, noise)
            if there < here.cost:
                x, cost = moved, there
                break
            move /= 2.0
        converged = here.cost - cost < ENOUGH
        if converged and step >= LEAST_STEPS:
            break
    x = x.copy()
    x[HEADING] = (x[HEADING] + np.pi) % (2.0 * np.pi) - np.pi
    x[PHASE] = (x[PHASE] + np.pi) % (2.0 * np.pi) - np.pi
    noise = estimate_noise(objective.residual(x, used), used.weights)
    return Fit(x, noise, objective.cost(x, used, noise), exchanged, start, converged, objective)
