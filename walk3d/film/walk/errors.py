"""Errors, against the ground truth, of a reconstructed walk and of two baselines."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.skeleton import ANKLES, LEFT_LEG, PELVIS, RIGHT_LEG, WALKER15
from pipeline.validation import InvalidInput
from walk3d.anatomy.prior.stance import stance_rows
from walk3d.film.walk.calibration import StandardErrors
from walk3d.film.walk.cycle import EVENT_DELAYS, deviations, gait_cycle
from walk3d.film.walk.objective import HEADING, LOG_F, TURN
from walk3d.film.walk.posterior import relative_positions
from walk3d.film.walk.reconstruction import Reconstruction
from walk3d.film.walk.sagittal_angles import sagittal_angles
from walk3d.film.walk.training import TrainingWalk
from walk3d.film.walk.view import level_axes

_HIPS = [LEFT_LEG[0], RIGHT_LEG[0]]
SCORED = [joint for joint in range(len(WALKER15.joints)) if joint != PELVIS]
"""Joints whose errors are averaged: all joints except the pelvis, which is the origin."""
_MIN_SD_MM = 1e-9


def level_angles(positions_mm: np.ndarray, heading_rad: np.ndarray | float) -> np.ndarray:
    """Return joint angles (T, 11), rad, given positions (T, 15, 3) in level camera axes and headings (T,), rad."""
    return sagittal_angles(positions_mm @ level_axes(heading_rad))


def headings(reconstruction: Reconstruction) -> np.ndarray:
    """Return the estimated headings (T,), rad, of all frames."""
    x = reconstruction.fit.x
    return x[HEADING] + x[TURN] * reconstruction.fit.times


def fitted_scale(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Return the factor that scales an estimate to the ground truth in the least-squares sense.

    The scale is not counted as an error, because one camera cannot distinguish size from distance.
    """
    return (estimate_mm * truth_mm).sum() / (estimate_mm**2).sum()


def mean_distance_mm(estimate_mm: np.ndarray, truth_mm: np.ndarray) -> float:
    """Return the mean distance of joints from the ground truth, mm, after the estimate (T, 15, 3) is scaled once."""
    off = fitted_scale(estimate_mm, truth_mm) * estimate_mm - truth_mm
    return np.linalg.norm(off[:, SCORED], axis=-1).mean()


def joint_errors(reconstruction: Reconstruction, truth_mm: np.ndarray) -> np.ndarray:
    """Return joint errors (T, 15, 3), divided by the posterior's standard deviations; 0 for the pelvis."""
    estimate, sd = reconstruction.posterior.positions_mm, reconstruction.posterior.sd_mm
    scale = fitted_scale(estimate, truth_mm)
    return (scale * estimate - truth_mm) / np.maximum(scale * sd, _MIN_SD_MM)


def event_errors(
    reconstruction: Reconstruction, truth_mm: np.ndarray, heading_rad: float
) -> list[np.ndarray]:
    """Return the errors of contact times and of toe-off times, each (n, 2), in seconds and in standard deviations.

    Each true event, from a spline through the recorded ankles, is compared with the nearest estimate.  Both feet are
    pooled.
    """
    times, frequency = reconstruction.fit.times, reconstruction.fit.frequency_hz
    walker_mm = truth_mm @ level_axes(heading_rad)
    errors = []
    for sign, later, of_sides in zip((1.0, -1.0), EVENT_DELAYS, reconstruction.event_times, strict=True):
        off = []
        for ankle, (at, sd) in zip(ANKLES, of_sides, strict=True):
            ahead = CubicSpline(times, sign * (walker_mm[:, ankle, 1] - walker_mm[:, PELVIS, 1]))
            turning = ahead.derivative().roots(extrapolate=False)
            true = turning[ahead(turning) > 0.5 * np.max(ahead(times))] + later / frequency
            if len(at) and len(true):
                nearest = np.abs(at - true[:, None]).argmin(axis=1)
                late = at[nearest] - true
                # At the ends of a clip the nearest event may belong to another step.
                close = np.abs(late) < 0.25 / frequency
                off.append(np.stack([late, late / sd[nearest]], axis=1)[close])
        errors.append(np.concatenate(off) if off else np.empty((0, 2)))
    return errors


def number_errors(reconstruction: Reconstruction, walk: TrainingWalk) -> np.ndarray:
    """Return the errors (25,) of the gait-cycle numbers of a reconstruction, in units of their standard deviations."""
    truth = gait_cycle(walk.walker, walk.frequency_hz, stance_rows(walk.walker)[1])
    off = reconstruction.cycle.values - truth.values
    return off / deviations(reconstruction.cycle.slopes, reconstruction.posterior.covariance)


def average_walker_mm(reconstruction: Reconstruction) -> np.ndarray:
    """Return a baseline (T, 15, 3), mm: the average walker with the estimated heading, phase and stride frequency."""
    return relative_positions(
        reconstruction.fit.objective.prior.model.mean, reconstruction.fit.x, reconstruction.fit.times
    )


def image_kept_mm(reconstruction: Reconstruction) -> np.ndarray:
    """Return a baseline (T, 15, 3), mm: the observed positions in the image, with the average walker's depth.

    Missing keypoints are those of the average walker.  The origin is the pelvis, or the middle of the hips if the
    pelvis is never seen.

    Raises
    ------
    InvalidInput
        If neither the pelvis nor the hips are ever seen.
    """
    estimate = average_walker_mm(reconstruction)
    a, b = reconstruction.starts.path.distance
    metric = reconstruction.keypoints.pixels * (a + b * reconstruction.fit.times)[:, None, None]
    visible = reconstruction.keypoints.weights > 0
    middle = [PELVIS] if visible[:, PELVIS].any() else _HIPS
    frames = np.flatnonzero(visible[:, middle].all(axis=1))
    if not len(frames):
        raise InvalidInput(
            "neither the pelvis nor both hips are visible in any frame", code="pelvis_not_seen"
        )
    origin = metric[:, middle].mean(axis=1)
    every = np.arange(len(metric))
    pelvis = np.stack([np.interp(every, frames, origin[frames, axis]) for axis in (0, 1)], axis=-1)
    estimate[..., :2] = np.where(visible[..., None], metric - pelvis[:, None], estimate[..., :2])
    return estimate


def standard_errors(
    reconstruction: Reconstruction,
    truth_mm: np.ndarray,
    heading_rad: float,
    walk: TrainingWalk,
    events: list[np.ndarray],
) -> StandardErrors:
    """Return all errors of a reconstructed clip in units of the posterior's standard deviations."""
    x, posterior = reconstruction.fit.x, reconstruction.posterior
    off = x[HEADING] - heading_rad
    away = [np.arctan2(np.sin(off), np.cos(off)), x[LOG_F] - np.log(walk.frequency_hz)]
    return StandardErrors(
        joint_errors(reconstruction, truth_mm),
        (posterior.angles_rad - level_angles(truth_mm, heading_rad)) / posterior.angles_sd_rad,
        [of_event[:, 1] for of_event in events],
        number_errors(reconstruction, walk),
        away / np.array([posterior.heading_sd_rad, posterior.log_frequency_sd]),
    )
