"""Tests of the anatomical prior: weights of walks, mirror images, shrinkage, and bone lengths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from tests.strategies import seeds, walkers
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Shrinkage

PLAIN = Shrinkage(mirror=False, within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)


def equal(count: int) -> np.ndarray:
    return np.full(count, 1.0 / count)


@given(seed=seeds, count=st.integers(2, 9))
@settings(max_examples=10, deadline=None)
def test_without_anything_it_is_the_sample_covariance(seed: int, count: int) -> None:
    people = walkers(np.random.default_rng(seed), count)
    prior = anatomical.fit(people, equal(count), PLAIN)
    rows = anatomical.by_joint(people).reshape(count, -1)
    np.testing.assert_allclose(prior.covariance.reshape(225, 225), np.cov(rows.T), atol=1e-7)
    np.testing.assert_allclose(anatomical.by_block(prior.mean), people.mean(axis=0), atol=1e-9)


def test_walks_of_one_person_count_as_one_person() -> None:
    people = walkers(np.random.default_rng(1), 4)
    weights = anatomical.person_weights(np.array(["a", "b", "c", "d"]))
    again = anatomical.person_weights(np.array(["a", "b", "c", "d", "d", "d"]))
    twice = np.concatenate([people, people[3:], people[3:]])
    once, repeated = anatomical.fit(people, weights, PLAIN), anatomical.fit(twice, again, PLAIN)
    np.testing.assert_allclose(repeated.mean, once.mean)
    # Only the effective size differs: equal walks do not make the fourth person more certain.
    size = 1.0 / (again**2).sum()
    ratio = size / (size - 1) * 3 / 4
    np.testing.assert_allclose(repeated.covariance, once.covariance * ratio, atol=1e-7)
    np.testing.assert_allclose(repeated.pair_variance, once.pair_variance)


def test_with_mirror_images_it_is_its_own_mirror_image() -> None:
    people = walkers(np.random.default_rng(2), 6)
    shrinkage = Shrinkage()
    prior = anatomical.fit(people, equal(6), shrinkage)
    mirrored = anatomical.fit(fourier.mirrored(people), equal(6), shrinkage)
    np.testing.assert_allclose(prior.mean, mirrored.mean, atol=1e-9)
    np.testing.assert_allclose(prior.covariance, mirrored.covariance, atol=1e-7)


def test_the_share_of_a_harmonic_ties_joints_and_nothing_else() -> None:
    people = walkers(np.random.default_rng(3), 12)
    S = anatomical.fit(people, equal(12), PLAIN).covariance
    T = anatomical.fit(people, equal(12), replace(PLAIN, within_harmonic=1.0)).covariance
    np.testing.assert_allclose(T[:, :, 0, :, :, 0], S[:, :, 0, :, :, 0], atol=1e-7)
    for p, q in ((1, 2), (3, 4)):
        together = (S[:, :, p, :, :, p] + S[:, :, q, :, :, q]) / 2
        np.testing.assert_allclose(T[:, :, p, :, :, p], together, atol=1e-7)
        np.testing.assert_allclose(T[:, :, q, :, :, q], together, atol=1e-7)
    for block in range(5):
        for other in set(range(5)) - {block}:
            assert not T[:, :, block, :, :, other].any()
    b = anatomical.fit(people, equal(12), replace(PLAIN, diagonal=1.0, extra_variance=7.0)).covariance
    np.testing.assert_allclose(b.reshape(225, 225), np.diag(np.diag(S.reshape(225, 225)) + 7.0), atol=1e-7)


def test_bones_are_those_of_the_tree_and_pairs_are_left_and_right() -> None:
    assert len(anatomical.BONES) == len(set(map(frozenset, anatomical.BONES))) == 16
    names = [
        {tuple(WALKER15.joints[j] for j in anatomical.BONES[b]) for b in pair} for pair in anatomical.PAIRS
    ]
    assert {("left_knee", "left_ankle"), ("right_knee", "right_ankle")} in names
    assert len(names) == 6


def test_lengths_are_distances_of_the_synthesised_joints() -> None:
    walker = walkers(np.random.default_rng(4), 1)[0]
    lengths = anatomical.bone_lengths(anatomical.by_joint(walker))
    times = np.arange(anatomical.PHASES) / anatomical.PHASES
    motion = fourier.synthesise(walker, 1.0, times)
    for number, (a, b) in enumerate(anatomical.BONES):
        np.testing.assert_allclose(
            lengths[number], np.linalg.norm(motion[:, a] - motion[:, b], axis=1), rtol=1e-12
        )


def test_a_walk_that_is_not_finite_is_refused() -> None:
    people = walkers(np.random.default_rng(0), 3)
    people[1, 0, 0, 0] = np.nan
    with rejects("not_finite", "the walks", index=(1, 0, 0, 0)):
        anatomical.fit(people, equal(3), Shrinkage())


@given(seed=st.integers(0, 1000))
def test_shrinkage_keeps_the_trace_and_bounds_the_eigenvalues(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(12, 4 * 9))
    S = rows.T @ rows / 12
    C = anatomical.structured_covariance(S, 9, Shrinkage(extra_variance=0.5))
    assert np.linalg.eigvalsh(C).min() >= 0.5 * (1 - 1e-9)
    # T averages a sine with its cosine, so the trace is kept; the rest of C is S itself.
    assert np.trace(C) == pytest.approx(np.trace(S) + 0.5 * len(S))
    nothing = Shrinkage(within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)
    np.testing.assert_array_equal(anatomical.structured_covariance(S, 9, nothing), S)


# --- stance -----------------------------------------------------------------------------------------------


def test_the_stance_prior_is_that_of_the_sum_of_precisions() -> None:
    people = walkers(np.random.default_rng(5), 8)
    prior = anatomical.fit(people, equal(8), Shrinkage())
    changed = anatomical.with_stance(prior, people, equal(8), share=0.3)
    rows, _ = anatomical.stance_rows(prior.mean)
    values = anatomical.by_joint(people).reshape(8, -1) @ rows.T
    spread = values.var(axis=0) + 25.0
    C = prior.covariance.reshape(225, 225)
    target = np.linalg.inv(np.linalg.inv(C) + 0.3 * (rows.T / spread) @ rows)
    np.testing.assert_allclose(changed.covariance.reshape(225, 225), target, rtol=1e-6, atol=1e-6)


def test_proportions_are_those_of_the_mean_whatever_the_size() -> None:
    people = walkers(np.random.default_rng(7), 8)
    prior = anatomical.fit(people, equal(8), Shrinkage())
    rows = anatomical.proportion_rows(prior.mean)
    change = np.random.default_rng(8).standard_normal(prior.mean.shape)

    def proportions(walker: np.ndarray) -> np.ndarray:
        length = anatomical.bone_lengths(walker).mean(axis=-1)
        size = anatomical.bone_lengths(prior.mean).mean(axis=-1)
        return length - size * (size @ length) / (size @ size)

    step = 1e-4
    slope = (proportions(prior.mean + step * change) - proportions(prior.mean - step * change)) / (2 * step)
    np.testing.assert_allclose(rows @ change.ravel(), slope, atol=1e-6)
    np.testing.assert_allclose(rows @ prior.mean.ravel(), 0.0, atol=1e-9)
    changed = anatomical.with_proportions(prior, tolerance=2.0).covariance.reshape(225, 225)
    target = np.linalg.inv(np.linalg.inv(prior.covariance.reshape(225, 225)) + rows.T @ rows / 4.0)
    np.testing.assert_allclose(changed, target, rtol=1e-6, atol=1e-5)
    assert np.diag(rows @ changed @ rows.T).max() < 4.0


def test_a_foot_that_slides_with_constant_speed_satisfies_the_stance_rows() -> None:
    """The stance constraint is zero for a foot that slides with constant speed.

    The rows of the mean are backward speeds minus their mean, and the slope is the derivative of the Fourier series.
    """
    people = walkers(np.random.default_rng(6), 8)
    prior = anatomical.fit(people, equal(8), Shrinkage())
    rows, _ = anatomical.stance_rows(prior.mean)
    np.testing.assert_allclose(rows.sum(axis=0), 0.0, atol=1e-12)
    phase = 2 * np.pi * np.arange(20) / 20
    step = 1e-5
    walker = anatomical.by_block(prior.mean)
    slope = (
        fourier.synthesise(walker, 1 / (2 * np.pi), phase + step)
        - fourier.synthesise(walker, 1 / (2 * np.pi), phase - step)
    )[..., 1] / (2 * step)
    chosen = [np.sort(np.argsort(slope[:, WALKER15.index(f"{s}_ankle")])[:8]) for s in ("left", "right")]
    speeds = np.concatenate(
        [slope[k, WALKER15.index(f"{s}_ankle")] for s, k in zip(("left", "right"), chosen, strict=True)]
    )
    np.testing.assert_allclose(rows @ prior.mean.ravel(), speeds - speeds.mean(), atol=1e-5)
