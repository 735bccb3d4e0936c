"""Tests of joint angles for known poses, and of their independence of position, size and heading."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from walk3d.anatomy.joint_angles import JOINT_ANGLES, angle_errors, flexion, joints_of

HANGING = {
    "pelvis": (0, 0, 900), "sternum": (0, 0, 1300), "head": (0, 0, 1600),
    "left_shoulder": (-200, 0, 1350), "right_shoulder": (200, 0, 1350),
    "left_elbow": (-200, 0, 1050), "right_elbow": (200, 0, 1050),
    "left_wrist": (-200, 0, 800), "right_wrist": (200, 0, 800),
    "left_hip": (-100, 0, 900), "right_hip": (100, 0, 900),
    "left_knee": (-100, 0, 500), "right_knee": (100, 0, 500),
    "left_ankle": (-100, 0, 100), "right_ankle": (100, 0, 100),
}  # fmt: skip


def pose(**moved: tuple[float, float, float]) -> np.ndarray:
    """Return a skeleton (15, 3), mm, that hangs straight down and faces +y, with some joints moved."""
    return np.array([{**HANGING, **moved}[name] for name in WALKER15.joints], dtype=float)


def degrees(positions: np.ndarray) -> dict[str, list[float]]:
    """Return the flexion of the left and the right side, degrees, by the name of the joint angle."""
    return dict(zip(JOINT_ANGLES, np.degrees(flexion(positions)).tolist(), strict=True))


def test_a_skeleton_that_hangs_straight_bends_nothing() -> None:
    assert np.degrees(flexion(pose())) == pytest.approx(np.zeros((4, 2)), abs=1e-9)


def test_known_poses_have_their_angles() -> None:
    lifted = degrees(pose(left_knee=(-100, 400, 900), left_ankle=(-100, 400, 500)))
    assert lifted["hip"] == pytest.approx([90, 0], abs=1e-9), "the left thigh points ahead"
    assert lifted["knee"] == pytest.approx([90, 0], abs=1e-9), "and the shank down"
    behind = degrees(
        pose(right_knee=(100, -200, 900 - 200 * 3**0.5), right_ankle=(100, -400, 900 - 400 * 3**0.5))
    )
    assert behind["hip"] == pytest.approx([0, -30], abs=1e-9), "behind the trunk is negative"
    assert behind["knee"] == pytest.approx([0, 0], abs=1e-6)
    ahead = 150 * 2**0.5
    arms = degrees(pose(right_elbow=(200, ahead, 1350 - ahead), right_wrist=(200, ahead + 250, 1350 - ahead)))
    assert arms["shoulder"] == pytest.approx([0, 45], abs=1e-9)
    assert arms["elbow"] == pytest.approx([0, 45], abs=1e-9)
    bowing = degrees(pose(sternum=(0, 400, 900), left_shoulder=(-200, 450, 900), right_shoulder=(200, 450, 900),
                          left_elbow=(-200, 450, 600), right_elbow=(200, 450, 600),
                          left_wrist=(-200, 450, 350), right_wrist=(200, 450, 350)))  # fmt: skip
    assert bowing["hip"] == pytest.approx([90, 90], abs=1e-9), "against the trunk, which lies ahead"
    assert bowing["shoulder"] == pytest.approx([90, 90], abs=1e-9)
    spread = degrees(pose(left_elbow=(-500, 0, 1350), left_wrist=(-750, 0, 1350)))
    assert spread["elbow"] == pytest.approx([0, 0], abs=1e-9), "sideways: abduction, no flexion of the elbow"


@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi), st.floats(0.01, 100))
def test_place_heading_and_size_change_no_angle(seed: int, turn: float, size: float) -> None:
    rng = np.random.default_rng(seed)
    positions = pose() + rng.normal(0, 60, size=(3, 15, 3))
    cos, sin = np.cos(turn), np.sin(turn)
    rotation = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    moved = size * positions @ rotation.T + rng.normal(0, 1000, size=3)
    assert flexion(moved) == pytest.approx(flexion(positions), abs=1e-7)


@given(st.integers(0, 2**32 - 1))
def test_a_mirror_exchanges_the_sides(seed: int) -> None:
    positions = pose() + np.random.default_rng(seed).normal(0, 60, size=(15, 3))
    swapped = [
        WALKER15.index(name.translate({}) if "_" not in name else
                       name.replace("left", "x").replace("right", "left").replace("x", "right"))
        for name in WALKER15.joints
    ]  # fmt: skip
    mirrored = positions[swapped] * [-1, 1, 1]
    assert flexion(mirrored) == pytest.approx(flexion(positions)[:, ::-1], abs=1e-9)


def test_what_has_no_direction_has_no_angle() -> None:
    alone = flexion(pose(left_wrist=HANGING["left_elbow"]))
    assert np.isnan(alone[JOINT_ANGLES.index("elbow"), 0])
    assert np.isnan(alone).sum() == 1
    with rejects("wrong_shape", "positions", shape=(14, 3)):
        flexion(np.zeros((14, 3)))


def test_an_angle_is_read_from_its_joints_alone() -> None:
    for number, angle in enumerate(JOINT_ANGLES):
        others = np.setdiff1d(np.arange(15), joints_of(angle))
        moved = pose()
        moved[others] += 37.0 * np.arange(1, 1 + 3 * len(others)).reshape(-1, 3)
        assert flexion(moved)[number] == pytest.approx(flexion(pose())[number], abs=1e-9), angle


def test_errors_over_a_cycle_with_and_without_offset() -> None:
    t = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    rmse, offset_free = angle_errors(0.3 + 0.2 * np.sin(t), np.zeros(100))
    assert offset_free == pytest.approx(0.2 / 2**0.5)
    assert rmse**2 == pytest.approx(0.3**2 + offset_free**2)
    around, _ = angle_errors(np.full(4, np.pi - 0.1), np.full(4, -np.pi + 0.1))
    assert around == pytest.approx(0.2), "around the circle"
