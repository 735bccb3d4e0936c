"""Tests of the perspective camera: hand-computed projections, inverse projection, and invalid cameras."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.core.pinhole import Pinhole, _check_intrinsics, look_at, project_by_matrix
from tests.core.cameras import off_centre
from tests.rejects import rejects
from tests.strategies import seeds

K = np.array([[900.0, 2.0, 320.0], [0.0, 1100.0, 240.0], [0.0, 0.0, 1.0]])


def cameras(
    seed: int, frames: int | None, *, moving: tuple[bool, bool, bool] = (True, True, True)
) -> Pinhole:
    """Return a random camera, constant or different in each frame."""
    generator = np.random.default_rng(seed)
    count = frames or 1
    parts = [
        np.array([K * [[1 + i], [1 + i], [1]] for i in 0.1 * np.arange(count)]),
        Rotation.random(count, rng=generator).as_matrix(),
        1000.0 * generator.standard_normal((count, 3)),
    ]
    return Pinhole(
        *(part if frames and moves else part[0] for part, moves in zip(parts, moving, strict=True))
    )


def ahead(camera: Pinhole, generator: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return random world points (…, 3) in front of a camera."""
    moved = generator.uniform([-500, -500, 100], [500, 500, 5000], (*shape, 3))
    return moved @ camera.rotation + camera.centre


@given(seed=seeds, moving=st.tuples(st.booleans(), st.booleans(), st.booleans()))
def test_projection_is_that_of_the_matrix_frame_by_frame(seed: int, moving: tuple[bool, bool, bool]) -> None:
    """Projection equals multiplication by P = K R [I | -C] and division, for constant and for moving cameras."""
    generator = np.random.default_rng(seed)
    camera = cameras(seed, 4, moving=moving)
    assert camera.frames == (4 if any(moving) else None)
    points = np.stack([ahead(camera.at(f), generator, (2, 3)) for f in range(4)])
    pixels = camera.project(points)
    assert pixels.shape == (4, 2, 3, 2)
    for f in range(4):
        at = camera.at(f)
        assert at.frames is None
        matrix = camera.matrix[f] if any(moving) else camera.matrix
        np.testing.assert_allclose(matrix, K_R_I_C(at), rtol=1e-12, atol=1e-9)
        image = np.concatenate([points[f], np.ones((2, 3, 1))], axis=-1) @ matrix.T
        np.testing.assert_allclose(pixels[f], image[..., :2] / image[..., 2:], rtol=1e-8, atol=1e-6)
        np.testing.assert_allclose(at.project(points[f]), pixels[f], rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(camera.in_camera(points)[f, ..., 2], image[..., 2], rtol=1e-8, atol=1e-6)


@given(seed=seeds, scale=st.sampled_from([1.0, -1.0, 0.01, -250.0]))
def test_a_matrix_of_any_scale_and_sign_projects_as_its_camera_does(seed: int, scale: float) -> None:
    generator = np.random.default_rng(seed)
    camera = cameras(seed, 4)
    points = np.stack([ahead(camera.at(f), generator, (5,)) for f in range(4)])
    points[:, 0] = 2.0 * camera.centre - points[:, 1]  # behind the camera
    pixels = project_by_matrix(scale * camera.matrix, points)
    assert np.isnan(pixels[:, 0]).all()
    np.testing.assert_allclose(pixels, camera.project(points), rtol=1e-7, atol=1e-5)
    first = project_by_matrix(scale * camera.matrix[0], points[:1])
    np.testing.assert_allclose(first, pixels[:1], rtol=1e-12, atol=1e-9)


def K_R_I_C(camera: Pinhole) -> np.ndarray:
    """Return the camera matrix K R [I | -C] of one camera."""
    return camera.intrinsics @ camera.rotation @ np.column_stack([np.eye(3), -camera.centre])


@given(seed=seeds, frames=st.sampled_from([None, 3]))
def test_pixels_and_depths_give_the_points_back(seed: int, frames: int | None) -> None:
    generator = np.random.default_rng(seed)
    camera = cameras(seed, frames)
    points = np.stack([ahead(camera.at(f), generator, (5,)) for f in range(frames or 1)])
    points = points if frames else points[0]
    depth = camera.in_camera(points)[..., 2]
    pixels = camera.project(points)
    np.testing.assert_allclose(camera.back_project(pixels, depth), points, rtol=1e-8, atol=1e-6)
    moved = camera.project(camera.back_project(pixels, 700.0))
    np.testing.assert_allclose(moved, pixels, rtol=1e-8, atol=1e-6)


def test_a_projection_that_can_be_checked_in_the_head() -> None:
    """In the image of a person who faces the camera, the person's right side appears on the left."""
    before = look_at(np.array([0.0, 4000.0, 1000.0]), np.array([0.0, 0.0, 1000.0]), focal_px=1000.0)
    camera = off_centre(before)
    np.testing.assert_allclose(camera.project(np.array([0.0, 0.0, 1000.0])), [320.0, 240.0])
    np.testing.assert_allclose(camera.project(np.array([400.0, 0.0, 1000.0])), [220.0, 240.0])
    np.testing.assert_allclose(camera.project(np.array([0.0, 0.0, 1400.0])), [320.0, 140.0])
    np.testing.assert_allclose(camera.rays(np.array([320.0, 240.0])), [0.0, -1.0, 0.0], atol=1e-12)
    far = look_at(np.array([0.0, 4e7, 0.0]), np.zeros(3), focal_px=4e7)
    np.testing.assert_allclose(far.project(np.array([300.0, 70.0, 500.0])), [-300.0, -500.0], rtol=1e-5)


def test_what_is_not_in_front_has_no_image() -> None:
    camera = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]), focal_px=1000.0)
    points = np.array([[10.0, 100.0, 10.0], [10.0, 0.0, 10.0], [10.0, -100.0, 10.0], [np.nan, 1.0, 1.0]])
    assert np.isfinite(camera.project(points)).all(axis=1).tolist() == [True, False, False, False]


