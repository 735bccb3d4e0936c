"""Errors of a reconstructed walk against the truth, and of two ways that learn nothing of the person."""

from __future__ import annotations

import numpy as np

from pipeline.core.keypoint_walk.posterior import joint_angles, relative_positions
from pipeline.core.keypoint_walk.reconstruction import Reconstruction
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

_PELVIS = WALKER15.index("pelvis")
_HIPS = [WALKER15.index("left_hip"), WALKER15.index("right_hip")]
SCORED = [joint for joint in range(len(WALKER15.joints)) if joint != _PELVIS]
"""Joints that can err: the pelvis is the origin."""
_DOWN = np.array([0.0, 1.0, 0.0])
_LEAST_SD_MM = 1e-9


def level_angles(positions_mm: np.ndarray) -> np.ndarray:
    """Joint angles (…, 8), rad, of positions (…, 15, 3) in level camera axes."""
    return joint_angles(positions_mm, _DOWN)


def fitted_scale(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Least-squares factor on an estimate: one camera does not tell size from distance."""
    return float((estimate_mm * truth_mm).sum() / (estimate_mm**2).sum())


def mean_distance_mm(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Mean distance of the joints over frames, the estimate (T, 15, 3) scaled to the truth once for the clip."""
    off = fitted_scale(estimate_mm, truth_mm) * estimate_mm - truth_mm
    return float(np.linalg.norm(off[:, SCORED], axis=-1).mean())


def joint_errors(found: Reconstruction, truth_mm: np.ndarray) -> np.ndarray:
    """Errors (T, 15, 3) over the posterior's standard deviations; 0 for the pelvis."""
    estimate, sd = found.posterior.positions_mm, found.posterior.sd_mm
    scale = fitted_scale(estimate, truth_mm)
    return np.asarray((scale * estimate - truth_mm) / np.maximum(scale * sd, _LEAST_SD_MM))


def angle_errors(found: Reconstruction, truth_mm: np.ndarray) -> np.ndarray:
    """Errors (T, 8) of joint angles over the posterior's standard deviations."""
    off = found.posterior.angles_rad - level_angles(truth_mm)
    return np.asarray(off / found.posterior.angles_sd_rad)


def average_walker_mm(found: Reconstruction) -> np.ndarray:
    """The average walker (T, 15, 3) with the heading, phase and frequency that were found."""
    objective = found.fit.objective
    return relative_positions(objective.prior.model.mean, found.fit.x, objective.setting.times)


def image_kept_mm(found: Reconstruction) -> np.ndarray:
    """The image as it is, with the average walker's depth (T, 15, 3); where a keypoint is missing, the average walker.

    The origin is the pelvis, or the middle of the hips if the pelvis is never seen.

    Raises
    ------
    InvalidInput
        If the hips are never seen, either.
    """
    kept = average_walker_mm(found)
    a, b = found.starts.path.distance
    metric = found.keypoints.pixels * (a + b * found.fit.objective.setting.times)[:, None, None]
    seen = found.keypoints.weights > 0
    middle = [_PELVIS] if seen[:, _PELVIS].any() else _HIPS
    frames = np.flatnonzero(seen[:, middle].all(axis=1))
    if not len(frames):
        raise InvalidInput("the pelvis is never seen")
    origin = metric[:, middle].mean(axis=1)
    every = np.arange(len(metric))
    pelvis = np.stack([np.interp(every, frames, origin[frames, axis]) for axis in (0, 1)], axis=-1)
    kept[..., :2] = np.where(seen[..., None], metric - pelvis[:, None], kept[..., :2])
    return kept
