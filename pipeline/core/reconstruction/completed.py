"""A whole walk from one view, by MAP: the image is kept, and what it does not show comes from the eigenwalkers."""

from __future__ import annotations

import numpy as np

from pipeline.core import camera
from pipeline.core.linear_model import LinearModel, of_measured, unflatten, without_joints
from pipeline.core.reconstruction.known_view import from_known_views


def complete_walk(
    model: LinearModel, sample: np.ndarray, view_angle_rad: float, seen: np.ndarray, *, noise_variance: float
) -> np.ndarray:
    """Return a walk (5, 15, 3), mm, of which one view shows some joints, by MAP [zhang2007 3.15].

    The image of the joints that are seen is kept; of the others the eigenwalkers give all three coordinates.

    Parameters
    ----------
    model : LinearModel
        Of 225 numbers, learnt without this walk.
    sample : (225,)
        The walk, mm; its image alone is used.
    view_angle_rad : float
    seen : (15,) bool
    noise_variance : float
        sigma² in mm².

    Raises
    ------
    InvalidInput
        As `from_known_views`.
    """
    found = from_known_views(
        of_measured(model, seen),
        without_joints(sample, seen),
        np.array([view_angle_rad]),
        noise_variance=noise_variance,
    )
    image = camera.project(unflatten(sample), view_angle_rad)
    completed = camera.combine(image, found.missing[0], view_angle_rad)
    expected = unflatten(model.mean + found.coefficients[0] @ model.components)
    return np.where(seen[:, None], completed, expected)
