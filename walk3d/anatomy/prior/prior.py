"""Prior of walkers: mean, shrunken covariance, and variation of bone lengths.

Symbols ------- ``w``      Fourier representation, here (joint, axis, block): the coefficients of a joint are adjacent
``S``      weighted covariance of the training walks, mirror images among them ``T``      S without correlations between
harmonics, or between sine and cosine: for each harmonic one 45 x 45 covariance of
           the joints' coordinates, the mean of those of its sine and cosine coefficients
``C``      ``(1 - a - b) S + a T + b diag S + tau I``, the prior covariance
``n_eff``  ``1 / sum of squared weights``: walks of one person count as one person

Reason: a few dozen people determine the correlation of joints within a harmonic, but not between harmonics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.core import fourier
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.validation import require_finite

JOINTS = len(WALKER15.joints)

BONES = np.array((*WALKER15.bones, (9, 12), (2, 5)))
"""Bones (16, 2) as parent and child: bones of the joint tree, then hip to hip and shoulder to shoulder."""


def _pairs() -> np.ndarray:
    number_of = {frozenset(bone): number for number, bone in enumerate(BONES.tolist())}
    mirrored = [number_of[frozenset(WALKER15.mirror[joint] for joint in bone)] for bone in BONES.tolist()]
    return np.array([(bone, other) for bone, other in enumerate(mirrored) if bone < other])


PAIRS = _pairs()
"""Pairs (P, 2) of left and right bones that are mirror images, as row indices of `BONES`."""


@dataclass(frozen=True, kw_only=True)
class Shrinkage:
    """Options of the shrinkage of the walkers' sample covariance.

    Attributes
    ----------
    mirror : bool
        Use each walk's mirror image as a training walk too, both with half the weight.
    within_harmonic : float
        a, the share of T.
    diagonal : float
        b, the share of diag S.
    extra_variance : float
        tau, mm²: variance in directions without training walks.
    """

    mirror: bool = True
    within_harmonic: float = 0.2
    diagonal: float = 0.1
    extra_variance: float = 20.0


@shortened
class Prior:
    """Prior of a walker: mean and covariance of the Fourier coefficients, and variances of bone lengths.

    Attributes
    ----------
    mean : (15, 3, 1 + 2H)
        Mean coefficients by joint, axis and block, mm.
    covariance : (15, 3, 1 + 2H, 15, 3, 1 + 2H)
        Covariance of the coefficients, mm².
    length_variance : (16,)
        Mean over training walks of the variance of each bone's length within the cycle, mm².
    pair_variance : (P,)
        Mean square of the difference between the mean lengths of a left and a right bone, mm².
    definition_variance : float
        Variance of a joint's offset relative to the training walks, along each axis, mm².
    """

    mean: np.ndarray
    covariance: np.ndarray
    length_variance: np.ndarray
    pair_variance: np.ndarray
    definition_variance: float = 0.0

    @cached_property
    def by_axis(self) -> np.ndarray:
        """Covariance (45 B, 45 B), mm², ordered by axis, then by joint and coefficient."""
        n = self.mean.size
        return np.ascontiguousarray(self.covariance.transpose(1, 0, 2, 4, 3, 5)).reshape(n, n)


def by_joint(coefficients: np.ndarray) -> np.ndarray:
    """Return Fourier coefficients (…, 1 + 2H, 15, S) in the order (…, 15, S, 1 + 2H), with the coefficients last."""
    return np.ascontiguousarray(np.moveaxis(coefficients, -3, -1))


def by_block(walkers: np.ndarray) -> np.ndarray:
    """Return Fourier coefficients (…, 15, S, 1 + 2H) in the order (…, 1 + 2H, 15, S); inverse of `by_joint`."""
    return np.ascontiguousarray(np.moveaxis(walkers, -1, -3))


def mirror_image(walkers: np.ndarray) -> np.ndarray:
    """Return mirror images of walkers (…, 15, S, B), with left and right exchanged and shifted by half a cycle."""
    return by_joint(fourier.mirrored(by_block(walkers)))


def person_weights(people: np.ndarray) -> np.ndarray:
    """Return weights (R,) of walks that give every person the same weight; their sum is one.

    Examples
    --------
    >>> person_weights(np.array(["a", "b", "b"])).tolist()
    [0.5, 0.25, 0.25]
    """
    _, person, counts = np.unique(people, return_inverse=True, return_counts=True)
    return 1.0 / (len(counts) * counts[person])


class Walks:
    """Training walks (R, 1 + 2H, 15, 3), mm, from which priors of any selection of the walks are learnt.

    Raises
    ------
    InvalidInput
        If a number is not finite.
    """

    def __init__(self, coefficients: np.ndarray, *, mirror: bool) -> None:
        require_finite("the walks", coefficients)
        images = (coefficients, fourier.mirrored(coefficients)) if mirror else (coefficients,)
        walkers = by_joint(np.stack(images))
        self._blocks, self._rows = walkers.shape[-1], walkers.reshape(*walkers.shape[:2], -1)
        lengths = bone_lengths(walkers)
        self._length_variance, length = lengths.var(axis=-1), lengths.mean(axis=-1)
        self._asymmetry = (length[..., PAIRS[:, 0]] - length[..., PAIRS[:, 1]]) ** 2

    def centred(self, some: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the weighted mean (45 B,) of the selected walks, their scaled deviations from it, and weights (N,).

        The deviations are rows (N, 45 B) with ``S = rows^T rows``.

        Walks are selected by number, (n,); their weights (n,) sum to one, and there are at least two.  The returned
        weights are of the walks and their mirror images.  Other walks have no influence.
        """
        size = 1.0 / (weights**2).sum()
        w = np.tile(weights, len(self._rows)) / len(self._rows)
        rows = self._rows[:, some].reshape(len(w), -1)
        mean = w @ rows
        rows -= mean
        rows *= np.sqrt(size / (size - 1.0) * w)[:, None]
        return mean, rows, w

    def fit(self, some: np.ndarray, weights: np.ndarray, shrinkage: Shrinkage) -> Prior:
        """Return the prior that is learnt from the walks with the given indices (n,) and weights (n,)."""
        blocks = self._blocks
        mean, rows, w = self.centred(some, weights)
        C = structured_covariance(rows.T @ rows, blocks, shrinkage)
        length_variance, asymmetry = (
            part[:, some].reshape(len(w), -1) for part in (self._length_variance, self._asymmetry)
        )
        return Prior(
            mean=mean.reshape(JOINTS, 3, blocks),
            covariance=C.reshape(JOINTS, 3, blocks, JOINTS, 3, blocks),
            length_variance=w @ length_variance,
            pair_variance=w @ asymmetry,
        )


