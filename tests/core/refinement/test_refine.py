"""Tests of the refinement of whole bodies: derivatives, equations, accuracy, gaps, invariances, bad input."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.refinement import Refinement, RefinementOptions, refine, reprojection
from pipeline.core.refinement.equations import LimbEquations, damped_step, minimise, normal_equations
from pipeline.core.refinement.reprojection import Observations
from pipeline.core.refinement.spherical import SphericalTrajectory
from pipeline.core.trajectory_basis import cosine_basis
from tests.core.cameras import off_centre
from tests.rejects import rejects
from tests.strategies import seeds

TREE = (-1, 0, 1, 2, 1, 0)
"""Parents of a test skeleton: a chain of three limbs with one branch, and a separate limb at the root."""


@dataclass(frozen=True)
class Body:
    """Synthetic limbs whose directions lie in a trajectory basis, and their images from a moving camera."""

    images: np.ndarray
    camera: Pinhole
    root: np.ndarray
    relative: np.ndarray
    lengths: np.ndarray
    charts: np.ndarray
    basis: np.ndarray
    paths: tuple[SphericalTrajectory, ...]
    parents: tuple[int, ...]

    @property
    def positions(self) -> np.ndarray:
        return kinematics(self.parents, self.root, self.relative)

    def start(self, seed: int, size: float = 0.03) -> np.ndarray:
        """Return the true limb directions with smooth random errors of about `size` radians."""
        generator = np.random.default_rng(seed)
        frames = len(self.root)
        waves = self.basis[:, :4] * np.sqrt(frames)
        bend = np.einsum("fk,klx->flx", waves, generator.standard_normal((4, len(self.lengths), 3)))
        return self.relative / self.lengths[:, None] + 0.5 * size * bend

    def refined(self, start: np.ndarray, **options: Any) -> Refinement:
        """Return the refinement from given initial directions, by default with the angle axes of the ground truth."""
        inputs = {"images": self.images, "camera": self.camera, "root": self.root, "lengths": self.lengths}
        inputs |= {"parents": self.parents, "basis": self.basis}
        of_refinement = {field.name for field in fields(RefinementOptions)}
        how = {"charts": self.charts} | {name: options.pop(name) for name in of_refinement & {*options}}
        return refine(directions=start, options=RefinementOptions(**how), **(inputs | options))


def kinematics(parents: tuple[int, ...], root: np.ndarray, relative: np.ndarray) -> np.ndarray:
    """Return joint positions (F, J, 3) from root and limb vectors, joint by joint."""
    positions = [root]
    for joint in range(1, len(parents)):
        positions.append(positions[parents[joint]] + relative[:, joint - 1])
    return np.stack(positions, axis=1)


def body(
    seed: int,
    *,
    frames: int = 40,
    components: int = 5,
    noise_px: float = 0.0,
    parents: tuple[int, ...] = TREE,
) -> Body:
    """Return a synthetic body whose limbs never cross the plane perpendicular to their viewing direction."""
    generator = np.random.default_rng(seed)
    basis = cosine_basis(frames, components)
    limbs = len(parents) - 1
    lengths = generator.uniform(150.0, 450.0, limbs)
    sizes = 0.12 * np.sqrt(frames) / np.arange(1, components + 1) ** 1.5
    paths = []
    for _ in range(limbs):
        theta, phi = generator.uniform(-1, 1, (2, components)) * sizes
        theta[0] += np.pi / 2 * np.sqrt(frames)
        lean = generator.uniform(0.5, 1.0) * generator.choice([-1.0, 1.0])
        ahead = np.array([np.cos(lean) * generator.choice([-1.0, 1.0]), np.sin(lean), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        turn = Rotation.from_euler("y", generator.uniform(-np.pi, np.pi)).as_matrix()
        paths.append(SphericalTrajectory(theta, phi, np.stack([ahead, np.cross(up, ahead), up]) @ turn.T))
    directions = np.stack([path.directions(basis) for path in paths], axis=1)
    relative = lengths[:, None] * directions
    t = np.linspace(0, 1, frames)
    root = np.column_stack([600 * t - 300, 100 * np.sin(3 * t), 900 + 40 * np.sin(9 * t)])
    centre = np.column_stack([800 * t - 200, np.full(frames, -3000.0), 1200 + 300 * np.cos(4 * t)])
    camera = off_centre(look_at(centre, root, focal_px=1000.0))
    images = camera.project(kinematics(parents, root, relative))
    images = images + noise_px * generator.standard_normal(images.shape)
    charts = np.stack([path.chart for path in paths])
    return Body(images, camera, root, relative, lengths, charts, basis, tuple(paths), parents)


def observed(one: Body, *, free: bool = False, penalty: float = 0.0) -> tuple[Observations, np.ndarray]:
    """Return the observations that `refine` works on, and unknowns close to the ground truth."""
    unknowns = np.stack([np.concatenate([p.coefficients_theta, p.coefficients_phi]) for p in one.paths])
    if free:
        unknowns = np.column_stack([unknowns, np.zeros(len(unknowns))])
    generator = np.random.default_rng(0)
    inputs = reprojection.observe(
        one.images[:, 1:],
        one.camera,
        one.root,
        parents=tuple(parent - 1 for parent in one.parents[1:]),
        lengths=one.lengths,
        charts=one.charts,
        basis=one.basis,
        penalty=penalty * generator.uniform(0.0, 2.0, unknowns.shape),
    )
    return inputs, unknowns + 0.05 * generator.standard_normal(unknowns.shape)


def jacobian(given: Observations, unknowns: np.ndarray) -> np.ndarray:
    """Return the analytic derivative (L, F, 2, L, N) of all reprojection errors by all unknowns, mostly zeros."""
    by_position, movement = reprojection.linearise(given, unknowns)
    if unknowns.shape[1] > 2 * given.basis.shape[1]:  # by the logarithm of the length
        movement = np.concatenate([movement, reprojection.relative(given, unknowns)[:, :, None]], axis=2)
    limbs, frames = given.visible.shape
    components = given.basis.shape[1]
    whole = np.zeros((limbs, frames, 2, limbs, unknowns.shape[1]))
    for joint in range(limbs):
        limb = joint
        while limb >= 0:
            by_angle = np.einsum("fyx,fcx->fyc", by_position[joint], movement[limb])
            coefficients = by_angle[..., :2, None] * given.basis[:, None, None]
            whole[joint, :, :, limb, : 2 * components] = coefficients.reshape(frames, 2, -1)
            whole[joint, :, :, limb, 2 * components :] = by_angle[..., 2:]
            limb = given.parents[limb]
    return whole


def with_gaps(one: Body, seed: int) -> Body:
    """Return the body with a fifth of its images missing, one frame without root and one without camera."""
    images = one.images.copy()
    images[np.random.default_rng(seed).uniform(size=images.shape[:2]) < 0.2] = np.nan
    root, centre = one.root.copy(), one.camera.centre.copy()
    root[3] = np.nan
    centre[5] = np.nan
    return replace(
        one,
        images=images,
        root=root,
        camera=Pinhole(one.camera.intrinsics, one.camera.rotation, centre),
    )


# --- derivatives and the algebra of the tree ---------------------------------------------------------------


@settings(max_examples=10)
@given(seed=seeds, free=st.booleans(), gaps=st.booleans())
def test_the_analytic_jacobian_is_the_limit_of_differences(seed: int, free: bool, gaps: bool) -> None:
    """The difference between analytic Jacobian and central differences falls with the square of the step."""
    first = body(seed, frames=12, components=3)
    inputs, unknowns = observed(with_gaps(first, seed) if gaps else first, free=free)
    exact = jacobian(inputs, unknowns).reshape(-1, unknowns.size)

    def residuals(flat: np.ndarray) -> np.ndarray:
        positions = reprojection.forward(inputs, reprojection.relative(inputs, flat.reshape(unknowns.shape)))
        return reprojection.residuals(inputs, positions).ravel()

    steps = np.array([1e-1, 1e-2, 1e-3])
    errors = []
    for step in steps:
        around = step * np.eye(unknowns.size)
        columns = [residuals(unknowns.ravel() + d) - residuals(unknowns.ravel() - d) for d in around]
        errors.append(np.abs(np.stack(columns, axis=1) / (2 * step) - exact).max())
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 < slope < 2.1
    assert errors[-1] < 1e-4 * np.abs(exact).max()


@settings(max_examples=10)
@given(seed=seeds)
def test_the_gradient_is_that_of_the_cost(seed: int) -> None:
    inputs, unknowns = observed(with_gaps(body(seed, noise_px=2.0), seed), free=True, penalty=3.0)
    along = np.random.default_rng(seed).standard_normal(unknowns.shape)
    gradient = normal_equations(inputs, unknowns).gradient
    step = 1e-5
    ahead, back = (reprojection.cost(inputs, unknowns + s * along) for s in (step, -step))
    size = float(np.linalg.norm(gradient) * np.linalg.norm(along))
    assert abs((ahead - back) / (2 * step) - (gradient * along).sum()) < 1e-7 * size


def dense(equations: LimbEquations) -> np.ndarray:
    """Return the second derivatives H of all limbs as one matrix."""
    limbs, size = equations.gradient.shape
    whole = np.zeros((limbs, size, limbs, size))
    for limb, (row, line) in enumerate(zip(equations.rows, equations.lines, strict=True)):
        for position, carrier in enumerate(line[line >= 0]):
            whole[limb, :, carrier] = row[:, position]
            whole[carrier, :, limb] = row[:, position].T
    return whole.reshape(limbs * size, -1)


@settings(max_examples=20)
@given(
    seed=seeds,
    free=st.booleans(),
    parents=st.sampled_from([TREE, (-1, 0), (-1, 0, 0, 0), (-1, 0, 1, 2, 3, 4), (-1, 0, 1, 1, 2, 2, 3)]),
)
def test_the_tree_has_the_algebra_of_the_dense_matrices(
    seed: int, free: bool, parents: tuple[int, ...]
) -> None:
    """Normal equations and damped step agree with those from the complete Jacobian matrix."""
    first = with_gaps(body(seed, frames=20, components=4, noise_px=3.0, parents=parents), seed)
    inputs, unknowns = observed(first, free=free, penalty=2.0)
    equations = normal_equations(inputs, unknowns)
    whole = jacobian(inputs, unknowns).reshape(-1, unknowns.size)
    positions = reprojection.forward(inputs, reprojection.relative(inputs, unknowns))
    differences = reprojection.residuals(inputs, positions)
    curvature = whole.T @ whole + np.diag(inputs.penalty.ravel())
    gradient = whole.T @ differences.ravel() + inputs.penalty.ravel() * unknowns.ravel()
    scale = np.abs(curvature).max()
    np.testing.assert_allclose(dense(equations), curvature, rtol=1e-9, atol=1e-9 * scale)
    np.testing.assert_allclose(
        equations.gradient.ravel(), gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max()
    )
    np.testing.assert_allclose(equations.scale.ravel(), np.diagonal(curvature), rtol=1e-9, atol=1e-9 * scale)
    damping = 0.01 * scale * np.random.default_rng(seed).uniform(0.5, 1.0, unknowns.shape)
    step = damped_step(equations, damping)
    expected = np.linalg.solve(curvature + np.diag(damping.ravel()), -gradient)
    np.testing.assert_allclose(step.ravel(), expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
    assert equations.curvature_along(step) == pytest.approx(
        step.ravel() @ curvature @ step.ravel(), rel=1e-9, abs=1e-12 * scale * np.square(step).sum()
    )
    again = damped_step(equations, damping)
    np.testing.assert_array_equal(again, step)


@settings(max_examples=20)
@given(
    seed=seeds,
    free=st.booleans(),
    parents=st.sampled_from([TREE, (-1, 0)]),
)
def test_the_exact_curvature_is_the_slope_of_the_gradient(
    seed: int, free: bool, parents: tuple[int, ...]
) -> None:
    """The exact second derivatives agree with central differences of the gradient."""
    first = with_gaps(body(seed, frames=20, components=4, noise_px=3.0, parents=parents), seed)
    inputs, unknowns = observed(first, free=free, penalty=2.0)
    curvature = dense(normal_equations(inputs, unknowns, exact=True))
    along = np.random.default_rng(seed).standard_normal(unknowns.shape)
    step = 1e-6
    ahead, back = (normal_equations(inputs, unknowns + s * along).gradient for s in (step, -step))
    target = ((ahead - back) / (2 * step)).ravel()
    np.testing.assert_allclose(curvature @ along.ravel(), target, rtol=1e-5, atol=1e-5 * np.abs(target).max())


# --- recovery ----------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(seed=seeds)
def test_a_truth_in_the_basis_is_recovered_from_a_perturbed_start(seed: int) -> None:
    first = body(seed)
    result = first.refined(first.start(seed))
    assert result.converged
    assert result.reprojection_error_px < 1e-9
    np.testing.assert_allclose(result.positions, first.positions, atol=1e-6)
    np.testing.assert_allclose(result.relative, first.relative, atol=1e-6)
    np.testing.assert_array_equal(result.lengths, first.lengths)


def test_the_minimum_is_that_of_an_outside_solver() -> None:
    """On noisy images, the refinement reaches the same minimum as SciPy's trust-region solver."""
    first = body(4, frames=24, components=4, noise_px=1.0)
    start = first.start(1, 0.01)
    result = first.refined(start, tolerance=1e-12)
    inputs, _ = observed(first)

    def residuals(flat: np.ndarray) -> np.ndarray:
        positions = reprojection.forward(
            inputs, reprojection.relative(inputs, flat.reshape(len(TREE) - 1, -1))
        )
        return reprojection.residuals(inputs, positions).ravel()

    ours = np.concatenate([result.coefficients_theta, result.coefficients_phi], axis=1)
    truth = [np.concatenate([p.coefficients_theta, p.coefficients_phi]) for p in first.paths]
    peer = least_squares(residuals, np.concatenate(truth), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    np.testing.assert_allclose(result.cost, peer.cost, rtol=1e-9)
    np.testing.assert_allclose(ours.ravel(), peer.x, atol=1e-4)
    np.testing.assert_allclose(result.cost, 0.5 * (residuals(ours.ravel()) ** 2).sum(), rtol=1e-12)
    errors = np.linalg.norm(residuals(ours.ravel()).reshape(-1, 2), axis=1)
    np.testing.assert_allclose(result.reprojection_error_px, np.sqrt((errors**2).mean()), rtol=1e-12)


@settings(max_examples=10)
@given(seed=seeds)
def test_lengths_are_kept_between_frames(seed: int) -> None:
    first = body(seed, noise_px=2.0)
    result = first.refined(first.start(seed), max_iterations=5)
    frames = len(first.root)
    between = result.relative_at(
        cosine_basis(frames, first.basis.shape[1], at=np.arange(0.0, frames - 0.9, 0.5))
    )
    np.testing.assert_allclose(
        np.linalg.norm(between, axis=2), np.tile(first.lengths, (len(between), 1)), rtol=1e-13
    )
    np.testing.assert_allclose(between[::2], result.relative, atol=1e-9)
    np.testing.assert_allclose(result.positions, kinematics(TREE, first.root, result.relative), atol=1e-9)


@settings(max_examples=10)
@given(seed=seeds)
def test_what_was_not_seen_is_imputed_on_the_sphere(seed: int) -> None:
    """Joints without an image are imputed at the correct limb length, also in frames without camera or root."""
    first = body(seed)
    gappy = with_gaps(first, seed)
    start = first.start(seed)
    start[np.isnan(gappy.images[:, 1:, 0])] = np.nan
    result = gappy.refined(start)
    assert result.converged
    np.testing.assert_allclose(result.relative, first.relative, atol=1e-5)
    np.testing.assert_array_equal(np.isnan(result.positions[..., 0]).all(axis=1), np.arange(40) == 3)
    rest = np.arange(40) != 3
    np.testing.assert_allclose(result.positions[rest], first.positions[rest], atol=1e-5)


def test_a_joint_never_seen_is_led_by_those_it_carries() -> None:
    """A limb whose end is never visible keeps its direction, unless a child joint is visible."""
    first = body(11)
    images = first.images.copy()
    images[:, 5] = np.nan  # a limb alone
    images[:, 2] = np.nan  # carries joint 3
    start = first.start(3, 0.01)
    retained = first.refined(start, images=images, max_iterations=1).relative[:, 4]
    result = first.refined(start, images=images)
    assert np.isfinite(result.positions).all()
    np.testing.assert_allclose(result.relative[:, 4], retained, atol=1e-9)
    assert result.reprojection_error_px < 1e-3
    np.testing.assert_allclose(
        np.linalg.norm(result.relative, axis=2), np.tile(first.lengths, (40, 1)), rtol=1e-12
    )


def test_a_soft_basis_bridges_a_block_that_a_hard_one_does_not() -> None:
    first = body(6, frames=60, noise_px=1.0)
    images, start = first.images.copy(), first.start(1, 0.0)
    images[20:32, 1:] = np.nan
    start[20:32] = np.nan
    many = cosine_basis(60, 30)

    def error(found: Refinement) -> float:
        return float(np.abs(found.positions - first.positions).max())

    soft = first.refined(start, images=images, basis=many, cutoff=6.0)
    hard = first.refined(start, images=images, basis=many)
    assert soft.converged
    assert error(soft) < 60.0
    assert error(soft) < 0.5 * error(hard)


@settings(max_examples=5)
@given(seed=seeds)
def test_the_world_may_be_turned(seed: int) -> None:
    """If the world is rotated, the refined body is the same, rotated."""
    first = body(seed, noise_px=0.5)
    start = first.start(seed, 0.01)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    turned = Pinhole(first.camera.intrinsics, first.camera.rotation @ turn.T, first.camera.centre @ turn.T)
    options: dict[str, Any] = {"charts": None, "tolerance": 1e-12, "cutoff": 3.0}
    before = first.refined(start, **options)
    moved = first.refined(start @ turn.T, camera=turned, root=first.root @ turn.T, **options)
    assert before.converged
    assert moved.converged
    np.testing.assert_allclose(moved.positions, before.positions @ turn.T, atol=1e-3)
    np.testing.assert_allclose(moved.cost, before.cost, rtol=1e-9)


def test_a_limb_through_the_printed_pole_and_round_it_is_found() -> None:
    """The refinement finds an arm that swings through the vertical, and a hand that rotates around it twice."""
    frames = 80
    t = (np.arange(frames) + 0.5) / frames
    swing, turning = 0.8 * np.cos(3 * np.pi * t), 2 * np.pi * (1 - np.cos(np.pi * t))
    arm = np.stack([np.sin(swing), np.zeros(frames), -np.cos(swing)], axis=1)
    hand = np.stack([np.cos(turning), np.sin(turning), np.full(frames, 0.5)], axis=1) / np.sqrt(1.25)
    relative = np.stack([300 * arm, 200 * hand], axis=1)
    root = np.column_stack([100 * t, 0 * t, 1400 + 0 * t])
    centre = np.column_stack([500 * np.sin(5 * t), -3000 + 0 * t, 1200 + 300 * t])
    camera = look_at(centre, root, focal_px=1000.0)
    positions = kinematics((-1, 0, 1), root, relative)
    start = relative + np.random.default_rng(0).standard_normal(relative.shape)
    result = refine(
        camera.project(positions), camera, root, (-1, 0, 1), start, np.array([300.0, 200.0]), basis=6
    )
    assert result.converged
    # The charts are those of the noisy start, so the truth is next to the basis and not in it.
    np.testing.assert_allclose(result.positions, positions, atol=5.0)
    exact = refine(
        camera.project(positions), camera, root, (-1, 0, 1), relative, np.array([300.0, 200.0]), basis=6
    )
    np.testing.assert_allclose(exact.positions, positions, atol=1e-6)


# --- lengths -----------------------------------------------------------------------------------------------


def test_free_lengths_are_found() -> None:
    first = body(8)
    wrong = first.lengths * np.array([1.05, 0.95, 1.1, 0.97, 1.02])
    start = first.start(2, 0.005)
    result = first.refined(start, lengths=wrong, free_lengths=True)
    assert result.converged
    np.testing.assert_allclose(result.lengths, first.lengths, rtol=1e-8)
    np.testing.assert_allclose(result.positions, first.positions, atol=1e-4)
    fixed = first.refined(start, lengths=wrong)
    assert fixed.cost > 1e6 * result.cost
    assert np.abs(fixed.positions - first.positions).max() > 10.0
    np.testing.assert_array_equal(fixed.lengths, wrong)


def test_free_lengths_keep_within_their_bounds() -> None:
    first = body(8)
    wrong = first.lengths * np.array([2.6, 1.0, 1.0, 0.4, 1.0])
    result = first.refined(first.start(2, 0.005), lengths=wrong, free_lengths=True)
    assert result.converged
    np.testing.assert_allclose(result.lengths[[0, 3]], wrong[[0, 3]] * [0.5, 2.0], rtol=1e-9)
    assert (np.abs(np.log(result.lengths / wrong)) <= np.log(2.0) + 1e-12).all()


# --- the descent -------------------------------------------------------------------------------------------


def test_the_cost_never_rises_and_convergence_is_not_claimed_early() -> None:
    first = body(9, noise_px=1.0)
    start = first.start(5, 0.05)
    costs = [first.refined(start, max_iterations=n) for n in (1, 2, 4, 8, 200)]
    assert not costs[0].converged
    assert costs[0].n_iterations == 1
    assert (np.diff([result.cost for result in costs]) <= 1e-12 * costs[-1].cost).all()
    assert costs[-1].converged
    assert costs[-1].n_iterations < 200
    inputs, _ = observed(first)
    moved = np.concatenate([costs[-1].coefficients_theta, costs[-1].coefficients_phi], axis=1)
    equations = normal_equations(inputs, moved)
    newton = damped_step(equations, 1e-9 * equations.scale)
    assert -0.5 * (newton * equations.gradient).sum() < 1e-6 * costs[-1].cost


def test_the_minimum_does_not_depend_on_rounding() -> None:
    """With noise and poor initial directions, the result does not depend on rounding errors."""
    first = body(12, noise_px=3.0)
    start = first.start(3, 0.3)
    result = first.refined(start, cutoff=4.0)
    jitter = 1.0 + 1e-14 * np.random.default_rng(0).standard_normal(start.shape)
    again = first.refined(start * jitter, cutoff=4.0)
    assert result.converged
    assert again.converged
    assert result.reprojection_error_px > 1.0
    np.testing.assert_allclose(again.positions, result.positions, atol=1e-8)


def test_a_start_at_the_minimum_is_soon_done() -> None:
    """A refinement that starts at its result ends after at most four steps."""
    first = body(10)
    result = first.refined(first.refined(first.start(1)).relative)
    assert result.converged
    assert result.n_iterations <= 4
    np.testing.assert_allclose(result.positions, first.positions, atol=1e-6)


def test_a_step_behind_the_camera_is_refused_and_the_run_goes_on() -> None:
    """A refinement step that would move a joint behind the camera is rejected, and the refinement continues."""
    frames = 10
    camera = Pinhole(np.diag([500.0, 500.0, 1.0]), np.eye(3), np.zeros(3))
    root = np.tile([0.0, 0.0, 900.0], (frames, 1))
    truth = np.tile([np.sin(0.75), 0.0, -np.cos(0.75)], (frames, 1))[:, None]
    begin = np.tile([np.sin(0.6), 0.5, -np.cos(0.6)], (frames, 1))[:, None]
    images = camera.project(kinematics((-1, 0), root, 1000.0 * truth))
    with_pole = np.array([[[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]])
    result = refine(
        images,
        camera,
        root,
        (-1, 0),
        begin,
        np.array([1000.0]),
        basis=1,
        options=RefinementOptions(charts=with_pole),
    )
    assert result.converged
    np.testing.assert_allclose(result.relative[:, 0], 1000.0 * truth[:, 0], atol=1e-5)
    inputs = reprojection.observe(
        images[:, 1:], camera, root, parents=(-1,), lengths=np.array([1000.0]), charts=with_pole,
        basis=np.ones((frames, 1)), penalty=np.zeros((1, 2)),
    )  # fmt: skip
    through = np.array([[np.pi / 2, 0.0]])  # straight at the camera and past it
    assert reprojection.cost(inputs, through) == np.inf
    assert reprojection.behind(
        inputs, reprojection.forward(inputs, reprojection.relative(inputs, through))
    ).all()
    bound = np.full((1, 2), np.inf)
    unknowns, cost, converged, _ = minimise(
        inputs, np.array([[np.pi / 2 + 0.5, 0.6]]), bound, max_iterations=100, tolerance=1e-8
    )
    assert converged
    assert cost < 1e-9
    assert np.isfinite(unknowns).all()


def test_a_start_behind_the_camera_is_refused_by_joint_and_frame() -> None:
    first = body(1)
    centre = first.camera.centre.copy()
    centre[7] = first.positions[7, 4] + [0.0, 1e4, 0.0]
    camera = Pinhole(first.camera.intrinsics, first.camera.rotation, centre)
    with rejects("behind_camera", "joint hand", frame=7):
        first.refined(first.start(1, 0.0), camera=camera, names=["root", "hand", "b", "c", "d", "e"])


def test_what_it_was_given_stays_as_it_was() -> None:
    first = with_gaps(body(1), 1)
    start = body(1).start(1)
    arrays = [first.images, first.root, first.lengths, first.basis, first.charts, start]
    before = [array.copy() for array in arrays]
    result = first.refined(start, free_lengths=True, max_iterations=3)
    for array, retained in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(array, retained)
    result.chart[:] = 0.0
    np.testing.assert_array_equal(first.charts, before[4])


# --- rejected input ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "rejection"),
    [
        ({"images": np.zeros((40, 6))}, rejects("wrong_shape", "images", shape=(40, 6))),
        ({"images": np.zeros((40, 5, 2))}, rejects("wrong_shape", "directions", shape=(40, 5, 3))),
        ({"images": np.full((40, 6, 2), np.nan)}, rejects("nothing_seen")),
        ({"root": np.zeros((39, 3))}, rejects("wrong_shape", "root", shape=(39, 3))),
        ({"parents": (-1, 0, 1, 2, 5, 1)}, rejects("not_a_tree")),
        ({"parents": np.arange(-0.5, 5.0)}, rejects("out_of_range", "parent", value=-0.5)),
        ({"parents": (-1, 0, 1)}, rejects("not_a_tree")),
        (
            {"lengths": np.array([1.0, 2.0, -3.0, 4.0, 5.0])},
            rejects("out_of_range", "length of joint 3", value=-3.0),
        ),
        ({"basis": 41}, rejects("out_of_range", "components", value=41)),
        ({"basis": np.ones((39, 2))}, rejects("wrong_shape", "basis", shape=(39, 2))),
        ({"charts": np.eye(3)}, rejects("wrong_shape", "charts", shape=(3, 3))),
        ({"charts": np.full((5, 3, 3), np.nan)}, rejects("not_rotation", "initial trajectory of joint 1")),
        ({"cutoff": np.nan}, rejects("out_of_range", "cutoff")),
        ({"tolerance": -1.0}, rejects("out_of_range", "tolerance", value=-1.0)),
        ({"max_iterations": 0}, rejects("out_of_range", "max_iterations", value=0)),
        ({"names": ["a"]}, rejects("wrong_shape", "names", shape=(1,))),
    ],
)
def test_what_cannot_be_used_is_refused_in_a_sentence(
    options: dict[str, Any], rejection: AbstractContextManager
) -> None:
    first = body(1)
    with rejection:
        first.refined(first.start(1, 0.0), **options)


def test_a_limb_without_any_direction_is_refused_by_name() -> None:
    first = body(1)
    start = first.start(1, 0.0)
    start[:, 2] = np.nan
    with rejects("no_direction", "initial trajectory of joint 3"):
        first.refined(start)


def test_cameras_of_other_frames_are_refused() -> None:
    first = body(1)
    other = Pinhole(first.camera.intrinsics, first.camera.rotation[1:], first.camera.centre[1:])
    with rejects("frames_disagree", frames=39):
        first.refined(first.start(1, 0.0), camera=other)
