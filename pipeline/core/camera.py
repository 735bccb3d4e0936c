"""Orthographic projection under a horizontal view: zhang2007 sections 3.2 and 4, appendix B.

Symbols
-------
``alpha``  view angle, rad: 0 is the frontal view, -pi/2 the left profile, +pi/2 the right profile
``C``      projection matrix, 225 -> 150 [zhang2007 3.5]
``w_hat``  2D Fourier representation (5, 15, 2): horizontal, vertical; flat (150,) in the printed order

Image horizontal = cos(alpha) x + sin(alpha) y, image vertical = z, missing = -sin(alpha) x + cos(alpha) y.

An orthographic image of the back is the mirror image of one of the front.  With +x to the walker's right the
printed horizontal [zhang2007 B.2] puts that right on the right of the image at alpha = 0, as seen from behind
(or in a mirror from the front); at +pi/2 the walk runs to the right of the image and the right side faces us.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15


def horizontal(motion: np.ndarray, view_angle_rad: float | np.ndarray) -> np.ndarray:
    """Return the horizontal image coordinate of points (…, 3): cos(alpha) x + sin(alpha) y [zhang2007 B.2].

    Examples
    --------
    >>> float(np.round(horizontal(np.array([1.0, 2.0, 3.0]), np.pi / 2), 12))
    2.0
    """
    return np.cos(view_angle_rad) * motion[..., 0] + np.sin(view_angle_rad) * motion[..., 1]


def vertical(motion: np.ndarray) -> np.ndarray:
    """Return the vertical image coordinate of points (…, 3): z in every view [zhang2007 B.3]."""
    return np.asarray(motion)[..., 2]


def missing_dimension(motion: np.ndarray, view_angle_rad: float | np.ndarray) -> np.ndarray:
    """Return the coordinate along the viewing direction, which the image lacks: -sin(alpha) x + cos(alpha) y."""
    return -np.sin(view_angle_rad) * motion[..., 0] + np.cos(view_angle_rad) * motion[..., 1]


def project(motion: np.ndarray, view_angle_rad: float | np.ndarray) -> np.ndarray:
    """Project 3D motion or a Fourier representation (…, 3) to 2D (…, 2) [zhang2007 3.4] [zhang2004 4].

    The projection is linear, so it does to Fourier coefficients what it does to positions.
    """
    return np.stack(np.broadcast_arrays(horizontal(motion, view_angle_rad), vertical(motion)), axis=-1)


def combine(observed: np.ndarray, missing: np.ndarray, view_angle_rad: float | np.ndarray) -> np.ndarray:
    """Return 3D motion (…, 3) from the 2D image (…, 2) and the missing dimension (…) [zhang2007 3.16] [zhang2004 10].

    The inverse of `project` with `missing_dimension`; the observed coordinates are kept as they are.
    """
    c, s = np.cos(view_angle_rad), np.sin(view_angle_rad)
    across = observed[..., 0]
    whole = c * across - s * missing, s * across + c * missing, observed[..., 1]
    return np.stack(np.broadcast_arrays(*whole), axis=-1)


def projection_matrix(view_angle_rad: float, *, trailing: int = 0) -> np.ndarray:
    """Return the projection matrix C (150, 225) [zhang2007 3.5] [zhang2004 5].

    With one trailing number it is (151, 226).

    Parameters
    ----------
    view_angle_rad : float
    trailing : int
        1 when the frequency is the last number of the representation (zhang2004), which is observed as it is.

    Notes
    -----
    The printed form; sweeps project by axis, with `horizontal` and `vertical`.
    """
    points = 5 * len(WALKER15.joints)
    of_point = np.array([[np.cos(view_angle_rad), np.sin(view_angle_rad), 0.0], [0.0, 0.0, 1.0]])
    matrix = np.zeros((2 * points + trailing, 3 * points + trailing))
    matrix[: 2 * points, : 3 * points] = np.kron(np.eye(points), of_point)
    matrix[2 * points :, 3 * points :] = np.eye(trailing)
    return matrix
