"""Tests of the errors of a reconstruction, of the scale of a clip, and of the two baselines."""

from __future__ import annotations

import numpy as np
import pytest

from tests.walk3d.film.walk.walkers import clip, prior
from walk3d.film.simulation.keypoints import SimulatedKeypoints
from walk3d.film.walk import Fitting, Reconstruction, errors, reconstruct


@pytest.fixture(scope="module")
def found() -> tuple[SimulatedKeypoints, Reconstruction]:
    """Return a simulated clip without detector errors, and its reconstruction."""
    sim = clip(40.0)
    observed = np.ones(sim.pixels.shape[:2])
    return sim, reconstruct(
        sim.pixels,
        observed,
        sim.frame_rate_hz,
        sim.focal_px,
        prior(),
        Fitting(both_labellings=False, max_starts=1),
    )


def test_size_is_no_error_but_shape_is() -> None:
    truth = np.random.default_rng(0).normal(size=(4, 15, 3))
    assert errors.fitted_scale(0.5 * truth, truth) == pytest.approx(2.0)
    assert errors.mean_distance_mm(3.0 * truth, truth) == pytest.approx(0.0, abs=1e-12)
    assert errors.mean_distance_mm(truth + np.array([0.0, 0.0, 1.0]), truth) > 0.5


def test_the_kept_image_is_right_in_the_image_and_average_in_depth(
    found: tuple[SimulatedKeypoints, Reconstruction],
) -> None:
    sim, walk = found
    retained, average = errors.image_kept_mm(walk), errors.average_walker_mm(walk)
    np.testing.assert_array_equal(retained[..., 2], average[..., 2])
    scale = errors.fitted_scale(retained, sim.positions_mm)
    off = np.abs(scale * retained - sim.positions_mm)[:, errors.SCORED].mean(axis=(0, 1))
    neighbours = np.abs(scale * average - sim.positions_mm)[:, errors.SCORED].mean(axis=(0, 1))
    assert off[:2].mean() < neighbours[:2].mean()
    assert errors.mean_distance_mm(walk.posterior.positions_mm, sim.positions_mm) < errors.mean_distance_mm(
        average, sim.positions_mm
    )


def test_errors_are_counted_in_standard_deviations(
    found: tuple[SimulatedKeypoints, Reconstruction],
) -> None:
    sim, walk = found
    z = errors.joint_errors(walk, sim.positions_mm)
    assert np.abs(z[:, 8]).max() == 0.0
    scale = errors.fitted_scale(walk.posterior.positions_mm, sim.positions_mm)
    again = sim.positions_mm + z * scale * walk.posterior.sd_mm
    np.testing.assert_allclose(again, scale * walk.posterior.positions_mm, atol=1e-6)
