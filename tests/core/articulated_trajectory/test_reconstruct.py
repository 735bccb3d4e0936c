"""Tests of the reconstruction of limbs and skeletons from one camera: accuracy, gaps, mirrors, hinges, refinement, bad
input.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera_paths
from pipeline.core.articulated_trajectory import (
    MARGIN_OF_DOUBT,
    Articulated,
    Options,
    TrajectoryBasis,
    choose_limb,
    prepared,
    select_signs,
)
from pipeline.core.articulation import RayStatus
from pipeline.core.binary_quadratic import minimise
from pipeline.core.limb_chain import WALKER14, Chain, forward, relative_trajectories
from pipeline.core.pinhole import Pinhole, look_at
from pipeline.core.reconstructibility import outside
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.synthetic.limbs import angular_limb, smooth_series, synthetic_body
from tests.core.cameras import parallel, still
from tests.rejects import rejects
from tests.strategies import seeds

QUICK_S = 0.0
"""Time limit of zero seconds for the proof of optimality, which makes the tests fast."""


@dataclass(frozen=True)
class Scene:
    """A synthetic body with known positions, and its images from one camera."""

    positions: np.ndarray
    lengths: np.ndarray
    camera: Pinhole
    images: np.ndarray
    chain: Chain = WALKER14

    @property
    def root(self) -> np.ndarray:
        return self.positions[:, self.chain.joints.index(self.chain.root)]

    def reconstructed(self, **options: Any) -> Articulated:
        inputs: dict[str, Any] = {"images": self.images, "camera": self.camera, "root": self.root}
        inputs |= {"lengths": self.lengths, "chain": self.chain}
        arguments = inputs | {name: value for name, value in options.items() if name in inputs}
        others = {name: value for name, value in options.items() if name not in inputs}
        quick = {"basis": TrajectoryBasis(20), "time_limit_s": QUICK_S}
        return prepared(**arguments, options=Options(**(quick | others))).whole()

    def errors_mm(self, positions: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.norm(positions - self.positions, axis=-1))


def scene(seed: int, *, frames: int = 60, sweep_rad: float = 1.5, noise_px: float = 0.0) -> Scene:
    """Return a body whose joint angles vary smoothly, seen by a camera that moves around it."""
    generator = np.random.default_rng(seed)
    body = synthetic_body(generator, frames, bandwidth=4)
    camera = camera_paths.around(frames, target=body.root_mm, sweep_rad=sweep_rad)
    images = camera.project(body.positions_mm)
    images = images + noise_px * generator.standard_normal(images.shape)
    return Scene(body.positions_mm, body.lengths_mm, camera, images)


def with_gaps(one: Scene, seed: int, *, share: float = 0.15) -> Scene:
    """Return the scene with randomly missing image points, and with a wrist that is hidden for eight frames."""
    images = one.images.copy()
    images[np.random.default_rng(seed).random(images.shape[:2]) < share] = np.nan
    images[20:28, one.chain.joints.index("right_wrist")] = np.nan
    return Scene(one.positions, one.lengths, one.camera, images, one.chain)


def length_errors(chain: Chain, positions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the relative error of the length of each limb in each frame."""
    return np.asarray(np.linalg.norm(relative_trajectories(chain, positions), axis=-1) / lengths - 1.0)


# --- recovery ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_a_body_of_smooth_angles_is_recovered_from_a_moving_camera(seed: int) -> None:
    first = scene(seed)
    reconstruction = first.reconstructed()
    assert first.errors_mm(reconstruction.chosen).max() < 0.1
    assert first.errors_mm(reconstruction.positions).max() < 0.2
    assert all(
        choice.solution.margin > 100.0 and not choice.undecided for choice in reconstruction.limbs.values()
    )
    assert set(reconstruction.confidence.values()) == {"green"}
    assert not reconstruction.imputed.any()


