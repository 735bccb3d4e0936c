"""Training of the model of walkers on recorded walks.

Symbols
-------
``W``      walker, (15, 3, 1 + 2H): coefficients of each joint's coordinates, adjacent; H = 4, 405 numbers
``m, S``   weighted mean and covariance of the training walks and their mirror images
``T, C``   as in `walk3d.anatomy.prior.prior`, which shrinks S as here
``n_eff``  ``1 / sum of squared weights``: walks of one person count as one person

Every walker is scaled to a height of 1500 mm (centre of the head above the ankles): one camera cannot distinguish size
from distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_count, require_finite, require_range, require_shape
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import JOINTS, PAIRS, Shrinkage

HARMONICS = 4
BLOCKS = 1 + 2 * HARMONICS
SIZE = JOINTS * 3 * BLOCKS
HEIGHT_MM = 1500.0
"""Height of the head's centre above the ankles, mm, to which each walker is scaled."""

MAX_WALKERS = 60.0
"""Maximum effective number of walkers."""


@dataclass(frozen=True, kw_only=True)
class Population:
    """Statistics of the training walks, scaled to 1500 mm, without the covariance of the Fourier coefficients.

    Subclasses add the covariance.

    Attributes
    ----------
    mean : (15, 3, 9)
        Average walker, mm, in the walker's frame about the mean pelvis.
    bone_variance : (16,)
        Mean variance of each bone's length within the cycle, mm².
    pair_variance : (P,)
        Mean squared difference of left and right bone, mm².
    aperiodic_variance : (15, 3)
        Mean square of each coordinate beyond four harmonics, mm².
    log_frequency : (2,)
        Mean and standard deviation of the natural logarithm of the stride frequency in hertz.
    walkers : int
        Number of people in the training walks.
    """

    mean: np.ndarray
    bone_variance: np.ndarray
    pair_variance: np.ndarray
    aperiodic_variance: np.ndarray
    log_frequency: np.ndarray
    walkers: int

    @property
    def counted(self) -> dict[str, Any]:
        """Fields that all kinds of population statistics have in common, by name."""
        return {entry.name: getattr(self, entry.name) for entry in fields(Population)}


@dataclass(frozen=True, kw_only=True)
class Moments(Population):
    """Statistics of the training walks, with the sample covariance of the Fourier coefficients.

    Attributes
    ----------
    covariance : (405, 405)
        S, mm².
    """

    covariance: np.ndarray


@dataclass(frozen=True, kw_only=True)
class WalkerModel(Population):
    """Statistics of the training walks, with the shrunken covariance of the Fourier coefficients.

    Attributes
    ----------
    covariance : (405, 405)
        C, mm².
    stance_variance : (16,)
        Variance of the stance rows, mm² per rad².
    """

    covariance: np.ndarray
    stance_variance: np.ndarray


@dataclass(frozen=True)
class TrainingWalk:
    """One recorded walk, scaled to 1500 mm.

    Attributes
    ----------
    walker : (15, 3, 9)
        Coefficients at phase zero, mm.
    frequency_hz : float
    aperiodic_variance : (15, 3)
        Mean square of the motion beyond the series, mm².
    height_mm : float
        Height of the centre of the head above the ankles before scaling.
    """

    walker: np.ndarray
    frequency_hz: float
    aperiodic_variance: np.ndarray
    height_mm: float


def training_walk(positions: np.ndarray, frame_rate_hz: float, height_mm: float) -> TrainingWalk:
    """Represent a recorded walk by four harmonics, scaled to 1500 mm.

    Parameters
    ----------
    positions : (T, 15, 3)
        Treadmill equivalent about the mean pelvis, mm.
    frame_rate_hz, height_mm : float
    """
    require_range("the height of a walker", height_mm, above=0, unit="mm")
    series = fourier.represent(positions, frame_rate_hz, harmonics=HARMONICS)
    scale = HEIGHT_MM / height_mm
    return TrainingWalk(
        walker=np.moveaxis(series.coefficients, 0, -1) * scale,
        frequency_hz=series.frequency_hz,
        aperiodic_variance=np.einsum("jaa->ja", series.residual_covariance) * scale**2,
        height_mm=height_mm,
    )


