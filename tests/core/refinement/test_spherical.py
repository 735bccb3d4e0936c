"""Tests of the angles of directions: conversion back, continuity, behaviour at the poles, rotation, gaps, and bad
input.
"""

from __future__ import annotations

import itertools
from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import dct
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from pipeline.core.refinement.spherical import (
    SphericalAngles,
    SphericalTrajectory,
    continuous_angles,
    farthest_chart,
    fit,
    tangents,
    to_directions,
    unit_vectors,
)
from pipeline.core.trajectory_basis import cosine_basis
from tests.rejects import rejects
from tests.strategies import seeds

STYLES = ("generic", "planar", "nearly_planar", "still", "nearly_still", "everywhere", "two")


def path(seed: int, style: str = "generic", frames: int = 60) -> np.ndarray:
    """Return random unit directions (F, 3) of a given style, which by default vary smoothly."""
    generator = np.random.default_rng(seed)
    waves = cosine_basis(max(frames, 5), 5)[:frames] * np.sqrt(frames)
    turn = Rotation.random(rng=generator)
    moving = waves @ (generator.standard_normal((5, 3)) * np.array([2.0, 1.0, 0.5, 0.2, 0.1])[:, None])
    if style == "everywhere":
        moving = generator.standard_normal((frames, 3))
    elif style in ("planar", "nearly_planar"):
        moving[:, 2] *= 0.0 if style == "planar" else 1e-7
    elif style in ("still", "nearly_still"):
        moving = np.array([0.0, 0.0, 1.0]) + moving * (0.0 if style == "still" else 1e-7)
    elif style == "two":
        moving = moving[:2]
    return unit_vectors(turn.apply(moving))


def farthest_from_pole(chart: np.ndarray, directions: np.ndarray) -> float:
    return float(np.abs(directions @ chart[2]).max())


@given(seed=seeds, style=st.sampled_from(STYLES))
def test_angles_lead_back_to_the_directions_in_any_chart(seed: int, style: str) -> None:
    directions = path(seed, style)
    for chart in (None, np.eye(3), Rotation.random(rng=np.random.default_rng(seed)).as_matrix()):
        angles = continuous_angles(directions, chart=chart)
        back = to_directions(angles.theta, angles.phi, angles.chart)
        np.testing.assert_allclose(back, directions, atol=2e-9)
        np.testing.assert_allclose(angles.chart @ angles.chart.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(angles.chart) > 0


@given(seed=seeds, frames=st.integers(min_value=1, max_value=9))
def test_no_choice_of_sheets_is_shorter(seed: int, frames: int) -> None:
    """Among all 2^F equivalent sequences of angles, none has smaller changes than the returned one."""
    directions = path(seed, "everywhere", frames)
    result = continuous_angles(directions, chart=np.eye(3))
    length = (np.diff(result.theta) ** 2 + np.diff(result.phi) ** 2).sum()
    theta = np.arccos(np.clip(directions[:, 2], -1, 1))
    phi = np.arctan2(directions[:, 1], directions[:, 0])
    best = np.inf
    for choice in itertools.product([1.0, -1.0], repeat=frames):
        sheet = np.array(choice)
        pairs = np.stack([theta * sheet, phi + np.pi * (sheet < 0)])
        best = min(best, (np.diff(np.unwrap(pairs, axis=1)) ** 2).sum())
    np.testing.assert_allclose(length, best, rtol=1e-6, atol=1e-12)


def test_a_turning_limb_has_no_jump_at_half_a_turn() -> None:
    """The azimuth of a direction that rotates three times around the pole increases to six pi, without a jump."""
    turning = np.linspace(0.0, 6 * np.pi, 200)
    across = np.stack([np.cos(turning), np.sin(turning), np.full(200, 0.3)], axis=1)
    angles = continuous_angles(across, chart=np.eye(3))
    np.testing.assert_allclose(np.diff(angles.phi), turning[1], atol=1e-9)
    assert np.ptp(angles.theta) < 1e-12


def test_a_limb_that_turns_over_both_poles_has_an_inclination_that_runs_on() -> None:
    turning = np.linspace(0.1, 4 * np.pi + 0.1, 200)
    over = np.stack([np.sin(turning), np.zeros(200), np.cos(turning)], axis=1)
    angles = continuous_angles(over, chart=np.eye(3))
    np.testing.assert_allclose(angles.theta, turning, atol=1e-9)
    np.testing.assert_allclose(angles.phi, 0.0, atol=1e-9)


def test_a_direction_at_the_pole_takes_its_azimuth_from_its_neighbours() -> None:
    swing = np.linspace(-0.4, 0.4, 9)  # exactly at the pole in the middle
    over = np.stack([np.sin(swing) * 0.6, np.sin(swing) * 0.8, -np.cos(swing)], axis=1)
    angles = continuous_angles(over, chart=np.eye(3))
    np.testing.assert_allclose(np.abs(np.diff(angles.theta)), 0.1, atol=1e-9)
    np.testing.assert_allclose(angles.phi, angles.phi[0], atol=1e-9)
    still = continuous_angles(np.tile([0.0, 0.0, 2.0], (4, 1)), chart=np.eye(3))
    np.testing.assert_array_equal(still.theta, 0.0)
    np.testing.assert_array_equal(still.phi, 0.0)


@given(seed=seeds, style=st.sampled_from(STYLES))
def test_no_pole_is_farther_from_the_path(seed: int, style: str) -> None:
    """No other pole is farther from a set of directions than the chosen one, among random and neighbouring poles."""
    directions = path(seed, style)
    chart = farthest_chart(directions)
    start = farthest_from_pole(chart, directions)
    generator = np.random.default_rng(seed)
    poles = unit_vectors(generator.standard_normal((500, 3)))
    near = unit_vectors(chart[2] + 10.0 ** generator.uniform(-6, -1, (200, 1)) * poles[:200])
    others = np.abs(np.concatenate([poles, near]) @ directions.T).max(axis=1)
    assert others.min() >= start - 1e-8


@given(seed=seeds, style=st.sampled_from(("generic", "everywhere", "turned corners", "twice")))
def test_the_pole_is_the_nearest_face_of_the_hull(seed: int, style: str) -> None:
    """The chosen pole is the normal of the convex hull face that Quickhull finds nearest to the origin."""
    generator = np.random.default_rng(seed)
    directions = path(seed, style if style == "everywhere" else "generic", int(generator.integers(4, 130)))
    if style == "turned corners":
        corners = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]), axis=-1).reshape(-1, 3)
        directions = unit_vectors(Rotation.random(rng=generator).apply(corners[generator.permutation(8)]))
    elif style == "twice":
        directions = np.concatenate([directions, -directions, directions + 1e-15])
    faces = ConvexHull(np.concatenate([directions, -directions])).equations
    pole = farthest_chart(unit_vectors(directions))[2]
    start, nearest = np.abs(directions @ pole).max(), -faces[:, 3].max()
    assert start == pytest.approx(nearest, abs=2e-12)
    same = np.abs(faces[:, :3] @ pole - 1.0) < 1e-9
    assert (faces[same, 3] > -nearest - 1e-9).any()


