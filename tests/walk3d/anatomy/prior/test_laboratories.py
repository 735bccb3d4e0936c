"""Tests of the prior for walkers of other laboratories, and of the estimated differences between laboratories."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.skeleton import WALKER15
from tests.strategies import seeds, walkers
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Differences

PELVIS = WALKER15.index("pelvis")


def prior_of(seed: int, count: int = 6) -> anatomical.Prior:
    return anatomical.fit(
        walkers(np.random.default_rng(seed), count), np.full(count, 1.0 / count), anatomical.Shrinkage()
    )


@given(seed=seeds, share=st.floats(0.1, 1.0), size=st.floats(0.0, 0.3), offset=st.floats(0.0, 60.0))
@settings(max_examples=10, deadline=None)
def test_constants_of_joints_gain_the_offset_and_everything_the_size(
    seed: int, share: float, size: float, offset: float
) -> None:
    prior = prior_of(seed)
    result = anatomical.unfamiliar(prior, Differences(offset_mm=(offset,) * 7, size=size), share)
    gained = result.covariance - prior.covariance
    for joint in (0, PELVIS, 11):
        for block in (0, 3):
            reference = offset**2 if block == 0 and joint != PELVIS else 0.0
            expected = share * (reference + size**2 * prior.mean[joint, 1, block] ** 2)
            np.testing.assert_allclose(gained[joint, 1, block, joint, 1, block], expected, atol=1e-6)
    together = share * size**2 * prior.mean[2, 0, 0] * prior.mean[5, 2, 1]
    np.testing.assert_allclose(gained[2, 0, 0, 5, 2, 1], together, atol=1e-6)
    np.testing.assert_allclose(result.definition_variance, 0.5 * share * offset**2)


@given(seed=seeds, count=st.integers(1, 4), share=st.floats(0.1, 1.0), offset=st.floats(1.0, 60.0))
@settings(max_examples=6, deadline=None)
def test_known_people_fix_what_sets_their_laboratory_apart(
    seed: int, count: int, share: float, offset: float
) -> None:
    # The oracle: one normal distribution of what sets the laboratory apart, its k people and one more, conditioned.
    prior = prior_of(seed)
    differences = Differences(offset_mm=(offset,) * 7, size=0.1)
    finite = walkers(np.random.default_rng(seed + 1), count) + 30.0
    n = prior.mean.size
    C = prior.covariance.reshape(n, n)
    L = anatomical.unfamiliar(prior, differences, share).covariance.reshape(n, n) - C
    together = np.kron(np.ones((count + 1, count + 1)), L / 2.0) + np.kron(np.eye(count + 1), C + L / 2.0)
    y = anatomical.by_joint(finite).reshape(count, n) - prior.mean.ravel()
    gain = np.linalg.solve(together[n:, n:], together[n:, :n]).T
    result = anatomical.unfamiliar(prior, differences, share, list(finite))
    np.testing.assert_allclose(result.mean.ravel() - prior.mean.ravel(), gain @ y.ravel(), atol=1e-6)
    expected = together[:n, :n] - gain @ together[n:, :n]
    np.testing.assert_allclose(result.covariance.reshape(n, n), expected, atol=1e-6 * abs(expected).max())
    # Bones turn about joints that lie elsewhere, wherever that is.
    assert result.definition_variance == anatomical.unfamiliar(prior, differences, share).definition_variance


def test_a_prior_of_no_differences_is_the_same() -> None:
    prior = prior_of(3)
    result = anatomical.unfamiliar(prior, Differences(offset_mm=(0.0,) * 7, size=0.0))
    np.testing.assert_array_equal(result.covariance, prior.covariance)
    before, after = (anatomical.tolerances(each) for each in (prior, result))
    np.testing.assert_array_equal(after.within, before.within)


def test_bones_of_other_joints_may_be_less_constant() -> None:
    prior = prior_of(4)
    before = anatomical.tolerances(prior)
    after = anatomical.tolerances(anatomical.unfamiliar(prior, Differences()))
    assert (after.within > before.within).all()
    assert (after.pairs > before.pairs).all()


def test_what_training_lacks_falls_with_every_laboratory() -> None:
    # Laboratories of equal weight: 2 B / L is left of what B (1 + 1/L) predicts and B (1 - 1/L) shows.
    for count in (1, 2, 5):
        names = np.repeat([f"laboratory {n}" for n in range(count)], 4)
        weights = np.full(len(names), 1.0 / len(names))
        np.testing.assert_allclose(anatomical.concentration(weights, names), 1.0 / count)


def two_laboratories(
    rng: np.random.Generator, count: int, people: int, offset_mm: float, size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return walks (R, 5, 15, 3) of several simulated laboratories, with the person and the laboratory of each walk."""
    base = walkers(rng, 1)[0]
    coefficients, names, owner = [], [], []
    for laboratory in range(count):
        moved = rng.normal(0.0, offset_mm / np.sqrt(2.0), (15, 3))
        moved = (moved + moved[list(WALKER15.mirror)] * [-1.0, 1.0, 1.0]) / np.sqrt(
            2.0
        )  # symmetric, same size
        moved[PELVIS] = 0.0
        scale = 1.0 + size / np.sqrt(2.0) * rng.standard_normal()
        for person in range(people):
            reference = base * (1.0 + 0.02 * rng.standard_normal())
            walker = scale * reference
            walker[0] += moved + rng.normal(0.0, 5.0, (15, 3))
            coefficients.append(walker)
            names.append(f"{laboratory} {person}")
            owner.append(str(laboratory))
    return np.stack(coefficients), np.array(names), np.array(owner)


