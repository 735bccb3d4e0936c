"""Tests of the image likelihood against its definition for single joints, and against numerical integration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from pipeline.core import camera
from pipeline.core.tracking import Likelihood
from tests.rejects import rejects
from tests.strategies import seeds

VIEW = 0.4


@given(
    seed=seeds,
    missing=st.floats(0, 1),
)
@settings(max_examples=60)
def test_the_density_is_the_product_over_the_joints_that_were_seen(seed: int, missing: float) -> None:
    """The image likelihood equals the product of SciPy's normal densities over the visible joints."""
    generator = np.random.default_rng(seed)
    joints = 300.0 * generator.standard_normal((4, 6, 3))
    image = 100.0 * generator.standard_normal((2, 6, 2))
    image[generator.random((2, 6)) < missing, 0] = np.nan  # one coordinate is enough to be missing
    noise = generator.uniform(5.0, 80.0, 6)
    likelihood = Likelihood(image, VIEW, noise)
    for frame in range(2):
        expected = np.zeros(4)
        for s in range(4):
            for j in range(6):
                if np.isnan(image[frame, j, 0]):
                    continue
                position = camera.project(joints[s, j], VIEW)
                shape = noise[j] ** 2 * np.eye(2)
                expected[s] += stats.multivariate_normal.logpdf(image[frame, j], position, shape)
        np.testing.assert_allclose(likelihood.log_density(joints, frame), expected, rtol=1e-9, atol=1e-9)


def test_an_unknown_place_is_integrated_out() -> None:
    """With an unknown horizontal position, the likelihood equals the integral over all horizontal shifts."""
    generator = np.random.default_rng(1)
    joints, noise = 10.0 * generator.standard_normal((1, 4, 3)), np.array([3.0, 5.0, 8.0, 4.0])
    image = camera.project(joints, VIEW) + noise[:, None] * generator.standard_normal((4, 2)) + [40.0, -5.0]
    image[0, 3] = np.nan
    finite = Likelihood(image, VIEW, noise)

    def density(across: float) -> float:
        shift = across * np.array([np.cos(VIEW), np.sin(VIEW), 0.0])
        return float(np.exp(finite.log_density(joints + shift, 0)[0]))

    expected = integrate.quad(density, 0.0, 80.0, epsabs=0.0)[0]
    result = Likelihood(image, VIEW, noise, place_known=False).log_density(joints, 0)[0]
    assert result == pytest.approx(np.log(expected), rel=1e-6)


def test_with_an_unknown_place_no_shift_along_the_horizontal_matters() -> None:
    generator = np.random.default_rng(2)
    joints, image = generator.standard_normal((5, 4, 3)), generator.standard_normal((1, 4, 2))
    for finite in (True, False):
        moved, sideways, upwards = (
            Likelihood(image + shift, VIEW, 1.0, place_known=finite).log_density(joints, 0)
            for shift in ([0.0, 0.0], [7.0, 0.0], [0.0, -3.0])
        )
        assert np.allclose(moved, sideways) != finite
        assert not np.allclose(moved, upwards)


def test_nothing_seen_says_nothing_and_a_joint_without_a_place_is_impossible() -> None:
    joints = np.array([[[0.0, 900.0, 0.0], [0.0, 900.0, 5.0]], [[0.0, 900.0, 0.0], [np.nan, 0.0, 5.0]]])
    image = np.zeros((3, 2, 2))
    image[1] = np.nan
    image[2, 1] = np.nan
    likelihood = Likelihood(image, VIEW, 1.0)
    assert likelihood.visible.sum(axis=1).tolist() == [2, 0, 1]
    assert np.isfinite(likelihood.log_density(joints, 0)).tolist() == [True, False]
    np.testing.assert_array_equal(likelihood.log_density(joints, 1), 0.0)
    assert np.ptp(likelihood.log_density(joints, 2)) == 0.0
    assert likelihood.log_peak[1] == 0.0


def test_a_noise_of_nothing_is_refused() -> None:
    with rejects("out_of_range", "noise", value=0.0):
        Likelihood(np.zeros((4, 15, 2)), VIEW, 0.0)
