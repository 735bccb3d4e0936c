"""Estimate of the walker in each frame, without the detector's bias, with error bars.

Symbols
-------
``Sigma'``  inverse Gauss-Newton matrix of the refinement;  ``Sigma`` covariance of W = m + G (W' - offset - m)
``R``       variance of each joint's motion beyond four harmonics
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from pipeline.core.fourier import cycle_basis, cycle_slope
from pipeline.skeleton import PELVIS
from walk3d.anatomy.prior import JOINTS
from walk3d.film.walk.objective import (
    HEADING,
    LOG_F,
    PHASE,
    TURN,
    Keypoints,
)  # fmt: skip
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.refinement import Fit
from walk3d.film.walk.sagittal_angles import JOINTS_OF, sagittal_angles, sagittal_slopes
from walk3d.film.walk.training import BLOCKS, SIZE
from walk3d.film.walk.view import level_axes

ANGLE_FLOOR_RAD = np.radians(2.0)
"""Standard deviation, rad, that is added in quadrature to the standard deviation of each joint angle."""


@dataclass(frozen=True)
class Posterior:
    """Estimated walk in each frame, relative to the pelvis and scaled to a walker of 1500 mm.

    Positions are in level camera axes.

    Attributes
    ----------
    walker : (15, 3, 9)
        W, without the detector's bias, mm.
    covariance : (407, 407)
        Covariance of W (Sigma, mm²), of the phase in the middle of the clip and of the logarithm of the frequency.
    positions_mm : (T, 15, 3)
    sd_mm : (T, 15, 3)
    angles_rad, angles_sd_rad : (T, 11)
        Angles in the order of `ANGLES`, in the walker's plane of progression.
    heading_sd_rad, log_frequency_sd : float
    """

    walker: np.ndarray
    covariance: np.ndarray
    positions_mm: np.ndarray
    sd_mm: np.ndarray
    angles_rad: np.ndarray
    angles_sd_rad: np.ndarray
    heading_sd_rad: float
    log_frequency_sd: float


def _spread(matrix: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """Return ``onto^T M^-1 onto``, given the lower triangle of a Gauss-Newton matrix M."""
    factor, failed = lapack.dpotrf(matrix, lower=1)
    if failed:
        return onto.T @ np.linalg.pinv(np.tril(matrix) + np.tril(matrix, -1).T, hermitian=True) @ onto
    half, _ = lapack.dtrtrs(factor, onto, lower=1)
    return half.T @ half


def remove_bias(prior: Prior, drawn: np.ndarray) -> np.ndarray:
    """Return the walker W (15, 3, 9), mm, by removing the detector's bias from the detected walker W' (405,)."""
    return prior.model.mean + (prior.bias_gain @ (drawn - prior.mean.ravel())).reshape(JOINTS, 3, BLOCKS)


def relative_positions(walker: np.ndarray, x: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the positions (T, 15, 3) of a walker's joints relative to the pelvis, in level camera axes, mm."""
    basis = cycle_basis(2.0 * np.pi * np.exp(x[LOG_F]) * times + x[PHASE], BLOCKS)
    positions = np.moveaxis((walker - walker[PELVIS]) @ basis.T, -1, 0)
    return positions @ np.swapaxes(level_axes(x[HEADING] + x[TURN] * times), 1, 2)


