"""Reconstructions of whole skeletons before several cameras, and their errors: what figure 4 of park2011 shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Motions:
    """Reconstructions of N clips from C cameras, their errors, and what the data say of each limb.

    Attributes
    ----------
    cameras : (C,) text
    stretch : (N,) int
        Of the data set.
    truth : (N, F, 15, 3)
        mm.
    positions : (N, C, F, 15, 3)
        mm.
    images : (N, C, F, 15, 2)
        px.
    camera_matrix : (N, C, F, 3, 4)
        A homogeneous point of the world, mm, to one of the image, px.
    imputed : (N, C, F, 15) bool
    azimuth_rad : (N, C)
        Of the camera in its middle frame.
    error_mm : (N, C, F, 15)
        Relative to the pelvis.
    error_up_to_mirror_mm, reprojection_error_px, reconstructibility_of_clip : (N, C)
    reconstructibility, mirror_margin, limb_error, length_change : (N, C, 14)
    length_ratio : (N, C, 14)
        Of the length that was assumed to the true one.
    hanging_error_mm, mean_pose_error_mm : (N, C)
        As the mean of `error_mm` over frames and limbs, of skeletons that do nothing (`nulls`).
    papers_error_mm, papers_error_sd_mm : (N, C)
        Mean of `error_mm` over limbs, and over frames its mean and standard deviation, in the paper's conditions; this
        and what follows NaN if they were not asked for.
    papers_error_up_to_mirror_mm, papers_length_change_max, papers_acceleration_ratio : (N, C)
        In the paper's conditions; the last as `acceleration_ratio`.
    papers_random_signs_acceleration_ratio : (N, C)
        Of candidates chosen at random.
    papers_true_root_error_mm : (N, C)
        As `papers_error_mm`, with the true root before the still camera as well.
    camera_outside_basis : (N, C)
        What the trajectory basis leaves of the camera's path about its mean, as part of it; 0 if it stands still.
    papers_hanging_error_mm : (N, C)
        As `hanging_error_mm`, with the lengths of the paper's conditions.
    objective, chosen_objective, best_objective, lower_bound : (N, C, 14)
        Of the programme's signs, of the trajectory that was made of them, of the best that is known, and a bound, on
        the same programme, mm².
    proved, mirrored : (N, C, 14) bool
    components : (N, C, 14) int
    """

    cameras: np.ndarray
    stretch: np.ndarray
    truth: np.ndarray
    positions: np.ndarray
    images: np.ndarray
    camera_matrix: np.ndarray
    imputed: np.ndarray
    azimuth_rad: np.ndarray
    error_mm: np.ndarray
    error_up_to_mirror_mm: np.ndarray
    reprojection_error_px: np.ndarray
    reconstructibility_of_clip: np.ndarray
    reconstructibility: np.ndarray
    mirror_margin: np.ndarray
    limb_error: np.ndarray
    length_change: np.ndarray
    length_ratio: np.ndarray
    hanging_error_mm: np.ndarray
    mean_pose_error_mm: np.ndarray
    papers_error_mm: np.ndarray
    papers_error_sd_mm: np.ndarray
    papers_error_up_to_mirror_mm: np.ndarray
    papers_length_change_max: np.ndarray
    papers_acceleration_ratio: np.ndarray
    papers_random_signs_acceleration_ratio: np.ndarray
    papers_hanging_error_mm: np.ndarray
    papers_true_root_error_mm: np.ndarray
    camera_outside_basis: np.ndarray
    objective: np.ndarray
    chosen_objective: np.ndarray
    best_objective: np.ndarray
    lower_bound: np.ndarray
    proved: np.ndarray
    mirrored: np.ndarray
    components: np.ndarray


@dataclass(frozen=True)
class MotionsOfBoth:
    """The same clips with the mirror of each limb as the limb alone chooses it, and tried in the whole skeleton."""

    as_chosen: Motions
    mirrors_tried: Motions | None
    """None if they were not tried; nothing in the paper's conditions, and no certificates beside."""
