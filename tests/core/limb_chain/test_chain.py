"""Tests of kinematic chains: limb vectors and joint positions, any order of joints, limb lengths, and invalid trees."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.limb_chain import WALKER14, Chain, forward, relative_trajectories, true_lengths
from pipeline.skeleton import WALKER15
from pipeline.synthetic.limbs import synthetic_body
from tests.rejects import rejects
from tests.strategies import seeds


def random_chain(generator: np.random.Generator, joints: int) -> Chain:
    """Return a random tree of joints in random order."""
    parents = [None if j == 0 else int(generator.integers(j)) for j in range(joints)]
    order = generator.permutation(joints)
    return Chain(
        tuple(f"joint {j}" for j in order),
        tuple(None if (p := parents[j]) is None else f"joint {p}" for j in order),
    )


# --- the tree ---------------------------------------------------------------------------------------------


def test_the_walkers_chain_has_fourteen_limbs_from_the_pelvis() -> None:
    assert WALKER14.root == "pelvis"
    assert sorted(map(tuple, WALKER14.ends.tolist())) == sorted(WALKER15.bones)
    path = ["left_wrist"]
    while path[-1] != WALKER14.root:
        path.append(WALKER14.held_by(path[-1]))
    assert path == ["left_wrist", "left_elbow", "left_shoulder", "sternum", "pelvis"]
    assert WALKER14.held_by("right_knee") == "right_hip"


@given(seed=seeds, joints=st.integers(1, 12))
def test_every_limb_comes_after_the_one_that_holds_it(seed: int, joints: int) -> None:
    chain = random_chain(np.random.default_rng(seed), joints)
    assert {chain.root, *chain.limbs} == set(chain.joints)
    reached = [chain.root]
    for limb, (parent, child) in zip(chain.limbs, chain.ends, strict=True):
        assert chain.joints[parent] == chain.held_by(limb)
        assert chain.joints[child] == limb
        assert chain.held_by(limb) in reached
        reached.append(limb)


def test_a_limb_that_is_not_there_is_refused() -> None:
    for name in ("tail", "pelvis"):  # the root is no limb
        with rejects("unknown_choice", "limb", value=name):
            WALKER14.held_by(name)


# --- there and back ---------------------------------------------------------------------------------------


@given(seed=seeds, joints=st.integers(1, 12), frames=st.integers(1, 4))
def test_relative_trajectories_and_forward_kinematics_are_inverse(
    seed: int, joints: int, frames: int
) -> None:
    generator = np.random.default_rng(seed)
    chain = random_chain(generator, joints)
    positions = 1000.0 * generator.standard_normal((frames, joints, 3))
    relative = relative_trajectories(chain, positions)
    assert relative.shape == (frames, joints - 1, 3)
    root = positions[:, chain.joints.index(chain.root)]
    np.testing.assert_allclose(forward(chain, root, relative), positions, atol=1e-9)


def test_a_chain_that_can_be_checked_in_the_head() -> None:
    leg = Chain(("ankle", "hip", "knee"), ("knee", None, "hip"))
    relative = np.array([[[0.0, 1, -4], [0, -1, -5]]])  # thigh, shank
    positions = forward(leg, np.array([[1.0, 0, 9]]), relative)
    np.testing.assert_array_equal(positions, [[[1, 0, 0], [1, 0, 9], [1, 1, 5]]])


def test_what_hangs_on_an_unknown_limb_is_unknown_and_nothing_else() -> None:
    body = synthetic_body(np.random.default_rng(0), 6)
    relative = body.relative_mm.copy()
    relative[2, WALKER14.limbs.index("left_shoulder")] = np.nan
    positions = forward(WALKER14, body.root_mm, relative)
    lost = np.isnan(positions).any(axis=2)
    assert [WALKER14.joints[j] for j in np.flatnonzero(lost[2])] == [
        "left_shoulder",
        "left_elbow",
        "left_wrist",
    ]
    assert not np.delete(lost, 2, axis=0).any()


def test_arrays_that_are_not_of_the_chain_are_refused() -> None:
    with rejects("wrong_shape", "positions", shape=(4, 14, 3)):
        relative_trajectories(WALKER14, np.zeros((4, 14, 3)))
    with rejects("wrong_shape", "relative trajectories", shape=(5, 14, 3)):
        forward(WALKER14, np.zeros((4, 3)), np.zeros((5, 14, 3)))


# --- lengths ----------------------------------------------------------------------------------------------


def test_true_lengths_are_means_over_the_frames_that_are_known() -> None:
    body = synthetic_body(np.random.default_rng(1), 30)
    positions = body.positions_mm.copy()
    positions[3:9, 4] = np.nan
    np.testing.assert_allclose(true_lengths(WALKER14, positions), body.lengths_mm, rtol=1e-12)
    pair = Chain(("root", "end"), (None, "root"))
    stretching = np.array([[[0.0, 0, 0], [3, 4, 0]], [[1, 0, 0], [1, 0, 7]]])
    assert true_lengths(pair, stretching).tolist() == [6.0]
    positions[:, 4] = np.nan
    with rejects("unknown_length", limb="left_wrist"):
        true_lengths(WALKER14, positions)