def fit(coefficients: np.ndarray, weights: np.ndarray, shrinkage: Shrinkage) -> Prior:
    """Return the prior learnt from walks (R, 1 + 2H, 15, 3), mm, with weights (R,)."""
    walks = Walks(coefficients, mirror=shrinkage.mirror)
    return walks.fit(np.arange(len(coefficients)), weights, shrinkage)


def within_harmonics(covariance: np.ndarray, blocks: int) -> np.ndarray:
    """Return the part of a covariance (n, n) that lies within each harmonic, with equal blocks for sine and cosine.

    Both blocks are the mean of the sine and the cosine block; all other blocks are zero.
    """
    restricted = np.zeros_like(covariance)
    _add_within_harmonics(restricted, covariance, blocks, 1.0)
    return restricted


def _add_within_harmonics(target: np.ndarray, covariance: np.ndarray, blocks: int, share: float) -> None:
    whole, sums = (
        matrix.reshape(len(covariance) // blocks, blocks, -1, blocks) for matrix in (covariance, target)
    )
    for same in ((0,), *((block, block + 1) for block in range(1, blocks, 2))):
        block_mean = share / len(same) * sum(whole[:, k, :, k] for k in same)
        for block in same:
            sums[:, block, :, block] += block_mean


def structured_covariance(covariance: np.ndarray, blocks: int, shrinkage: Shrinkage) -> np.ndarray:
    """Return the shrunken covariance C (n, n) of a sample covariance S (n, n).

    The coefficients of a coordinate, `blocks` of them, are adjacent.
    """
    a, b = shrinkage.within_harmonic, shrinkage.diagonal
    shrunken = (1.0 - a - b) * covariance
    if a:
        _add_within_harmonics(shrunken, covariance, blocks, a)
    shrunken[np.diag_indices_from(shrunken)] += b * np.diag(covariance) + shrinkage.extra_variance
    return shrunken


def conditioned_on_rows(prior: Prior, rows: np.ndarray, variances: np.ndarray) -> Prior:
    """Return the prior under the constraint that linear functions of the coefficients have the mean walker's values.

    Parameters
    ----------
    prior : Prior
    rows : (n, 45 B)
        Functionals of the coefficients by joint, axis and block.
    variances : (n,)
        Variance that each functional may have.
    """
    C = prior.covariance.reshape(rows.shape[1], -1)
    crossed = rows @ C
    inner = crossed @ rows.T
    inner[np.diag_indices_from(inner)] += variances
    changed = C - crossed.T @ np.linalg.solve(inner, crossed)
    return replace(prior, covariance=changed.reshape(prior.covariance.shape))


PHASES = 20
"""Number of phases of the cycle at which bone lengths are computed.

It is more than twice the number of harmonics of a squared length.
"""


def bone_lengths(walkers: np.ndarray) -> np.ndarray:
    """Return bone lengths (…, 16, K) at the phases of the cycle, from walkers (…, 15, 3, 1 + 2H)."""
    across = walkers[..., BONES[:, 1], :, :] - walkers[..., BONES[:, 0], :, :]
    basis = fourier.cycle_basis(fourier.equal_phases(PHASES), walkers.shape[-1])
    return np.linalg.norm(across @ basis.T, axis=-2)


def image_axes(view_angles_rad: np.ndarray) -> np.ndarray:
    """Return rotations (A, 3, 3) from the walker's axes to the image axes of A views: across, up and away.

    Examples
    --------
    >>> np.round(image_axes(np.array([np.pi / 2]))[0] @ np.array([1.0, 2.0, 3.0]), 12) + 0.0
    array([ 2.,  3., -1.])
    """
    angles = np.atleast_1d(np.asarray(view_angles_rad, float))
    c, s = np.cos(angles), np.sin(angles)
    axes = np.zeros((len(angles), 3, 3))
    axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 2], axes[:, 2, 0], axes[:, 2, 1] = c, s, 1.0, -s, c
    return axes
