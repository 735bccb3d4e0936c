"""What holds of a person who was not learnt from: the pattern, the modes; and the spectrum of people drawn again.

Each is given beside its baseline: a pattern taken at random, numbers of a posture that are not correlated.
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
"""Dimensions of the aSpace that mozerov2006 figure 3 shows."""

HELD, PRINTED = 0.95, 16
"""Share of the variance that the aSpace holds, and the eigenvectors that the paper needs for it."""


@dataclass(frozen=True)
class Moments:
    """Sums over all postures of each person, of which the covariance of any people follows.

    Attributes
    ----------
    count : (C,)
        Postures.
    total : (C, 37)
    squares : (C, 37, 37)
    """

    count: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    def covariances(self, weights: np.ndarray) -> np.ndarray:
        """Return the covariance (B, 37, 37) of postures of people counted so often (B, C)."""
        count = (weights @ self.count)[:, None]
        mean = weights @ self.total / count
        return (
            np.tensordot(weights, self.squares, axes=1) / count[..., None] - mean[:, :, None] * mean[:, None]
        )


def moments(performances: Sequence[np.ndarray], person: np.ndarray) -> Moments:
    """Return the moments of the postures (F_i, 37) of each person, the people in alphabetical order."""
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
    """Return ``table_space`` and ``table_space_draws``: size of the aSpace, of all and of people drawn again.

    Uncorrelated: the same numbers of a posture, each shuffled over time by itself, so that the covariance is left
    with its diagonal.  The eigenvectors that hold a share are those of all people: drawn again, they would always
    hold more, since fewer people are different ones.
    """
    found = moments(performances, person)
    people = len(found.count)
    weights = bootstrap.resampling_weights(people, derive_generator(0, "people"))
    whole = found.covariances(np.ones((1, people), int))
    everyone = _sizes(whole, whole[0])
    drawn = _sizes(found.covariances(weights), whole[0]) if people > 1 else everyone.iloc[:0]
    return everyone, pd.concat(
        [pd.DataFrame({DRAW: np.arange(1, len(drawn) + 1)}), drawn.reset_index(drop=True)], axis=1
    )


def _sizes(covariances: np.ndarray, of_all: np.ndarray) -> pd.DataFrame:
    """Return how many eigenvectors hold the variance (B,), and how much the paper's number of those of all holds."""
    columns = {}
    for suffix, correlated in {"": True, "_uncorrelated": False}.items():
        of, whole = (x if correlated else x * np.eye(x.shape[-1]) for x in (covariances, of_all))
        spectra, total = np.linalg.eigvalsh(of)[:, ::-1], np.trace(of, axis1=1, axis2=2)
        columns[f"components{suffix}"] = [
            aspace.smallest_dimensions(values, sum_, HELD)
            for values, sum_ in zip(spectra, total, strict=True)
        ]
        first = np.linalg.eigh(whole)[1][:, -PRINTED:]
        columns[f"held_by_{PRINTED}{suffix}"] = np.einsum("ik,bij,jk->b", first, of, first) / total
    return pd.DataFrame(columns)


def patterns_of_others(
    distances: np.ndarray, person: np.ndarray, pattern_of: Callable[[np.ndarray], int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of each performance (M,) from the pattern of the other people's, and from any of theirs.

    NaN where no two performances of others are left.

    Parameters
    ----------
    distances : (M, M)
        C(n, m) of pattern n and performance m.
    person : (M,)
    pattern_of : callable
        Of some performances, ascending indices, the place among them of the pattern that a model of them takes.
    """
    chosen, arbitrary = np.full((2, len(person)), np.nan)
    for label in np.unique(person):
        out = person == label
        if (~out).sum() < 2:
            continue
        others = np.flatnonzero(~out)
        pattern = others[pattern_of(others)]
        chosen[out] = distances[pattern, out]
        arbitrary[out] = distances[np.ix_(others, np.flatnonzero(out))].mean(axis=0)
    return chosen, arbitrary


def variance_along_modes(
    performances: Sequence[np.ndarray], person: np.ndarray, modes: int = MODES
) -> tuple[np.ndarray, np.ndarray]:
    """Return the share of each performance's variance (M,) along the first modes of other people, and its baseline.

    The baseline are as many single numbers of a posture, those that vary most in the other people.  NaN for one person
    alone.
    """
    along, baseline = np.full((2, len(person)), np.nan)
    labels = np.unique(person)
    found = moments(performances, person)
    for number, label in enumerate(labels):
        if len(labels) < 2:
            break
        others = (np.arange(len(labels)) != number).astype(int)
        (covariance,) = found.covariances(others[None])
        vectors = np.linalg.eigh(covariance)[1][:, ::-1][:, :modes]
        numbers = np.argsort(-np.diag(covariance), kind="stable")[:modes]
        for m in map(int, np.flatnonzero(person == label)):
            away = performances[m] - performances[m].mean(axis=0)
            whole = (away**2).sum()
            along[m] = ((away @ vectors) ** 2).sum() / whole
            baseline[m] = (away[:, numbers] ** 2).sum() / whole
    return along, baseline
