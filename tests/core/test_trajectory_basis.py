"""Tests of the trajectory basis: the printed cosines, the best fit to observed frames, and the number of components."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dct, idct

from pipeline.core import trajectory_basis as basis
from tests.rejects import rejects
from tests.strategies import seeds


def imputed(
    theta: np.ndarray, observed: np.ndarray, values: np.ndarray, *, ridge: np.ndarray | None = None
) -> np.ndarray:
    """Return the fitted trajectory in all frames."""
    return np.asarray(theta @ basis.coefficients(theta, observed, values, ridge=ridge))


@given(frames=st.integers(1, 200), data=st.data())
@settings(max_examples=60)
def test_the_basis_is_that_of_the_discrete_cosine_transform(frames: int, data: st.DataObject) -> None:
    components = data.draw(st.integers(1, frames))
    theta = basis.cosine_basis(frames, components)
    transform = dct(np.eye(frames), type=2, norm="ortho", axis=0)
    np.testing.assert_allclose(theta, transform[:components].T, atol=1e-13)
    np.testing.assert_allclose(theta.T @ theta, np.eye(components), atol=1e-13)


def test_the_basis_of_a_long_sequence_is_orthonormal_to_rounding() -> None:
    theta = basis.cosine_basis(200_000, 6)
    np.testing.assert_allclose(theta.T @ theta, np.eye(6), atol=1e-12)


@given(seed=seeds, frames=st.integers(4, 60), soft=st.booleans(), data=st.data())
@settings(max_examples=80)
def test_the_quadratic_form_of_the_observed_frames_is_the_error_of_the_best_fit(
    seed: int, frames: int, soft: bool, data: st.DataObject
) -> None:
    """The residual in the observed frames equals that of least squares on SciPy's cosine transform."""
    generator = np.random.default_rng(seed)
    components = data.draw(st.integers(1, frames // 2))
    theta = idct(np.eye(frames, components), type=2, norm="ortho", axis=0)
    # Every other frame at least, so that hard coefficients are determined too.
    observed = (np.arange(frames) % 2 == 0) | (generator.uniform(size=frames) < 0.5)
    ridge = basis.soft_ridge(components, generator.uniform(1, 10)) if soft else None
    c = generator.standard_normal((int(observed.sum()), 3))
    rows = theta[observed] if ridge is None else np.vstack([theta[observed], np.diag(np.sqrt(ridge))])
    target = c if ridge is None else np.vstack([c, np.zeros((components, 3))])
    a = np.linalg.lstsq(rows, target, rcond=None)[0]
    least = np.square(rows @ a - target).sum()

    b = basis.restricted(basis.cosine_basis(frames, components), observed, ridge=ridge)
    assert np.square(c).sum() - np.square(b.T @ c).sum() == pytest.approx(least, rel=1e-9, abs=1e-10)
    assert np.linalg.norm(b, 2) <= 1 + 1e-12
    everywhere = np.full((frames, 3), np.nan)
    everywhere[observed] = c
    np.testing.assert_allclose(basis.coefficients(theta, observed, everywhere, ridge=ridge), a, atol=1e-8)
    np.testing.assert_allclose(imputed(theta, observed, everywhere, ridge=ridge), theta @ a, atol=1e-8)


def test_the_restricted_basis_is_that_of_the_triangular_factor() -> None:
    theta, ridge = basis.cosine_basis(30, 8), basis.soft_ridge(8, 4.0)
    observed = np.arange(30) % 5 != 2
    gram = theta[observed].T @ theta[observed]
    for weights in (None, ridge):
        lower = np.linalg.cholesky(gram + (0 if weights is None else np.diag(weights)))
        expected = np.linalg.solve(lower, theta[observed].T).T
        np.testing.assert_allclose(basis.restricted(theta, observed, ridge=weights), expected, atol=1e-12)


def test_without_gaps_the_soft_basis_has_shorter_cosines() -> None:
    observed = np.ones(50, dtype=bool)
    soft = basis.restricted(basis.cosine_basis(50, 20), observed, ridge=basis.soft_ridge(20, 8.0))
    shorter = basis.cosine_basis(50, 20) / np.sqrt(1.0 + basis.soft_ridge(20, 8.0))
    np.testing.assert_allclose(soft, shorter, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(soft, axis=0)[[0, 8]], [1.0, np.sqrt(0.5)])


@given(seed=seeds, gap=st.integers(0, 6))
@settings(max_examples=40)
def test_a_trajectory_in_the_basis_is_imputed_exactly(seed: int, gap: int) -> None:
    generator = np.random.default_rng(seed)
    theta = basis.cosine_basis(60, 10)
    truth = theta @ generator.standard_normal((10, 3))
    observed = np.ones(60, dtype=bool)
    start = generator.integers(0, 60 - gap)
    observed[start : start + gap] = False
    with_holes = np.where(observed[:, None], truth, np.nan)
    np.testing.assert_allclose(imputed(theta, observed, with_holes), truth, atol=1e-9)


def test_a_soft_basis_does_not_run_wild_in_a_gap_where_a_hard_one_does() -> None:
    generator = np.random.default_rng(11)
    theta = basis.cosine_basis(100, 20)
    truth = basis.cosine_basis(100, 8) @ (10 * generator.standard_normal((8, 3)))
    observed = np.ones(100, dtype=bool)
    observed[40:65] = False
    visible = truth + 0.5 * generator.standard_normal(truth.shape)
    error = {
        name: np.abs(imputed(theta, observed, visible, ridge=ridge) - truth)[~observed].max()
        for name, ridge in (("hard", None), ("soft", basis.soft_ridge(20, 10.0)))
    }
    assert error["soft"] < 0.1 * error["hard"]


GOOD = np.ones(10, dtype=bool)
HOLED = np.where(np.arange(10) == 3, np.nan, 1.0)[:, None]
REFUSED: dict[str, tuple[Callable[[], object], AbstractContextManager]] = {
    "no frames": (lambda: basis.cosine_basis(0, 1), rejects("out_of_range", "frames", value=0)),
    "no components": (lambda: basis.cosine_basis(5, 0), rejects("out_of_range", "components", value=0)),
    "more components than frames": (
        lambda: basis.cosine_basis(5, 6),
        rejects("out_of_range", "components", value=6),
    ),
    "cutoff": (lambda: basis.soft_ridge(3, 0.0), rejects("out_of_range", "cutoff", value=0.0)),
    "cutoff NaN": (lambda: basis.soft_ridge(3, float("nan")), rejects("out_of_range", "cutoff")),
    "all missing": (lambda: basis.restricted(basis.cosine_basis(10, 3), ~GOOD), rejects("all_missing")),
    "too few": (
        lambda: basis.restricted(basis.cosine_basis(10, 5), np.arange(10) < 4),
        rejects("undetermined", observed=4, components=5),
    ),
    "a block too long": (
        lambda: basis.restricted(basis.cosine_basis(200, 40), np.arange(200) < 60),
        rejects("undetermined", observed=60, components=40),
    ),
    "mask of the wrong length": (
        lambda: basis.restricted(basis.cosine_basis(9, 3), GOOD),
        rejects("mismatch"),
    ),
    "mask of numbers": (
        lambda: basis.restricted(basis.cosine_basis(10, 3), GOOD.astype(int)),
        rejects("mismatch"),
    ),
    "negative ridge": (
        lambda: basis.restricted(basis.cosine_basis(10, 3), GOOD, ridge=np.full(3, -1.0)),
        rejects("out_of_range", "ridge", value=-1.0),
    ),
    "not finite": (lambda: imputed(basis.cosine_basis(10, 3), GOOD, HOLED), rejects("not_finite", "frame 3")),
    "values of the wrong shape": (
        lambda: imputed(basis.cosine_basis(10, 3), GOOD, np.ones(10)),
        rejects("wrong_shape", "trajectory", shape=(10,)),
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_done_is_refused_in_one_sentence(case: str) -> None:
    attempt, rejection = REFUSED[case]
    with rejection:
        attempt()


@given(seed=seeds)
def test_the_basis_alone_finds_what_moving_rays_determine_and_no_more(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames, components = 40, 5
    theta = basis.cosine_basis(frames, components)
    truth = theta @ rng.normal(size=(components, 3))
    turning = rng.normal(size=(frames, 3))
    turning /= np.linalg.norm(turning, axis=1, keepdims=True)
    np.testing.assert_allclose(basis.on_rays(theta, truth + 7.0 * turning, turning), truth, atol=1e-8)
    # Parallel rays do not determine the depth: the trajectory of least norm on them has depth 0.
    ahead = np.broadcast_to([0.0, 0.0, 1.0], (frames, 3))
    np.testing.assert_allclose(basis.on_rays(theta, truth, ahead), truth * [1.0, 1.0, 0.0], atol=1e-8)