def test_the_printed_pole_has_steps_of_a_radian_where_ours_has_none() -> None:
    """Near the vertical, a thigh's azimuth jumps with the printed pole, but not with ours [park2011 4 as printed]."""
    swing = 0.5 * np.sin(np.linspace(0, 4 * np.pi, 100))
    thigh = np.stack([np.full(100, 0.01), np.sin(swing), -np.cos(swing)], axis=1)
    printed, ours = continuous_angles(thigh, chart=np.eye(3)), continuous_angles(thigh)
    assert np.abs(np.diff(printed.phi)).max() > 1.0
    assert max(np.abs(np.diff(ours.phi)).max(), np.abs(np.diff(ours.theta)).max()) < 0.1


@given(seed=seeds)
def test_the_chart_turns_with_the_world(seed: int) -> None:
    directions = path(seed)
    turn = Rotation.random(rng=np.random.default_rng(seed + 1)).as_matrix()
    start, moved = continuous_angles(directions), continuous_angles(directions @ turn.T)
    basis = cosine_basis(60, 8)
    smooth = fit(start, basis).directions(basis) @ turn.T
    np.testing.assert_allclose(fit(moved, basis).directions(basis), smooth, atol=1e-6)


def test_cosines_are_rows_of_the_orthonormal_transform() -> None:
    np.testing.assert_allclose(cosine_basis(12, 12), dct(np.eye(12), norm="ortho", axis=0).T, atol=1e-12)
    few = cosine_basis(12, 3, at=np.array([0.0, 0.5, 1.0]))
    assert few.shape == (3, 3)
    assert (np.diff(few[:, 1]) < 0).all()


def in_basis(seed: int, frames: int, components: int) -> tuple[SphericalTrajectory, np.ndarray]:
    """Return a random smooth trajectory around the equator of its angle axes, with its basis."""
    generator = np.random.default_rng(seed)
    basis = cosine_basis(frames, components)
    sizes = 0.15 * np.sqrt(frames) / np.arange(1, components + 1) ** 2
    theta, phi = generator.uniform(-1, 1, (2, components)) * sizes
    theta[0] += np.pi / 2 * np.sqrt(frames)
    return SphericalTrajectory(theta, phi, Rotation.random(rng=generator).as_matrix()), basis


@given(seed=seeds, missing=st.floats(min_value=0.0, max_value=0.4))
def test_a_trajectory_of_the_basis_comes_back_also_where_frames_are_missing(
    seed: int, missing: float
) -> None:
    truth, basis = in_basis(seed, 80, 6)
    observed = truth.directions(basis)
    observed[np.random.default_rng(seed).uniform(size=80) < missing] = np.nan
    observed[40] = truth.directions(basis)[40]
    angles = continuous_angles(3.0 * observed, chart=truth.chart)
    assert (np.isnan(angles.theta) == np.isnan(observed[:, 0])).all()
    result = fit(angles, basis)
    np.testing.assert_allclose(result.directions(basis), truth.directions(basis), atol=1e-7)