@pytest.mark.parametrize("seed", range(3))
def test_lengths_that_nobody_knows_are_read_off_the_rays(seed: int) -> None:
    first = scene(seed, frames=100)
    reconstruction = first.reconstructed(lengths=np.full(14, np.nan))
    ratio = reconstruction.lengths / first.lengths
    assert abs(np.median(ratio) - 1.0) < 0.03
    assert np.abs(ratio - 1.0).mean() < 0.1
    finite = np.where(
        np.arange(14) == 4, np.nan, first.lengths
    )  # one alone: the others stay as they are given
    mixed = first.reconstructed(lengths=finite)
    np.testing.assert_array_equal(np.delete(mixed.lengths, 4), np.delete(first.lengths, 4))
    assert 0.5 < mixed.lengths[4] / first.lengths[4] < 1.02


@pytest.mark.parametrize("use_hinges", [False, True])
def test_mirrors_are_tried_with_whatever_is_not_known(use_hinges: bool) -> None:
    first = scene(5, frames=100, sweep_rad=0.0, noise_px=1.0)
    options = {
        "lengths": np.full(14, np.nan), "noise_px": 1.0, "use_hinges": use_hinges
    }  # fmt: skip
    plain, attempts = (first.reconstructed(try_mirrors=t, **options) for t in (False, True))
    assert plain.refined is not None
    assert attempts.refined is not None
    assert attempts.refined.cost < plain.refined.cost
    for limb in first.chain.limbs:
        assert attempts.limbs[limb].hits.radius == pytest.approx(plain.limbs[limb].hits.radius)
        assert attempts.limbs[limb].basis == plain.limbs[limb].basis


def test_joints_may_stand_in_any_order() -> None:
    first = scene(1)
    order = np.random.default_rng(3).permutation(len(WALKER14.joints))
    chain = Chain(tuple(WALKER14.joints[j] for j in order), tuple(WALKER14.parents[j] for j in order))
    lengths = first.lengths[[WALKER14.limbs.index(limb) for limb in chain.limbs]]
    turned = Scene(first.positions[:, order], lengths, first.camera, first.images[:, order], chain)
    start, moved = first.reconstructed(), turned.reconstructed()
    np.testing.assert_allclose(moved.chosen, start.chosen[:, order], atol=1e-9)
    np.testing.assert_allclose(moved.positions, start.positions[:, order], atol=1e-3)
    assert set(moved.limbs) == set(start.limbs)


def test_a_chain_from_the_foot_upwards_is_reconstructed_too() -> None:
    whole = scene(2)
    joints = ("left_hip", "left_ankle", "left_knee")
    chain = Chain(joints, ("left_knee", None, "left_ankle"))
    places = [WALKER14.joints.index(joint) for joint in joints]
    positions = whole.positions[:, places]
    lengths = np.linalg.norm(relative_trajectories(chain, positions), axis=-1).mean(axis=0)
    leg = Scene(positions, lengths, whole.camera, whole.images[:, places], chain)
    assert chain.limbs == ("left_knee", "left_hip")
    for use_hinges in (False, True):
        reconstruction = leg.reconstructed(use_hinges=use_hinges)
        assert leg.errors_mm(reconstruction.positions).max() < 0.2


def test_one_camera_for_all_frames_serves_as_its_copies_do() -> None:
    first = scene(3, sweep_rad=0.0)
    camera = still(60, target=first.root.mean(axis=0))
    images = camera.project(first.positions)
    many = Scene(first.positions, first.lengths, camera, images)
    single = Scene(first.positions, first.lengths, camera.at(0), images)
    np.testing.assert_array_equal(
        many.reconstructed(refine=False).chosen, single.reconstructed(refine=False).chosen
    )