def posterior(prior: Prior, fit: Fit, keypoints: Keypoints) -> Posterior:
    """Return the estimated walk in each frame, with its error bars.

    Parameters
    ----------
    prior : Prior
    fit : Fit
    keypoints : Keypoints
        Keypoints with labels exchanged as in `fit.exchanged`.
    """
    x, times = fit.x, fit.times
    T = len(times)
    matrix = fit.objective.quadratic(fit.objective.at(x), keypoints, fit.noise).matrix
    walker = remove_bias(prior, x[:SIZE])
    back = np.eye(len(x), order="F")
    back[:SIZE, :SIZE] = prior.bias_gain.T
    covariance = _spread(matrix, back)
    covariance[:SIZE, :SIZE] += prior.remaining

    omega, psi = 2.0 * np.pi * fit.frequency_hz, fit.phases_rad
    basis, slope = cycle_basis(psi, BLOCKS), cycle_slope(psi, BLOCKS)
    A = level_axes(x[HEADING] + x[TURN] * times)
    relative = walker - walker[PELVIS]
    positions, phased = (np.einsum("tik,jkt->jti", A, relative @ waves.T) for waves in (basis, slope))
    aperiodic = prior.model.aperiodic_variance
    leftover = np.einsum("tik,jk->tji", A**2, aperiodic + aperiodic[PELVIS])
    leftover[:, PELVIS] = 0.0

    # Rows of a joint: its coefficients, minus the pelvis's; then heading, turn, phase, log frequency.
    turned = np.stack([-positions[..., 2], np.zeros((JOINTS, T)), positions[..., 0]], axis=-1)
    others = np.stack(
        [turned, turned * times[:, None], phased, phased * (omega * times)[:, None]], axis=-1
    )  # (15, T, 3, 4)
    direct = (A[..., None] * basis[:, None, None, :]).reshape(T * 3, 27)
    index = [HEADING, TURN, PHASE, LOG_F]
    variance = np.empty((JOINTS, T, 3))
    for joint in range(JOINTS):
        part = np.r_[27 * joint : 27 * (joint + 1), 27 * PELVIS : 27 * (PELVIS + 1), index]
        block = covariance[np.ix_(part, part)]
        rows = np.hstack([direct, -direct, others[joint].reshape(T * 3, 4)])
        variance[joint] = ((rows @ block) * rows).sum(axis=1).reshape(T, 3)
    variance[PELVIS] = 0.0

    heading_sd = np.sqrt(covariance[HEADING, HEADING])
    of_walk = np.r_[:SIZE, PHASE, LOG_F]
    covariance = covariance[np.ix_(of_walk, of_walk)]
    timed = np.zeros((T, SIZE + 2))
    timed[:, SIZE], timed[:, SIZE + 1] = 1.0, omega * times
    angles, angles_sd = angles_with_deviations(walker, covariance, psi, timed)
    return Posterior(
        walker=walker,
        covariance=covariance,
        positions_mm=np.moveaxis(positions, 0, 1),
        sd_mm=np.sqrt(np.maximum(np.moveaxis(variance, 0, 1), 0.0) + leftover),
        angles_rad=angles,
        angles_sd_rad=angles_sd,
        heading_sd_rad=heading_sd,
        log_frequency_sd=np.sqrt(covariance[-1, -1]),
    )


def sample_positions(
    estimate: Posterior, x: np.ndarray, times: np.ndarray, generator: np.random.Generator, count: int
) -> np.ndarray:
    """Draw walks (S, T, 15, 3), mm, from the posterior distribution of the walker and the heading.

    Positions are relative to the pelvis, in level camera axes.

    Parameters
    ----------
    estimate : Posterior
    x : (417,)
        Unknowns of the fit.
    times : (T,)
    generator : numpy.random.Generator
    count : int

    Notes
    -----
    The samples are periodic: changes from step to step are part of `Posterior.sd_mm` only.
    """
    values, vectors = np.linalg.eigh(estimate.covariance[:SIZE, :SIZE])
    drawn = generator.standard_normal((count, SIZE + 1))
    off = (drawn[:, :SIZE] * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    walks = []
    for walker, turn in zip(off.reshape(count, *estimate.walker.shape), drawn[:, SIZE], strict=True):
        turned = x.copy()
        turned[HEADING] += turn * estimate.heading_sd_rad
        walks.append(relative_positions(estimate.walker + walker, turned, times))
    return np.stack(walks)


def angles_with_deviations(
    walker: np.ndarray, covariance: np.ndarray, psi: np.ndarray, phase_slopes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a walker's joint angles (T, 11) at the given phases, rad, and their standard deviations.

    The standard deviations contain `ANGLE_FLOOR_RAD`.

    Parameters
    ----------
    walker : (15, 3, 9)
    covariance : (407, 407)
        Covariance of the walker, its phase and the logarithm of its frequency.
    psi : (T,)
        Phases.
    phase_slopes : (T, 407)
        Derivatives of the phases with respect to these unknowns.
    """
    basis = cycle_basis(psi, BLOCKS)
    positions, moving = (np.moveaxis(walker @ waves.T, -1, 0) for waves in (basis, cycle_slope(psi, BLOCKS)))
    slopes = sagittal_slopes(positions)
    rates = np.einsum("tajx,tjx->ta", slopes, moving)
    # An angle depends on a few joints directly, and on all unknowns through the phase: the parts are added separately.
    of_phases = phase_slopes @ covariance
    variance = rates**2 * (of_phases * phase_slopes).sum(axis=-1)[:, None]
    unknown = np.arange(SIZE).reshape(JOINTS, 3, BLOCKS)
    for number, joints in enumerate(JOINTS_OF):
        part = unknown[joints, 1:].ravel()
        rows = (slopes[:, number, joints, 1:, None] * basis[:, None, None]).reshape(len(psi), -1)
        of_rows = rows @ covariance[np.ix_(part, part)] + 2.0 * rates[:, [number]] * of_phases[:, part]
        variance[:, number] += (of_rows * rows).sum(axis=-1)
    return sagittal_angles(positions), np.sqrt(np.maximum(variance, 0.0) + ANGLE_FLOOR_RAD**2)
