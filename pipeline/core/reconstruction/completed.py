"""Reconstruction of a complete walk from the image of some joints, by maximum a posteriori (MAP) estimation."""

from __future__ import annotations

import numpy as np

from pipeline.core import camera
from pipeline.core.linear_model import LinearModel, of_measured, unflatten, without_joints
from pipeline.core.reconstruction.known_view import from_known_views


def complete_walk(
    model: LinearModel, sample: np.ndarray, view_angle_rad: float, seen: np.ndarray, *, noise_variance: float
) -> np.ndarray:
    """Return a complete walk (5, 15, 3), mm, from one view of some of its joints, by MAP [zhang2007 3.15].

    Visible joints keep their image.  The eigenwalkers give the third coordinate, and all three of the other joints.

    Parameters
    ----------
    model : LinearModel
        Model of 225 numbers, learnt without this walk.
    sample : (225,)
        The walk, mm; only its image is used.
    view_angle_rad : float
    seen : (15,) bool
    noise_variance : float
        sigma² in mm².

    Raises
    ------
    InvalidInput
        As `from_known_views`.
    """
    estimate = from_known_views(
        of_measured(model, seen),
        without_joints(sample, seen),
        np.array([view_angle_rad]),
        noise_variance=noise_variance,
    )
    image = camera.project(unflatten(sample), view_angle_rad)
    completed = camera.combine(image, estimate.missing[0], view_angle_rad)
    expected = unflatten(model.mean + estimate.coefficients[0] @ model.components)
    return np.where(seen[:, None], completed, expected)
