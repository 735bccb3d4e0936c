"""Tests of the linear system of least squares and MAP against the printed estimators."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction import gram_of, least_squares, maximum_a_posteriori
from tests.rejects import rejects
from tests.strategies import Fold, angles, folds

variances = st.floats(min_value=0.0, max_value=3.0).map(lambda exponent: 10.0**exponent)


@given(fold=folds(styles=("generic",), trailing=0), angle=angles, noise_variance=st.none() | variances)
@settings(max_examples=40, deadline=None)
def test_the_solution_is_the_printed_one(fold: Fold, angle: float, noise_variance: float | None) -> None:
    """Solutions and costs agree with [zhang2007 3.9] for least squares, and with [zhang2007 3.15] for MAP
    [zhang2007 4.5, 4.6].
    """
    model = fold.model
    gram = gram_of(model, noise_variance)
    C = camera.projection_matrix(angle)
    E_hat, d = C @ model.components.T, C @ (fold.sample - model.mean)
    c, s, h = np.cos([angle]), np.sin([angle]), (E_hat * gram.white.scale).T @ d
    k = gram.solve(c, s, h[None, :, None], noise_variance)[0, :, 0] * gram.white.scale
    if noise_variance is None:
        expected, penalty = least_squares(E_hat, d), 0.0
    else:
        expected = maximum_a_posteriori(E_hat, d, model.eigenvalues, noise_variance=noise_variance)
        penalty = noise_variance * float((expected**2 / model.eigenvalues).sum())
    np.testing.assert_allclose(k, expected, rtol=0, atol=1e-8 * max(np.abs(expected).max(), 1.0))
    cost = gram.eliminate(c, s, (d @ d)[None, None, None], h[None, None], noise_variance)[0, 0, 0]
    misfit = float(((d - E_hat @ expected) ** 2).sum()) + penalty
    assert cost == pytest.approx(misfit, rel=1e-8, abs=1e-11 * float(d @ d))


def test_directions_that_no_view_shows_from_above_are_still_found_unseen() -> None:
    """Coefficients that a view cannot determine are zero, even if no eigenwalker varies vertically."""
    components = np.zeros((2, 75, 3))
    components[0, 0, 0] = components[1, 1, 1] = 1.0  # one across, one along the walk
    model = LinearModel(np.zeros(225), components.reshape(2, 225), np.array([4.0, 1.0]), 5.0)
    gram = gram_of(model, None)
    z = gram.solve(np.ones(1), np.zeros(1), np.array([[[3.0], [1e-17]]]), None)
    np.testing.assert_allclose(z[0, :, 0], [3.0, 0.0])


@pytest.mark.parametrize("noise_variance", [0.0, -1.0, np.nan, np.inf])
def test_a_noise_variance_that_is_not_positive_is_refused(noise_variance: float) -> None:
    model = LinearModel(np.zeros(225), np.eye(225)[:1], np.ones(1), 1.0)
    with rejects("out_of_range", "the noise variance (sigma²)"):
        gram_of(model, noise_variance)
