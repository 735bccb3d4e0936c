"""Tests of choices among values that differ only by rounding errors."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.choice import first_lowest
from tests.strategies import seeds


@given(seeds, st.integers(2, 20), st.floats(-1e6, 1e6))
def test_rounding_of_tied_values_does_not_change_the_choice(seed: int, count: int, lowest: float) -> None:
    generator = np.random.default_rng(seed)
    values = lowest + generator.choice([0.0, 1.0 + abs(lowest)], count)
    values[generator.integers(count)] = lowest
    rounded = values * (1.0 + 1e-14 * generator.uniform(-1, 1, count))
    assert first_lowest(rounded) == first_lowest(values) == values.argmin()


def test_differences_beyond_the_margin_decide() -> None:
    assert first_lowest(np.array([1.0 + 1e-9, 1.0])) == 1
    assert first_lowest(np.array([1.0 + 1e-9, 1.0]), margin=1e-8) == 0


def test_infinities_and_axes() -> None:
    table = np.array([[np.inf, 3.0], [2.0, np.inf], [np.inf, 3.0]])
    assert first_lowest(table).tolist() == [1, 0, 1]
    assert first_lowest(table, axis=0).tolist() == [1, 0]
    assert first_lowest(np.full(3, np.inf)) == 0