@given(seed=seeds, missing=st.booleans(), hinged=st.booleans())
@settings(max_examples=8)
def test_whatever_is_chosen_reprojects_to_the_images_and_keeps_every_length(
    seed: int, missing: bool, hinged: bool
) -> None:
    first = scene(seed, frames=40, noise_px=0.0)
    first = with_gaps(first, seed) if missing else first
    reconstruction = first.reconstructed(use_hinges=hinged, basis=TrajectoryBasis(30, 6.0))
    assert np.abs(length_errors(WALKER14, reconstruction.positions, reconstruction.lengths)).max() < 1e-9
    np.testing.assert_array_equal(reconstruction.lengths, first.lengths)
    for limb, choice in reconstruction.limbs.items():
        sizes = np.linalg.norm(choice.relative, axis=1)
        length = first.lengths[WALKER14.limbs.index(limb)]
        met = ~choice.hits.adjusted
        np.testing.assert_allclose(sizes[met], length, rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(choice.directions, axis=1), 1.0, rtol=1e-12)
        chosen = choice.hits.chosen(np.where(choice.signs == 0, 1, choice.signs))
        decided = choice.used & (choice.solution.values[np.cumsum(choice.used) - 1] == choice.signs)
        np.testing.assert_array_equal(choice.relative[decided], chosen[decided])


def test_arguments_are_left_as_they_were() -> None:
    first = with_gaps(scene(4), 4)
    images, root, lengths = first.images.copy(), first.root.copy(), first.lengths.copy()
    first.reconstructed(root=root, lengths=lengths, use_hinges=True)
    np.testing.assert_array_equal(first.images, images)
    np.testing.assert_array_equal(first.root, root)
    np.testing.assert_array_equal(first.lengths, lengths)


# --- gaps and dropped frames ------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_missing_points_are_imputed_on_the_sphere_and_flagged(seed: int) -> None:
    first = with_gaps(scene(seed), seed)
    reconstruction = first.reconstructed(basis=TrajectoryBasis(14))
    missing = np.isnan(first.images).any(axis=-1)
    missing[:, WALKER14.joints.index(WALKER14.root)] = False
    np.testing.assert_array_equal(reconstruction.imputed, missing)
    assert np.isfinite(reconstruction.positions).all()
    assert np.isfinite(reconstruction.chosen).all()
    assert np.abs(length_errors(WALKER14, reconstruction.positions, first.lengths)).max() < 1e-9
    assert first.errors_mm(reconstruction.positions)[missing].max() < 5.0
    for limb, choice in reconstruction.limbs.items():
        gaps = missing[:, WALKER14.joints.index(limb)]
        np.testing.assert_array_equal(choice.used, ~gaps)
        assert (choice.signs[gaps] == 0).all()
        assert (np.abs(choice.signs[~gaps]) == 1).all()


def test_a_parent_that_was_not_seen_does_not_cost_its_child_any_frame() -> None:
    first = scene(5)
    images = first.images.copy()
    images[10:16, WALKER14.joints.index("left_elbow")] = np.nan
    reconstruction = first.reconstructed(images=images, basis=TrajectoryBasis(12))
    assert reconstruction.limbs["left_elbow"].used.sum() == 54
    assert reconstruction.limbs["left_wrist"].used.all()
    assert first.errors_mm(reconstruction.positions)[:, WALKER14.joints.index("left_wrist")].max() < 5.0


def test_frames_without_root_or_camera_drop_out() -> None:
    first = scene(6)
    root, centre = first.root.copy(), first.camera.centre.copy()
    root[7:9] = np.nan
    centre[30] = np.nan
    camera = Pinhole(first.camera.intrinsics, first.camera.rotation, centre)
    reconstruction = first.reconstructed(root=root, camera=camera, basis=TrajectoryBasis(12))
    lost = np.isin(np.arange(60), [7, 8, 30])
    for limb in WALKER14.limbs:
        np.testing.assert_array_equal(reconstruction.limbs[limb].used, ~lost)
        np.testing.assert_array_equal(reconstruction.imputed[:, WALKER14.joints.index(limb)], lost)
    assert np.isnan(reconstruction.positions[7:9]).all(), "without its root a body is nowhere"
    assert np.isfinite(reconstruction.positions[30]).all(), "without its camera it is imputed"
    assert np.nanmax(first.errors_mm(reconstruction.positions)) < 1.0


