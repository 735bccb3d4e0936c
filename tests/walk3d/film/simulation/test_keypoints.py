"""Tests that the errors of a simulated detector have the requested size and autocorrelation."""

from __future__ import annotations

import numpy as np
import pytest

from walk3d.film.simulation.keypoints import DetectorError, resample, slow_error, swap_times


@pytest.mark.parametrize("decay", [0.0, 0.5, 0.9])
def test_slow_error_keeps_its_size_and_forgets_at_its_rate(decay: float) -> None:
    result = slow_error(np.random.default_rng(0), (400, 500), 3.0, decay)
    np.testing.assert_allclose(result[[0, 10, 399]].std(axis=1), 3.0, rtol=0.1)
    assert (result[1:] * result[:-1]).mean() / (result**2).mean() == pytest.approx(decay, abs=0.02)


def test_labels_are_exchanged_as_often_and_as_long_as_asked() -> None:
    error = DetectorError(swaps_per_s=0.2, swap_s=(0.1, 0.3))
    result = swap_times(np.random.default_rng(0), 300_000, 30.0, error)
    # One in five seconds: they hardly overlap.
    assert result.mean() == pytest.approx(0.2 * 0.2, rel=0.1)


def test_another_rate_reads_between_the_frames() -> None:
    line = np.arange(11.0)[:, None, None] * np.ones((1, 15, 3))
    np.testing.assert_allclose(resample(line, 100.0, 40.0)[:, 0, 0], [0.0, 2.5, 5.0, 7.5, 10.0])