def test_a_frame_whose_camera_is_not_known_has_no_image_and_the_others_do() -> None:
    camera = cameras(3, 3)
    rotation, centre = camera.rotation.copy(), camera.centre.copy()
    rotation[1] = centre[2] = np.nan
    partly = Pinhole(camera.intrinsics, rotation, centre)
    assert partly.known.tolist() == [True, False, False]
    assert bool(camera.at(0).known)
    points = np.stack([ahead(camera.at(f), np.random.default_rng(0), (2,)) for f in range(3)])
    assert np.isfinite(partly.project(points)).all(axis=(1, 2)).tolist() == [True, False, False]
    np.testing.assert_array_equal(partly.project(points)[0], camera.project(points)[0])


def test_following_cameras_look_at_their_targets() -> None:
    generator = np.random.default_rng(0)
    centre, target = generator.standard_normal((2, 6, 3)) * 1000.0
    camera = look_at(centre, target, focal_px=800.0)
    np.testing.assert_allclose(camera.project(target), 0.0, atol=1e-9)
    above = camera.project(np.add(target, [0.0, 0.0, 1.0]))
    np.testing.assert_allclose(above[:, 0], 0.0, atol=1e-9)
    assert (above[:, 1] < 0.0).all()


def test_a_camera_does_not_change_with_what_it_was_made_of() -> None:
    centre = np.array([0.0, 0.0, -10.0])
    camera = Pinhole(K, np.eye(3), centre)
    before = camera.project(np.ones(3))
    centre[:] = 7.0
    np.testing.assert_array_equal(camera.project(np.ones(3)), before)
    with pytest.raises(ValueError, match="read-only"):
        camera.centre[0] = 1.0


@pytest.mark.parametrize(
    ("intrinsics", "rotation", "centre", "rejection"),
    [
        (np.eye(4), np.eye(3), np.zeros(3), rejects("wrong_shape", array="intrinsics", shape=(4, 4))),
        (K, np.eye(3)[:2], np.zeros(3), rejects("wrong_shape", array="rotation")),
        (K, np.eye(3), np.zeros(2), rejects("wrong_shape", array="centre", shape=(2,))),
        (K, np.stack([np.eye(3)] * 2), np.zeros((3, 3)), rejects("frames_disagree", frames=[2, 3])),
        (-K, np.eye(3), np.zeros(3), rejects("out_of_range", value=-1100.0)),
        (K.T, np.eye(3), np.zeros(3), rejects("invalid_intrinsics")),
        (np.full((3, 3), np.nan), np.eye(3), np.zeros(3), rejects("out_of_range")),
        (K, 1.01 * np.eye(3), np.zeros(3), rejects("not_rotation")),
        (K, np.diag([1.0, 1.0, -1.0]), np.zeros(3), rejects("reflection")),
    ],
)
def test_what_is_no_camera_is_refused(
    intrinsics: np.ndarray, rotation: np.ndarray, centre: np.ndarray, rejection: AbstractContextManager
) -> None:
    with rejection:
        Pinhole(intrinsics, rotation, centre)


def test_points_that_do_not_fit_the_cameras_are_refused() -> None:
    with rejects("wrong_shape", shape=(4, 2)):
        cameras(0, None).project(np.zeros((4, 2)))
    with rejects("wrong_shape", shape=(3,)):
        cameras(0, 3).project(np.zeros(3))
    with rejects("frames_disagree", frames=4):
        cameras(0, 3).in_camera(np.zeros((4, 3)))
    with rejects("along_vertical"):
        look_at(np.zeros(3), np.array([0.0, 0.0, 5.0]), focal_px=1.0)


@pytest.mark.parametrize(("row", "column", "value"), [(1, 0, 0.1), (2, 0, 0.1), (2, 1, 0.1), (2, 2, 2.0)])
def test_each_fixed_entry_of_the_intrinsics_is_checked(row: int, column: int, value: float) -> None:
    intrinsics = np.diag([900.0, 800.0, 1.0])
    _check_intrinsics(intrinsics)
    intrinsics[row, column] = value
    with rejects("invalid_intrinsics"):
        _check_intrinsics(intrinsics)


@pytest.mark.parametrize(("first", "second"), [(0.0, 800.0), (900.0, -1.0)])
def test_both_focal_lengths_are_positive(first: float, second: float) -> None:
    with rejects("out_of_range"):
        _check_intrinsics(np.diag([first, second, 1.0]))
