"""Tests of the baselines of mozerov2006: performances without timing errors, and results for other people."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.clips.options import SyntheticPerformances
from pipeline.clips.performances import synthetic_performances
from pipeline.core import aspace
from pipeline.studies.actions.dataset import PostureDataset, Postures
from pipeline.studies.actions.figures.new_people import (
    moments,
    patterns_of_others,
    space_tables,
    variance_along_modes,
)
from pipeline.studies.actions.figures.pairs import squared_distances
from pipeline.studies.actions.model import Action, ActionSpaceModel
from pipeline.studies.actions.without_mistiming import without_mistiming

OPTIONS = ActionSpaceModel(samples=40, max_disparity=19)


@pytest.fixture(scope="module")
def dataset() -> Postures:
    """Ten synthetic bending performances by five people."""
    clips = synthetic_performances(SyntheticPerformances(performances=10, subjects=5), 3)
    return PostureDataset().build(clips, workers=1)


@pytest.fixture(scope="module")
def action(dataset: Postures) -> Action:
    return OPTIONS.learn(dataset, workers=1)


def variance(x: np.ndarray) -> float:
    return float(x.var(axis=0, ddof=1).mean())


@pytest.mark.parametrize("known", [True, False])
def test_without_mistiming_synchronization_takes_less_off(
    dataset: Postures, action: Action, known: bool
) -> None:
    data = dataset if known else replace(dataset, phase=None)
    baseline = without_mistiming(data, action, OPTIONS)
    gained = variance(action.synchronized) / variance(action.linear)
    all_the_same = variance(baseline.synchronized) / variance(baseline.linear)
    assert gained < all_the_same <= 1.0
    assert (baseline.distances <= baseline.distances_linear * (1 + 1e-12)).all()
    if not known:
        assert baseline.linear.mean(axis=0) == pytest.approx(action.synchronized.mean(axis=0))
        assert variance(baseline.linear) == pytest.approx(variance(action.synchronized)), (
            "as large, of another sign"
        )


def test_pairs_give_the_variance_also_of_unequal_lengths() -> None:
    rng = np.random.default_rng(0)
    equal = list(rng.normal(size=(4, 7, 3)))
    distance = squared_distances(equal)
    assert distance.sum() / (2 * 4 * 3) == pytest.approx(
        np.stack(equal).var(axis=0, ddof=1).sum(axis=1).mean()
    )
    shorter = [equal[0][:3], *equal[1:]]
    assert squared_distances(shorter)[0, 1] == pytest.approx(((equal[0][:3] - equal[1][:3]) ** 2).sum() / 3)
    assert squared_distances(shorter)[1, 2] == pytest.approx(distance[1, 2])


def test_the_pattern_of_others_has_not_seen_the_person() -> None:
    person = np.array(["a", "a", "b", "b", "c"])
    distances = np.abs(np.arange(5.0)[:, None] - np.arange(5.0))
    groups: list[list[int]] = []

    def middle(others: np.ndarray) -> int:
        """Return the position of the median among some performances, and store the numbers of these performances."""
        groups.append(others.tolist())
        return len(others) // 2

    chosen, arbitrary = patterns_of_others(distances, person, middle)
    assert groups == [[2, 3, 4], [0, 1, 4], [0, 1, 2, 3]]
    assert chosen[0] == distances[3, 0], "of 2, 3, 4 the middle one is the median"
    assert arbitrary[0] == distances[[2, 3, 4], 0].mean()
    moved = distances.copy()
    moved[:2, :2] = 99.0  # among the person's own
    assert patterns_of_others(moved, person, middle)[0][:2].tolist() == chosen[:2].tolist()
    assert np.isnan(patterns_of_others(distances, np.repeat("a", 5), middle)[0]).all()


def test_moments_of_people_give_the_covariance_of_all_their_postures(dataset: Postures) -> None:
    postures = dataset.split(dataset.postures)
    result = moments(postures, dataset.person)
    (covariance,) = result.covariances(np.ones((1, 5), dtype=int))
    assert covariance == pytest.approx(np.cov(np.concatenate(postures).T, ddof=0), abs=1e-12)
    everyone, drawn = space_tables(postures, dataset.person)
    space = aspace.learn(postures)
    assert everyone["components"][0] == space.dimensions
    assert everyone["held_by_16"][0] == pytest.approx(space.eigenvalues[:16].sum() / space.total_variance)
    assert (everyone["components_uncorrelated"] >= everyone["components"]).all()
    assert len(drawn) == 2000
    assert drawn["held_by_16"].between(0, 1 + 1e-9).all()
    # Those drawn again lie about all of them: the axes are not fitted anew to fewer people.
    assert 0.2 < (drawn["held_by_16"] < everyone["held_by_16"][0]).mean() < 0.8


def test_modes_hold_more_than_as_many_numbers_and_all_hold_everything(dataset: Postures) -> None:
    postures = dataset.split(dataset.postures)
    along, baseline = variance_along_modes(postures, dataset.person)
    assert ((baseline > 0) & (baseline < along) & (along < 1)).all()
    assert variance_along_modes(postures, dataset.person, modes=37)[0] == pytest.approx(1.0)
    assert np.isnan(variance_along_modes(postures, np.repeat("a", 10))[0]).all()
