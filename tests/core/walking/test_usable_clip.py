"""Units, sizes and gaps of a clip, before walking is looked for in it."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.core import walking
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput
from tests.core.walks import RATE_HZ, overground

# Sizes


def test_stature_counts_from_the_lowest_ankle() -> None:
    positions = np.zeros((100, 15, 3))
    positions[:, WALKER15.index("head"), 2] = 1600.0
    positions[:, WALKER15.index("left_ankle"), 2] = np.where(np.arange(100) < 50, 80.0, 300.0)
    positions[:, WALKER15.index("right_ankle"), 2] = 380.0 - positions[:, WALKER15.index("left_ankle"), 2]
    assert walking.stature(positions) == 1520.0


# Gaps


def test_short_gaps_are_bridged_and_long_ones_are_not() -> None:
    clip = overground(0)
    valid = np.ones(clip.positions.shape[:2], dtype=bool)
    valid[300:310, 4] = False  # 0.10 s
    valid[500:511, 4] = False  # 0.11 s
    valid[700:705, 9] = False
    valid[:6, 2] = False  # nothing before it
    valid[-6:, 2] = False
    holed = np.where(valid[..., None], clip.positions, np.nan)
    bridged = walking.bridge_gaps(holed, valid, RATE_HZ, gap_s=0.1)
    filled, complete = bridged.positions, bridged.whole
    assert bridged.n_filled == 10 + 5
    expected = np.ones(len(valid), dtype=bool)
    expected[500:511] = False
    expected[:6] = expected[-6:] = False
    np.testing.assert_array_equal(complete, expected)
    np.testing.assert_array_equal(
        filled[complete & valid.all(axis=1)], clip.positions[complete & valid.all(axis=1)]
    )
    np.testing.assert_allclose(filled[300:310, 4], clip.positions[300:310, 4], atol=2.0)
    np.testing.assert_allclose(filled[700:705, 9], clip.positions[700:705, 9], atol=1.0)
    assert np.isnan(filled[500:511, 4]).all()
    assert np.isnan(holed[300:310, 4]).all()  # the argument is as it was


@pytest.mark.parametrize(
    ("rate_hz", "gap_s", "frames"), [(100.0, 0.29, 29), (30.0, 0.1, 3), (120.0, 0.1, 12)]
)
def test_a_gap_of_exactly_the_limit_is_bridged(rate_hz: float, gap_s: float, frames: int) -> None:
    positions = np.cumsum(np.ones((80, 2, 3)), axis=0)
    for longer in (0, 1):
        valid = np.ones((80, 2), dtype=bool)
        valid[20 : 20 + frames + longer, 1] = False
        holed = np.where(valid[..., None], positions, np.nan)
        bridged = walking.bridge_gaps(holed, valid, rate_hz, gap_s=gap_s)
        assert bridged.n_filled == (0 if longer else frames)
        assert bridged.whole.all() == (not longer)
        if not longer:
            np.testing.assert_allclose(bridged.positions, positions, rtol=1e-12)


def test_a_joint_seen_in_three_frames_is_left_alone() -> None:
    valid = np.zeros((10, 1), dtype=bool)
    valid[[2, 4, 6]] = True
    positions = np.where(valid[..., None], 1.0, np.nan) * np.ones(3)
    bridged = walking.bridge_gaps(positions, valid, RATE_HZ, gap_s=0.1)
    assert bridged.n_filled == 0
    np.testing.assert_array_equal(bridged.whole, valid[:, 0])


# Sizes and units


def test_sizes_worked_out_in_the_head() -> None:
    positions = np.zeros((4, 15, 3))
    heights = {"head": 1700.0, "hip": 900.0, "knee": 500.0, "ankle": 80.0, "pelvis": 900.0}
    for j, name in enumerate(WALKER15.joints):
        positions[:, j, 2] = heights.get(name.split("_")[-1], 1200.0)
    assert walking.leg_length(positions) == pytest.approx(820.0)
    assert walking.stature(positions) == pytest.approx(1620.0)
    positions[1:, WALKER15.index("left_knee")] = np.nan
    positions[0, WALKER15.index("left_knee"), 0] = 300.0  # 500 + √(300² + 420²) = 500 + 516.1
    assert walking.leg_length(positions) == pytest.approx((1016.14 + 820.0) / 2, abs=0.01)


@pytest.mark.parametrize(
    ("mm_to_unit", "looks"),
    [
        (1e-3, "looks like metres"),
        (0.1, "looks like centimetres"),
        (1 / 25.4, "looks like inches"),
        (1 / 304.8, "looks like feet"),
        (50.0, "unit of length is wrong \\(expected legs of 250 to 1300 mm"),
        (1e-6, "unit of length is wrong \\(expected"),
    ],
)
def test_other_units_are_refused_by_name(mm_to_unit: float, looks: str) -> None:
    positions = overground(0).positions
    walking.require_millimetres(positions)
    with pytest.raises(InvalidInput, match=looks):
        walking.require_millimetres(positions * mm_to_unit)


def test_legs_of_36_are_inches_rather_than_the_centimetres_of_a_small_child() -> None:
    positions = overground(0).positions
    with pytest.raises(InvalidInput, match=r"looks like inches .*received 36 mm"):
        walking.require_millimetres(positions * 36.0 / walking.leg_length(positions))


def test_a_child_who_has_just_learnt_to_walk_has_legs_of_280_mm() -> None:
    positions = overground(0).positions
    walking.require_millimetres(positions * 280.0 / walking.leg_length(positions))


def test_velocities_are_no_positions() -> None:
    clip = overground(0)
    velocity = np.gradient(clip.positions, 1.0 / 100.0, axis=0)
    velocity *= 800.0 / walking.leg_length(velocity)
    with pytest.raises(InvalidInput, match="change their length: velocities, or angles"):
        walking.require_millimetres(velocity)


@pytest.mark.parametrize("hidden", ["left_knee", "right_ankle"])
def test_legs_that_were_never_seen_whole_are_refused(hidden: str) -> None:
    positions = overground(0).positions.copy()
    positions[:, WALKER15.index(hidden)] = np.nan
    with pytest.raises(InvalidInput, match="never seen whole"):
        walking.require_millimetres(positions)


@pytest.mark.parametrize("axis", [0, 1])
def test_joints_of_a_film_have_no_depth(axis: int) -> None:
    positions = overground(0).positions.copy()
    positions[..., axis] = 7.0
    with pytest.raises(InvalidInput, match="all joints lie in one plane"):
        walking.require_millimetres(positions)


@pytest.mark.parametrize("where", [0.2, 0.75, 1.0])
def test_a_marker_of_thigh_or_shank_is_no_knee(where: float) -> None:
    positions = overground(0).positions.copy()
    hip, knee, ankle = (WALKER15.index(f"left_{part}") for part in ("hip", "knee", "ankle"))
    mirror = list(WALKER15.mirror)
    for a, b, c in ((hip, knee, ankle), (mirror[hip], mirror[knee], mirror[ankle])):
        positions[:, b] = (1.0 - where) * positions[:, a] + where * positions[:, c]
    with pytest.raises(InvalidInput, match="are no person's: a marker was taken for a joint"):
        walking.require_millimetres(positions)


_ARM = ["shoulder", "elbow", "wrist"]


@pytest.mark.parametrize(
    "parts", [["ankle"], ["knee"], ["knee", "ankle"], ["hip"], ["wrist"], ["shoulder"], _ARM]
)
def test_points_of_the_other_side_are_refused(parts: list[str]) -> None:
    positions = overground(0).positions.copy()
    positions[:3, WALKER15.index("left_elbow")] = np.nan
    pairs = [[WALKER15.index(f"{side}_{part}") for side in ("left", "right")] for part in parts]
    for left, right in pairs:
        positions[:, [left, right]] = positions[:, [right, left]]
    with pytest.raises(InvalidInput, match="left and right are exchanged in the names of points"):
        walking.require_millimetres(positions)


def test_legs_that_scissor_and_shanks_that_cross_are_not_exchanged() -> None:
    walk = overground(0).positions
    hips, knees, ankles = (
        [WALKER15.index(f"{side}_{part}") for side in ("left", "right")] for part in ("hip", "knee", "ankle")
    )
    inwards = np.diff(walk[:, hips], axis=1) * [[1.0], [-1.0]]
    scissoring = walk.copy()
    scissoring[:, knees] += 0.6 * inwards
    scissoring[:, ankles] += 0.6 * inwards
    walking.require_millimetres(scissoring)
    sitting = np.repeat(walk[:1], 100, axis=0)
    sitting[:, ankles] += 0.9 * inwards[:1]
    walking.require_millimetres(sitting)
    walking.require_millimetres(sitting + np.random.default_rng(1).normal(size=sitting.shape))


def test_no_size_at_all_is_refused() -> None:
    with pytest.raises(InvalidInput, match="unit of length is wrong"):
        walking.require_millimetres(np.zeros((9, 15, 3)))


def test_a_limb_that_is_longer_than_its_twin_by_more_than_a_tenth_is_remarked() -> None:
    clip = overground(2).positions.copy()
    assert walking.uneven_legs(clip) == []
    hip, knee, ankle = (WALKER15.index(f"left_{part}") for part in ("hip", "knee", "ankle"))
    clip[:, ankle] = clip[:, knee] + 1.2 * (clip[:, ankle] - clip[:, knee])
    clip[:5, ankle] = np.nan
    (told,) = walking.uneven_legs(clip)
    assert told.startswith("The left shank is")
    clip[:, knee] = clip[:, hip] + 0.85 * (clip[:, knee] - clip[:, hip])
    assert [sentence.split()[2] for sentence in walking.uneven_legs(clip)] == ["thigh", "shank"]
    clip[:, knee] = np.nan
    assert walking.uneven_legs(clip) == []


def test_a_length_just_beyond_the_bound_does_not_print_alike() -> None:
    clip = overground(2).positions.copy()
    clip *= 1300.4 / walking.leg_length(clip)
    with pytest.raises(InvalidInput, match=r"expected legs of 250 to 1300 mm, received 1300\.4 mm"):
        walking.require_millimetres(clip)
