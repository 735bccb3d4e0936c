"""Tests that error bars are learnt on people and laboratories that are left out of the model."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.clips.kinds import WALKS, Walks
from walk3d.film.reconstruct import model_file, training
from walk3d.film.reconstruct.training import Training, train
from walk3d.film.simulation.filmed import training_walks
from walk3d.film.walk import Moments, TrainingWalk, compact, moments
from walk3d.film.walk.calibration import ANYBODY, AS_OURS


@pytest.fixture
def walks() -> Walks:
    """Return the walks of seven synthetic walkers of two laboratories."""
    owner = compose(["experiment=zhang2007_fig2", "data=synthetic", "scale=smoke", "data.walkers=7"])
    output = owner.data.request(WALKS, owner.skeleton, owner.seed, owner.workers).make()
    assert isinstance(output, Walks)
    return replace(output, source=np.where(np.arange(len(output)) < 4, "here", "there"))


@pytest.mark.thorough
def test_a_person_and_then_a_whole_laboratory_is_left_out(
    walks: Walks, monkeypatch: pytest.MonkeyPatch
) -> None:
    finite: list[set[str]] = []

    def noted(rest: list[TrainingWalk], people: np.ndarray) -> Moments:
        finite.append(set(people.tolist()))
        return moments(rest, people)

    monkeypatch.setattr(training, "moments", noted)
    monkeypatch.setattr(training, "HEADINGS_DEG", (30,))
    trained = train(walks, Training(components=2))
    everybody, start = set(walks.person.tolist()), set(walks.person[:4].tolist())
    assert list(trained.calibrations) == [AS_OURS, ANYBODY]
    assert finite == [everybody, *(everybody - {who} for who in walks.person), everybody - start, start]
    assert trained.about["calibration"]["clips"] == 2 * 2 * 7
    of_one = train(replace(walks, source=np.repeat("here", len(walks))), Training(components=2))
    assert list(of_one.calibrations) == [AS_OURS]
    # Of one laboratory nothing is known of how laboratories differ, of two of 4 and 3 people about half.
    assert of_one.unfamiliar == 1.0
    assert trained.unfamiliar == pytest.approx((4**2 + 3**2) / 7**2)


MIRRORS = [Path(folder) for folder in os.environ.get("MOCAP_MIRROR", "").split(":")]


@pytest.mark.skipif(
    not all(
        any((mirror / source).is_dir() for mirror in MIRRORS) for source in ("cmu", "biomechzoo", "people")
    ),
    reason="needs MOCAP_MIRROR with the recordings of data=many",
)
def test_the_model_that_comes_with_the_package_is_what_the_recordings_give() -> None:
    """The shipped model equals the model that is trained on the recordings.

    After a change of a mapping to joints, train the model again, and add a line to the changelog.
    """
    owner = compose(["experiment=zhang2007_fig2", "dataset.walks=all", "data=many"])
    walks = owner.data.request(WALKS, owner.skeleton, owner.seed, owner.workers).make()
    assert isinstance(walks, Walks)
    result = compact(moments(training_walks(walks), walks.person), Training().components)
    ships = model_file.load().compact
    np.testing.assert_allclose(result.mean, ships.mean, atol=1e-3)
    np.testing.assert_allclose(result.eigenvalues, ships.eigenvalues, rtol=1e-5)