def test_many_laboratories_tell_how_far_apart_they_are() -> None:
    walks = two_laboratories(np.random.default_rng(5), 150, 6, 25.0, 0.1)
    assumed = Differences(offset_mm=(60.0,) * 7, size=0.4)
    result = anatomical.learn_differences(*walks, assumed)
    # A sum of squares over the midline's joints has no part across, and size takes part of every offset.
    np.testing.assert_allclose(result.offset_mm[1:], 25.0, rtol=0.2)
    np.testing.assert_allclose(result.size, 0.1, rtol=0.25)


def test_one_laboratory_or_lone_people_tell_nothing() -> None:
    rng = np.random.default_rng(6)
    assumed = Differences(offset_mm=(11.0,) * 7, size=0.05)
    for walks in (two_laboratories(rng, 1, 9, 25.0, 0.1), two_laboratories(rng, 9, 1, 25.0, 0.1)):
        assert anatomical.learn_differences(*walks, assumed) == assumed


def test_what_is_assumed_counts_less_as_laboratories_are_added() -> None:
    assumed = Differences(offset_mm=(100.0,) * 7, size=0.1)
    result = [
        np.mean(
            anatomical.learn_differences(
                *two_laboratories(np.random.default_rng(7), count, 8, 10.0, 0.1), assumed
            ).offset_mm
        )
        for count in (1, 2, 6, 40)
    ]
    assert result == sorted(result, reverse=True)
    assert result[-1] < 45.0


@given(offsets=st.lists(st.floats(0.0, 60.0), min_size=7, max_size=7), across=st.booleans())
@settings(max_examples=20, deadline=None)
def test_laboratories_move_joints_alike_on_both_sides(offsets: list[float], across: bool) -> None:
    result = anatomical.definitions(Differences(offset_mm=tuple(offsets)), across=across)
    matrix = result.reshape(45, 45)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() >= -1e-9 * max(np.trace(matrix), 1.0)
    assert not result[PELVIS].any()  # everything is about it
    mirror, sides = list(WALKER15.mirror), [-1.0, 1.0, 1.0]
    pairs = [joint for joint in range(15) if mirror[joint] != joint]
    assert len(pairs) == 12
    image = (result[mirror] * np.array(sides)[:, None, None])[pairs]
    np.testing.assert_array_equal(
        image, result[pairs]
    )  # what moves a joint outwards moves its mirror image as far
    knee, hip = WALKER15.index("left_knee"), WALKER15.index("right_hip")
    assert not result[knee, :, hip].any()
    offset = offsets[anatomical.GROUP_OF_JOINT[knee]]
    np.testing.assert_allclose(result[knee, [0, 1], knee, [0, 1]], [across * offset**2, offset**2])
