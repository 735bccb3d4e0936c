"""Prior of the walker as a detector sees it, which combines the model of walkers with the detector's bias.

Symbols
-------
``F``      floor of a detector: variance of its constant bias and slow error
``W'``     the walker as detected, ``N(m + offset, C + F)``; the estimate is ``W = m + G (W' - offset - m)``
``G``      ``C (C + F)^-1``: gain that removes the bias
``C``      covariance of walkers, plus that of the joint definitions of an unknown laboratory
``P0``     prior precision of W': inverse of C + F, plus the stance rows
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lapack

from pipeline.validation import require_range, require_shape
from walk3d.anatomy.prior import JOINTS, definitions, stance_rows
from walk3d.film.walk.training import BLOCKS, SIZE, WalkerModel
from walk3d.film.walk.view import level_axes

STANCE_WEIGHT = 0.3
BONE_FACTOR = 2.0
"""Factor by which the model's tolerances of bone lengths are multiplied."""
HEADINGS = 72
GRID_BLOCKS = 5
"""Number of Fourier coefficients of a coordinate in the grid search: the constant and two harmonics."""
SLOW_MM = 2.0
"""Standard deviation, mm per coefficient, of the detector errors that repeat in each gait cycle."""

GRID_CONSTANT_MM, GRID_HARMONIC_MM, GRID_SIZE, GRID_PITCH = 25.0, 12.5, 0.03, np.radians(4.0)
"""Standard deviations that the grid search adds to those of the population of walkers.

In order: bias, mm; slow error, mm; relative size; pitch of the camera, rad.
"""
UNSEEN_MM = 5.0
"""Standard deviation, mm, that the grid search adds to constant coefficients if some joints are not visible."""


@dataclass(frozen=True, kw_only=True)
class Detector:
    """Systematic differences between a detector's keypoints and the joints of the model.

    Attributes
    ----------
    offset_mm : (15, 3)
        Mean of keypoint minus joint in the walker's frame, for a walker of 1500 mm.
    floor_mm : (15,)
        Standard deviation of the constant bias about that offset, per axis.
    visible : (15,) bool
        False for joints that the detector does not have, or derives from others.
    """

    offset_mm: np.ndarray = field(default_factory=lambda: np.zeros((JOINTS, 3)))
    floor_mm: np.ndarray = field(default_factory=lambda: np.full(JOINTS, 10.0))
    visible: np.ndarray = field(default_factory=lambda: np.ones(JOINTS, bool))

    def __post_init__(self) -> None:
        require_shape("the offset of keypoints", self.offset_mm, (JOINTS, 3))
        require_shape("the floor of keypoints", self.floor_mm, (JOINTS,))
        for floor in self.floor_mm:
            require_range("the floor of a keypoint", float(floor), at_least=0, unit="mm")


@dataclass(frozen=True)
class Grid:
    """Images of walkers with two harmonics at all headings, for the grid search.

    The images at opposite headings are mirror images.

    Attributes
    ----------
    headings_rad : (72,)
    inverse_factor : (36, n, n)
        Inverse of the lower Cholesky factor of the covariance, by coefficient, visible joint and image axis (right,
        down). The constant is centred over joints.
    whitened_mean : (36, n)
        Product of this factor with the mean.
    log_determinant : (72,)
    """

    headings_rad: np.ndarray
    inverse_factor: np.ndarray
    whitened_mean: np.ndarray
    log_determinant: np.ndarray


@dataclass(frozen=True)
class Prior:
    """Prior of the walker as one detector sees it, with results that many clips share.

    Attributes
    ----------
    model : WalkerModel
    detector : Detector
    mean : (15, 3, 9)
        Mean of W', mm.
    covariance : (405, 405)
        Covariance C, mm².
    precision : (405, 405)
        Prior precision P0.
    bias_gain : (405, 405)
        Gain G.
    remaining : (405, 405)
        Covariance ``C - G C`` that the bias leaves unknown, mm².
    belt : (405,)
        Speed of the ground, mm per radian of phase.
    bone_sd, pair_sd : (16,), (P,)
        Tolerances of lengths, mm.
    grid : Grid
    """

    model: WalkerModel
    detector: Detector
    mean: np.ndarray
    covariance: np.ndarray
    precision: np.ndarray
    bias_gain: np.ndarray
    remaining: np.ndarray
    belt: np.ndarray
    bone_sd: np.ndarray
    pair_sd: np.ndarray
    grid: Grid


