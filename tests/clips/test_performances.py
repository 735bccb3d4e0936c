"""Tests of performances of one action: cuts, rejected recordings and their reasons."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.clips.kinds import PERFORMANCES, Performances
from pipeline.clips.options import Locomotion, Skeleton, Steady, SyntheticPerformances
from pipeline.clips.performances import synthetic_performances, whole_clip
from pipeline.clips.usable import NoUsableClips, PreparedClip, RawClip
from pipeline.clips.varied import longest_stretch
from pipeline.core import fourier
from pipeline.formats.points import trc
from pipeline.ingestion.data import Cut, FolderData, RecordedPerformances
from pipeline.skeleton import WALKER15
from pipeline.synthetic.walkers import walking_population
from tests.rejects import rejects


def performances(folder: Path, **options: Any) -> Performances:
    """Return the performances in a folder of files."""
    data = FolderData(name="folder", path=str(folder), **options)
    output = data.request(PERFORMANCES, Skeleton(), 1, 2).make()
    assert isinstance(output, Performances)
    return output


def test_synthetic_performances_carry_their_truth() -> None:
    options = SyntheticPerformances(performances=7, subjects=3, frames_mean=60.0)
    output = synthetic_performances(options, 11)
    assert output.phase is not None
    assert len(output) == 7
    assert len(set(output.person)) == 3
    assert len(output.phase) == len(output.positions) == output.first[-1]
    for a, b in zip(output.first[:-1], output.first[1:], strict=True):
        phase = output.phase[a:b]
        assert (np.diff(phase) > 0).all()
        assert phase[0] == pytest.approx(0.0, abs=1e-9)
        assert phase[-1] == pytest.approx(1.0, abs=1e-9)
    assert [row["verdict"] for row in output.report] == ["kept"] * 7
    assert len(synthetic_performances(SyntheticPerformances(limit=3), 11)) == 3
    other = synthetic_performances(options, 12)
    assert not np.array_equal(other.positions[:5], output.positions[:5])


def test_a_clip_is_a_performance_unless_joints_are_missing_in_its_middle(bends: Path) -> None:
    output = performances(bends)
    rows = {row["clip"]: row for row in output.report}
    assert rows["a_2.trc"]["verdict"] == "refused"
    assert (rows["a_2.trc"]["code"], rows["a_2.trc"]["values"]) == ("long_gap", {"frame": 30})
    assert "frame 30" in rows["a_2.trc"]["reason"]
    assert rows["b_3.trc"]["first_frame"] == 20
    assert list(output.clip) == ["a_0.trc", "b_1.trc", "b_3.trc"]
    assert output.phase is None, "the true course of a recording is unknown"


def test_a_clip_without_time_for_key_frames_is_refused() -> None:
    moving = synthetic_performances(SyntheticPerformances(performances=3), 1).motion(0)
    row = whole_clip(RawClip({"clip": "a"}, moving[:20], 120.0)).row
    assert (row["code"], row["values"]) == ("too_short", {"needed": 30, "frames": 20})


def test_too_few_performances_are_refused_with_the_reasons(bends: Path) -> None:
    with rejects("too_few_clips", needed=3, count=1) as caught:
        performances(bends, pattern="a_*")
    assert isinstance(caught.value, NoUsableClips)
    reason = next(row["reason"] for row in caught.value.report if row["code"] == "long_gap")
    assert reason in str(caught.value)


@pytest.mark.parametrize("select", [whole_clip, longest_stretch])
def test_where_nobody_moves_or_the_pelvis_jumps_there_is_no_action(
    select: Callable[..., PreparedClip],
) -> None:
    moving = synthetic_performances(SyntheticPerformances(performances=3), 1).motion(0)
    lost = moving.copy()
    lost[40:, :, 2] += 900.0
    still = np.repeat(moving[:1], 60, axis=0)
    retained, *refused = (
        select(RawClip({"clip": "a"}, motion, 30.0)).row for motion in (moving, still, lost)
    )
    assert retained["verdict"] == "kept"
    assert [row["code"] for row in refused] == ["nobody_moves", "pelvis_jumps"]
    assert "frame 39" in refused[1]["reason"]


def test_the_middle_cycle_of_a_walk_begins_and_ends_at_phase_zero(tmp_path: Path) -> None:
    people = walking_population(
        np.random.default_rng(2), male=2, female=2, duration_s=6.0, frame_rate_hz=100.0, marker_noise_mm=0.0
    )
    for n, motion in enumerate(people.positions_mm):
        trc.write(tmp_path / f"p{n}_1.trc", WALKER15.joints, motion, 100.0)
    output = performances(
        tmp_path,
        performances=RecordedPerformances(cut=Cut.cycles),
        steady=Steady(locomotion=Locomotion.treadmill),
    )
    assert len(output) == 4
    for n in range(4):
        cycle = output.motion(n)
        whole = fourier.represent(people.positions_mm[n], 100.0)
        assert len(cycle) == round(100.0 / whole.frequency_hz) + 1
        # The fundamental of left minus right ankle along the walk rises through zero at both ends.
        ankles = (cycle[:, 11, 1] - cycle[:, 14, 1])[:-1]
        turn = np.exp(-2j * np.pi * np.arange(len(ankles)) / len(ankles))
        phase = np.angle((ankles * turn).sum() * 1j)
        assert abs(phase) < 0.1
        assert np.linalg.norm(cycle[0] - cycle[-1], axis=-1).mean() < 30.0, "a cycle closes, nearly"