@given(seed=seeds)
def test_the_path_stays_on_the_sphere_at_any_time(seed: int) -> None:
    """Interpolated directions have unit length at any time between frames."""
    truth, basis = in_basis(seed, 30, 6)
    between = truth.directions(cosine_basis(30, 6, at=np.linspace(0, 29, 117)))
    np.testing.assert_allclose(np.linalg.norm(between, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(between[::4], truth.directions(basis), atol=1e-12)
    line = 0.5 * (between[:-4:4] + between[4::4])
    assert (np.linalg.norm(line, axis=1) < np.linalg.norm(between[2::4], axis=1)).all()


def test_a_penalty_bridges_a_gap_that_a_hard_basis_does_not() -> None:
    truth, basis = in_basis(3, 60, 6)
    many = cosine_basis(60, 30)
    noisy = truth.directions(basis) + 1e-3 * np.random.default_rng(0).standard_normal((60, 3))
    noisy[25:37] = np.nan
    angles = continuous_angles(noisy, chart=truth.chart)
    soft = fit(angles, many, penalty=(np.arange(30) / 8.0) ** 6)
    error = [np.abs(f.directions(many) - truth.directions(basis)).max() for f in (soft, fit(angles, many))]
    assert error[0] < 0.05
    assert error[0] < 0.2 * error[1]


def test_an_azimuth_near_the_pole_counts_little() -> None:
    """An azimuth error near the pole hardly influences the fit, because it hardly changes the direction."""
    theta, phi = np.full(20, np.pi / 2), np.zeros(20)
    theta[3], phi[3] = 1e-3, 2.0
    basis = cosine_basis(20, 2)
    result = fit(SphericalAngles(theta, phi, np.eye(3)), basis)
    assert np.abs(basis @ result.coefficients_phi).max() < 1e-5


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_the_derivative_is_that_of_the_directions(step: float) -> None:
    generator = np.random.default_rng(0)
    theta, phi = generator.uniform(-7, 7, (2, 50))
    chart = Rotation.random(rng=generator).as_matrix()
    given_ = tangents(theta, phi, chart)
    by_theta = to_directions(theta + step, phi, chart) - to_directions(theta - step, phi, chart)
    by_phi = to_directions(theta, phi + step, chart) - to_directions(theta, phi - step, chart)
    difference = np.stack([by_theta, by_phi], axis=1) / (2 * step)
    assert np.abs(given_ - difference).max() < step**2


def test_what_it_was_given_stays_as_it_was() -> None:
    directions = path(5) * 3.0
    directions[4] = np.nan
    before = directions.copy()
    angles = continuous_angles(directions)
    original = angles.theta.copy()
    fit(angles, cosine_basis(60, 4))
    np.testing.assert_array_equal(directions, before)
    np.testing.assert_array_equal(angles.theta, original)


@pytest.mark.parametrize(
    ("directions", "rejection"),
    [
        (np.ones((4, 2)), rejects("wrong_shape", "directions", shape=(4, 2))),
        (np.full((4, 3), np.nan), rejects("no_direction")),
        (np.array([[1.0, 0, 0], [0, 0, 0]]), rejects("zero_length", frame=1)),
    ],
)
def test_directions_that_are_none_are_refused(
    directions: np.ndarray, rejection: AbstractContextManager
) -> None:
    with rejection:
        continuous_angles(directions)


def test_a_fit_of_nothing_is_refused() -> None:
    angles, basis = continuous_angles(path(1)), cosine_basis(60, 4)
    with rejects("wrong_shape", "basis", shape=(59, 4)):
        fit(angles, basis[1:])
    with rejects("out_of_range", "penalty", value=-1.0):
        fit(angles, basis, penalty=-np.ones(4))
    with rejects("not_finite", "penalty", index=(0,)):
        fit(angles, basis, penalty=np.full(4, np.nan))


@settings(max_examples=20)
@given(seed=seeds, size=st.sampled_from([1e-200, 1e-3, 1e200]))
def test_the_length_of_a_direction_does_not_matter(seed: int, size: float) -> None:
    directions = path(seed)
    start, moved = continuous_angles(directions), continuous_angles(size * directions)
    np.testing.assert_allclose(moved.theta, start.theta, atol=1e-6)
    np.testing.assert_allclose(moved.phi, start.phi, atol=1e-6)


def test_angles_stay_continuous_through_the_poles_over_two_turns() -> None:
    turn = np.arange(33) * np.pi / 8  # exactly at a pole in every eighth frame
    circle = np.stack([np.sin(turn), np.zeros(33), np.cos(turn)], axis=1)
    angles = continuous_angles(circle, chart=np.eye(3))
    np.testing.assert_allclose(np.abs(np.diff(angles.theta)), np.pi / 8, atol=1e-9)
    np.testing.assert_allclose(np.diff(angles.phi), 0.0, atol=1e-9)