def test_a_soft_basis_may_have_more_components_than_frames_were_seen() -> None:
    first = scene(7)
    images = first.images.copy()
    images[12:48, WALKER14.joints.index("head")] = np.nan
    smooth = TrajectoryBasis(40, 8.0)
    reconstruction = first.reconstructed(images=images, basis=smooth)
    assert reconstruction.limbs["head"].used.sum() == 24
    assert np.isfinite(reconstruction.positions).all()
    with rejects("undetermined", "limb head", observed=24, components=40):
        first.reconstructed(images=images, basis=TrajectoryBasis(40))


@given(seed=seeds, seen=st.integers(3, 12))
@settings(max_examples=20)
def test_fewer_columns_cost_every_trajectory_the_same(seed: int, seen: int) -> None:
    """The restricted soft basis of few observed frames gives the same cost J as the full normal equations."""
    generator = np.random.default_rng(seed)
    frames, smooth = 30, TrajectoryBasis(20, 5.0)
    observed = np.zeros(frames, dtype=bool)
    observed[generator.choice(frames, seen, replace=False)] = True
    rows = smooth.rows(frames, observed)
    assert rows.shape == (seen, min(seen, 20))
    theta = cosine_basis(frames, 20)[observed]
    c = generator.standard_normal((seen, 3))
    a = np.linalg.solve(theta.T @ theta + np.diag(smooth.ridge), theta.T @ c)
    cost = ((c - theta @ a) ** 2).sum() + (a * (smooth.ridge[:, None] * a)).sum()
    np.testing.assert_allclose(outside(rows, c) ** 2, cost, rtol=1e-6, atol=1e-12)


def close_up(frames: int = 40) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return cameras, pixels, parents and length of a limb that one camera approaches so closely that a candidate is
    behind it.
    """
    generator = np.random.default_rng(8)
    limb = angular_limb(generator, frames, length_mm=500.0, middle=np.array([1.0, 1.0, 0.0]))
    parents = 40.0 * smooth_series(generator, frames, 3, bandwidth=3)
    t = np.linspace(0.0, 1.0, frames)
    distance = np.where((t > 0.4) & (t < 0.6), 300.0, 3000.0)
    centre = parents + np.stack([np.zeros(frames), -distance, np.zeros(frames)], axis=1)
    camera = look_at(centre, parents, focal_px=800.0)
    pixels = camera.project(parents + limb.relative)
    return camera.matrix, pixels, parents, limb.length_mm


def test_forced_frames_take_the_candidate_in_front_of_the_camera() -> None:
    cameras, pixels, parents, length = close_up()
    choice = choose_limb(cameras, pixels, parents, length, basis=TrajectoryBasis(8), time_limit_s=QUICK_S)
    forced = choice.hits.status == RayStatus.FORCED
    assert forced.sum() >= 4
    assert choice.used[forced].all()
    depth = np.einsum("fx,fx->f", cameras[:, 2, :3], parents + choice.relative) + cameras[:, 2, 3]
    assert (depth[choice.used] > 0).all()
    free = (choice.hits.status != RayStatus.TWO) & choice.used
    assert (choice.hits.half_chord[free] == 0).all(), "what is forced has no other candidate left"


def test_frames_whose_candidates_are_behind_the_camera_are_dropped_and_imputed() -> None:
    first = scene(9)
    centre, rotation = first.camera.centre, first.camera.rotation.copy()
    away = look_at(centre, 2.0 * centre - first.root, focal_px=1000.0)
    rotation[40:44] = away.rotation[40:44]
    turned = Pinhole(first.camera.intrinsics, rotation, centre)
    cameras, joint = turned.matrix, WALKER14.joints.index("sternum")
    choice = choose_limb(
        cameras,
        np.nan_to_num(first.images[:, joint]),
        first.root,
        float(first.lengths[WALKER14.limbs.index("sternum")]),
        basis=TrajectoryBasis(10),
        time_limit_s=QUICK_S,
    )
    behind = np.isin(np.arange(60), range(40, 44))
    np.testing.assert_array_equal(choice.hits.status == RayStatus.BEHIND, behind)
    np.testing.assert_array_equal(choice.used, ~behind)
    error = np.linalg.norm(first.root + choice.relative - first.positions[:, joint], axis=1)
    assert error.max() < 2.0


# --- mirrors ----------------------------------------------------------------------------------------------


def parallel_limb(seed: int, frames: int = 50) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return orthographic cameras, pixels and parent positions of a limb, and its true relative trajectory."""
    generator = np.random.default_rng(seed)
    limb = angular_limb(generator, frames, length_mm=300.0, middle=np.array([0.3, 1.0, -0.2]))
    parents = 200.0 * smooth_series(generator, frames, 3, bandwidth=3)
    cameras = parallel(frames, target=parents.mean(axis=0))
    homogeneous = np.concatenate([parents + limb.relative, np.ones((frames, 1))], axis=1)
    pixels = np.einsum("fij,fj->fi", cameras[:, :2], homogeneous)
    return cameras, pixels, parents, limb.relative


