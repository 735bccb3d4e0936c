"""Tests of the variance of pelvis height and direction cosines that other performances explain."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given

from pipeline.studies.actions.figures.performances import _explained
from tests.strategies import seeds


@given(seed=seeds)
def test_what_all_do_alike_is_explained_and_what_each_does_by_himself_is_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    alike = np.sin(np.linspace(0.0, 5.0, 30))[:, None] * rng.normal(size=37)
    reference = rng.normal(size=(6, 30, 37))
    action = SimpleNamespace(linear=np.zeros((6, 30, 1)), disparity=np.zeros((6, 30), dtype=int))
    height, cosines = np.r_[True, np.zeros(36, dtype=bool)], np.r_[False, np.ones(36, dtype=bool)]
    for explained, left in ((0, cosines), (1, height)):
        result = _explained([alike + noise * left for noise in reference], action)  # type: ignore[arg-type]
        assert result[explained] == pytest.approx(np.ones(6))
        # The others' mean of noise adds a fifth of it to what is left, and the common part takes its own share.
        assert (result[1 - explained] < result[explained]).all()
    assert (_explained(list(reference), action)[1] < 0.0).all()  # type: ignore[arg-type]