def prepare(
    model: WalkerModel, detector: Detector, *, bone_factor: float = BONE_FACTOR, unfamiliar: float = 0.0
) -> Prior:
    """Return the prior of walkers for one detector.

    It contains all results that do not depend on the clip.

    Parameters
    ----------
    model : WalkerModel
    detector : Detector
    bone_factor : float
        Factor on the learnt tolerances of bones.
    unfamiliar : float
        Share of the variance between laboratories that the model lacks, see `anatomical.concentration`; 0 if the
        walker's laboratory is known.
    """
    covariance = model.covariance.reshape(JOINTS, 3, BLOCKS, JOINTS, 3, BLOCKS).copy()
    covariance[:, :, 0, :, :, 0] += unfamiliar * definitions(across=False)
    covariance = covariance.reshape(SIZE, SIZE)
    floor = np.broadcast_to(detector.floor_mm[:, None], (JOINTS, 3))
    variance = np.full((JOINTS, 3, BLOCKS), SLOW_MM**2)
    variance[:, :, 0] = floor**2
    with_floor = covariance + np.diag(variance.ravel())
    factor = cho_factor(with_floor, lower=True)
    bias_gain = cho_solve(factor, covariance).T
    rows, belt = stance_rows(model.mean)
    precision = cho_solve(factor, np.eye(SIZE))
    precision += STANCE_WEIGHT * (rows.T / (model.stance_variance + 25.0)) @ rows
    mean = model.mean.copy()
    mean[:, :, 0] += detector.offset_mm
    typical = np.sqrt(np.mean(detector.floor_mm[detector.visible] ** 2)) if detector.visible.any() else 0.0
    return Prior(
        model=model,
        detector=detector,
        mean=mean,
        covariance=covariance,
        precision=(precision + precision.T) / 2.0,
        bias_gain=bias_gain,
        remaining=covariance - bias_gain @ covariance,
        belt=belt,
        bone_sd=np.sqrt(bone_factor**2 * model.bone_variance + 1.0 + 2.0 * SLOW_MM**2),
        pair_sd=np.sqrt(bone_factor**2 * model.pair_variance + 1.0 + 4.0 * typical**2),
        grid=projected_grid(mean, covariance, detector.visible),
    )


def projected_grid(mean: np.ndarray, covariance: np.ndarray, visible: np.ndarray) -> Grid:
    """Return mean and covariance of the images of walkers at all headings, for the visible joints and two harmonics.

    Parameters
    ----------
    mean : (15, 3, 9)
    covariance : (405, 405)
    visible : (15,) bool
    """
    joints = np.flatnonzero(visible)
    count = len(joints)
    headings = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS
    axes = level_axes(headings[: HEADINGS // 2])
    part = covariance.reshape(JOINTS, 3, BLOCKS, JOINTS, 3, BLOCKS)
    part = part[joints][:, :, :GRID_BLOCKS][:, :, :, joints][:, :, :, :, :, :GRID_BLOCKS]
    size = count * 2 * GRID_BLOCKS
    # Relative to the mean of the visible joints: the position in the image carries no information here.
    centring = np.eye(count) - 1.0 / count

    def centred(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[:, :, 0] = np.tensordot(centring, values[:, :, 0], axes=1)
        return values

    average = centred(mean[joints][:, :, :GRID_BLOCKS])
    part = centred(centred(part).transpose(3, 4, 5, 0, 1, 2))
    extra = np.full((GRID_BLOCKS, count, 2), GRID_HARMONIC_MM**2)
    extra[0] = GRID_CONSTANT_MM**2 + (0.0 if visible.all() else UNSEEN_MM**2)
    means = np.empty((len(axes), size))
    factors = np.empty((len(axes), size, size))
    determinants = np.empty(len(axes))
    for number, turn in enumerate(axes):
        image = turn[:2]
        rows = np.tensordot(image, part, axes=(1, 1))  # (2, J, b, J, 3, b)
        both = np.tensordot(image, rows, axes=(1, 4))  # (2', 2, J, b, J, b)
        both = both.transpose(3, 2, 1, 5, 4, 0).reshape(size, size)
        level = np.einsum("ia,jab->bji", turn, average)
        means[number] = level[..., :2].ravel()
        tilt = np.zeros((GRID_BLOCKS, count, 2))
        tilt[..., 1] = level[..., 2]
        both += np.diag(extra.ravel()) + GRID_SIZE**2 * np.outer(means[number], means[number])
        both += GRID_PITCH**2 * np.outer(tilt, tilt)
        factor = np.linalg.cholesky(both)
        factors[number] = lapack.dtrtri(factor, lower=1)[0]
        determinants[number] = 2.0 * np.log(np.diag(factor)).sum()
    return Grid(headings, factors, (factors @ means[..., None])[..., 0], np.tile(determinants, 2))


def belt_speed(prior: Prior) -> float:
    """Return the speed of the ground under the average walker, mm per radian of the gait cycle's phase."""
    return prior.belt @ prior.model.mean.ravel()
