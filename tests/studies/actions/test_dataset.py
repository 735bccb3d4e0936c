"""Tests of posture sequences: a performance is resampled from its first to its last frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.clips.options import SyntheticPerformances
from pipeline.clips.performances import synthetic_performances
from pipeline.studies.actions.dataset import PostureDataset

QUICK_ONES = SyntheticPerformances(performances=3, subjects=2, frames_mean=90.0, frame_rate_hz=60.0)


def test_faster_recordings_are_resampled_and_their_ends_are_kept() -> None:
    clips = synthetic_performances(QUICK_ONES, 5)
    assert clips.phase is not None
    output = PostureDataset(frame_rate_hz=30.0).build(clips, workers=2)
    np.testing.assert_allclose(np.diff(output.first), (np.diff(clips.first) - 1) / 2 + 1, atol=0.51)
    assert set(output.frame_rate_hz) == {30.0}
    np.testing.assert_allclose(output.positions[[0, -1]], clips.positions[[0, -1]], atol=1e-9)
    assert output.phase is not None
    np.testing.assert_allclose(output.phase[[0, -1]], clips.phase[[0, -1]], atol=1e-9)


def test_slower_recordings_and_a_rate_of_zero_stay_as_they_are() -> None:
    clips = replace(synthetic_performances(QUICK_ONES, 5), phase=None, moving_phase=None)
    for rate_hz in (0.0, 60.0, 100.0):
        output = PostureDataset(frame_rate_hz=rate_hz).build(clips, workers=1)
        np.testing.assert_array_equal(output.first, clips.first)
        np.testing.assert_allclose(output.positions, clips.positions, atol=1e-9)
        assert set(output.frame_rate_hz) == {60.0}
