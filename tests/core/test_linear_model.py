"""Tests of the average walker, the eigenwalkers and cross-validation [zhang2007 3.2, 3.3] [zhang2004 2, 3]."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pipeline.core import camera, fourier, linear_model
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction import Gram
from tests.rejects import rejects
from tests.strategies import STYLES, Fold, angles, folds, seeds, walkers

sizes = st.integers(min_value=3, max_value=30)
styles = st.sampled_from(STYLES)


def population(seed: int, count: int, style: str) -> np.ndarray:
    return linear_model.flatten(walkers(np.random.default_rng(seed), count, style))


def same(one: LinearModel, other: LinearModel) -> bool:
    """Return True if two linear models are identical to the last bit."""
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("mean", "components", "eigenvalues", "total_variance", "last_scale")
    )


@given(seed=seeds, count=sizes, style=styles, divisor=st.sampled_from(["R-1", "R"]))
@settings(max_examples=25, deadline=None)
def test_the_model_is_the_eigendecomposition_of_the_covariance(
    seed: int, count: int, style: str, divisor: str
) -> None:
    samples = population(seed, count, style)
    model = linear_model.fit(samples, count, divisor=divisor)
    covariance = np.cov(samples.T, ddof=1 if divisor == "R-1" else 0)
    values = np.linalg.eigvalsh(covariance)[::-1]
    largest = values[0]
    np.testing.assert_allclose(model.mean, samples.mean(axis=0), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(model.eigenvalues, values[: count - 1], rtol=1e-9, atol=1e-9 * largest)
    assert model.total_variance == pytest.approx(np.trace(covariance), rel=1e-9)
    unit = model.components @ model.components.T
    np.testing.assert_allclose(unit, np.eye(count - 1), rtol=0, atol=1e-10)
    left = covariance @ model.components.T - model.components.T * model.eigenvalues
    assert np.abs(left).max() < 1e-9 * largest
    assert (np.diff(model.eigenvalues) <= 0).all()


@given(seed=seeds, count=sizes)
@settings(max_examples=15, deadline=None)
def test_the_model_is_that_of_scikit_learn(seed: int, count: int) -> None:
    decomposition = pytest.importorskip("sklearn.decomposition", reason="the extra `bench` has scikit-learn")
    samples = population(seed, count, "generic")
    retained = min(count - 1, 10)
    model = linear_model.fit(samples, retained)
    theirs = decomposition.PCA(n_components=retained, svd_solver="full").fit(samples)
    np.testing.assert_allclose(model.eigenvalues, theirs.explained_variance_, rtol=1e-9)
    np.testing.assert_allclose(
        model.eigenvalues / model.total_variance, theirs.explained_variance_ratio_, rtol=1e-9
    )
    signs = np.sign((model.components * theirs.components_).sum(axis=1))
    gaps = np.abs(np.diff(model.eigenvalues, prepend=np.inf, append=0)) / model.eigenvalues[0]
    distance = np.minimum(gaps[:-1], gaps[1:]) > 1e-6  # components of tied eigenvalues are anybody's
    np.testing.assert_allclose(
        model.components[distance], (signs[:, None] * theirs.components_)[distance], rtol=0, atol=1e-6
    )


def test_the_divisor_scales_every_eigenvalue() -> None:
    samples = population(5, 11, "generic")
    first, other = (linear_model.fit(samples, 10, divisor=d) for d in ("R-1", "R"))
    np.testing.assert_allclose(other.eigenvalues, first.eigenvalues * 10 / 11, rtol=1e-12)
    np.testing.assert_array_equal(other.components, first.components)


def test_two_walkers_worked_out_in_the_head() -> None:
    model = linear_model.fit(np.array([[0.0, 1.0, 5.0], [0.0, -3.0, 5.0]]), 9)
    assert model.mean.tolist() == [0.0, -1.0, 5.0]
    np.testing.assert_allclose(model.components, [[0.0, 1.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(model.eigenvalues, [8.0])  # (2² + 2²) / (2 - 1)
    assert model.total_variance == pytest.approx(8.0)


@given(seed=seeds, count=sizes, style=styles)
@settings(max_examples=20, deadline=None)
def test_the_largest_entry_of_a_component_is_positive(seed: int, count: int, style: str) -> None:
    samples = population(seed, count, style)
    components = linear_model.fit(samples, count).components
    size = np.abs(components)
    # The first of those that differ by rounding: which of them is the largest depends on the processor.
    largest = (size >= (1.0 - 1e-6) * size.max(axis=1, keepdims=True)).argmax(axis=1)
    assert (components[np.arange(len(components)), largest] > 0).all()
    # Walkers reflected in their mean have the same covariance, so the same components, not the opposite ones.
    if style == "generic":
        reflected = linear_model.fit(2 * samples.mean(axis=0) - samples, count).components
        np.testing.assert_allclose(reflected, components, rtol=0, atol=1e-6)


@given(seed=seeds, count=sizes, asked=st.integers(1, 300), style=styles)
@settings(max_examples=20, deadline=None)
def test_there_are_never_more_components_than_walkers_less_one(
    seed: int, count: int, asked: int, style: str
) -> None:
    samples = population(seed, count, style)
    model = linear_model.fit(samples, asked)
    retained = min(asked, count - 1)
    assert model.components.shape == (retained, 225)
    assert model.eigenvalues.shape == (retained,)
    whole = linear_model.fit(samples, count)
    # A few of many are computed in another way than all.
    np.testing.assert_allclose(
        model.eigenvalues, whole.eigenvalues[:retained], rtol=1e-9, atol=1e-12 * whole.eigenvalues[0]
    )
    assert model.total_variance == pytest.approx(whole.total_variance, rel=1e-12)
    below = whole.eigenvalues[retained] if retained < count - 1 else -np.inf
    if model.eigenvalues[-1] - below > 1e-3 * whole.eigenvalues[0]:  # of equal ones either is as good
        first = whole.components[:retained]
        np.testing.assert_allclose(model.components.T @ model.components, first.T @ first, rtol=0, atol=1e-10)
    if asked >= count - 1:  # then every walker is a sum of eigenwalkers
        k = (samples - model.mean) @ model.components.T
        np.testing.assert_allclose(model.mean + k @ model.components, samples, rtol=0, atol=1e-8)


def test_there_are_never_more_components_than_numbers() -> None:
    assert linear_model.fit(np.random.default_rng(0).standard_normal((20, 4)), 9).components.shape == (4, 4)


def test_flattening_keeps_the_printed_order_and_puts_the_frequency_last() -> None:
    people = np.arange(2 * 225.0).reshape(2, 5, 15, 3)
    rows = linear_model.flatten(people, np.array([0.5, 1.0]))
    assert rows.shape == (2, 226)
    assert rows[0, :4].tolist() == [0.0, 1.0, 2.0, 3.0]  # x, y, z of the first joint of p0, then the second
    assert rows[1, 45] == people[1, 1, 0, 0]  # p1 follows p0
    np.testing.assert_allclose(rows[:, -1], [np.pi, 2 * np.pi])
    np.testing.assert_array_equal(linear_model.unflatten(rows), people)
    np.testing.assert_array_equal(linear_model.unflatten(linear_model.flatten(people)[0]), people[0])


@given(seed=seeds, count=st.integers(3, 12), held_out=st.integers(0, 11), style=styles, grouped=st.booleans())
@settings(max_examples=40, deadline=None)
def test_nothing_of_a_held_out_walker_reaches_its_fold(
    seed: int, count: int, held_out: int, style: str, grouped: bool
) -> None:
    """A cross-validation fold uses nothing of the held-out person: no other walk, no mirror image and no frequency."""
    held_out %= count
    generator = np.random.default_rng(seed)
    people = walkers(generator, count, style)
    rates = generator.uniform(0.7, 1.1, count)
    groups = generator.integers(0, max(count - 1, 3), count) if grouped else np.arange(count)
    assume(len(np.unique(groups)) >= 3)

    def fold(people: np.ndarray, rates: np.ndarray) -> LinearModel:
        models = linear_model.leave_one_out(
            linear_model.flatten(people, rates),
            8,
            groups=groups,
            mirrors=linear_model.flatten(fourier.mirrored(people), rates),
            scale_last=None,
        )
        return next(model for model, r in models if r == held_out)

    before = fold(people, rates)
    gone = groups == groups[held_out]
    people[gone] += 1e3 * generator.standard_normal(people[gone].shape)
    rates[gone] *= 3.0
    assert same(fold(people, rates), before)
    people[~gone] += 1.0 * generator.standard_normal(people[~gone].shape)
    assert not same(fold(people, rates), before)


@given(seed=seeds, people=st.integers(20, 150), numbers=st.integers(2, 12), wanted=st.integers(1, 12))
@settings(max_examples=20, deadline=None)
def test_folds_of_many_people_share_sums_and_nothing_of_who_is_left_out(
    seed: int, people: int, numbers: int, wanted: int
) -> None:
    generator = np.random.default_rng(seed)
    samples = 1e3 + generator.standard_normal((2 * people, numbers)) * np.geomspace(100.0, 1.0, numbers)
    groups = generator.integers(0, people, len(samples))
    assume(len(np.unique(groups)) >= 3)
    shared = list(linear_model.leave_one_out(samples, wanted, groups=groups))
    for model, r in shared:
        alone = linear_model.fit(samples[groups != groups[r]], wanted)
        np.testing.assert_allclose(model.mean, alone.mean, rtol=1e-12)
        np.testing.assert_allclose(model.eigenvalues, alone.eigenvalues, rtol=1e-7)
        np.testing.assert_allclose(model.total_variance, alone.total_variance, rtol=1e-7)
        projectors = [
            part.components.T @ (part.eigenvalues[:, None] * part.components) for part in (model, alone)
        ]
        np.testing.assert_allclose(*projectors, atol=1e-6 * alone.eigenvalues[0])
    moved = samples.copy()
    moved[groups == groups[0]] *= -3.0
    again = next(linear_model.leave_one_out(moved, wanted, groups=groups, only=[0]))
    first = next(linear_model.leave_one_out(samples, wanted, groups=groups, only=[0]))
    assert same(again[0], first[0])


@given(seed=seeds, count=st.integers(3, 12), style=styles)
@settings(max_examples=20, deadline=None)
def test_every_walker_is_left_out_once_and_in_order(seed: int, count: int, style: str) -> None:
    samples = population(seed, count, style)
    folds = list(linear_model.leave_one_out(samples, 5))
    assert [r for _, r in folds] == list(range(count))
    for model, r in folds:
        assert same(model, linear_model.fit(np.delete(samples, r, axis=0), 5))


def test_of_two_groups_that_are_left_out_no_walk_is_learnt_from() -> None:
    people = walkers(np.random.default_rng(3), 7)
    samples, mirrors = linear_model.flatten(people), linear_model.flatten(fourier.mirrored(people))
    groups = np.array([0, 1, 1, 2, 3, 0, 2])
    pairs = []
    for model, g, h in linear_model.leave_two_out(samples, 5, groups=groups, mirrors=mirrors):
        retained = [k for k, group in enumerate(groups) if group not in (g, h)]
        assert same(model, linear_model.fit(np.concatenate([samples[retained], mirrors[retained]]), 5))
        pairs.append((g, h))
    assert pairs == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


def test_mirror_images_join_the_training_set() -> None:
    people = walkers(np.random.default_rng(2), 6)
    samples = linear_model.flatten(people)
    mirrors = linear_model.flatten(fourier.mirrored(people))
    for model, r in linear_model.leave_one_out(samples, 20, mirrors=mirrors):
        training = np.concatenate([np.delete(samples, r, axis=0), np.delete(mirrors, r, axis=0)])
        assert same(model, linear_model.fit(training, 20))
        assert len(model.eigenvalues) == 9
        average = linear_model.unflatten(model.mean)
        np.testing.assert_allclose(fourier.mirrored(average), average, rtol=0, atol=1e-9)


@given(seed=seeds, count=st.integers(4, 12))
@settings(max_examples=20, deadline=None)
def test_the_order_of_the_walkers_does_not_matter(seed: int, count: int) -> None:
    samples = population(seed, count, "generic")
    order = np.random.default_rng(seed).permutation(count)
    shuffled = {int(order[r]): model for model, r in linear_model.leave_one_out(samples[order], count)}
    for model, r in linear_model.leave_one_out(samples, count):
        other = shuffled[r]
        np.testing.assert_allclose(other.mean, model.mean, rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            other.eigenvalues, model.eigenvalues, rtol=0, atol=1e-9 * model.eigenvalues[0]
        )
        covariance, expected = ((m.components.T * m.eigenvalues) @ m.components for m in (other, model))
        np.testing.assert_allclose(covariance, expected, rtol=0, atol=1e-9 * model.eigenvalues[0])


@given(seed=seeds, count=st.integers(3, 15))
@settings(max_examples=20, deadline=None)
def test_the_frequency_varies_as_much_as_the_mean_of_the_rest(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    samples = linear_model.flatten(walkers(generator, count), generator.uniform(0.7, 1.1, count))
    model = linear_model.fit(samples, count, scale_last=None)
    scaled = samples[:, -1] * model.last_scale
    assert scaled.var() == pytest.approx(samples[:, :-1].var(axis=0).mean(), rel=1e-9)
    assert model.mean[-1] == pytest.approx(scaled.mean(), rel=1e-12)
    given_by_hand = linear_model.fit(samples, count, scale_last=model.last_scale)
    assert same(model, given_by_hand)


def test_a_frequency_that_all_share_is_left_alone() -> None:
    """A frequency that is equal for all walkers is not scaled, because its variance is only rounding error."""
    samples = linear_model.flatten(walkers(np.random.default_rng(0), 7), np.full(7, 0.93))
    assert linear_model.fit(samples, 5, scale_last=None).last_scale == 1.0
    assert linear_model.fit(np.array([[1.0, 0.1], [1.0, 0.3]]), 1, scale_last=None).last_scale == 1.0


@pytest.mark.parametrize("frequency", [False, True])
@pytest.mark.parametrize("hidden", [[], [3, 4, 11]])
def test_coefficients_are_those_that_made_the_samples(frequency: bool, hidden: list[int]) -> None:
    generator = np.random.default_rng(7)
    people = walkers(generator, 12)
    rates = generator.uniform(0.8, 1.1, 12) if frequency else None
    model = linear_model.fit(linear_model.flatten(people, rates), 5)
    truth = 100.0 * generator.standard_normal((4, 5))
    samples = model.mean + truth @ model.components
    samples[:, -1] /= model.last_scale
    measured = ~np.isin(np.arange(15), hidden)
    linear_model.unflatten(samples)[..., hidden, :] = np.nan
    output = linear_model.coefficients(model, np.nan_to_num(samples), measured=measured)
    np.testing.assert_allclose(output, truth, rtol=1e-9, atol=1e-7)
    if not hidden:
        largest = linear_model.largest_coefficients(model, samples)
        np.testing.assert_allclose(largest, np.abs(truth).max(axis=0), rtol=1e-9)


@given(fold=folds(), angle=angles, prior=st.booleans())
@settings(max_examples=40, deadline=None)
def test_the_whitened_form_is_the_projected_eigenwalkers(fold: Fold, angle: float, prior: bool) -> None:
    """The matrix A of the linear system equals that from the printed projection matrix at any view angle."""
    model = fold.model
    white = linear_model.whiten(model, prior=prior)
    spread = np.sqrt(model.eigenvalues)
    retained = spread > 1e-12 * spread.max()
    np.testing.assert_allclose(white.scale, spread if prior else retained.astype(float), rtol=1e-15)
    trailing = model.mean.size - 225
    projected = camera.projection_matrix(angle, trailing=trailing) @ model.components.T * white.scale
    gram = Gram(white).at(np.cos([angle]), np.sin([angle]))[0]
    np.testing.assert_allclose(
        gram, projected.T @ projected, rtol=0, atol=1e-12 * max(white.scale.max() ** 2, 1)
    )
    assert white.mean_z.size == 75 + trailing
    np.testing.assert_array_equal(white.mean_y, model.mean[:225].reshape(75, 3)[:, 1])


GOOD = np.random.default_rng(0).standard_normal((5, 6))
HOLED = GOOD.copy()
HOLED[3, 2] = np.inf


@pytest.mark.parametrize(
    ("samples", "components", "options", "rejection"),
    [
        (GOOD[0], 2, {}, rejects("too_few_people")),
        (GOOD[:1], 2, {}, rejects("too_few_people", shape=(1, 6))),
        (GOOD, 0, {}, rejects("out_of_range", "the number of components", value=0)),
        (GOOD, 2, {"divisor": "R-2"}, rejects("unknown_choice", "the divisor", value="R-2")),
        (HOLED, 2, {}, rejects("not_finite", walker=3)),
        (GOOD, 2, {"scale_last": 0.0}, rejects("out_of_range", "the scale of the last number", value=0.0)),
        (GOOD, 2, {"scale_last": np.nan}, rejects("out_of_range", "the scale of the last number")),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(
    samples: np.ndarray, components: int, options: dict, rejection: AbstractContextManager
) -> None:
    with rejection:
        linear_model.fit(samples, components, **options)


@pytest.mark.parametrize(
    ("samples", "options", "rejection"),
    [
        (GOOD[:2], {}, rejects("too_few_people", count=2)),
        (GOOD[:2], {"mirrors": GOOD[:2]}, rejects("too_few_people", count=2)),
        (GOOD, {"groups": np.array([1, 1, 2, 2, 2])}, rejects("too_few_people", count=2)),
        (GOOD, {"groups": np.arange(4)}, rejects("mismatch", groups=(4,))),
        (GOOD, {"mirrors": GOOD[:4]}, rejects("mismatch", mirrors=(4, 6))),
    ],
)
def test_too_few_people_are_refused(
    samples: np.ndarray, options: dict, rejection: AbstractContextManager
) -> None:
    with rejection:
        next(linear_model.leave_one_out(samples, 2, **options))
