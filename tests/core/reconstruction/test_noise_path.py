"""Tests of reconstruction errors for many noise variances against the printed formulas [zhang2007 3.15, 4.2]."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera, errors, fourier, reconstruction
from pipeline.core.linear_model import LinearModel, fit, flatten, unflatten
from tests.core.printed import printed
from tests.strategies import Fold, angles, folds, walkers

variances = st.floats(min_value=0.0, max_value=3.0).map(lambda exponent: 10.0**exponent)
TIMES = np.arange(40) / 40.0  # a cycle of one hertz


def error_path(model: LinearModel, sample: np.ndarray, view: np.ndarray, sweep: np.ndarray) -> np.ndarray:
    return reconstruction.NoisePath(model, view, sweep).error(sample)


@given(
    fold=folds(),
    view=st.lists(angles, min_size=1, max_size=4),
    sweep=st.lists(variances, min_size=1, max_size=5),
)
@settings(max_examples=60, deadline=None)
def test_the_path_of_errors_equals_the_naive_loop_over_time(
    fold: Fold, view: list[float], sweep: list[float]
) -> None:
    """For each view and noise variance, the error equals the mean square error of explicitly synthesised motion."""
    path = error_path(fold.model, fold.sample, np.array(view), np.array(sweep))
    truth = fourier.synthesise(unflatten(fold.sample), 1.0, TIMES)
    size = max(np.square(unflatten(fold.sample - fold.model.mean)).mean(), 1e-6)
    for a, angle in enumerate(view):
        for s, noise_variance in enumerate(sweep):
            k, _, _ = printed(fold.model, fold.sample, angle, noise_variance)
            guess = fourier.synthesise(unflatten(fold.model.mean + k @ fold.model.components), 1.0, TIMES)
            error = errors.absolute_error_over_time(
                camera.missing_dimension(truth, angle), camera.missing_dimension(guess, angle)
            )
            assert path[a, s] == pytest.approx(error.mean(), rel=1e-9, abs=1e-9 * size)


def test_the_path_of_errors_is_that_of_single_reconstructions() -> None:
    people = flatten(walkers(np.random.default_rng(4), 40))
    model, view, sweep = fit(people[1:], 30), np.radians([-90, -20, 0, 45]), np.array([1.0, 70.0, 625.0])
    path = error_path(model, people[0], view, sweep)
    for s, noise_variance in enumerate(sweep):
        first = reconstruction.from_known_views(model, people[0], view, noise_variance=noise_variance)
        expected = errors.walker_error(errors.absolute_error(first.delta))
        np.testing.assert_allclose(path[:, s], expected, rtol=1e-9)


def test_a_path_of_many_variances_passes_through_single_reconstructions() -> None:
    """Errors for 625 noise variances, interpolated from a few, equal single reconstructions."""
    people = flatten(walkers(np.random.default_rng(6), 40))
    model, view, sweep = fit(people[1:], 30), np.radians([-60.0, 10.0]), np.arange(1.0, 626.0)
    path = error_path(model, people[0], view, sweep)
    for s in (0, 1, 17, 300, 624):
        first = reconstruction.from_known_views(model, people[0], view, noise_variance=sweep[s])
        expected = errors.walker_error(errors.absolute_error(first.delta))
        np.testing.assert_allclose(path[:, s], expected, rtol=1e-9)


def test_what_depends_on_the_model_alone_serves_all_walkers_bit_by_bit() -> None:
    people = flatten(walkers(np.random.default_rng(5), 20))
    model, view, sweep = fit(people[3:], 12), np.radians([-60.0, 10.0]), np.arange(1.0, 200.0)
    path = reconstruction.NoisePath(model, view, sweep)
    for person in people[:3]:
        alone = error_path(model, person, view, sweep)
        np.testing.assert_array_equal(path.error(person), alone)
