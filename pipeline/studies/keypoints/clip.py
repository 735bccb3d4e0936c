"""One simulated clip of somebody whom the model does not know: filmed, reconstructed, compared with the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.keypoint_walk import Prior, Reconstruction, errors, reconstruct
from pipeline.core.keypoint_walk.calibration import KIND_OF
from pipeline.core.keypoint_walk.objective import HEADING, LOG_F
from pipeline.synthetic.keypoints import SimulatedKeypoints

METHODS = ("keypoint_walk", "average_walker", "image_kept")


@dataclass(frozen=True)
class ClipErrors:
    """Errors of one clip.

    Attributes
    ----------
    view_error_deg : float
        Heading found less true, within ±180.
    cadence_error_percent : float
    distance_mm : (3,)
        Mean distance of the joints, by `METHODS`.
    angle_deg : (3, 4)
        Root mean square error of knees, hips, shanks and elbows.
    joints : (T, 15, 3)
        Errors over standard deviations.
    angles : (T, 8)
    residual_percent : float
        Of the height in the image.
    """

    view_error_deg: float
    cadence_error_percent: float
    distance_mm: np.ndarray
    angle_deg: np.ndarray
    joints: np.ndarray
    angles: np.ndarray
    residual_percent: float


def reconstruct_clip(simulated: SimulatedKeypoints, prior: Prior) -> Reconstruction:
    """Reconstruct a simulated clip of which nothing is known but focal length and frame rate."""
    seen = np.ones(simulated.pixels.shape[:2])
    return reconstruct(
        simulated.pixels, seen, simulated.frame_rate_hz, simulated.focal_px, prior, both_labellings=False
    )


def compare(found: Reconstruction, simulated: SimulatedKeypoints, frequency_hz: float) -> ClipErrors:
    """Compare a reconstruction with the truth.

    Parameters
    ----------
    found : Reconstruction
    simulated : SimulatedKeypoints
    frequency_hz : float
        True stride frequency.
    """
    truth = simulated.positions_mm
    true_angles = errors.level_angles(truth)
    estimates = (found.posterior.positions_mm, errors.average_walker_mm(found), errors.image_kept_mm(found))
    angle = np.empty((len(estimates), KIND_OF.max() + 1))
    for m, estimate in enumerate(estimates):
        squares = np.degrees(errors.level_angles(estimate) - true_angles) ** 2
        angle[m] = [np.sqrt(squares[:, kind == KIND_OF].mean()) for kind in range(angle.shape[1])]
    off = float(np.degrees(found.fit.x[HEADING] - simulated.heading_rad))
    return ClipErrors(
        view_error_deg=(off + 180.0) % 360.0 - 180.0,
        cadence_error_percent=100.0 * (float(np.exp(found.fit.x[LOG_F])) / frequency_hz - 1.0),
        distance_mm=np.array([errors.mean_distance_mm(estimate, truth) for estimate in estimates]),
        angle_deg=angle,
        joints=errors.joint_errors(found, truth),
        angles=errors.angle_errors(found, truth),
        residual_percent=found.relative_residual,
    )
