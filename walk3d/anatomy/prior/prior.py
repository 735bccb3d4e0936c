"""What is known of walkers before one is seen: a mean, a shrunken covariance, and how constant bones are.

Symbols
-------
``w``      Fourier representation, here (joint, axis, block): the coefficients of a joint stand together
``S``      weighted covariance of the training walks, mirror images among them
``T``      S without what ties harmonics, or sine and cosine, together: for each harmonic one 45 x 45 covariance of the
           joints' coordinates, the mean of that of its sine and that of its cosine coefficients
``C``      ``(1 - a - b) S + a T + b diag S + tau I``, the prior covariance
``n_eff``  ``1 / sum of squared weights``: walks of one person count as one person

Why so: a few dozen people tell what the joints do together in a harmonic, but not how harmonics go together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from pipeline.validation import require_finite

JOINTS = len(WALKER15.joints)

BONES = np.array((*WALKER15.bones, (9, 12), (2, 5)))
"""(16, 2): the tree's bones as parent and child, then hip to hip and shoulder to shoulder."""


def _pairs() -> np.ndarray:
    place = {frozenset(bone): number for number, bone in enumerate(BONES.tolist())}
    mirrored = [place[frozenset(WALKER15.mirror[joint] for joint in bone)] for bone in BONES.tolist()]
    return np.array([(bone, other) for bone, other in enumerate(mirrored) if bone < other])


PAIRS = _pairs()
"""(P, 2): bones of the left and the right side that are each other's mirror image, as rows of `BONES`."""


@dataclass(frozen=True, kw_only=True)
class Shrinkage:
    """How the sample covariance is changed, as few people need it.

    Attributes
    ----------
    mirror : bool
        Whether each walk's mirror image is a training walk too, each with half the weight.
    within_harmonic : float
        a, the share of T.
    diagonal : float
        b, the share of diag S.
    extra_variance : float
        tau, mm²: what no training walk shows.
    """

    mirror: bool = True
    within_harmonic: float = 0.2
    diagonal: float = 0.1
    extra_variance: float = 20.0


@dataclass(frozen=True)
class Prior:
    """Mean and covariance of walkers, and the variation of their bones.

    Attributes
    ----------
    mean : (15, 3, 1 + 2H)
        mm, by joint, axis and block.
    covariance : (15, 3, 1 + 2H, 15, 3, 1 + 2H)
        mm².
    length_variance : (16,)
        Mean over training walks of the variance of each bone's length within the cycle, mm².
    pair_variance : (P,)
        Mean square of the difference of the mean lengths of left and right bone, mm².
    definition_variance : float
        Of where a joint of the walker lies about where the training walks had it, along each axis, mm².
    """

    mean: np.ndarray
    covariance: np.ndarray
    length_variance: np.ndarray
    pair_variance: np.ndarray
    definition_variance: float = 0.0

    @cached_property
    def by_axis(self) -> np.ndarray:
        """The covariance (45 B, 45 B), axis by axis."""
        n = self.mean.size
        return np.ascontiguousarray(self.covariance.transpose(1, 0, 2, 4, 3, 5)).reshape(n, n)


def by_joint(coefficients: np.ndarray) -> np.ndarray:
    """Coefficients (…, 15, S, 1 + 2H) of Fourier representations (…, 1 + 2H, 15, S)."""
    return np.ascontiguousarray(np.moveaxis(coefficients, -3, -1))


def by_block(walkers: np.ndarray) -> np.ndarray:
    """The inverse of `by_joint`."""
    return np.ascontiguousarray(np.moveaxis(walkers, -1, -3))


def mirror_image(walkers: np.ndarray) -> np.ndarray:
    """Mirror images of walkers (…, 15, S, B): left and right exchanged, shifted by half a cycle."""
    return by_joint(fourier.mirrored(by_block(walkers)))


def person_weights(people: np.ndarray) -> np.ndarray:
    """Weights (R,) of walks that give every person the same weight; they sum to one.

    Examples
    --------
    >>> person_weights(np.array(["a", "b", "b"])).tolist()
    [0.5, 0.25, 0.25]
    """
    _, of, counts = np.unique(people, return_inverse=True, return_counts=True)
    return 1.0 / (len(counts) * counts[of])


