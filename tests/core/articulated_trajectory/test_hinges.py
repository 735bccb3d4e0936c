"""Tests of hinges: flexion of knees and elbows in any coordinate system, and the chains that have hinges."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.core.articulated_trajectory.hinges import HINGES, _cost_ratio, flexion, wrong_share
from pipeline.core.articulated_trajectory.limb_choice import LimbChoice
from pipeline.core.limb_chain import WALKER14, Chain
from pipeline.skeleton import WALKER15
from pipeline.synthetic.walkers import walking_population
from tests.strategies import seeds

DOWN, BACK, AHEAD, RIGHT = (
    np.array([vector], dtype=float) for vector in ((0, 0, -1), (0, -1, 0), (0, 1, 0), (1, 0, 0))
)
KNEE, ELBOW = -1.0, 1.0


def test_a_knee_flexes_backwards_and_an_elbow_forwards() -> None:
    assert flexion(DOWN, BACK, RIGHT, KNEE).tolist() == [1.0]
    assert flexion(DOWN, AHEAD, RIGHT, KNEE).tolist() == [-1.0]
    assert flexion(DOWN, AHEAD, RIGHT, ELBOW).tolist() == [1.0]
    assert flexion(DOWN, BACK, RIGHT, ELBOW).tolist() == [-1.0]


def test_a_straight_limb_does_not_flex() -> None:
    assert flexion(DOWN, 7.0 * DOWN, RIGHT, KNEE).tolist() == [0.0]


def test_the_size_is_the_sine_of_the_angle() -> None:
    angles = np.radians([0.0, 10.0, 30.0, 90.0, 150.0])
    shanks = np.stack([np.zeros(5), -np.sin(angles), -np.cos(angles)], axis=1)
    upper, axis = np.repeat(DOWN, 5, axis=0), np.repeat(RIGHT, 5, axis=0)
    np.testing.assert_allclose(flexion(upper, shanks, axis, KNEE), np.sin(angles), atol=1e-15)


@given(seed=seeds, frames=st.integers(1, 20))
def test_flexion_turns_with_the_world_and_forgets_lengths(seed: int, frames: int) -> None:
    generator = np.random.default_rng(seed)
    upper, lower, axis = generator.standard_normal((3, frames, 3))
    start = flexion(upper, lower, axis, KNEE)
    assert (np.abs(start) <= 1.0 + 1e-12).all()
    turn = Rotation.random(random_state=seed).as_matrix()
    sizes = generator.uniform(0.1, 1000.0, (3, frames, 1))
    moved = sizes * np.stack([upper, lower, axis]) @ turn.T
    end = flexion(moved[0], moved[1], moved[2], KNEE)
    np.testing.assert_allclose(end, start, atol=1e-12)
    np.testing.assert_allclose(flexion(upper, lower, -axis, KNEE), -start, atol=1e-15)
    np.testing.assert_allclose(flexion(upper, lower, axis, ELBOW), -start, atol=1e-15)


@given(seed=seeds)
def test_a_mirror_in_depth_flexes_the_other_way(seed: int) -> None:
    """The mirror image of two limbs in the image plane, which a still camera cannot exclude, flexes in the opposite
    direction.
    """
    generator = np.random.default_rng(seed)
    upper, lower = generator.standard_normal((2, 10, 3))
    across = np.repeat(RIGHT, 10, axis=0)
    mirror = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(
        flexion(upper * mirror, lower * mirror, across, KNEE),
        -flexion(upper, lower, across, KNEE),
        atol=1e-15,
    )


def test_synthetic_walkers_flex_their_knees_and_elbows_the_right_way() -> None:
    """Knees and elbows of synthetic walkers flex in the right direction in nearly every frame."""
    people = walking_population(np.random.default_rng(4), male=2, female=2, duration_s=2.0)
    for joints in people.positions_mm:
        at = {name: joints[:, WALKER15.index(name)] for name in WALKER15.joints}
        for hinge in HINGES:
            upper = at[hinge.upper] - at[WALKER14.held_by(hinge.upper)]
            lower = at[hinge.lower] - at[hinge.upper]
            bend = flexion(upper, lower, at[hinge.right] - at[hinge.left], hinge.sense)
            assert wrong_share(bend) < 0.05, hinge.lower


# --- how much is wrong ------------------------------------------------------------------------------------


def test_the_share_counts_how_far_and_not_how_often() -> None:
    assert wrong_share(np.array([0.3, 0.3, -0.2])) == pytest.approx(0.25)
    assert wrong_share(np.array([1.0, 0.5])) == 0.0
    assert wrong_share(np.array([-0.1])) == 1.0


def test_frames_that_are_not_known_do_not_count() -> None:
    assert wrong_share(np.array([np.nan, 0.75, -0.25])) == pytest.approx(0.25)


@pytest.mark.parametrize("bend", [[], [np.nan, np.nan], [0.0, 0.0]])
def test_without_any_flexion_it_is_the_toss_of_a_coin(bend: list[float]) -> None:
    assert wrong_share(np.array(bend)) == 0.5


@given(seed=seeds)
def test_a_mirror_is_wrong_where_the_limb_is_right(seed: int) -> None:
    bend = np.random.default_rng(seed).uniform(-1, 1, 30)
    assert wrong_share(bend) + wrong_share(-bend) == pytest.approx(1.0)


# --- which chains have them -------------------------------------------------------------------------------


def test_the_walkers_chain_has_all_four() -> None:
    assert [hinge.fits(WALKER14) for hinge in HINGES] == [True] * 4
    assert {hinge.lower for hinge in HINGES} == {"left_ankle", "right_ankle", "left_wrist", "right_wrist"}


def test_a_chain_without_the_joints_of_the_axis_has_none() -> None:
    leg = Chain(("left_hip", "left_knee", "left_ankle"), (None, "left_hip", "left_knee"))
    assert not any(hinge.fits(leg) for hinge in HINGES)


def test_a_chain_from_the_foot_upwards_has_none_in_that_leg() -> None:
    joints = ("left_ankle", "left_knee", "left_hip", "right_hip", "right_knee", "right_ankle")
    chain = Chain(joints, (None, "left_ankle", "left_knee", "left_hip", "right_hip", "right_knee"))
    assert [hinge.lower for hinge in HINGES if hinge.fits(chain)] == ["right_ankle"]


def test_a_knee_that_is_the_root_is_no_limb_and_no_hinge() -> None:
    joints = ("left_knee", "left_ankle", "left_hip", "right_hip")
    chain = Chain(joints, (None, "left_knee", "left_knee", "left_hip"))
    assert not any(hinge.fits(chain) for hinge in HINGES)


@pytest.mark.parametrize(("mirrored", "ratio"), [(False, 1.0), (True, 3.5)])
def test_a_mirror_costs_its_margin(mirrored: bool, ratio: float) -> None:
    choice = SimpleNamespace(mirrored=mirrored, solution=SimpleNamespace(margin=3.5))
    assert _cost_ratio(cast(LimbChoice, choice)) == ratio