def moments(walks: Sequence[TrainingWalk], people: np.ndarray) -> Moments:
    """Return mean, covariance and other statistics of the walks of several people and of the walks' mirror images.

    Parameters
    ----------
    walks : sequence of TrainingWalk
        R walks.
    people : (R,)
        Person of each walk.

    Raises
    ------
    InvalidInput
        If there are fewer than two people or a coefficient is not finite.
    """
    people = require_shape("people", people, (len(walks),))
    if (count := len(np.unique(people))) < 2:
        raise InvalidInput(
            "a model of walkers needs two people or more", received=count, code="too_few_people", count=count
        )
    weights = anatomical.person_weights(people)
    walkers = require_finite("walkers", np.stack([walk.walker for walk in walks]))
    both = np.concatenate([walkers, anatomical.mirror_image(walkers)]).reshape(2 * len(walks), -1)
    half = np.concatenate([weights, weights]) / 2.0
    effective = min(1.0 / (weights**2).sum(), MAX_WALKERS)
    mean = half @ both
    centred = np.sqrt(half)[:, None] * (both - mean)
    lengths = anatomical.bone_lengths(walkers)
    average = lengths.mean(axis=-1)
    aperiodic = weights @ np.stack([walk.aperiodic_variance for walk in walks]).reshape(len(walks), -1)
    aperiodic = aperiodic.reshape(JOINTS, 3)
    log_frequency = np.log([walk.frequency_hz for walk in walks])
    centre = weights @ log_frequency
    return Moments(
        mean=mean.reshape(JOINTS, 3, BLOCKS),
        covariance=effective / (effective - 1.0) * (centred.T @ centred),
        bone_variance=weights @ lengths.var(axis=-1),
        pair_variance=weights @ (average[:, PAIRS[:, 0]] - average[:, PAIRS[:, 1]]) ** 2,
        aperiodic_variance=(aperiodic + aperiodic[list(WALKER15.mirror)]) / 2.0,
        log_frequency=np.array([centre, np.sqrt(weights @ (log_frequency - centre) ** 2)]),
        walkers=count,
    )


def model_of(sample: Moments) -> WalkerModel:
    """Return the model of walkers for the given sample statistics, with a shrunken covariance."""
    rows, _ = anatomical.stance_rows(sample.mean)
    return WalkerModel(
        **sample.counted,
        covariance=anatomical.structured_covariance(sample.covariance, BLOCKS, Shrinkage()),
        stance_variance=np.einsum("ra,ab,rb->r", rows, sample.covariance, rows, optimize=True),
    )


def train(walks: Sequence[TrainingWalk], people: np.ndarray) -> WalkerModel:
    """Learn the model from R walks; `people` (R,) contains the person of each walk."""
    return model_of(moments(walks, people))


@dataclass(frozen=True, kw_only=True)
class CompactMoments(Population):
    """Statistics of walkers with a compact covariance.

    It consists of a few eigenwalkers and, for the remainder, the covariance of joints within each harmonic.

    No training person can be read from them: there are fewer eigenwalkers than half the people, none of their
    coefficients, and otherwise only means over all people.

    Attributes
    ----------
    components : (N, 405)
        Eigenwalkers of S, rows of length one.
    eigenvalues : (N,)
        mm².
    within : (5, 45, 45)
        Diagonal blocks of T: of the constant and of each harmonic, mm².
    """

    components: np.ndarray
    eigenvalues: np.ndarray
    within: np.ndarray


def compact(sample: Moments, components: int) -> CompactMoments:
    """Reduce the sample covariance to eigenwalkers, and to the covariance of the remainder within each harmonic.

    Raises
    ------
    InvalidInput
        If there are as many eigenwalkers as half the people, or more: people could be reconstructed from their span.
    """
    require_count("the number of eigenwalkers", components, below=sample.walkers / 2.0)
    values, vectors = np.linalg.eigh(sample.covariance)
    order = np.argsort(values)[::-1][:components]
    T = anatomical.within_harmonics(sample.covariance, BLOCKS).reshape(JOINTS * 3, BLOCKS, JOINTS * 3, BLOCKS)
    blocks = np.stack([T[:, k, :, k] for k in (0, *range(1, BLOCKS, 2))])
    return CompactMoments(
        **sample.counted, components=vectors[:, order].T, eigenvalues=values[order], within=blocks
    )


def expand(sample: CompactMoments) -> Moments:
    """Return the statistics with the full covariance, restored from eigenwalkers and blocks within each harmonic."""
    main = (sample.components.T * sample.eigenvalues) @ sample.components
    T = np.zeros((JOINTS * 3, BLOCKS, JOINTS * 3, BLOCKS))
    for block in range(BLOCKS):
        T[:, block, :, block] = sample.within[(block + 1) // 2]
    covariance = main + T.reshape(SIZE, SIZE) - anatomical.within_harmonics(main, BLOCKS)
    return Moments(**sample.counted, covariance=(covariance + covariance.T) / 2.0)
