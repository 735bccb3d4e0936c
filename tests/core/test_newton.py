"""Tests of the bracketed Newton method on functions with known minima."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.newton import minimise
from tests.strategies import seeds


@given(seeds, st.integers(1, 30))
def test_the_zero_of_the_slope_is_found(seed: int, count: int) -> None:
    """The minima of functions cosh(a (x - c)) of very different widths are found."""
    generator = np.random.default_rng(seed)
    a, centre = 10.0 ** generator.uniform(-1, 1.5, count), generator.uniform(-1, 1, count)
    lower, upper = centre - generator.uniform(0.01, 3, count), centre + generator.uniform(0.01, 3, count)
    start = generator.uniform(lower, upper)

    def slopes(rows: np.ndarray, x: np.ndarray) -> np.ndarray:
        return a[rows] * np.sinh(a[rows] * (x - centre[rows]))

    options: dict[str, Any] = {"tolerance": 1e-10, "most_iterations": 200}
    solution = minimise(slopes, start, lower, upper, curvature=np.zeros(count), **options)
    assert solution.converged.all()
    np.testing.assert_allclose(solution.at, centre, rtol=0, atol=1e-8)
    alone = minimise(
        lambda rows, x: slopes(np.full(1, count - 1), x),
        start[-1:],
        lower[-1:],
        upper[-1:],
        curvature=np.zeros(1),
        **options,
    )
    assert alone.at[0] == solution.at[-1]


@pytest.mark.parametrize("slope", [-1.0, 1.0])
def test_a_function_without_a_minimum_ends_at_the_end_towards_which_it_falls(slope: float) -> None:
    solution = minimise(
        lambda rows, x: np.full(1, slope),
        np.zeros(1),
        np.full(1, -2.0),
        np.full(1, 3.0),
        tolerance=1e-9,
        most_iterations=60,
        curvature=np.zeros(1),
    )
    assert solution.converged.all()
    assert solution.at[0] == pytest.approx(3.0 if slope < 0 else -2.0, abs=1e-8)


def test_a_first_curvature_makes_the_first_step_newton_s() -> None:
    places: list[float] = []

    def slopes(rows: np.ndarray, x: np.ndarray) -> np.ndarray:
        places.append(float(x[0]))
        return 2.0 * (x - 0.25)

    bracket = np.full(1, -1.0), np.full(1, 1.0)
    solution = minimise(
        slopes, np.full(1, 0.5), *bracket, tolerance=1e-12, most_iterations=9, curvature=np.full(1, 2.0)
    )
    assert places[:2] == [0.5, 0.25]
    assert solution.at[0] == pytest.approx(0.25, abs=1e-12)


def test_too_few_iterations_are_told_and_the_last_place_is_one_that_was_evaluated() -> None:
    observed: list[float] = []

    def slopes(rows: np.ndarray, x: np.ndarray) -> np.ndarray:
        observed.append(float(x[0]))
        return np.asarray(np.arctan(x - 1.0))

    bracket = np.full(1, -10.0), np.full(1, 10.0)
    solution = minimise(
        slopes, np.full(1, 9.0), *bracket, tolerance=1e-12, most_iterations=2, curvature=np.zeros(1)
    )
    assert solution.converged.tolist() == [False]
    assert len(observed) == 2 == solution.n_iterations[0]
    assert solution.at[0] == observed[-1]