@pytest.mark.parametrize("seed", range(4))
def test_with_parallel_rays_a_limb_and_its_mirror_tie_and_it_is_said(seed: int) -> None:
    cameras, pixels, parents, truth = parallel_limb(seed)
    choice = choose_limb(cameras, pixels, parents, 300.0, basis=TrajectoryBasis(14), time_limit_s=QUICK_S)
    assert choice.solution.margin == pytest.approx(1.0, abs=1e-6)
    assert choice.undecided
    mirror = select_signs(choice.hits, choice.solution, choice.used, TrajectoryBasis(14), mirrored=True)
    assert mirror.mirrored
    assert not choice.mirrored
    free = choice.hits.status == RayStatus.TWO
    np.testing.assert_array_equal(mirror.signs[free], -choice.signs[free])
    errors = [np.linalg.norm(first.relative - truth, axis=1).max() for first in (choice, mirror)]
    assert min(errors) < 1e-3, "one of the two is the truth"
    assert max(errors) > 30.0, "and the other is not"


def test_the_mirror_is_there_whatever_the_margin() -> None:
    first = scene(10)
    for choice in first.reconstructed(refine=False).limbs.values():
        assert choice.solution.mirror_signs.shape == (choice.used.sum(),)
        assert choice.solution.mirror_objective >= choice.solution.objective
        assert choice.undecided == (choice.solution.margin < MARGIN_OF_DOUBT)


def test_a_far_still_camera_leaves_every_limb_in_doubt() -> None:
    first = scene(11)
    camera = still(60, target=first.root.mean(axis=0), distance_mm=1e7)
    reconstruction = first.reconstructed(images=camera.project(first.positions), camera=camera, refine=False)
    assert all(choice.undecided for choice in reconstruction.limbs.values())
    assert max(choice.solution.margin for choice in reconstruction.limbs.values()) < 1.5


# --- hinges -----------------------------------------------------------------------------------------------

LEG = Chain(
    ("pelvis", "left_hip", "right_hip", "left_knee", "left_ankle"),
    (None, "pelvis", "pelvis", "left_hip", "left_knee"),
)


