"""Tests of synthetic limbs: constant lengths, smooth angles, and exact recovery of a trajectory in the basis."""

from __future__ import annotations

from contextlib import AbstractContextManager
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from pipeline.core.articulation import ray_sphere
from pipeline.core.camera_paths import around, hand_held
from pipeline.core.limb_chain import WALKER14, true_lengths
from pipeline.core.reconstructibility import outside
from pipeline.synthetic.limbs import angular_limb, smooth_series, synthetic_body
from tests.core.limbs import cartesian_limb
from tests.rejects import rejects
from tests.strategies import seeds


def spectrum(series: np.ndarray) -> np.ndarray:
    """Return the coefficients of a series in the orthonormal cosine basis over all frames."""
    return np.asarray(dct(series, axis=0, norm="ortho"))


def cosines(frames: int, count: int) -> np.ndarray:
    return np.asarray(dct(np.eye(frames), axis=0, norm="ortho")[:count].T)


# --- what is true of each ---------------------------------------------------------------------------------


@given(
    seed=seeds,
    frames=st.integers(5, 60),
    bandwidth=st.integers(2, 5),
    swing=st.floats(0.0, 1.5),
    length=st.sampled_from([0.0, 5.0, 300.0, 1e4]),
)
def test_an_angular_limb_keeps_its_length_and_its_angles_to_the_basis(
    seed: int, frames: int, bandwidth: int, swing: float, length: float
) -> None:
    limb = angular_limb(
        np.random.default_rng(seed), frames, length_mm=length, swing_rad=swing, bandwidth=bandwidth
    )
    np.testing.assert_allclose(np.linalg.norm(limb.relative, axis=1), length, rtol=1e-12)
    assert np.abs(spectrum(limb.angles_rad)[bandwidth:]).max(initial=0.0) < 1e-12
    departure = np.abs(limb.angles_rad - [np.pi / 2, 0.0]).max(axis=0)
    np.testing.assert_allclose(departure, swing, atol=1e-12)
    # The angles, read from the directions in the chart.
    np.testing.assert_allclose(limb.chart @ limb.chart.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(limb.chart) > 0.0
    if length:
        x, y, z = (limb.relative @ limb.chart.T).T / length
        np.testing.assert_allclose(np.arccos(z), limb.angles_rad[:, 0], atol=1e-7)
        np.testing.assert_allclose(np.arctan2(y, x), limb.angles_rad[:, 1], atol=1e-7)


def test_coordinates_of_an_angular_limb_leave_the_basis_faster_than_geometrically() -> None:
    left = np.zeros((20, 6))
    for seed in range(20):
        c = spectrum(angular_limb(np.random.default_rng(seed), 100, bandwidth=3, swing_rad=0.8).relative)
        left[seed] = [np.linalg.norm(c[k:]) / np.linalg.norm(c) for k in (4, 8, 12, 16, 20, 28)]
    worst = left.max(axis=0)
    assert worst[0] > 1e-3
    assert worst[-1] < 1e-13
    assert (np.diff(np.log(worst[:5]), 2) < 0).all()


@given(seed=seeds, frames=st.integers(12, 40), bandwidth=st.integers(2, 6))
def test_a_cartesian_limb_is_inside_the_basis_and_so_changes_its_length(
    seed: int, frames: int, bandwidth: int
) -> None:
    chi = cartesian_limb(np.random.default_rng(seed), frames, length_mm=300.0, bandwidth=bandwidth)
    assert outside(cosines(frames, bandwidth), chi) < 1e-9
    assert np.ptp(np.linalg.norm(chi, axis=1)) > 0.0
    np.testing.assert_allclose(np.linalg.norm(chi.mean(axis=0)), 300.0)


@given(seed=seeds, frames=st.integers(12, 40), count=st.integers(2, 4))
def test_a_moving_limb_of_constant_length_is_not_inside_the_basis(seed: int, frames: int, count: int) -> None:
    limb = angular_limb(np.random.default_rng(seed), frames, bandwidth=2, swing_rad=0.8)
    assert outside(cosines(frames, count), limb.relative) > 1e-5 * limb.length_mm
    still = angular_limb(np.random.default_rng(seed), frames, swing_rad=0.0)
    assert outside(cosines(frames, 1), still.relative) < 1e-10


def test_a_body_keeps_its_lengths_and_moves_all_over() -> None:
    body = synthetic_body(np.random.default_rng(0), 80, stature_mm=1800.0)
    np.testing.assert_allclose(true_lengths(WALKER14, body.positions_mm), body.lengths_mm, rtol=1e-12)
    distances = np.linalg.norm(body.relative_mm, axis=2)
    np.testing.assert_allclose(distances, np.broadcast_to(body.lengths_mm, (80, 14)), rtol=1e-12)
    assert (np.ptp(body.relative_mm, axis=0).max(axis=1) > 0.2 * body.lengths_mm).all()
    pelvis = body.positions_mm[:, WALKER14.joints.index("pelvis")]
    np.testing.assert_array_equal(pelvis, body.root_mm)
    assert np.abs(spectrum(body.root_mm)[5:]).max() < 1e-9
    assert np.ptp(body.root_mm[:, :2], axis=0).min() > 400.0
    height = body.positions_mm[..., 2].mean(axis=0)
    order = ["head", "sternum", "pelvis", "left_knee", "left_ankle"]
    assert (np.diff([height[WALKER14.joints.index(joint)] for joint in order]) < 0).all()
    left, right = (
        body.positions_mm[:, WALKER14.joints.index(f"{s}_hip"), 0].mean() for s in ("left", "right")
    )
    assert left < pelvis[:, 0].mean() < right


def test_the_same_seed_is_the_same_body() -> None:
    first, other, third = (synthetic_body(np.random.default_rng(s), 20).positions_mm for s in (1, 1, 2))
    np.testing.assert_array_equal(first, other)
    assert (first != third).any(axis=(0, 2)).all()


# --- exact recovery ---------------------------------------------------------------------------------------


def all_signs(frames: int) -> np.ndarray:
    return np.array(list(product((-1.0, 1.0), repeat=frames)))


def objectives(basis: np.ndarray, middle: np.ndarray, half_chord: np.ndarray) -> np.ndarray:
    """Return the squared residual (2^F,) outside the basis for every combination of mirror signs."""
    chi = middle + all_signs(len(middle))[:, :, None] * half_chord
    left = chi - np.einsum("fk,gk,sgd->sfd", basis, basis, chi)
    return np.asarray((left**2).sum(axis=(1, 2)))


def test_a_limb_inside_the_basis_is_recovered_exactly() -> None:
    """The best of 2^12 sign combinations is the true trajectory of a limb in front of a hand-held camera."""
    for seed in range(12):
        generator = np.random.default_rng(seed)
        limb = angular_limb(generator, 12, bandwidth=2, swing_rad=0.4)
        parents = 200.0 * generator.standard_normal((12, 3))
        camera = hand_held(generator, around(12, target=np.zeros(3), sweep_rad=2.0), target=np.zeros(3))
        hits = ray_sphere(camera.matrix, camera.project(parents + limb.relative), parents, limb.length_mm)
        value = objectives(cosines(12, 5), hits.middle, hits.half_chord)
        best, second = np.argsort(value)[:2]
        np.testing.assert_allclose(hits.chosen(all_signs(12)[best]), limb.relative, atol=1e-6)
        assert value[best] < 1e-2 * value[second]


def test_coordinates_inside_the_basis_are_recovered_without_any_residual() -> None:
    for seed in range(12):
        generator = np.random.default_rng(100 + seed)
        chi = cartesian_limb(generator, 10, bandwidth=3)
        camera = hand_held(generator, around(10, target=np.zeros(3), sweep_rad=2.0), target=np.zeros(3))
        v = camera.rays(camera.project(chi))
        v /= np.linalg.norm(v, axis=1, keepdims=True)
        along = (chi * v).sum(axis=1)
        value = objectives(cosines(10, 3), chi - along[:, None] * v, along[:, None] * v)
        assert value.argmin() == len(value) - 1  # all plus: the truth
        assert value[-1] < 1e-20 * 300.0**2
        assert np.sort(value)[1] > 1.0


# --- refusals ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "rejection"),
    [
        ({"length_mm": -1.0}, rejects("out_of_range", "length_mm", value=-1.0)),
        ({"swing_rad": 1.6}, rejects("out_of_range", "swing_rad", value=1.6)),
        ({"bandwidth": 1}, rejects("out_of_range", "bandwidth", value=1)),
        ({"bandwidth": 21}, rejects("out_of_range", "bandwidth", value=21)),
        ({"middle": np.zeros(3)}, rejects("not_a_direction", "middle")),
        ({"middle": np.ones(2)}, rejects("not_a_direction", "middle")),
        ({"middle": np.array([np.nan, 0, 1])}, rejects("not_a_direction", "middle")),
    ],
)
def test_limbs_that_cannot_be_are_refused(options: dict, rejection: AbstractContextManager) -> None:
    with rejection:
        angular_limb(np.random.default_rng(0), 20, **options)


def test_bodies_and_series_that_cannot_be_are_refused() -> None:
    generator = np.random.default_rng(0)
    with rejects("out_of_range", "stature", value=0.0):
        synthetic_body(generator, 20, stature_mm=0.0)
    assert np.abs(smooth_series(generator, 2, 1, bandwidth=2)).max() == 1.0
    with rejects("out_of_range", "bandwidth", value=2):
        smooth_series(generator, 1, 1, bandwidth=2)
