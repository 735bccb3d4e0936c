"""Tests that calibrated error bars have the stated coverage, for each group of joints, axis and kind of angle."""

from __future__ import annotations

import numpy as np
import pytest

from walk3d.film.walk.calibration import (
    CYCLE_KIND_OF,
    GROUP_OF,
    KIND_OF,
    LEVELS,
    NORMAL,
    StandardErrors,
    angle_half_widths,
    cycle_half_widths,
    joint_half_widths,
    learn,
)  # fmt: skip


def test_learnt_bars_cover_what_their_level_says() -> None:
    rng = np.random.default_rng(0)
    joints = rng.standard_t(3, size=(4000, 15, 3)) * (1.0 + GROUP_OF[:, None] + 0.3 * np.arange(3))
    angles = rng.standard_t(3, size=(4000, 11)) * (1.0 + KIND_OF)
    numbers = rng.standard_t(3, size=(4000, 25)) * (1.0 + CYCLE_KIND_OF)
    events = [rng.standard_t(3, size=4000), 3.0 * rng.standard_t(3, size=5000)]
    views = rng.standard_t(3, size=(4000, 2)) * (1.0, 3.0)
    clips = [StandardErrors(joints, angles, events, numbers[0], views[0])]
    rest = zip(numbers[1:], views[1:], strict=True)
    clips += [StandardErrors(joints[:0], angles[:0], [np.empty(0)] * 2, z, view) for z, view in rest]
    result = learn(clips)
    sd_mm, sd_rad = rng.uniform(1.0, 9.0, size=(15, 3)), rng.uniform(0.1, 0.9, size=11)
    observed = GROUP_OF >= 0  # the pelvis has no bar
    for number, level in enumerate(LEVELS):
        covered = np.abs(joints * sd_mm) <= joint_half_widths(result, sd_mm, number)
        np.testing.assert_allclose(covered.mean(axis=0)[observed], level, atol=0.03)
        covered = np.abs(angles * sd_rad) <= angle_half_widths(result, sd_rad, number)
        np.testing.assert_allclose(covered.mean(axis=0), level, atol=0.03)
        covered = np.abs(views) <= result.view[:, number] * NORMAL[number]
        np.testing.assert_allclose(covered.mean(axis=0), level, atol=0.03)
        covered = np.abs(numbers) <= cycle_half_widths(result, np.ones(25), number)
        np.testing.assert_allclose(covered.mean(axis=0), level, atol=0.03)
        for z, multiplier in zip(events, result.cycle[:2, number], strict=True):
            assert np.mean(np.abs(z) <= multiplier * NORMAL[number]) == pytest.approx(level, abs=1e-3)


def test_an_event_of_which_nothing_was_learnt_keeps_its_bars() -> None:
    none = np.empty(0)
    result = learn(
        [StandardErrors(np.ones((2, 15, 3)), np.ones((2, 11)), [none, np.ones(3)], np.ones(25), np.ones(2))]
    )
    np.testing.assert_array_equal(result.cycle[0], 1.0)
    assert result.cycle[1, 0] > 1.0