def stepping(seed: int, *, chain: Chain = LEG, frames: int = 60) -> Scene:
    """Return a leg that swings and flexes as in walking, seen obliquely from the front by a still camera."""
    generator = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, frames)
    turn = 2 * np.pi * generator.uniform(1.0, 2.0) * t + generator.uniform(0, 2 * np.pi)
    thigh = 0.2 + generator.uniform(0.3, 0.6) * np.sin(turn)
    shank = (
        thigh
        - 0.15
        - generator.uniform(0.3, 1.0) * (0.5 - 0.5 * np.cos(turn + generator.uniform(0, 2 * np.pi)))
    )

    def swung(angle: np.ndarray) -> np.ndarray:
        return np.stack([np.zeros(frames), np.sin(angle), -np.cos(angle)], axis=1)

    walk = [np.zeros(frames), 1000.0 * generator.uniform() * t, 900.0 + 20.0 * np.sin(4 * np.pi * t)]
    limbs = {
        "left_hip": np.tile([-90.0, 0.0, 0.0], (frames, 1)),
        "right_hip": np.tile([90.0, 0.0, 0.0], (frames, 1)),
        "left_knee": 420.0 * swung(thigh),
        "left_ankle": 400.0 * swung(shank),
        "marker": 150.0 * swung(thigh + 1.0),
    }
    relative = np.stack([limbs[limb] for limb in chain.limbs], axis=1)
    positions = forward(chain, np.stack(walk, axis=1), relative)
    camera = still(frames, target=positions[:, 0].mean(axis=0), azimuth_rad=0.5)
    lengths = np.linalg.norm(relative[0], axis=1)
    return Scene(positions, lengths, camera, camera.project(positions), chain)


def right_limbs(one: Scene, found: Articulated, limb: str) -> bool:
    """Return True if the estimate of a limb is not mirrored: its mean error is below a quarter of its length."""
    truth = relative_trajectories(one.chain, one.positions)[:, one.chain.limbs.index(limb)]
    error = np.linalg.norm(found.limbs[limb].relative - truth, axis=1).mean()
    return bool(error < 0.25 * one.lengths[one.chain.limbs.index(limb)])


def test_hinges_find_the_flexing_leg_where_the_programme_alone_cannot() -> None:
    trials = [stepping(seed) for seed in range(24)]
    share = {}
    for use_hinges in (False, True):
        outcome = [first.reconstructed(use_hinges=use_hinges, refine=False) for first in trials]
        share[use_hinges] = {
            limb: np.mean(
                [right_limbs(first, result, limb) for first, result in zip(trials, outcome, strict=True)]
            )
            for limb in ("left_knee", "left_ankle")
        }
    assert share[False]["left_ankle"] <= 0.5, "alone it is no better than the toss of a coin"
    for limb in ("left_knee", "left_ankle"):
        assert share[True][limb] >= 0.8
        assert share[True][limb] > share[False][limb]


def test_what_else_is_carried_by_a_mirrored_limb_goes_with_it() -> None:
    """If a hinge mirrors the thigh, other limbs attached to the knee are reconstructed from the new knee position."""
    chain = Chain((*LEG.joints[:4], "marker", "left_ankle"), (*LEG.parents[:4], "left_knee", "left_knee"))
    moved = 0
    for seed in range(6):
        first = stepping(seed, chain=chain)
        reconstruction = first.reconstructed(use_hinges=True, refine=False)
        moved += reconstruction.limbs["left_knee"].mirrored
        knee, marker = reconstruction.limbs["left_knee"], reconstruction.limbs["marker"]
        hip = reconstruction.chosen[:, chain.joints.index("left_hip")]
        end = hip + 420.0 * knee.directions  # the hips do not move: chosen and smooth are one
        at = reconstruction.chosen[:, chain.joints.index("marker")]
        np.testing.assert_allclose(at - end, marker.relative, atol=1.0)
        observed = first.camera.project(at)
        np.testing.assert_allclose(observed, first.images[:, chain.joints.index("marker")], atol=0.5)
    assert moved > 0


def test_hinges_leave_alone_what_the_images_have_decided() -> None:
    first = scene(12)
    without, within = first.reconstructed(refine=False), first.reconstructed(refine=False, use_hinges=True)
    np.testing.assert_array_equal(within.chosen, without.chosen)
    assert not any(choice.mirrored for choice in within.limbs.values())