class Walks:
    """Walks (R, 1 + 2H, 15, 3) to learn from, mm; what each has for every choice of some is computed once.

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
        self._apart = (length[..., PAIRS[:, 0]] - length[..., PAIRS[:, 1]]) ** 2

    def centred(self, some: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mean (45 B,) of some walks (n,) int with these weights (n,), and rows (N, 45 B) that make their S.

        S is their products ``rows^T rows``.  The last is the weights (N,) of the walks and their mirror images.
        Nothing of the other walks reaches them.
        There are two or more, and the weights sum to one.
        """
        size = 1.0 / (weights**2).sum()
        w = np.tile(weights, len(self._rows)) / len(self._rows)
        rows = self._rows[:, some].reshape(len(w), -1)
        mean = w @ rows
        rows -= mean
        rows *= np.sqrt(size / (size - 1.0) * w)[:, None]
        return mean, rows, w

    def fit(self, some: np.ndarray, weights: np.ndarray, shrinkage: Shrinkage) -> Prior:
        """Learn the prior from some walks (n,) int with these weights (n,), as `centred` has them."""
        blocks = self._blocks
        mean, rows, w = self.centred(some, weights)
        C = structured_covariance(rows.T @ rows, blocks, shrinkage)
        length_variance, apart = (
            part[:, some].reshape(len(w), -1) for part in (self._length_variance, self._apart)
        )
        return Prior(
            mean=mean.reshape(JOINTS, 3, blocks),
            covariance=C.reshape(JOINTS, 3, blocks, JOINTS, 3, blocks),
            length_variance=w @ length_variance,
            pair_variance=w @ apart,
        )


def fit(coefficients: np.ndarray, weights: np.ndarray, shrinkage: Shrinkage) -> Prior:
    """Learn the prior from walks (R, 1 + 2H, 15, 3) with weights (R,), as by `Walks`."""
    walks = Walks(coefficients, mirror=shrinkage.mirror)
    return walks.fit(np.arange(len(coefficients)), weights, shrinkage)


def within_harmonics(covariance: np.ndarray, blocks: int) -> np.ndarray:
    """T of a covariance (n, n): per harmonic the mean of its sine's and its cosine's block, nothing between them."""
    found = np.zeros_like(covariance)
    _add_within_harmonics(found, covariance, blocks, 1.0)
    return found


def _add_within_harmonics(found: np.ndarray, covariance: np.ndarray, blocks: int, share: float) -> None:
    whole, sums = (
        matrix.reshape(len(covariance) // blocks, blocks, -1, blocks) for matrix in (covariance, found)
    )
    for same in ((0,), *((block, block + 1) for block in range(1, blocks, 2))):
        kept = share / len(same) * sum(whole[:, k, :, k] for k in same)
        for block in same:
            sums[:, block, :, block] += kept


def structured_covariance(covariance: np.ndarray, blocks: int, shrinkage: Shrinkage) -> np.ndarray:
    """C: a sample covariance S (n, n), shrunken towards what a few dozen people can support.

    The coefficients of a coordinate, `blocks` of them, stand together.
    """
    a, b = shrinkage.within_harmonic, shrinkage.diagonal
    found = (1.0 - a - b) * covariance
    if a:
        _add_within_harmonics(found, covariance, blocks, a)
    found[np.diag_indices_from(found)] += b * np.diag(covariance) + shrinkage.extra_variance
    return found


def conditioned_on_rows(prior: Prior, rows: np.ndarray, variances: np.ndarray) -> Prior:
    """Return a prior to which linear functionals are known to be those of its mean.

    Parameters
    ----------
    prior : Prior
    rows : (n, 45 B)
        The functionals, of coefficients by joint, axis and block.
    variances : (n,)
        Of what each may be off by.
    """
    C = prior.covariance.reshape(rows.shape[1], -1)
    seen = rows @ C
    inner = seen @ rows.T
    inner[np.diag_indices_from(inner)] += variances
    changed = C - seen.T @ np.linalg.solve(inner, seen)
    return replace(prior, covariance=changed.reshape(prior.covariance.shape))


PHASES = 20
"""Phases of the cycle at which lengths are looked at: more than twice the harmonics of a squared length."""


def bone_lengths(walkers: np.ndarray) -> np.ndarray:
    """Lengths (…, 16, K) of the bones at the phases of the cycle, of walkers (…, 15, 3, 1 + 2H)."""
    across = walkers[..., BONES[:, 1], :, :] - walkers[..., BONES[:, 0], :, :]
    basis = fourier.cycle_basis(fourier.equal_phases(PHASES), walkers.shape[-1])
    return np.linalg.norm(across @ basis.T, axis=-2)


def image_axes(view_angles_rad: np.ndarray) -> np.ndarray:
    """Rotations (A, 3, 3) from the walker's axes to across, up and away.

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
