"""Errors of a reconstruction in the missing dimension: zhang2007 section 4.2, zhang2004 section 4.2.

Symbols
-------
``E_abs(j)``  mean over time of the squared error in the missing dimension of joint j, mm².  The papers call
              it absolute; it is a mean square.
``E_rel(j)``  the same over the variance of the missing dimension [zhang2007 4.3]; that variance is printed as
              sigma² too, but is not the noise variance of [zhang2007 3.12]
``delta``     difference of Fourier coefficients in the missing dimension, (…, 1 + 2H, J)

By Parseval the mean over a cycle of a Fourier series squared is |p0|² + ½ sum(|p_h|² + |q_h|²), so that the
sums over time of the papers need no time.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import camera
from pipeline.validation import require_choice


def parseval_weights(blocks: int) -> np.ndarray:
    """Return the weights (1 + 2H,) of the Fourier coefficients in the mean square over a cycle: 1, ½, ½, …."""
    return np.concatenate([[1.0], np.full(blocks - 1, 0.5)])


def absolute_error(delta: np.ndarray, residual_power: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the mean squared error of each joint over a cycle, E_abs (…, J), mm².

    It is computed from coefficient differences (…, 1 + 2H, J) [zhang2007 4.1] [zhang2004 11].

    `residual_power` (…, J) is the mean square of what the truth has beyond its series (`truth: motion`); it
    adds exactly where residual and harmonics are orthogonal over whole cycles.
    """
    return np.einsum("...bj,b->...j", np.square(delta), parseval_weights(delta.shape[-2])) + residual_power


def absolute_error_over_time(original: np.ndarray, reconstructed: np.ndarray) -> np.ndarray:
    """Return the mean squared error of each joint, E_abs (J,), mm², over the frames of two motions (T, J).

    This is the published form [zhang2007 4.1] [zhang2004 11].
    """
    return np.mean(np.square(np.asarray(original) - np.asarray(reconstructed)), axis=0)


def relative_error(absolute: np.ndarray, variance: np.ndarray | float) -> np.ndarray:
    """Return the relative error E_rel: E_abs divided by the variance of the missing dimension [zhang2007 4.3]
    [zhang2004 12].
    """
    return absolute / variance


def walker_error(per_joint: np.ndarray) -> np.ndarray:
    """Return the error of a walker, the mean of joint errors E_abs or E_rel [zhang2007 4.2] [zhang2007 4.4]
    [zhang2004 13].

    The joints are the last axis.

    Joints without an error (NaN) were not measured and are left out.
    """
    unknown = np.isnan(per_joint)
    if not unknown.any():
        return np.mean(per_joint, axis=-1)
    return np.where(unknown, 0.0, per_joint).sum(axis=-1) / (~unknown).sum(axis=-1)


def along_missing(covariance: np.ndarray, view_angle_rad: np.ndarray) -> np.ndarray:
    """Return the variance (A, …) along the viewing direction at A view angles, from covariance matrices (…, 3, 3)."""
    angle = np.asarray(view_angle_rad).reshape(-1, *([1] * (covariance.ndim - 2)))
    c, s = np.cos(angle), np.sin(angle)
    return s**2 * covariance[..., 0, 0] - 2 * s * c * covariance[..., 0, 1] + c**2 * covariance[..., 1, 1]


def missing_variance(
    temporal_covariance: np.ndarray,
    average_posture: np.ndarray,
    view_angle_rad: np.ndarray,
    *,
    kind: str = "temporal",
) -> np.ndarray:
    """Return the variance of the missing dimension at A view angles, averaged over the fifteen joints, (A,) mm².

    The paper calls it the average overall variance.

    Parameters
    ----------
    temporal_covariance : (J, 3, 3)
        mm².
    average_posture : (J, 3)
        mm.
    view_angle_rad : (A,)
    kind : {"temporal", "overall"}
        ``temporal``: variance over time of each joint, averaged over joints; ``overall``: all joints and
        instants about their common mean.  The paper's words allow both.
    """
    require_choice("the kind of variance", kind, ("temporal", "overall"))
    view_angle_rad = np.atleast_1d(view_angle_rad)
    variance = along_missing(temporal_covariance, view_angle_rad).mean(axis=-1)
    if kind == "temporal":
        return variance
    places = camera.missing_dimension(average_posture[None], view_angle_rad[:, None])
    return variance + places.var(axis=-1)
