"""The walker without the detector's bias, in every frame, with error bars.

Symbols
-------
``Sigma'``  inverse Gauss-Newton matrix of the refinement;  ``Sigma`` covariance of W = m + G (W' - offset - m)
``R``       what four harmonics leave of each joint's motion
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from pipeline.core.anatomical import JOINTS
from pipeline.core.fourier import cycle_basis, cycle_slope
from pipeline.core.keypoint_walk.objective import (
    HEADING,
    LOG_F,
    PHASE,
    TURN,
    Keypoints,
    Noise,
)  # fmt: skip
from pipeline.core.keypoint_walk.prior import Prior
from pipeline.core.keypoint_walk.refinement import Fit
from pipeline.core.keypoint_walk.training import BLOCKS, SIZE
from pipeline.core.keypoint_walk.view import level_axes, level_axes_slope
from pipeline.skeleton import WALKER15

PELVIS = WALKER15.index("pelvis")
ANGLES = (
    "left_knee",
    "right_knee",
    "left_hip",
    "right_hip",
    "left_shank",
    "right_shank",
    "left_elbow",
    "right_elbow",
)
"""Joint angles, in the order of every array of them."""
ANGLE_FLOOR_RAD = np.radians(2.0)
"""Standard deviation added to those of joint angles."""


def _angle_joints(name: str) -> tuple[int, int, int, int]:
    """Joints from and to which the two directions of an angle point."""
    side, _, joint = name.partition("_")
    of = {
        part: WALKER15.index(f"{side}_{part}")
        for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    }
    if joint == "knee":
        return of["hip"], of["knee"], of["knee"], of["ankle"]
    if joint == "hip":
        return WALKER15.index("sternum"), PELVIS, of["hip"], of["knee"]
    if joint == "elbow":
        return of["shoulder"], of["elbow"], of["elbow"], of["wrist"]
    return -1, -1, of["knee"], of["ankle"]


_ENDS = np.array([_angle_joints(name) for name in ANGLES])


def joint_angles(positions: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Joint angles (…, 8), rad: 0 is straight; a shank's is from the vertical.

    Parameters
    ----------
    positions : (…, 15, 3)
    down : (3,)
        The vertical, downwards.
    """
    first = positions[..., _ENDS[:, 1], :] - positions[..., _ENDS[:, 0], :]
    first = np.where((_ENDS[:, 0] < 0)[:, None], down, first)
    second = positions[..., _ENDS[:, 3], :] - positions[..., _ENDS[:, 2], :]
    cross = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(cross, (first * second).sum(axis=-1)))


@dataclass(frozen=True)
class Posterior:
    """The walk in every frame, relative to the pelvis, in level camera axes, for a walker of 1500 mm.

    Attributes
    ----------
    walker : (15, 3, 9)
        W, bias given back, mm.
    walker_covariance : (405, 405)
        Sigma, mm².
    positions_mm : (T, 15, 3)
    sd_mm : (T, 15, 3)
    angles_rad, angles_sd_rad : (T, 8)
        As `ANGLES` names them.
    heading_sd_rad, log_frequency_sd : float
    """

    walker: np.ndarray
    walker_covariance: np.ndarray
    positions_mm: np.ndarray
    sd_mm: np.ndarray
    angles_rad: np.ndarray
    angles_sd_rad: np.ndarray
    heading_sd_rad: float
    log_frequency_sd: float


def _inverse(matrix: np.ndarray) -> np.ndarray:
    factor, failed = lapack.dpotrf(matrix, lower=1)
    if failed:
        return np.linalg.pinv(matrix, hermitian=True)
    inverse, _ = lapack.dpotri(factor, lower=1)
    return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)


def give_bias_back(prior: Prior, drawn: np.ndarray) -> np.ndarray:
    """W (15, 3, 9) of the walker W' (405,) as the detector draws him."""
    return prior.model.mean + (prior.giving_back @ (drawn - prior.mean.ravel())).reshape(JOINTS, 3, BLOCKS)


