"""Tests of still, moving and hand-held cameras: positions, images, and the limit of large distances."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from pipeline.core.camera_paths import around, hand_held
from pipeline.core.pinhole import Pinhole, look_at, project_by_matrix
from tests.core.cameras import parallel, still
from tests.rejects import rejects
from tests.strategies import seeds

TARGET = np.array([100.0, -200.0, 900.0])


def moving_target(seed: int, frames: int) -> np.ndarray:
    return TARGET + 300.0 * np.random.default_rng(seed).standard_normal((frames, 3))


@given(
    seed=seeds,
    frames=st.integers(1, 20),
    sweep=st.floats(-7.0, 7.0),
    distance=st.floats(100.0, 1e6),
    height=st.floats(-2000.0, 2000.0),
)
def test_around_is_a_level_circle_that_looks_at_its_target(
    seed: int, frames: int, sweep: float, distance: float, height: float
) -> None:
    camera = around(
        frames,
        target=TARGET,
        sweep_rad=sweep,
        distance_mm=distance,
        height_mm=height,
    )
    assert camera.frames == frames
    away = camera.centre - TARGET
    np.testing.assert_allclose(away[:, 2], height, atol=1e-9)
    np.testing.assert_allclose(np.hypot(away[:, 0], away[:, 1]), distance, rtol=1e-12)
    points = np.broadcast_to(TARGET, (frames, 3))
    np.testing.assert_allclose(camera.project(points), 0.0, atol=1e-6)
    upwards = camera.project(np.add(points, [0.0, 0.0, 1.0]))
    assert (upwards[:, 1] < 0.0).all()
    steps = np.diff(away[:, 0] + 1j * away[:, 1])
    np.testing.assert_allclose(
        np.abs(steps), np.abs(steps).mean() if frames > 1 else 0.0, atol=1e-6 * distance
    )


def test_places_that_can_be_checked_in_the_head() -> None:
    """Camera positions agree with hand-computed values for azimuths of 0 and 90 degrees and a sweep of 180 degrees."""
    ahead = still(2, target=np.zeros(3), distance_mm=3000.0, height_mm=500.0)
    np.testing.assert_allclose(ahead.centre, [[0, 3000, 500]] * 2, atol=1e-9)
    left = still(1, target=np.zeros(3), distance_mm=3000.0, azimuth_rad=np.pi / 2)
    np.testing.assert_allclose(left.centre, [[-3000, 0, 0]], atol=1e-9)
    half = around(3, target=np.zeros(3), distance_mm=10.0, sweep_rad=np.pi)
    np.testing.assert_allclose(half.centre, [[10, 0, 0], [0, 10, 0], [-10, 0, 0]], atol=1e-9)


@given(seed=seeds, distance=st.sampled_from([2e3, 4e3, 1e6]))
def test_the_image_keeps_its_size_whatever_the_distance(seed: int, distance: float) -> None:
    camera = still(4, target=TARGET, distance_mm=distance, px_per_mm=0.5)
    right = camera.rotation[:, 0]
    displayed = camera.project(np.tile(TARGET, (4, 1)) + 10.0 * right)
    np.testing.assert_allclose(displayed, np.tile([5.0, 0.0], (4, 1)), atol=1e-6)
    assert camera.intrinsics[0, 0] == 0.5 * distance


@given(seed=seeds)
def test_a_moving_target_stays_in_the_middle_and_the_camera_where_it_was(seed: int) -> None:
    target = moving_target(seed, 9)
    camera = still(9, target=target)
    np.testing.assert_allclose(camera.project(target), 0.0, atol=1e-6)
    assert np.ptp(camera.centre, axis=0).max() == 0.0
    fixed = hand_held(np.random.default_rng(seed), camera, target=target)
    np.testing.assert_allclose(fixed.project(target), 0.0, atol=1e-6)


def test_a_hand_shakes_as_much_as_it_is_told() -> None:
    steady = around(400, target=TARGET, sweep_rad=0.5)
    generator = np.random.default_rng(0)
    trembling = (
        hand_held(generator, steady, target=TARGET, sway_mm=0.0, tremor_mm=20.0).centre - steady.centre
    )
    assert trembling.std() == pytest.approx(20.0, rel=0.05)
    swaying = [
        hand_held(generator, steady, target=TARGET, sway_mm=50.0, tremor_mm=0.0).centre - steady.centre
        for _ in range(60)
    ]
    assert np.std(swaying) == pytest.approx(50.0, rel=0.1)
    waves = np.abs(dct(swaying[0], axis=0, norm="ortho"))
    assert waves[5:].max() < 1e-9 < waves[1:5].max()
    still_hand = hand_held(generator, steady, target=TARGET, sway_mm=0.0, tremor_mm=0.0)
    np.testing.assert_allclose(still_hand.matrix, steady.matrix, atol=1e-6)


def test_a_hand_is_the_same_for_the_same_seed() -> None:
    steady = around(12, target=TARGET, sweep_rad=0.5)
    first, other, third = (
        hand_held(np.random.default_rng(seed), steady, target=TARGET).centre for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, other)
    assert (first != third).all()


def test_far_cameras_see_what_parallel_ones_see() -> None:
    points = moving_target(3, 7)
    limit = project_by_matrix(parallel(7, target=TARGET, azimuth_rad=0.4), points)
    off = []
    for distance in (1e4, 1e6, 1e8):
        camera = still(7, target=TARGET, distance_mm=distance, azimuth_rad=0.4)
        off.append(np.abs(camera.project(points) - limit).max())
    np.testing.assert_allclose(np.diff(np.log10(off)), -2.0, atol=0.1)
    # All depths look alike: nothing tells in front from behind.
    towards = [np.sin(0.4), -np.cos(0.4), 0.0]
    deeper = project_by_matrix(
        parallel(7, target=TARGET, azimuth_rad=0.4), points + 500.0 * np.array(towards)
    )
    np.testing.assert_allclose(deeper, limit, atol=1e-9)


@given(seed=seeds)
def test_projection_by_rows_is_that_of_the_pinhole(seed: int) -> None:
    camera = hand_held(np.random.default_rng(seed), around(5, target=TARGET, sweep_rad=2.0), target=TARGET)
    points = moving_target(seed, 10).reshape(5, 2, 3)
    points[2, 1] = camera.centre[2] + (camera.centre[2] - TARGET)  # behind
    pixels = project_by_matrix(camera.matrix, points)
    np.testing.assert_allclose(pixels, camera.project(points), rtol=1e-9, atol=1e-6)
    assert np.isnan(pixels[2, 1]).all()
    np.testing.assert_allclose(project_by_matrix(-camera.matrix, points), pixels, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "rejection"),
    [
        ({"frames": 0}, rejects("out_of_range", "frames", value=0)),
        ({"distance_mm": 0.0}, rejects("out_of_range", "distance_mm", value=0.0)),
        ({"px_per_mm": np.nan}, rejects("out_of_range", "px_per_mm")),
        ({"azimuth_rad": np.nan}, rejects("not_finite", "angles and height", index=(0,))),
        ({"target": np.zeros(2)}, rejects("wrong_shape", "target", shape=(2,))),
        ({"target": np.full(3, np.nan)}, rejects("not_finite", "target", index=(0,))),
    ],
)
def test_paths_that_lead_nowhere_are_refused(options: dict, rejection: AbstractContextManager) -> None:
    requested = {"frames": 4, "target": TARGET, **options}
    with rejection:
        still(requested.pop("frames"), **requested)


def test_a_hand_without_a_path_is_refused() -> None:
    first = look_at(np.zeros(3), TARGET, focal_px=1.0)
    with rejects("not_a_path"):
        hand_held(np.random.default_rng(0), first, target=TARGET)
    path = still(3, target=TARGET)
    with rejects("out_of_range", "tremor_mm", value=-1.0):
        hand_held(np.random.default_rng(0), path, target=TARGET, tremor_mm=-1.0)
    zooming = Pinhole(np.stack([path.intrinsics] * 3), path.rotation, path.centre)
    with rejects("not_a_path"):
        hand_held(np.random.default_rng(0), zooming, target=TARGET)
    with rejects("wrong_shape", "cameras", shape=(3, 3, 4)):
        project_by_matrix(path.matrix, np.zeros((4, 3)))
