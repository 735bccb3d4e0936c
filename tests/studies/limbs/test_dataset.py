"""Tests of motion stretches of equal length that are cut from clips of varied motion."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.clips.kinds import VariedClips
from pipeline.clips.options import SyntheticClips
from pipeline.clips.varied import synthetic_clips
from pipeline.skeleton import WALKER15
from pipeline.studies.limbs.dataset import LimbDataset
from tests.rejects import rejects


@pytest.fixture(scope="module")
def clips() -> VariedClips:
    """Three clips at 60 Hz: one of bending with its natural duration, and two of exactly three seconds."""
    return synthetic_clips(SyntheticClips(clips=3, seconds=3.0, frame_rate_hz=60.0), 3)


def test_stretches_are_of_one_length_and_short_clips_are_named(clips: VariedClips) -> None:
    frames = np.diff(clips.first)
    shortest = int(np.argmin(frames))
    length = int(frames[shortest] / 2) + 4
    cut = LimbDataset(frames=length, frame_rate_hz=30.0, stretches=3).build(clips, workers=2)
    assert cut.positions.shape[1:] == (length, 15, 3)
    assert set(cut.clip) < set(clips.clip)
    assert clips.clip[shortest] not in cut.clip
    (remark,) = cut.remarks
    assert f"shorter than {length} frames" in remark
    assert cut.frame_rate_hz == 30.0


def test_lengths_are_those_of_the_limbs(clips: VariedClips) -> None:
    cut = LimbDataset(frames=30, frame_rate_hz=30.0).build(clips, workers=1)
    assert cut.remarks == []
    ends = WALKER15.joints.index("left_knee"), WALKER15.joints.index("left_hip")
    thigh = np.linalg.norm(np.subtract(*(cut.positions[:, :, e] for e in ends)), axis=-1)
    assert np.isclose(cut.lengths_mm, thigh.mean(axis=1)[:, None]).any(axis=1).all()


def test_clips_that_are_all_too_short_are_refused(clips: VariedClips) -> None:
    with rejects("too_short", "dataset.frames", frames=91):
        LimbDataset(frames=5000).build(clips, workers=1)


def test_clips_slower_than_the_stretches_are_told(clips: VariedClips) -> None:
    output = LimbDataset(frames=50, frame_rate_hz=120.0).build(clips, workers=1)
    assert output.remarks == [
        f"3 clips are slower than 120 Hz, so that their stretches last longer (e.g. {clips.clip[0]})"
    ]
    frames = np.diff(clips.first)[list(clips.clip).index(output.clip[-1])]
    assert output.start_s[-1] == (frames - 50) / 60.0