def relative_positions(walker: np.ndarray, x: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Positions (T, 15, 3) relative to the pelvis in level camera axes, mm."""
    basis = cycle_basis(2.0 * np.pi * np.exp(x[LOG_F]) * times + x[PHASE], BLOCKS)
    own = np.moveaxis((walker - walker[PELVIS]) @ basis.T, -1, 0)
    return np.asarray(own @ np.swapaxes(level_axes(x[HEADING] + x[TURN] * times), 1, 2))


def posterior(prior: Prior, fit: Fit, keypoints: Keypoints, noise: Noise) -> Posterior:
    """Compute the walk and its error bars.

    Parameters
    ----------
    prior : Prior
    fit : Fit
    keypoints : Keypoints
        With labels exchanged as `fit.exchanged` says.
    noise : Noise
    """
    x, times = fit.x, fit.objective.setting.times
    T = len(times)
    inverse = _inverse(fit.objective.quadratic(x, keypoints, noise).matrix)
    walker = give_bias_back(prior, x[:SIZE])
    G = prior.giving_back
    covariance = np.empty(inverse.shape)
    covariance[:SIZE, :SIZE] = G @ inverse[:SIZE, :SIZE] @ G.T + prior.remaining
    covariance[:SIZE, SIZE:] = G @ inverse[:SIZE, SIZE:]
    covariance[SIZE:, :SIZE] = covariance[:SIZE, SIZE:].T
    covariance[SIZE:, SIZE:] = inverse[SIZE:, SIZE:]

    omega = 2.0 * np.pi * np.exp(x[LOG_F])
    psi = omega * times + x[PHASE]
    basis, slope = cycle_basis(psi, BLOCKS), cycle_slope(psi, BLOCKS)
    A, dA = level_axes(x[HEADING] + x[TURN] * times), level_axes_slope(x[HEADING] + x[TURN] * times)
    relative = walker - walker[PELVIS]
    own, moving = relative @ basis.T, relative @ slope.T
    positions = np.einsum("tik,jkt->tji", A, own)
    aperiodic = prior.model.aperiodic_variance
    leftover = np.einsum("tik,jk->tji", A**2, aperiodic + aperiodic[PELVIS])
    leftover[:, PELVIS] = 0.0

    # Rows of a joint: its coefficients, minus the pelvis's; then heading, turn, phase, log frequency.
    turned = np.einsum("tik,jkt->jti", dA, own)
    phased = np.einsum("tik,jkt->jti", A, moving)
    others = np.stack(
        [turned, turned * times[:, None], phased, phased * (omega * times)[:, None]], axis=-1
    )  # (15, T, 3, 4)
    direct = (A[..., None] * basis[:, None, None, :]).reshape(T * 3, 27)
    index = [HEADING, TURN, PHASE, LOG_F]
    variance = np.empty((JOINTS, T, 3))
    for joint in range(JOINTS):
        part = np.r_[27 * joint : 27 * (joint + 1), 27 * PELVIS : 27 * (PELVIS + 1), index]
        block = covariance[np.ix_(part, part)]
        rows = np.concatenate([direct, -direct, others[joint].reshape(T * 3, 4)], axis=1)
        variance[joint] = ((rows @ block) * rows).sum(axis=1).reshape(T, 3)
    variance[PELVIS] = 0.0

    angles, angle_variance = _angles(walker, covariance, psi, omega, times)
    return Posterior(
        walker=walker,
        walker_covariance=covariance[:SIZE, :SIZE],
        positions_mm=positions,
        sd_mm=np.sqrt(np.maximum(np.moveaxis(variance, 0, 1), 0.0) + leftover),
        angles_rad=angles,
        angles_sd_rad=np.sqrt(angle_variance + ANGLE_FLOOR_RAD**2),
        heading_sd_rad=float(np.sqrt(covariance[HEADING, HEADING])),
        log_frequency_sd=float(np.sqrt(covariance[LOG_F, LOG_F])),
    )


def sample_positions(
    found: Posterior, x: np.ndarray, times: np.ndarray, generator: np.random.Generator, count: int
) -> np.ndarray:
    """Walks (S, T, 15, 3) drawn from the posterior of walker and heading: about the pelvis, level camera axes, mm.

    Parameters
    ----------
    found : Posterior
    x : (417,)
        Unknowns of the fit.
    times : (T,)
    generator : numpy.random.Generator
    count : int

    Notes
    -----
    Of periodic walkers: what changes from step to step is in `Posterior.sd_mm`, not in these.
    """
    values, vectors = np.linalg.eigh(found.walker_covariance)
    drawn = generator.standard_normal((count, SIZE + 1))
    off = (drawn[:, :SIZE] * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    walks = []
    for walker, turn in zip(off.reshape(count, *found.walker.shape), drawn[:, SIZE], strict=True):
        turned = x.copy()
        turned[HEADING] += turn * found.heading_sd_rad
        walks.append(relative_positions(found.walker + walker, turned, times))
    return np.stack(walks)


_DOWN = np.array([0.0, 0.0, -1.0])


def _angles(
    walker: np.ndarray, covariance: np.ndarray, psi: np.ndarray, omega: float, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles (T, 8) in the walker's frame and their variances."""
    basis, slope = cycle_basis(psi, BLOCKS), cycle_slope(psi, BLOCKS)
    own = np.moveaxis(walker @ basis.T, -1, 0)
    angles = joint_angles(own, _DOWN)
    variance = np.empty_like(angles)
    moving = np.moveaxis(walker @ slope.T, -1, 0)
    for number, ends in enumerate(_ENDS):
        joints = sorted({int(j) for j in ends if j >= 0})
        first = own[:, ends[1]] - own[:, ends[0]] if ends[0] >= 0 else np.broadcast_to(_DOWN, (len(psi), 3))
        second = own[:, ends[3]] - own[:, ends[2]]
        to_first, to_second = _angle_slopes(first, second)
        slopes = {joint: np.zeros((len(psi), 3)) for joint in joints}
        if ends[0] >= 0:
            slopes[int(ends[1])] += to_first
            slopes[int(ends[0])] -= to_first
        slopes[int(ends[3])] += to_second
        slopes[int(ends[2])] -= to_second
        rows = [(slopes[j][:, :, None] * basis[:, None]).reshape(len(psi), 27) for j in joints]
        phased = sum((slopes[j] * moving[:, j]).sum(axis=1) for j in joints)
        rows += [np.stack([phased, phased * omega * times], axis=1)]
        part = np.r_[tuple(np.arange(27 * j, 27 * (j + 1)) for j in joints)]
        part = np.concatenate([part, [PHASE, LOG_F]])
        stacked = np.concatenate(rows, axis=1)
        variance[:, number] = ((stacked @ covariance[np.ix_(part, part)]) * stacked).sum(axis=1)
    return angles, np.maximum(variance, 0.0)


def _angle_slopes(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (T, 3) of the angle between two vectors (T, 3) with respect to each."""
    a = first / np.linalg.norm(first, axis=1, keepdims=True)
    b = second / np.linalg.norm(second, axis=1, keepdims=True)
    cosine = (a * b).sum(axis=1, keepdims=True)
    # Straight limbs: the slope's direction is arbitrary, its size is not.
    sine = np.maximum(np.sqrt(np.maximum(1.0 - cosine**2, 0.0)), 1e-3)
    return (
        -(b - cosine * a) / sine / np.linalg.norm(first, axis=1, keepdims=True),
        -(a - cosine * b) / sine / np.linalg.norm(second, axis=1, keepdims=True),
    )