# --- refinement -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_refinement_fits_the_images_and_keeps_lengths(seed: int) -> None:
    first = scene(seed, noise_px=0.05)
    reconstruction = first.reconstructed(noise_px=0.05, basis=TrajectoryBasis(6))
    assert reconstruction.refined is not None
    assert reconstruction.refined.converged
    assert reconstruction.refined.reprojection_error_px < 0.5
    assert np.abs(length_errors(WALKER14, reconstruction.positions, first.lengths)).max() < 1e-9
    assert first.errors_mm(reconstruction.chosen).mean() < 10.0
    assert first.errors_mm(reconstruction.positions).mean() < 10.0
    between = reconstruction.refined.relative_at(cosine_basis(60, 6, at=np.arange(0, 59, 0.25)))
    sizes = np.linalg.norm(between, axis=-1) / reconstruction.lengths
    np.testing.assert_allclose(sizes, 1.0, rtol=1e-12, err_msg="between frames as well")


def test_without_refinement_positions_are_what_was_chosen() -> None:
    first = scene(1)
    reconstruction = first.reconstructed(refine=False)
    assert reconstruction.refined is None
    np.testing.assert_array_equal(reconstruction.positions, reconstruction.chosen)


# --- one limb ---------------------------------------------------------------------------------------------


def test_a_limb_of_no_length_stays_at_its_parent() -> None:
    first = scene(3)
    joint = WALKER14.joints.index("pelvis")
    choice = choose_limb(
        first.camera.matrix,
        first.images[:, joint],
        first.root,
        0.0,
        basis=TrajectoryBasis(10),
        time_limit_s=QUICK_S,
    )
    np.testing.assert_array_equal(choice.relative, np.zeros((60, 3)))
    np.testing.assert_array_equal(choice.directions, np.zeros((60, 3)))


def test_the_signs_are_those_of_the_programme() -> None:
    cameras, pixels, parents, length = close_up()
    smooth = TrajectoryBasis(8)
    choice = choose_limb(cameras, pixels, parents, length, basis=smooth, time_limit_s=5.0)
    assert choice.solution.proved
    alone = minimise(
        smooth.rows(len(pixels), choice.used),
        choice.hits.middle[choice.used],
        choice.hits.half_chord[choice.used],
        time_limit_s=5.0,
    )
    assert alone.proved
    np.testing.assert_allclose(alone.objective, choice.solution.objective, rtol=1e-6)


def test_the_ridge_of_a_soft_basis_is_the_sixth_power() -> None:
    assert TrajectoryBasis(4, 2.0).ridge.tolist() == [0.0, 2.0**-6, 1.0, 1.5**6]
    assert TrajectoryBasis(3).ridge.tolist() == [0.0, 0.0, 0.0]


def test_nearly_tangent_rays_are_left_open_within_the_noise() -> None:
    """The depth sign of a limb perpendicular to the ray is left open with noise of 1 px, but not without noise."""
    first = scene(13, noise_px=1.0)
    joint, limb = WALKER14.joints.index("left_hip"), WALKER14.limbs.index("left_hip")
    given_ = (first.camera.matrix, first.images[:, joint], first.root, float(first.lengths[limb]))
    chosen = {
        noise: choose_limb(*given_, basis=TrajectoryBasis(10), noise_px=noise, time_limit_s=QUICK_S)
        for noise in (0.0, 1.0)
    }
    assert (np.abs(chosen[0.0].solution.values) == 1.0).all()
    open_ = np.abs(chosen[1.0].solution.values) < 1.0
    assert open_.any()
    # sqrt(2 r sigma), sigma a pixel at four metres: 4 mm.
    half = np.linalg.norm(chosen[1.0].hits.half_chord[chosen[1.0].used], axis=1)
    bound = np.sqrt(2.0 * first.lengths[limb] * 4.0)
    assert half[open_].max() < 1.2 * bound


