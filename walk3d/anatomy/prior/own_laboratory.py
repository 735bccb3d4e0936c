"""Prior learnt from other laboratories, calibrated for a walker on people of the walker's laboratory.

The height of a walker is seen from every side, so prior and known people are scaled to it.  The known people and their
mirror images then show where the laboratory places its joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.core import fourier, walking
from pipeline.shortened import shortened
from pipeline.skeleton import ANKLES, WALKER15
from walk3d.anatomy.prior.laboratories import Differences, unfamiliar
from walk3d.anatomy.prior.prior import Prior, Shrinkage, by_block, by_joint, structured_covariance

INSTANTS = 40
"""Number of instants of the gait cycle at which the height of a walker is measured."""
WEIGHT_OF_OTHERS = 0.5
"""Weight of a person of another laboratory, relative to a person of the walker's laboratory.

It was chosen between 1 and a half: with eight of CMU's adults known to a model of children, bars of 95 % cover 97.2 and
96.5 % of the truth.
"""
OF_HEIGHT = (WALKER15.index("head"), *ANKLES)
"""Joints from which the height of a walker is measured."""


def height_mm(walker: np.ndarray) -> float:
    """Return the height, mm, of the head's centre above the ankles of a walker (1 + 2H, 15, 3)."""
    return walking.stature(fourier.synthesise(walker, 1.0, np.arange(INSTANTS) / INSTANTS))


def scaled(prior: Prior, ratio: float) -> Prior:
    """Return a prior rescaled to people who are `ratio` times as tall."""
    square = ratio**2
    return replace(
        prior,
        mean=ratio * prior.mean,
        covariance=square * prior.covariance,
        length_variance=square * prior.length_variance,
        pair_variance=square * prior.pair_variance,
    )


def truncated(prior: Prior, blocks: int) -> Prior:
    """Return the prior with only the first `blocks` Fourier coefficients of each coordinate."""
    covariance = np.ascontiguousarray(prior.covariance[:, :, :blocks, :, :, :blocks])
    return replace(prior, mean=prior.mean[..., :blocks], covariance=covariance)


@shortened
class Learnt:
    """Prior learnt from laboratories other than the walker's own.

    Attributes
    ----------
    prior : Prior
    share : float
        Share of the differences between laboratories that the prior does not cover, see `unfamiliar`.
    people : int
        Number of people behind the prior.
    """

    prior: Prior
    share: float
    people: int


def calibrated(
    learnt: Learnt, walker_mm: float, known: Sequence[np.ndarray], heights_mm: Sequence[float]
) -> Prior:
    """Return the prior for the laboratory of a walker, calibrated on the 3D walks of a few people recorded there.

    Parameters
    ----------
    learnt : Learnt
    walker_mm : float
        Height of the walker.
    known : sequence of (1 + 2H, 15, 3)
        Mean walk of each known person, mm.
    heights_mm : sequence of float
        Their heights.

    Notes
    -----
    The mean moves to where the laboratory places its joints.  The covariance is then pooled with that of the K known
    people about this mean: ``(n C + K S) / (n + K)``, where n is `WEIGHT_OF_OTHERS` times the number of people behind
    C.
    """
    scale = walker_mm / height_mm(by_block(learnt.prior.mean))
    walkers = [walker_mm / height * walk for walk, height in zip(known, heights_mm, strict=True)]
    both = [(walker + fourier.mirrored(walker)) / 2.0 for walker in walkers]
    differences = Differences()
    prior = unfamiliar(scaled(learnt.prior, scale), differences, learnt.share, both)
    if not walkers:
        return prior
    sides = np.concatenate([walkers, [fourier.mirrored(walker) for walker in walkers]])
    off = (by_joint(sides) - prior.mean).reshape(len(sides), -1)
    sample = structured_covariance(off.T @ off / len(sides), prior.mean.shape[-1], Shrinkage())
    n, K = WEIGHT_OF_OTHERS * learnt.people, len(walkers)
    pooled = (n * prior.covariance + K * sample.reshape(prior.covariance.shape)) / (n + K)
    return replace(prior, covariance=pooled)
