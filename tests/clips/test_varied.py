"""Tests of clips of varied motion: the longest part of each recording, and the kinds of synthetic clips."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.clips.kinds import VARIED
from pipeline.clips.options import Skeleton, SyntheticClips
from pipeline.clips.varied import synthetic_clips
from pipeline.ingestion.data import FolderData


def test_synthetic_clips_come_in_turn_and_are_long_enough() -> None:
    output = synthetic_clips(SyntheticClips(clips=5, seconds=4.0), 3)
    assert list(output.action) == ["walking", "bending", "smooth angles", "walking", "bending"]
    lengths = np.diff(output.first)
    assert (lengths[[0, 2, 3]] == 121).all()
    assert {row["verdict"] for row in output.report} == {"kept"}
    assert list(synthetic_clips(SyntheticClips(clips=5, limit=1), 3).clip) == ["walking_001"]


def test_a_gap_leaves_the_longest_stretch(bends: Path) -> None:
    output = FolderData(name="folder", path=str(bends)).request(VARIED, Skeleton(), 1, 2).make()
    rows = {row["clip"]: row for row in output.report}
    assert {row["verdict"] for row in rows.values()} == {"kept"}
    broken = rows["a_2.trc"]
    assert (broken["first_frame"], broken["last_frame"]) in ((0, 29), (60, broken["frames"] - 1))
    assert broken["last_frame"] - broken["first_frame"] + 1 >= broken["frames"] - 60 - 30
    assert (
        len(output.motion(list(output.clip).index("a_2.trc")))
        == 1 + broken["last_frame"] - broken["first_frame"]
    )