# --- rejected input --------------------------------------------------------------------------------------


def _without(joint: str) -> Callable[[Scene], dict[str, Any]]:
    def changed(one: Scene) -> dict[str, Any]:
        images = one.images.copy()
        images[:, WALKER14.joints.index(joint)] = np.nan
        return {"images": images}

    return changed


def _from_behind(one: Scene) -> dict[str, Any]:
    centre = one.camera.centre
    return {"camera": look_at(centre, 2.0 * centre - one.root, focal_px=1000.0)}


def _unknown_camera(one: Scene) -> dict[str, Any]:
    return {
        "camera": Pinhole(one.camera.intrinsics, one.camera.rotation, np.full_like(one.camera.centre, np.nan))
    }


@pytest.mark.parametrize(
    ("change", "rejection"),
    [
        (_without("left_elbow"), rejects("no_ray_hits", "limb left_elbow", missing=60)),
        (_from_behind, rejects("no_ray_hits", "limb sternum", behind=60)),
        (_unknown_camera, rejects("no_ray_hits", "limb sternum", missing=60)),
        (lambda one: {"images": np.full_like(one.images, np.nan)}, rejects("no_ray_hits", "limb sternum")),
        (lambda one: {"root": np.full_like(one.root, np.nan)}, rejects("no_ray_hits", "limb sternum")),
        (
            lambda one: {"lengths": -one.lengths},
            rejects("out_of_range", "limb sternum, radius", value=-501.5),
        ),
        (lambda one: {"lengths": one.lengths / 1000.0}, rejects("rays_miss_limb", "limb sternum")),
        (lambda one: {"camera": one.camera.intrinsics}, rejects("wrong_type", "camera")),
        (
            lambda one: {"basis": TrajectoryBasis(61)},
            rejects("out_of_range", "limb sternum, components", value=61),
        ),
        (lambda one: {"adjust": "never"}, rejects("unknown_choice", "limb sternum, adjust", value="never")),
        (lambda one: {"noise_px": -1.0}, rejects("out_of_range", "limb sternum, noise_px", value=-1.0)),
        (lambda one: {"time_limit_s": np.nan}, rejects("out_of_range", "limb sternum, time_limit_s")),
        (
            lambda one: {"lengths": np.where(np.arange(14) == 2, 0.0, one.lengths)},
            rejects("out_of_range", "length of joint right_hip", value=0.0),
        ),
        (lambda one: {"images": one.images[:, 1:]}, rejects("wrong_shape", "images", shape=(60, 14, 2))),
        (lambda one: {"images": 3.0}, rejects("wrong_shape", "images", shape=())),
        (lambda one: {"images": one.images[:2]}, rejects("out_of_range", "frames", value=2)),
        (lambda one: {"images": one.images[:0]}, rejects("out_of_range", "frames", value=0)),
        (lambda one: {"root": one.root[:50]}, rejects("wrong_shape", "root", shape=(50, 3))),
        (lambda one: {"lengths": one.lengths[:3]}, rejects("wrong_shape", "lengths", shape=(3,))),
        (
            lambda one: {"camera": still(59, target=one.root[0])},
            rejects("frames_disagree", "camera", frames=59),
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(
    change: Callable[[Scene], dict[str, Any]], rejection: AbstractContextManager
) -> None:
    film = scene(14)
    with rejection as refused:
        film.reconstructed(**change(film))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("components", [0, -3])
def test_a_basis_of_no_components_is_refused(components: int) -> None:
    with rejects("out_of_range", "components"):
        TrajectoryBasis(components)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.nan, np.inf])
def test_a_cutoff_that_is_none_is_refused(cutoff: float) -> None:
    with rejects("out_of_range", "cutoff"):
        TrajectoryBasis(20, cutoff)
