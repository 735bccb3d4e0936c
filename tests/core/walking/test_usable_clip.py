"""Tests of gap filling in a clip."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.core import walking
from pipeline.skeleton import WALKER15
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
