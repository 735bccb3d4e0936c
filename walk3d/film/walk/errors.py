"""Errors of a reconstructed walk against the truth, and of two ways that learn nothing of the person."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.skeleton import ANKLES, LEFT_LEG, PELVIS, RIGHT_LEG, WALKER15
from pipeline.validation import InvalidInput
from walk3d.anatomy.prior.stance import stance_rows
from walk3d.film.walk.calibration import StandardErrors
from walk3d.film.walk.cycle import LATER, deviations, gait_cycle
from walk3d.film.walk.objective import HEADING, LOG_F, TURN
from walk3d.film.walk.posterior import relative_positions
from walk3d.film.walk.reconstruction import Reconstruction
from walk3d.film.walk.sagittal_angles import sagittal_angles
from walk3d.film.walk.training import TrainingWalk
from walk3d.film.walk.view import level_axes

_HIPS = [LEFT_LEG[0], RIGHT_LEG[0]]
SCORED = [joint for joint in range(len(WALKER15.joints)) if joint != PELVIS]
"""Joints that can err: the pelvis is the origin."""
_LEAST_SD_MM = 1e-9


def level_angles(positions_mm: np.ndarray, heading_rad: np.ndarray | float) -> np.ndarray:
    """Angles (T, 11), rad, of positions (T, 15, 3) in level camera axes, of somebody of this heading (T,)."""
    return sagittal_angles(positions_mm @ level_axes(heading_rad))


def headings(found: Reconstruction) -> np.ndarray:
    """Headings (T,) that were found."""
    x = found.fit.x
    return x[HEADING] + x[TURN] * found.fit.times


def fitted_scale(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Least-squares factor on an estimate: one camera does not tell size from distance."""
    return (estimate_mm * truth_mm).sum() / (estimate_mm**2).sum()


def mean_distance_mm(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Mean distance of the joints over frames, the estimate (T, 15, 3) scaled to the truth once for the clip."""
    off = fitted_scale(estimate_mm, truth_mm) * estimate_mm - truth_mm
    return np.linalg.norm(off[:, SCORED], axis=-1).mean()


def joint_errors(found: Reconstruction, truth_mm: np.ndarray) -> np.ndarray:
    """Errors (T, 15, 3) over the posterior's standard deviations; 0 for the pelvis."""
    estimate, sd = found.posterior.positions_mm, found.posterior.sd_mm
    scale = fitted_scale(estimate, truth_mm)
    return (scale * estimate - truth_mm) / np.maximum(scale * sd, _LEAST_SD_MM)


def event_errors(found: Reconstruction, truth_mm: np.ndarray, heading_rad: float) -> list[np.ndarray]:
    """Errors of the times of contacts and of toe-offs, s, and over their standard deviations: two of (n, 2).

    The true ones are those of the recorded ankles, step by step, between frames by a spline; every one of them is
    compared with the nearest that was found, both feet pooled.
    """
    times, frequency = found.fit.times, found.fit.frequency_hz
    own = truth_mm @ level_axes(heading_rad)
    errors = []
    for sign, later, of_sides in zip((1.0, -1.0), LATER, found.event_times, strict=True):
        off = []
        for ankle, (at, sd) in zip(ANKLES, of_sides, strict=True):
            ahead = CubicSpline(times, sign * (own[:, ankle, 1] - own[:, PELVIS, 1]))
            turning = ahead.derivative().roots(extrapolate=False)
            true = turning[ahead(turning) > 0.5 * np.max(ahead(times))] + later / frequency
            if len(at) and len(true):
                nearest = np.abs(at - true[:, None]).argmin(axis=1)
                late = at[nearest] - true
                # At the ends of a clip the nearest may be another step's.
                close = np.abs(late) < 0.25 / frequency
                off.append(np.stack([late, late / sd[nearest]], axis=1)[close])
        errors.append(np.concatenate(off) if off else np.empty((0, 2)))
    return errors


def number_errors(found: Reconstruction, walk: TrainingWalk) -> np.ndarray:
    """Errors (25,) of the numbers of the gait cycle against a whole walk's, over their standard deviations."""
    truth = gait_cycle(walk.walker, walk.frequency_hz, stance_rows(walk.walker)[1])
    off = found.cycle.values - truth.values
    return off / deviations(found.cycle.slopes, found.posterior.covariance)


def average_walker_mm(found: Reconstruction) -> np.ndarray:
    """The average walker (T, 15, 3) with the heading, phase and frequency that were found."""
    return relative_positions(found.fit.objective.prior.model.mean, found.fit.x, found.fit.times)


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
    metric = found.keypoints.pixels * (a + b * found.fit.times)[:, None, None]
    seen = found.keypoints.weights > 0
    middle = [PELVIS] if seen[:, PELVIS].any() else _HIPS
    frames = np.flatnonzero(seen[:, middle].all(axis=1))
    if not len(frames):
        raise InvalidInput("the pelvis is never seen", code="pelvis_not_seen")
    origin = metric[:, middle].mean(axis=1)
    every = np.arange(len(metric))
    pelvis = np.stack([np.interp(every, frames, origin[frames, axis]) for axis in (0, 1)], axis=-1)
    kept[..., :2] = np.where(seen[..., None], metric - pelvis[:, None], kept[..., :2])
    return kept


def standard_errors(
    found: Reconstruction,
    truth_mm: np.ndarray,
    heading_rad: float,
    walk: TrainingWalk,
    events: list[np.ndarray],
) -> StandardErrors:
    """Errors of a clip over their standard deviations, of somebody whose heading, whole walk and events these were."""
    x, posterior = found.fit.x, found.posterior
    off = x[HEADING] - heading_rad
    away = [np.arctan2(np.sin(off), np.cos(off)), x[LOG_F] - np.log(walk.frequency_hz)]
    return StandardErrors(
        joint_errors(found, truth_mm),
        (posterior.angles_rad - level_angles(truth_mm, heading_rad)) / posterior.angles_sd_rad,
        [of_event[:, 1] for of_event in events],
        number_errors(found, walk),
        away / np.array([posterior.heading_sd_rad, posterior.log_frequency_sd]),
    )
