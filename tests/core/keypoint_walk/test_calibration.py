"""Bars whose multipliers were learnt cover what their level says, in every group, axis and kind of angle."""

from __future__ import annotations

import numpy as np

from pipeline.core.keypoint_walk.calibration import (
    GROUP_OF,
    KIND_OF,
    LEVELS,
    angle_half_widths,
    joint_half_widths,
    learn,
)  # fmt: skip


def test_learnt_bars_cover_what_their_level_says() -> None:
    rng = np.random.default_rng(0)
    joints = rng.standard_t(3, size=(4000, 15, 3)) * (1.0 + GROUP_OF[:, None] + 0.3 * np.arange(3))
    angles = rng.standard_t(3, size=(4000, 8)) * (1.0 + KIND_OF)
    found = learn(joints, angles)
    sd_mm, sd_rad = rng.uniform(1.0, 9.0, size=(15, 3)), rng.uniform(0.1, 0.9, size=8)
    seen = GROUP_OF >= 0  # the pelvis has no bar
    for number, level in enumerate(LEVELS):
        covered = np.abs(joints * sd_mm) <= joint_half_widths(found, sd_mm, number)
        np.testing.assert_allclose(covered.mean(axis=0)[seen], level, atol=0.03)
        covered = np.abs(angles * sd_rad) <= angle_half_widths(found, sd_rad, number)
        np.testing.assert_allclose(covered.mean(axis=0), level, atol=0.03)
