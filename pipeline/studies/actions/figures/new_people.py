"""Generalisation of the action model to new people, from held-out people and from bootstrap samples of people.

Held-out people are compared with the pattern and the modes of the others.  Bootstrap samples give the variation of the
spectrum.

Each result has a baseline: a pattern chosen at random, and numbers of a posture without correlation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.core import aspace, bootstrap
from pipeline.seeding import derive_generator
from pipeline.studies.replicated import DRAW

MODES = 4
"""Number of dimensions of the posture space (aSpace) that mozerov2006 figure 3 shows."""

COVERED, PRINTED = 0.95, 16
"""Share of the posture variance that the aSpace explains, and the published number of its eigenvectors."""


@dataclass(frozen=True)
class Moments:
    """Sums over the postures of each person, from which covariances of postures for any sample of people follow.

    Attributes
    ----------
    count : (C,)
        Number of postures.
    total : (C, 37)
    squares : (C, 37, 37)
    """

    count: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    def covariances(self, weights: np.ndarray) -> np.ndarray:
        """Return the covariance matrices (B, 37, 37) of postures, for B rows of person weights (B, C)."""
        count = (weights @ self.count)[:, None]
        mean = weights @ self.total / count
        return (
            np.tensordot(weights, self.squares, axes=1) / count[..., None] - mean[:, :, None] * mean[:, None]
        )


def moments(performances: Sequence[np.ndarray], person: np.ndarray) -> Moments:
    """Return sums of the postures (F_i, 37) and of products of their numbers, for each person in alphabetical order."""
    middle = np.concatenate(performances).mean(axis=0)  # against cancellation
    groups = [
        np.concatenate([p for p, who in zip(performances, person, strict=True) if who == label]) - middle
        for label in np.unique(person)
    ]
    return Moments(
        count=np.array([len(x) for x in groups]),
        total=np.stack([x.sum(axis=0) for x in groups]),
        squares=np.stack([x.T @ x for x in groups]),
    )


def space_tables(performances: Sequence[np.ndarray], person: np.ndarray) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return tables of the number of eigenvectors for the required variance, for all people and resampled people.

    The uncorrelated baseline shuffles each number of a posture over time, so that only the diagonal of the covariance
    remains.  The paper's number of eigenvectors is taken from all people: eigenvectors of a resample would cover
    more, because it has fewer different people.
    """
    sums = moments(performances, person)
    people = len(sums.count)
    weights = bootstrap.resampling_weights(people, derive_generator(0, "people"))
    covariance = sums.covariances(np.ones((1, people), int))
    everyone = _sizes(covariance, covariance[0])
    drawn = _sizes(sums.covariances(weights), covariance[0]) if people > 1 else everyone.iloc[:0]
    return everyone, pd.concat(
        [pd.DataFrame({DRAW: np.arange(1, len(drawn) + 1)}), drawn.reset_index(drop=True)], axis=1
    )


def _sizes(covariances: np.ndarray, of_all: np.ndarray) -> pd.DataFrame:
    """Return the number (B,) of eigenvectors for the required variance, and the variance share (B,) of the first 16.

    The share is explained by the published number of eigenvectors, computed from all people.
    """
    columns = {}
    for suffix, correlated in {"": True, "_uncorrelated": False}.items():
        matrices, reference = (x if correlated else x * np.eye(x.shape[-1]) for x in (covariances, of_all))
        spectra, total = np.linalg.eigvalsh(matrices)[:, ::-1], np.trace(matrices, axis1=1, axis2=2)
        columns[f"components{suffix}"] = [
            aspace.smallest_dimensions(values, sum_, COVERED)
            for values, sum_ in zip(spectra, total, strict=True)
        ]
        first = np.linalg.eigh(reference)[1][:, -PRINTED:]
        columns[f"held_by_{PRINTED}{suffix}"] = np.einsum("ik,bij,jk->b", first, matrices, first) / total
    return pd.DataFrame(columns)


def patterns_of_others(
    distances: np.ndarray, person: np.ndarray, pattern_of: Callable[[np.ndarray], int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return each performance's distance (M,) from the median performance of other people, and from all on average.

    The second distance is a mean.  NaN if fewer than two performances of others remain.

    Parameters
    ----------
    distances : (M, M)
        C(n, m) of pattern n and performance m.
    person : (M,)
    pattern_of : callable
        Of some performances, ascending indices, the place among them of the pattern that a model of them takes.
    """
    from_median, from_any = np.full((2, len(person)), np.nan)
    for label in np.unique(person):
        out = person == label
        if (~out).sum() < 2:
            continue
        others = np.flatnonzero(~out)
        pattern = others[pattern_of(others)]
        from_median[out] = distances[pattern, out]
        from_any[out] = distances[np.ix_(others, np.flatnonzero(out))].mean(axis=0)
    return from_median, from_any


def variance_along_modes(
    performances: Sequence[np.ndarray], person: np.ndarray, modes: int = MODES
) -> tuple[np.ndarray, np.ndarray]:
    """Return the share (M,) of each performance's variance along the eigenvectors of other people, and a baseline.

    The baseline uses as many single numbers of a posture, those that vary most in the other people.  NaN for a single
    person.
    """
    along, baseline = np.full((2, len(person)), np.nan)
    labels = np.unique(person)
    sums = moments(performances, person)
    for number, label in enumerate(labels):
        if len(labels) < 2:
            break
        others = (np.arange(len(labels)) != number).astype(int)
        (covariance,) = sums.covariances(others[None])
        vectors = np.linalg.eigh(covariance)[1][:, ::-1][:, :modes]
        numbers = np.argsort(-np.diag(covariance), kind="stable")[:modes]
        for m in map(int, np.flatnonzero(person == label)):
            deviations = performances[m] - performances[m].mean(axis=0)
            total = (deviations**2).sum()
            along[m] = ((deviations @ vectors) ** 2).sum() / total
            baseline[m] = (deviations[:, numbers] ** 2).sum() / total
    return along, baseline
