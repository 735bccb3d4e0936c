"""Reconstruction of one simulated clip of a left-out person, and comparison with the ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.skeleton import WALKER15
from walk3d.film.simulation.keypoints import SimulatedKeypoints
from walk3d.film.study.conditions import Condition
from walk3d.film.walk import Prior, Reconstruction, TrainingWalk, errors, reconstruct
from walk3d.film.walk.calibration import KIND_OF, StandardErrors
from walk3d.film.walk.exchanged import exchange_all
from walk3d.film.walk.objective import HEADING, LOG_F
from walk3d.film.walk.verdict import judge

METHODS = ("keypoint_walk", "average_walker", "image_kept")


@dataclass(frozen=True)
class ClipErrors:
    """Errors of the reconstruction of one clip.

    Attributes
    ----------
    view_error_deg : float
        Estimated minus true heading, within ±180.
    cadence_error_percent : float
    distance_mm : (3,)
        Mean distance of the joints, by `METHODS`.
    angle_deg : (3, 6)
        Root mean square error of knees, hips, shanks, elbows, shoulders and the trunk.
    event_ms : (2,)
        Median distance of contacts and of toe-offs from the true ones; NaN if the clip contains none.
    over_sd : StandardErrors
    residual_percent : float
        Residual, per cent of the height in the image.
    verdict : str
        Verdict on the clip.
    labels_right, labels_unsure : bool
        True if left and right are the walker's; True if both labellings would be returned.
    """

    view_error_deg: float
    cadence_error_percent: float
    distance_mm: np.ndarray
    angle_deg: np.ndarray
    event_ms: np.ndarray
    over_sd: StandardErrors
    residual_percent: float
    verdict: str
    labels_right: bool
    labels_unsure: bool


def reconstruct_clip(simulated: SimulatedKeypoints, prior: Prior, condition: Condition) -> Reconstruction:
    """Reconstruct a simulated clip from its keypoints, focal length and frame rate."""
    pixels = exchange_all(simulated.pixels) if condition.wrong_labels else simulated.pixels.copy()
    pixels[:, [WALKER15.index(joint) for joint in condition.hidden]] = np.nan
    return reconstruct(
        pixels,
        np.ones(pixels.shape[:2]),
        simulated.frame_rate_hz,
        simulated.focal_px * condition.focal_factor,
        prior,
        condition.fitting,
    )


def compare(
    reconstruction: Reconstruction, simulated: SimulatedKeypoints, walk: TrainingWalk, condition: Condition
) -> ClipErrors:
    """Compare the reconstruction of a simulated clip with the ground truth.

    Parameters
    ----------
    reconstruction : Reconstruction
    simulated : SimulatedKeypoints
    walk : TrainingWalk
        The whole walk that was filmed.
    condition : Condition
    """
    truth, heading = simulated.positions_mm, simulated.heading_rad
    true_angles, headings = errors.level_angles(truth, heading), errors.headings(reconstruction)
    events = errors.event_errors(reconstruction, truth, heading)
    estimates = (
        reconstruction.posterior.positions_mm,
        errors.average_walker_mm(reconstruction),
        errors.image_kept_mm(reconstruction),
    )
    angle = np.empty((len(estimates), KIND_OF.max() + 1))
    for m, estimate in enumerate(estimates):
        squares = np.degrees(errors.level_angles(estimate, headings) - true_angles) ** 2
        angle[m] = [np.sqrt(squares[:, kind == KIND_OF].mean()) for kind in range(angle.shape[1])]
    off = np.degrees(reconstruction.fit.x[HEADING] - simulated.heading_rad)
    return ClipErrors(
        view_error_deg=(off + 180.0) % 360.0 - 180.0,
        cadence_error_percent=100.0 * (np.exp(reconstruction.fit.x[LOG_F]) / walk.frequency_hz - 1.0),
        distance_mm=np.array([errors.mean_distance_mm(estimate, truth) for estimate in estimates]),
        angle_deg=angle,
        event_ms=np.array([1000.0 * np.median(np.abs(z[:, 0])) if len(z) else np.nan for z in events]),
        over_sd=errors.standard_errors(reconstruction, truth, heading, walk, events),
        residual_percent=reconstruction.relative_residual,
        verdict=str(judge(reconstruction).verdict),
        labels_right=reconstruction.labels_exchanged == condition.wrong_labels,
        labels_unsure=reconstruction.labels_unsure,
    )
