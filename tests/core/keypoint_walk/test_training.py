"""The model of walkers: mean, structured covariance, mirror images."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.keypoint_walk import compact, expand, moments, prepare, structured_covariance, train
from pipeline.core.keypoint_walk.prior import Detector
from pipeline.core.keypoint_walk.training import (
    BLOCKS,
    BONES,
    HEIGHT_MM,
    PAIRS,
    bone_lengths,
    cycle_basis,
    cycle_slope,
    mirror_image,
    stance_rows,
)  # fmt: skip
from pipeline.validation import InvalidInput
from tests.core.keypoint_walk.walkers import prior, walks


def test_every_walker_has_the_same_height() -> None:
    for walk in walks():
        rest = walk.walker[:, 2, 0]
        assert rest[0] - min(rest[11], rest[14]) == pytest.approx(HEIGHT_MM, rel=0.08)


@given(seed=st.integers(0, 1000))
def test_structured_covariance_is_positive_and_keeps_the_diagonal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(12, 4 * BLOCKS))
    S = rows.T @ rows / 12
    C = structured_covariance(S, extra_variance=0.5)
    assert np.linalg.eigvalsh(C).min() >= 0.5 * (1 - 1e-9)
    # T averages a sine with its cosine, so the trace is kept; the rest of C is S itself.
    assert np.trace(C) == pytest.approx(np.trace(S) + 0.5 * len(S))
    np.testing.assert_allclose(structured_covariance(S, within=0.0, diagonal=0.0, extra_variance=0.0), S)


def test_the_model_of_mirrored_people_is_the_same() -> None:
    people = np.arange(len(walks()))
    one = train(list(walks()), people)
    mirrored = [
        type(w)(mirror_image(w.walker), w.frequency_hz, w.aperiodic_variance, w.height_mm) for w in walks()
    ]
    other = train(mirrored, people)
    np.testing.assert_allclose(other.mean, one.mean, atol=1e-8)
    np.testing.assert_allclose(other.covariance, one.covariance, atol=1e-6)
    np.testing.assert_allclose(mirror_image(one.mean), one.mean, atol=1e-8)


def test_walks_of_one_person_count_as_one_person() -> None:
    people = np.arange(len(walks()))
    once = train(list(walks()), people)
    twice = train([*walks(), walks()[0]], np.append(people, 0))
    np.testing.assert_allclose(twice.mean, once.mean, atol=1e-9)


def test_slope_of_the_basis() -> None:
    phase, step = np.linspace(0, 6, 7), 1e-6
    numeric = (cycle_basis(phase + step) - cycle_basis(phase - step)) / (2 * step)
    np.testing.assert_allclose(cycle_slope(phase), numeric, atol=1e-8)


def test_feet_on_the_ground_move_backwards_at_the_belt_speed() -> None:
    model = prior().model
    rows, belt = stance_rows(model.mean)
    flat = model.mean.ravel()
    assert belt @ flat > 0
    assert np.abs(rows @ flat).max() < 0.5 * (belt @ flat)


def test_bones_are_those_of_the_tree_and_pairs_are_mirror_images() -> None:
    assert len(BONES) == 16
    lengths = bone_lengths(walks()[0].walker[None])[0].mean(axis=-1)
    np.testing.assert_allclose(lengths[PAIRS[:, 0]], lengths[PAIRS[:, 1]], rtol=0.1)


def test_a_detector_without_bias_gives_nothing_back() -> None:
    exact = prepare(prior().model, Detector(floor_mm=np.zeros(15)))
    biased = prior()
    W = prior().mean.ravel() + 5.0
    assert (
        np.abs(exact.giving_back @ (W - exact.mean.ravel()) - 5.0).max()
        < np.abs(biased.giving_back @ (W - biased.mean.ravel()) - 5.0).max()
    )
    assert np.linalg.eigvalsh(biased.remaining).min() > -1e-6


def test_one_person_is_no_population() -> None:
    with pytest.raises(InvalidInput, match="two people or more"):
        train([walks()[0], walks()[0]], np.array([1, 1]))


def test_a_compact_model_keeps_the_variance_and_leading_eigenwalkers() -> None:
    whole = moments(list(walks()), np.arange(len(walks())))
    small = compact(whole, 5)
    back = expand(small)
    assert np.trace(back.covariance) == pytest.approx(np.trace(whole.covariance))
    assert np.linalg.eigvalsh(back.covariance).min() > -1e-6 * np.trace(back.covariance)
    for component in small.components:
        assert component @ back.covariance @ component >= component @ whole.covariance @ component * (
            1 - 1e-9
        )
    assert small.components.shape == (5, whole.covariance.shape[0])
    with pytest.raises(InvalidInput, match="eigenwalkers"):
        compact(whole, 7)
