"""The likelihood of an image against its definition, joint by joint and by numerical integration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, stats

from pipeline.core import camera
from pipeline.core.pinhole import look_at
from pipeline.core.tracking import Likelihood
from pipeline.validation import InvalidInput
from tests.strategies import seeds

VIEW = 0.4


@given(
    seed=seeds,
    perspective=st.booleans(),
    missing=st.floats(0, 1),
)
@settings(max_examples=60)
def test_the_density_is_the_product_over_the_joints_that_were_seen(
    seed: int, perspective: bool, missing: float
) -> None:
    """Against a loop over particles and joints with the densities of scipy."""
    generator = np.random.default_rng(seed)
    joints = 300.0 * generator.standard_normal((4, 6, 3))
    root = generator.standard_normal((2, 3)) * 50.0
    view = look_at(np.array([5000.0, 200.0, 900.0]), np.zeros(3), focal_px=900.0) if perspective else VIEW
    image = 100.0 * generator.standard_normal((2, 6, 2))
    image[generator.random((2, 6)) < missing, 0] = np.nan  # one coordinate is enough to be missing
    noise = generator.uniform(5.0, 80.0, 6)
    likelihood = Likelihood(image, view, noise, root)
    for frame in range(2):
        expected = np.zeros(4)
        for s in range(4):
            for j in range(6):
                if np.isnan(image[frame, j, 0]):
                    continue
                point = joints[s, j] + root[frame]
                place = camera.project(point, view) if isinstance(view, float) else view.project(point)
                shape = noise[j] ** 2 * np.eye(2)
                expected[s] += stats.multivariate_normal.logpdf(image[frame, j], place, shape)
        np.testing.assert_allclose(likelihood.log_density(joints, frame), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("unknown_place", ["across", "image"])
def test_an_unknown_place_is_integrated_out(unknown_place: str) -> None:
    """Against the integral over every shift of the image."""
    generator = np.random.default_rng(1)
    joints, noise = 10.0 * generator.standard_normal((1, 4, 3)), np.array([3.0, 5.0, 8.0, 4.0])
    image = camera.project(joints, VIEW) + noise[:, None] * generator.standard_normal((4, 2)) + [40.0, -25.0]
    image[0, 3] = np.nan
    known = Likelihood(image, VIEW, noise)

    def density(up: float, across: float) -> float:
        shift = across * np.array([np.cos(VIEW), np.sin(VIEW), 0.0]) + [0.0, 0.0, up]
        return float(np.exp(known.log_density(joints + shift, 0)[0]))

    if unknown_place == "across":
        expected = integrate.quad(lambda a: density(0.0, a), 0.0, 80.0, epsabs=0.0)[0]
    else:
        expected = integrate.dblquad(density, 0.0, 80.0, -65.0, 15.0, epsabs=0.0)[0]
    found = Likelihood(image, VIEW, noise, unknown_place=unknown_place).log_density(joints, 0)[0]
    assert found == pytest.approx(np.log(expected), rel=1e-6)


def test_with_an_unknown_place_no_shift_of_the_image_matters() -> None:
    generator = np.random.default_rng(2)
    joints, image = generator.standard_normal((5, 4, 3)), generator.standard_normal((1, 4, 2))
    kinds = {"none": (0, 0), "across": (1, 0), "image": (1, 1)}
    for name, free in kinds.items():
        there, shifted = (
            Likelihood(i, VIEW, 1.0, unknown_place=name).log_density(joints, 0)
            for i in (image, np.add(image, [7.0, -3.0]))
        )
        assert np.allclose(there, shifted) == (free == (1, 1))
        sideways = Likelihood(np.add(image, [7.0, 0.0]), VIEW, 1.0, unknown_place=name).log_density(joints, 0)
        assert np.allclose(there, sideways) == bool(free[0])


def test_nothing_seen_says_nothing_and_behind_the_camera_is_impossible() -> None:
    pinhole = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), focal_px=1000.0)
    joints = np.array([[[0.0, 900.0, 0.0], [0.0, 900.0, 5.0]], [[0.0, 900.0, 0.0], [0.0, -900.0, 5.0]]])
    image = np.zeros((4, 2, 2))
    image[1] = np.nan
    image[2, 1] = np.nan
    root = np.zeros((4, 3))
    root[3] = np.nan
    likelihood = Likelihood(image, pinhole, 1.0, root)
    assert likelihood.seen.sum(axis=1).tolist() == [2, 0, 1, 0]
    assert np.isfinite(likelihood.log_density(joints, 0)).tolist() == [True, False]
    np.testing.assert_array_equal(likelihood.log_density(joints, 1), 0.0)
    assert np.ptp(likelihood.log_density(joints, 2)) == 0.0
    np.testing.assert_array_equal(likelihood.log_density(joints, 3), 0.0)
    assert [likelihood.log_peak[frame] for frame in (1, 3)] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"image": np.zeros((4, 15))}, r"observed joints must have shape \(T, J, 2\) \(got \(4, 15\)\)"),
        ({"image": np.zeros((0, 15, 2))}, r"observed coordinates must be at least 1"),
        ({"image": np.full((4, 15, 2), np.inf)}, "frame 0: an observed coordinate is infinite"),
        ({"noise": 0.0}, r"noise must be above 0 \(got 0\)"),
        (
            {"noise": np.ones(4)},
            r"noise must have shape \(15,\) \(got \(4,\)\)",
        ),
        ({"root": np.zeros((3, 3))}, r"root must have shape \(4, 3\) \(got \(3, 3\)"),
        ({"unknown_place": "depth"}, "unknown_place must be one of none, across, image .got depth"),
        (
            {"camera": "profile"},
            "camera is unknown .expected a view angle in radians or a Pinhole, received profile",
        ),
        ({"camera": np.nan}, "camera is unknown"),
        ({"camera": None}, "camera is unknown .*received NoneType"),
        (
            {
                "camera": look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), focal_px=1.0),
                "unknown_place": "image",
            },
            "a pinhole needs to know where the actor stands",
        ),
        (
            {"camera": look_at(np.zeros((3, 3)), np.tile([0.0, 1.0, 0.0], (3, 1)), focal_px=1.0)},
            r"disagree in their frames \(expected 4, received 3\)",
        ),
    ],
)
def test_bad_input_is_refused_in_a_sentence(change: dict, sentence: str) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        Likelihood(**{"image": np.zeros((4, 15, 2)), "camera": VIEW, "noise": 1.0, **change})
