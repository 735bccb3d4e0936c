"""Tests that the search for exchanged labels finds the labels with the smallest cost of all sequences."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from walk3d.film.walk.exchanged import LIMBS, cheapest_labels, exchange, exchange_all


@given(seed=st.integers(0, 10_000), frames=st.integers(1, 8))
def test_no_sequence_of_labels_is_cheaper(seed: int, frames: int) -> None:
    costs = np.random.default_rng(seed).exponential(20.0, size=(2, frames))

    def total(labels: tuple[int, ...]) -> float:
        switches = sum(a != b for a, b in itertools.pairwise(labels))
        return float(sum(costs[label, t] for t, label in enumerate(labels)) + 14.0 * switches)

    result = tuple(int(label) for label in cheapest_labels(costs[0], costs[1]))
    assert total(result) <= min(map(total, itertools.product((0, 1), repeat=frames))) + 1e-9


def test_exchanging_twice_gives_back_and_all_is_legs_and_arms() -> None:
    values = np.random.default_rng(0).normal(size=(5, 15, 2))
    some = {limb: np.array([True, False, True, False, True]) for limb in LIMBS}
    np.testing.assert_array_equal(exchange(exchange(values, some), some), values)
    everything = {limb: np.ones(5, dtype=bool) for limb in LIMBS}
    np.testing.assert_array_equal(exchange(values, everything), exchange_all(values))
