"""The walker as a detector draws him: the model, the detector's bias, and what is computed once for many clips.

Symbols
-------
``F``      variance of a detector's constant bias and slow error: its floor
``W'``     the walker as the detector draws him, ``N(m + offset, C + F)``; the answer is ``W = m + G (W' - offset - m)``
``G``      ``C (C + F)^-1``: gives the bias back
``C``      covariance of walkers, and of where a laboratory that the model does not know puts their joints
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
"""On the learnt tolerances of lengths."""
HEADINGS = 72
GRID_BLOCKS = 5
"""Coefficients of two harmonics, which the grid looks at."""
SLOW_MM = 2.0
"""Error of a detector that follows the cycle, mm on each coefficient."""

GRID_CONSTANT_MM, GRID_HARMONIC_MM, GRID_SIZE, GRID_PITCH = 25.0, 12.5, 0.03, np.radians(4.0)
"""What the grid allows for besides the population: bias, slow error, size, pitch of the camera."""
UNSEEN_MM = 5.0


@dataclass(frozen=True, kw_only=True)
class Detector:
    """How the keypoints of a detector differ from the joints.

    Attributes
    ----------
    offset_mm : (15, 3)
        Mean of keypoint minus joint in the walker's frame, for a walker of 1500 mm.
    floor_mm : (15,)
        Standard deviation of the constant bias about that offset, per axis.
    seen : (15,) bool
        False for joints that the detector has not, or derives from others.
    """

    offset_mm: np.ndarray = field(default_factory=lambda: np.zeros((JOINTS, 3)))
    floor_mm: np.ndarray = field(default_factory=lambda: np.full(JOINTS, 10.0))
    seen: np.ndarray = field(default_factory=lambda: np.ones(JOINTS, bool))

    def __post_init__(self) -> None:
        require_shape("the offset of keypoints", self.offset_mm, (JOINTS, 3))
        require_shape("the floor of keypoints", self.floor_mm, (JOINTS,))
        for floor in self.floor_mm:
            require_range("the floor of a keypoint", float(floor), at_least=0, unit="mm")


@dataclass(frozen=True)
class Grid:
    """Projected walkers of two harmonics at all headings; from the opposite side image right changes its sign.

    Attributes
    ----------
    headings_rad : (72,)
    inverse_factor : (36, n, n)
        Inverse of the lower Cholesky factor of the covariance, by coefficient, joint seen and image axis (right, down),
        the constant centred over joints.
    whitened_mean : (36, n)
        The factor's product with the mean.
    log_determinant : (72,)
    """

    headings_rad: np.ndarray
    inverse_factor: np.ndarray
    whitened_mean: np.ndarray
    log_determinant: np.ndarray


@dataclass(frozen=True)
class Prior:
    """Prior of the walker as one detector draws him.

    Attributes
    ----------
    model : WalkerModel
    detector : Detector
    mean : (15, 3, 9)
        Of W', mm.
    covariance : (405, 405)
        C, mm².
    precision : (405, 405)
        P0.
    giving_back : (405, 405)
        G.
    remaining : (405, 405)
        ``C - G C``: what the bias hides, mm².
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
    giving_back: np.ndarray
    remaining: np.ndarray
    belt: np.ndarray
    bone_sd: np.ndarray
    pair_sd: np.ndarray
    grid: Grid


def prepare(
    model: WalkerModel, detector: Detector, *, bone_factor: float = BONE_FACTOR, unfamiliar: float = 0.0
) -> Prior:
    """Prepare the prior of one detector.

    Parameters
    ----------
    model : WalkerModel
    detector : Detector
    bone_factor : float
        Factor on the learnt tolerances of bones.
    unfamiliar : float
        Share of what sets laboratories apart that the model lacks, as `anatomical.concentration` gives it; 0: it knows
        the walker's.
    """
    covariance = model.covariance.reshape(JOINTS, 3, BLOCKS, JOINTS, 3, BLOCKS).copy()
    covariance[:, :, 0, :, :, 0] += unfamiliar * definitions(across=False)
    covariance = covariance.reshape(SIZE, SIZE)
    floor = np.broadcast_to(detector.floor_mm[:, None], (JOINTS, 3))
    variance = np.full((JOINTS, 3, BLOCKS), SLOW_MM**2)
    variance[:, :, 0] = floor**2
    with_floor = covariance + np.diag(variance.ravel())
    factor = cho_factor(with_floor, lower=True)
    giving_back = cho_solve(factor, covariance).T
    rows, belt = stance_rows(model.mean)
    precision = cho_solve(factor, np.eye(SIZE))
    precision += STANCE_WEIGHT * (rows.T / (model.stance_variance + 25.0)) @ rows
    mean = model.mean.copy()
    mean[:, :, 0] += detector.offset_mm
    typical = np.sqrt(np.mean(detector.floor_mm[detector.seen] ** 2)) if detector.seen.any() else 0.0
    return Prior(
        model=model,
        detector=detector,
        mean=mean,
        covariance=covariance,
        precision=(precision + precision.T) / 2.0,
        giving_back=giving_back,
        remaining=covariance - giving_back @ covariance,
        belt=belt,
        bone_sd=np.sqrt(bone_factor**2 * model.bone_variance + 1.0 + 2.0 * SLOW_MM**2),
        pair_sd=np.sqrt(bone_factor**2 * model.pair_variance + 1.0 + 4.0 * typical**2),
        grid=projected_grid(mean, covariance, detector.seen),
    )


def projected_grid(mean: np.ndarray, covariance: np.ndarray, seen: np.ndarray) -> Grid:
    """Mean and covariance of the image of two harmonics, at all headings, of the joints seen.

    Parameters
    ----------
    mean : (15, 3, 9)
    covariance : (405, 405)
    seen : (15,) bool
    """
    joints = np.flatnonzero(seen)
    count = len(joints)
    headings = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS
    axes = level_axes(headings[: HEADINGS // 2])
    part = covariance.reshape(JOINTS, 3, BLOCKS, JOINTS, 3, BLOCKS)
    part = part[joints][:, :, :GRID_BLOCKS][:, :, :, joints][:, :, :, :, :, :GRID_BLOCKS]
    size = count * 2 * GRID_BLOCKS
    # Coefficients about the mean of the joints seen: the place in the image says nothing here.
    centring = np.eye(count) - 1.0 / count

    def centred(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[:, :, 0] = np.tensordot(centring, values[:, :, 0], axes=1)
        return values

    average = centred(mean[joints][:, :, :GRID_BLOCKS])
    part = centred(centred(part).transpose(3, 4, 5, 0, 1, 2))
    extra = np.full((GRID_BLOCKS, count, 2), GRID_HARMONIC_MM**2)
    extra[0] = GRID_CONSTANT_MM**2 + (0.0 if seen.all() else UNSEEN_MM**2)
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
    """Speed of the average walker's ground, mm per radian of phase."""
    return prior.belt @ prior.model.mean.ravel()
