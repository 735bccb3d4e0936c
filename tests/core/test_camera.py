"""Tests of the projection from 3D to 2D and back [zhang2007 3.4, 3.5, 3.16, B.2, B.3] [zhang2004 4, 5, 10]."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from pipeline.core import camera
from tests.strategies import angles, seeds


@given(seed=seeds, angle=angles)
@settings(max_examples=50, deadline=None)
def test_combining_undoes_projecting(seed: int, angle: float) -> None:
    motion = np.random.default_rng(seed).standard_normal((5, 15, 3))
    observed, missing = camera.project(motion, angle), camera.missing_dimension(motion, angle)
    np.testing.assert_allclose(camera.combine(observed, missing, angle), motion, rtol=0, atol=1e-14)


@given(seed=seeds, angle=angles)
@settings(max_examples=50, deadline=None)
def test_observed_coordinates_are_kept_whatever_is_missing(seed: int, angle: float) -> None:
    """A combination of image and missing dimension projects to the same image [zhang2007 3.16]."""
    generator = np.random.default_rng(seed)
    observed, invented = generator.standard_normal((5, 15, 2)), generator.standard_normal((5, 15))
    together = camera.combine(observed, invented, angle)
    np.testing.assert_allclose(camera.project(together, angle), observed, rtol=0, atol=1e-14)
    np.testing.assert_allclose(camera.missing_dimension(together, angle), invented, rtol=0, atol=1e-14)


@given(seed=seeds, angle=angles)
@settings(max_examples=30, deadline=None)
def test_the_projection_matrix_projects(seed: int, angle: float) -> None:
    """The projection matrix projects Fourier representations in the printed order, with and without the frequency."""
    sample = np.random.default_rng(seed).standard_normal(226)
    expected = camera.project(sample[:225].reshape(5, 15, 3), angle).reshape(-1)
    matrix = camera.projection_matrix(angle)
    assert matrix.shape == (150, 225)
    np.testing.assert_allclose(matrix @ sample[:225], expected, rtol=0, atol=1e-14)
    matrix = camera.projection_matrix(angle, trailing=1)
    assert matrix.shape == (151, 226)
    np.testing.assert_allclose(matrix @ sample, np.append(expected, sample[-1]), rtol=0, atol=1e-14)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(151), rtol=0, atol=1e-14)


@given(seed=seeds, angle=angles, turn=angles)
@settings(max_examples=50, deadline=None)
def test_turning_the_walker_is_turning_the_view(seed: int, angle: float, turn: float) -> None:
    motion = np.random.default_rng(seed).standard_normal((4, 15, 3))
    c, s = np.cos(turn), np.sin(turn)
    turned = motion @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T  # from x towards y
    np.testing.assert_allclose(
        camera.project(turned, angle), camera.project(motion, angle - turn), rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(
        camera.missing_dimension(turned, angle),
        camera.missing_dimension(motion, angle - turn),
        rtol=0,
        atol=1e-13,
    )


@given(seed=seeds, angle=angles)
@settings(max_examples=30, deadline=None)
def test_the_opposite_view_is_the_mirror_image(seed: int, angle: float) -> None:
    motion = np.random.default_rng(seed).standard_normal((4, 15, 3))
    np.testing.assert_allclose(
        camera.project(motion, angle + np.pi),
        camera.project(motion, angle) * [-1, 1],
        rtol=0,
        atol=1e-13,
    )


@pytest.mark.parametrize(
    ("angle_deg", "seen", "lost"),
    [(0, [1.0, 3.0], 2.0), (90, [2.0, 3.0], -1.0), (-90, [-2.0, 3.0], 1.0), (180, [-1.0, 3.0], -2.0)],
)
def test_four_views_worked_out_in_the_head(angle_deg: float, seen: list[float], lost: float) -> None:
    """Projections of a point at four view angles agree with hand-computed values."""
    point = np.array([1.0, 2.0, 3.0])  # right, forwards, up
    np.testing.assert_allclose(camera.project(point, np.radians(angle_deg)), seen, atol=1e-15)
    assert camera.missing_dimension(point, np.radians(angle_deg)) == pytest.approx(lost)
    assert camera.vertical(point) == 3.0
    assert camera.horizontal(point, np.radians(angle_deg)) == pytest.approx(seen[0])


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_many_angles_at_once_are_the_angles_one_by_one(seed: int) -> None:
    generator = np.random.default_rng(seed)
    motion, views = generator.standard_normal((15, 3)), generator.uniform(-3, 3, 6)
    each = [camera.missing_dimension(motion, view) for view in views]
    np.testing.assert_array_equal(camera.missing_dimension(motion[None], views[:, None]), np.stack(each))
    missing, observed = generator.standard_normal((2, 6, 15)), generator.standard_normal((6, 15, 2))
    each = [camera.combine(o, m, view) for o, m, view in zip(observed, missing[0], views, strict=True)]
    np.testing.assert_array_equal(camera.combine(observed, missing[0], views[:, None]), np.stack(each))
