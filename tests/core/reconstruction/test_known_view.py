"""Tests of 3D reconstruction from one known view against the printed formulas [zhang2007 3.5-3.16, A.1-A.5]."""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pipeline.core import camera, errors, reconstruction
from pipeline.core.linear_model import LinearModel, fit, flatten, unflatten
from tests.core.printed import printed
from tests.rejects import rejects
from tests.strategies import Fold, angles, folds, seeds, walkers

variances = st.floats(min_value=0.0, max_value=3.0).map(lambda exponent: 10.0**exponent)


def problem(seed: int, numbers: int = 150, unknowns: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a random well-conditioned matrix E (150, N), data d (150,) and eigenvalues (N,)."""
    generator = np.random.default_rng(seed)
    return (
        generator.standard_normal((numbers, unknowns)) / np.sqrt(numbers),
        300.0 * generator.standard_normal(numbers),
        10.0 ** generator.uniform(2, 5, unknowns),
    )


def error_path(model: LinearModel, sample: np.ndarray, view: np.ndarray, sweep: np.ndarray) -> np.ndarray:
    return reconstruction.NoisePath(model, view, sweep).error(sample)


# The two estimators


@given(seed=seeds, unknowns=st.integers(1, 40))
@settings(max_examples=40, deadline=None)
def test_least_squares_is_the_printed_pseudo_inverse(seed: int, unknowns: int) -> None:
    """Least squares coefficients equal the printed [zhang2007 3.9]: (E'E)^-1 E'd."""
    E, d, _ = problem(seed, unknowns=unknowns)
    k = np.linalg.inv(E.T @ E) @ E.T @ d
    np.testing.assert_allclose(reconstruction.least_squares(E, d), k, rtol=1e-8, atol=1e-8)


@given(seed=seeds, unknowns=st.integers(1, 40), noise_variance=variances)
@settings(max_examples=40, deadline=None)
def test_map_is_the_printed_closed_form(seed: int, unknowns: int, noise_variance: float) -> None:
    """MAP coefficients equal the printed [zhang2007 3.15, A.5]: [diag(sigma²/lambda) + E'E]^-1 E'd."""
    E, d, eigenvalues = problem(seed, unknowns=unknowns)
    k = np.linalg.inv(np.diag(noise_variance / eigenvalues) + E.T @ E) @ E.T @ d
    coefficients = reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=noise_variance)
    np.testing.assert_allclose(coefficients, k, rtol=1e-8, atol=1e-8)


@given(seed=seeds, noise_variance=variances)
@settings(max_examples=40, deadline=None)
def test_the_gradient_of_the_posterior_is_zero_at_map_and_its_value_lowest(
    seed: int, noise_variance: float
) -> None:
    """At the MAP coefficients, the posterior is maximal and its gradient is zero [zhang2007 3.14, A.1-A.4]."""
    E, d, eigenvalues = problem(seed)
    k = reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=noise_variance)
    gradient = (-2 * E.T @ d + 2 * E.T @ E @ k) / (2 * noise_variance) + 2 * k / (2 * eigenvalues)  # A.3
    size = np.abs(E.T @ d / noise_variance).max()
    assert np.abs(gradient).max() < 1e-10 * size
    np.testing.assert_allclose(  # A.4
        E.T @ E @ k + noise_variance * k / eigenvalues, E.T @ d, rtol=0, atol=1e-9 * np.abs(E.T @ d).max()
    )

    def objective(k: np.ndarray) -> float:  # A.1
        return float(((d - E @ k) ** 2).sum() / (2 * noise_variance) + (k**2 / (2 * eigenvalues)).sum())

    generator = np.random.default_rng(seed)
    for step in 10.0 ** np.arange(-1, 3):
        assert objective(k + step * generator.standard_normal(len(k))) > objective(k)


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_no_noise_is_least_squares_and_all_noise_the_average_walker(seed: int) -> None:
    E, d, eigenvalues = problem(seed)
    exact = reconstruction.least_squares(E, d)
    gone = [
        np.linalg.norm(
            reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=variance) - exact
        )
        for variance in (1e-2, 1e-4, 1e-6)
    ]
    np.testing.assert_allclose(np.divide(gone[1:], gone[:-1]), 1e-2, rtol=0.05)  # linear in sigma²
    size = [
        np.linalg.norm(reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=variance))
        for variance in (1e9, 1e11, 1e13)
    ]
    np.testing.assert_allclose(np.divide(size[1:], size[:-1]), 1e-2, rtol=0.05)
    assert size[-1] < 1e-3 * np.linalg.norm(exact)


@given(seed=seeds, noise_variance=variances)
@settings(max_examples=20, deadline=None)
def test_an_eigenwalker_without_variance_takes_no_part(seed: int, noise_variance: float) -> None:
    E, d, eigenvalues = problem(seed)
    eigenvalues[[2, 7]] = 0.0
    k = reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=noise_variance)
    assert k[[2, 7]].tolist() == [0.0, 0.0]
    rest = np.delete(np.arange(12), [2, 7])
    without = reconstruction.maximum_a_posteriori(
        E[:, rest], d, eigenvalues[rest], noise_variance=noise_variance
    )
    np.testing.assert_allclose(k[rest], without, rtol=1e-9, atol=1e-9)


def test_two_coefficients_worked_out_in_the_head() -> None:
    E, d = np.eye(2), np.array([3.0, 4.0])
    coefficients = reconstruction.maximum_a_posteriori(E, d, np.array([10.0, 30.0]), noise_variance=10.0)
    np.testing.assert_allclose(coefficients, [1.5, 3.0])  # lambda / (lambda + sigma²) of each


# Sweeps of known views


@given(fold=folds(), view=st.lists(angles, min_size=1, max_size=5), noise_variance=st.none() | variances)
@settings(max_examples=60, deadline=None)
def test_the_sweep_equals_the_printed_way(
    fold: Fold, view: list[float], noise_variance: float | None
) -> None:
    """Reconstructions from several views equal the printed formulas, with or without the walk's frequency."""
    result = reconstruction.from_known_views(
        fold.model, fold.sample, np.array(view), noise_variance=noise_variance
    )
    for a, angle in enumerate(view):
        k, missing, delta = printed(fold.model, fold.sample, angle, noise_variance)
        size = max(np.abs(delta).max(), np.abs(k).max(), 1.0)
        if noise_variance is None:
            E_hat = camera.projection_matrix(angle, trailing=fold.model.mean.size - 225)
            singular = np.linalg.svd(E_hat @ fold.model.components.T, compute_uv=False)
            assume(singular[-1] > 3e-3)  # the error of both ways grows with the square of its inverse
        np.testing.assert_allclose(result.coefficients[a], k, rtol=0, atol=1e-9 * size)
        np.testing.assert_allclose(result.missing[a], missing, rtol=0, atol=1e-9 * size)
        np.testing.assert_allclose(result.delta[a], delta, rtol=0, atol=1e-9 * size)


@given(fold=folds(styles=("generic",)), angle=angles)
@settings(max_examples=30, deadline=None)
def test_small_noise_variances_lead_to_least_squares(fold: Fold, angle: float) -> None:
    view = np.array([angle])
    exact = reconstruction.from_known_views(fold.model, fold.sample, view, noise_variance=None)
    near = reconstruction.from_known_views(fold.model, fold.sample, view, noise_variance=1e-7)
    size = np.abs(exact.missing).max()
    np.testing.assert_allclose(near.missing, exact.missing, rtol=0, atol=1e-4 * size)
    far = reconstruction.from_known_views(fold.model, fold.sample, view, noise_variance=1e14)
    average = camera.missing_dimension(unflatten(fold.model.mean), angle)
    np.testing.assert_allclose(far.missing[0], average, rtol=0, atol=1e-3)


@given(fold=folds(), angle=angles, noise_variance=st.none() | variances)
@settings(max_examples=30, deadline=None)
def test_the_signs_of_eigenwalkers_do_not_matter(
    fold: Fold, angle: float, noise_variance: float | None
) -> None:
    model, view = fold.model, np.array([angle])
    signs = fold.generator.choice([-1.0, 1.0], len(model.eigenvalues))
    turned = dataclasses.replace(model, components=model.components * signs[:, None])
    first, other = (
        reconstruction.from_known_views(m, fold.sample, view, noise_variance=noise_variance)
        for m in (model, turned)
    )
    # Products that cancel differently are rounded differently, and least squares may amplify that.
    size = np.abs(first.coefficients).max() + np.abs(first.missing).max()
    np.testing.assert_allclose(other.missing, first.missing, rtol=0, atol=1e-8 * size)
    np.testing.assert_allclose(other.coefficients * signs, first.coefficients, rtol=0, atol=1e-8 * size)


@given(fold=folds(styles=("generic",), trailing=0), angle=angles, noise_variance=variances)
@settings(max_examples=30, deadline=None)
def test_metres_give_the_same_walker(fold: Fold, angle: float, noise_variance: float) -> None:
    """In metres instead of millimetres, the walker is the same, and squared errors are a millionth of those before."""
    model, view = fold.model, np.array([angle])
    in_metres = dataclasses.replace(
        model, mean=model.mean * 1e-3, eigenvalues=model.eigenvalues * 1e-6, total_variance=0.0
    )
    path = error_path(model, fold.sample, view, np.array([noise_variance]))
    other = error_path(in_metres, fold.sample * 1e-3, view, np.array([noise_variance * 1e-6]))
    np.testing.assert_allclose(other, path * 1e-6, rtol=1e-8)
    first = reconstruction.from_known_views(model, fold.sample, view, noise_variance=None)
    two = reconstruction.from_known_views(in_metres, fold.sample * 1e-3, view, noise_variance=None)
    size = np.abs(first.missing).max()
    np.testing.assert_allclose(two.missing * 1e3, first.missing, rtol=0, atol=1e-8 * size)


@given(seed=seeds, angle=angles, noise_variance=st.none() | variances)
@settings(max_examples=30, deadline=None)
def test_a_walker_within_the_model_is_found_exactly(
    seed: int, angle: float, noise_variance: float | None
) -> None:
    generator = np.random.default_rng(seed)
    model = fit(flatten(walkers(generator, 15)), 9)
    k = generator.standard_normal(9) * np.sqrt(model.eigenvalues)
    sample = model.mean + k @ model.components
    result = reconstruction.from_known_views(model, sample, np.array([angle]), noise_variance=noise_variance)
    if noise_variance is None:
        np.testing.assert_allclose(result.coefficients[0], k, rtol=0, atol=1e-7 * np.abs(k).max())
        assert np.abs(result.delta).max() < 1e-6
    else:  # shrunk towards the average walker
        white, true = result.coefficients[0] / np.sqrt(model.eigenvalues), k / np.sqrt(model.eigenvalues)
        assert np.linalg.norm(white) < np.linalg.norm(true)


@given(seed=seeds, angle=angles, noise_variance=st.none() | variances, unknowns=st.integers(2, 6))
@settings(max_examples=80, deadline=None)
def test_what_a_view_does_not_show_is_left_out(
    seed: int, angle: float, noise_variance: float | None, unknowns: int
) -> None:
    """Coefficients that the view does not determine are zero, as in the solution of smallest norm.

    The products that make the matrix cancel only to rounding, which must not pass for information.
    """
    generator = np.random.default_rng(seed)
    lost = np.array([-np.sin(angle), np.cos(angle), 0.0])
    components = generator.standard_normal((unknowns + 1, 75, 3))
    components[0] = generator.standard_normal((75, 1)) * lost
    components[2] = generator.standard_normal() * components[1] + generator.standard_normal((75, 1)) * lost
    components /= np.linalg.norm(components, axis=(1, 2), keepdims=True)
    model = LinearModel(
        mean=300.0 * generator.standard_normal(225),
        components=components.reshape(unknowns + 1, 225),
        eigenvalues=10.0 ** generator.uniform(2, 5, unknowns + 1),
        total_variance=1e6,
    )
    sample = model.mean + 100.0 * generator.standard_normal(225)
    view = np.array([angle])
    result = reconstruction.from_known_views(model, sample, view, noise_variance=noise_variance)
    C = camera.projection_matrix(angle)
    E_hat, d = C @ model.components.T, C @ (sample - model.mean)
    if noise_variance is None:
        k = np.linalg.pinv(E_hat, rcond=1e-9) @ d
    else:
        k = reconstruction.maximum_a_posteriori(E_hat, d, model.eigenvalues, noise_variance=noise_variance)
        path = error_path(model, sample, view, np.array([noise_variance]))
        delta = camera.missing_dimension(unflatten(sample - model.mean - k @ model.components), angle)
        assert path[0, 0] == pytest.approx(errors.absolute_error(delta).mean(), rel=1e-9)
    np.testing.assert_allclose(result.coefficients[0], k, rtol=0, atol=1e-7 * np.abs(k).max())
    assert abs(result.coefficients[0, 0]) < 1e-9 * np.abs(k).max()


def test_walkers_who_do_not_vary_leave_the_average_walker() -> None:
    person = flatten(walkers(np.random.default_rng(0), 1))[0]
    model = fit(np.stack([person] * 4), 3)
    for noise_variance in (None, 70.0):
        result = reconstruction.from_known_views(
            model, person + 9.0, np.zeros(1), noise_variance=noise_variance
        )
        assert np.abs(result.coefficients).max() < 1e-6
        np.testing.assert_allclose(result.delta, 9.0, rtol=1e-6)


@given(fold=folds(), angle=angles)
@settings(max_examples=20, deadline=None)
def test_the_observed_coordinates_are_kept(fold: Fold, angle: float) -> None:
    """The reconstructed walker keeps the observed image coordinates exactly [zhang2007 3.16]."""
    result = reconstruction.from_known_views(fold.model, fold.sample, np.array([angle]), noise_variance=70.0)
    truth = unflatten(fold.sample)
    observed = camera.project(truth, angle)
    together = camera.combine(observed, result.missing[0], angle)
    np.testing.assert_allclose(camera.project(together, angle), observed, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        camera.missing_dimension(truth - together, angle), result.delta[0], rtol=0, atol=1e-9
    )
    perfect = camera.combine(observed, result.missing[0] + result.delta[0], angle)
    np.testing.assert_allclose(perfect, truth, rtol=0, atol=1e-9)


@given(fold=folds(trailing=0), angle=angles, noise_variance=st.none() | variances)
@settings(max_examples=20, deadline=None)
def test_the_missing_dimension_of_the_walker_does_not_reach_the_estimate(
    fold: Fold, angle: float, noise_variance: float | None
) -> None:
    lost = np.array([-np.sin(angle), np.cos(angle), 0.0])
    other = fold.sample + (100.0 * fold.generator.standard_normal((75, 1)) * lost).reshape(-1)
    first, two = (
        reconstruction.from_known_views(fold.model, w, np.array([angle]), noise_variance=noise_variance)
        for w in (fold.sample, other)
    )
    size = np.abs(first.missing).max() + np.abs(first.coefficients).max()
    np.testing.assert_allclose(two.missing, first.missing, rtol=0, atol=1e-7 * size)
    assert np.abs(two.delta - first.delta).max() > 1.0


# Refusals


MODEL = fit(flatten(walkers(np.random.default_rng(1), 5)), 3)
HOLED = MODEL.mean.copy()
HOLED[8] = np.nan


@pytest.mark.parametrize("noise_variance", [0.0, -1.0, np.nan, np.inf])
def test_a_noise_variance_that_is_not_positive_is_refused(noise_variance: float) -> None:
    fault = ("out_of_range", "the noise variance (sigma²)")
    view = np.zeros(1)
    with rejects(*fault, value=noise_variance):
        reconstruction.maximum_a_posteriori(np.eye(2), np.ones(2), np.ones(2), noise_variance=noise_variance)
    with rejects(*fault, value=noise_variance):
        reconstruction.from_known_views(MODEL, MODEL.mean, view, noise_variance=noise_variance)
    with rejects(*fault):
        error_path(MODEL, MODEL.mean, view, np.array([70.0, noise_variance]))


@pytest.mark.parametrize(
    ("sample", "rejection"),
    [
        (np.zeros(226), partial(rejects, "wrong_shape", "the walker", shape=(226,))),
        (np.zeros((5, 15, 3)), partial(rejects, "wrong_shape", "the walker", shape=(5, 15, 3))),
        (HOLED, partial(rejects, "not_finite", "the walker", index=(8,))),
    ],
)
def test_a_walker_who_does_not_fit_the_model_is_refused(sample: np.ndarray, rejection: partial) -> None:
    with rejection():
        reconstruction.from_known_views(MODEL, sample, np.zeros(1), noise_variance=None)
    with rejection():
        error_path(MODEL, sample, np.zeros(1), np.array([70.0]))


@pytest.mark.parametrize(
    ("E", "d", "eigenvalues", "rejection"),
    [
        (
            np.eye(3),
            np.ones(2),
            np.ones(3),
            partial(rejects, "wrong_shape", "d", shape=(2,)),
        ),
        (np.ones(3), np.ones(3), np.ones(3), partial(rejects, "wrong_shape", "E", shape=(3,))),
        (np.eye(2), np.array([1.0, np.nan]), np.ones(2), partial(rejects, "not_finite", "d", index=(1,))),
        (np.full((2, 2), np.inf), np.ones(2), np.ones(2), partial(rejects, "not_finite", "E", index=(0, 0))),
        (np.eye(2), np.ones(2), np.ones(3), partial(rejects, "wrong_shape", "eigenvalues", shape=(3,))),
        (np.eye(2), np.ones(2), np.array([1.0, -1.0]), partial(rejects, "out_of_range", value=-1.0)),
    ],
)
def test_equations_that_do_not_fit_together_are_refused(
    E: np.ndarray, d: np.ndarray, eigenvalues: np.ndarray, rejection: partial
) -> None:
    with rejection():
        reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=1.0)
    if rejection.args[-1] in ("E", "d"):
        with rejection():
            reconstruction.least_squares(E, d)
