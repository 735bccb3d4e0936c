"""Performances and clips of varied motion: what is cut, what is refused and why, who takes turns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.__main__ import compose
from pipeline.clips import corpus, performances, varied
from pipeline.clips.corpus import Clip, clips_of, in_turn, require
from pipeline.core import fourier
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15, SourceMapping
from pipeline.stages import dataset, ingest
from pipeline.storage.store import Store
from pipeline.studies.options import (
    FolderData,
    LimbDataset,
    PostureDataset,
    RecordedData,
    RecordedPerformances,
    Steady,
    SyntheticClips,
    SyntheticPerformances,
)
from pipeline.synthetic import bending
from pipeline.synthetic.walkers import walking_population
from pipeline.validation import InvalidInput

OWN_JOINTS = SourceMapping(name="walker15", up="z", joints={j: {j: 1.0} for j in WALKER15.joints})


def clip(name: str, person: str, path: Path | None = None) -> Clip:
    return Clip(name, person, "folder", "", path, "", OWN_JOINTS, 0.0, "")


def test_listed_recordings_are_read_once_and_the_absent_ones_come_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = tmp_path / "raw"
    raw.mkdir()
    trials = ["gone_b", "second", "gone_a", "first"]
    rows = ["path,source,subject,trial,action,frame_rate_hz,skeleton,bytes"]
    for trial in trials:
        rows.append(f"{trial}.trc,here,{trial},{trial},walk,60,walker15,{len(trial)}")
        if not trial.startswith("gone"):
            (raw / f"{trial}.trc").write_text(trial)
    table = tmp_path / "sources.csv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    options = RecordedData(
        name="recorded",
        sources=["here"],
        table=str(table),
        raw=str(raw),
        skeletons={"walker15": OWN_JOINTS},
        performances=RecordedPerformances(sources=["here"], action="walk", limit=1),
    )
    read: list[str] = []
    digest = corpus._digest

    def noted(path: Path) -> str:
        read.append(path.stem)
        return digest(path)

    monkeypatch.setattr(corpus, "_digest", noted)
    found = clips_of(options, OWN_JOINTS, "walks")
    assert [(c.name, c.path is None) for c in found] == [
        ("first", False), ("second", False), ("gone_b", True), ("gone_a", True)
    ]  # fmt: skip
    assert sorted(read) == ["first", "second"]
    limited = clips_of(options, OWN_JOINTS, "performances")
    assert [c.name for c in limited] == ["first", "gone_b", "gone_a"], "a limit counts those that are here"


@given(st.lists(st.sampled_from("abc"), max_size=12), st.integers(0, 14))
def test_people_take_turns_until_the_limit(people: list[str], limit: int) -> None:
    clips = [clip(str(n), who) for n, who in enumerate(people)]
    chosen = in_turn(clips, limit)
    assert [c.name for c in chosen] == [c.name for c in clips if c in chosen], "in the order given"
    assert len(chosen) == (min(limit, len(clips)) if limit else len(clips))
    counts = [sum(c.person == who for c in chosen) for who in set(people)]
    have = [people.count(who) for who in set(people)]
    for mine, all_mine in zip(counts, have, strict=True):
        assert mine == all_mine or mine >= max(counts) - 1, "nobody waits while another goes twice"


@pytest.mark.parametrize(
    ("data", "purpose", "words"),
    [("hdm05", "walks", "holds no walks"), ("hdm05", "clips", "holds no varied motion")],
)
def test_a_data_set_without_a_corpus_is_refused_by_name(data: str, purpose: str, words: str) -> None:
    options = compose(["experiment=zhang2007_fig2", f"data={data}"]).data
    with pytest.raises(InvalidInput, match=f"the data set {data} {words}"):
        require(options, purpose)
    require(options, "performances")
    require(compose(["experiment=zhang2007_fig2"]).data, purpose)


def test_synthetic_performances_carry_their_truth() -> None:
    options = SyntheticPerformances(performances=7, subjects=3, frames_mean=60.0)
    arrays, notes = performances.synthetic_performances(options, 11)
    assert len(arrays["first"]) == 8
    assert len(set(arrays["person"])) == 3
    assert len(arrays["phase"]) == len(arrays["positions"]) == arrays["first"][-1]
    for a, b in zip(arrays["first"][:-1], arrays["first"][1:], strict=True):
        phase = arrays["phase"][a:b]
        assert (np.diff(phase) > 0).all()
        assert phase[0] == pytest.approx(0.0, abs=1e-9)
        assert phase[-1] == pytest.approx(1.0, abs=1e-9)
    assert [row["verdict"] for row in notes["report"]] == ["kept"] * 7
    fewer, _ = performances.synthetic_performances(SyntheticPerformances(limit=3), 11)
    assert len(fewer["first"]) == 4
    other, _ = performances.synthetic_performances(options, 12)
    assert not np.array_equal(other["positions"][:5], arrays["positions"][:5])


@pytest.fixture(scope="module")
def bends(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four performances as files, at 60 Hz; one has lost the head in its middle, another its first frames."""
    folder = tmp_path_factory.mktemp("bends")
    made = bending.bending_performances(
        np.random.default_rng(5), performances=4, subjects=2, frames_mean=90, frame_rate_hz=60.0
    )
    for n, motion in enumerate(made.positions_mm):
        motion = motion.copy()
        if n == 2:
            motion[30:60, 0] = np.nan
        if n == 3:
            motion[:20, 4] = np.nan
        trc.write(folder / f"{'ab'[n % 2]}_{n}.trc", WALKER15.joints, motion, 60.0)
    return folder


def folder_data(folder: Path, **options: Any) -> FolderData:
    return FolderData(name="folder", path=str(folder), **options)


def test_a_clip_is_a_performance_unless_joints_are_missing_in_its_middle(bends: Path, tmp_path: Path) -> None:
    store = Store(tmp_path)
    made = ingest.run(folder_data(bends), OWN_JOINTS, 1, 2, store, purpose="performances")
    rows = {row["clip"]: row for row in made.notes["report"]}
    assert rows["a_2.trc"]["verdict"] == "refused"
    assert "missing for too long" in rows["a_2.trc"]["reason"]
    assert "frame 30" in rows["a_2.trc"]["reason"]
    assert rows["b_3.trc"]["first_frame"] == 20
    assert list(made.arrays["clip"]) == ["a_0.trc", "b_1.trc", "b_3.trc"]
    postures = dataset.run(PostureDataset(frame_rate_hz=30.0), made, 2, store)
    frames = np.diff(made.arrays["first"])
    np.testing.assert_allclose(np.diff(postures.arrays["first"]), (frames - 1) / 2 + 1, atol=0.51)
    assert set(postures.arrays["frame_rate_hz"]) == {30.0}
    # Ends are kept: the first and last posture are those of the recording.
    np.testing.assert_allclose(
        postures.arrays["positions"][[0, -1]], made.arrays["positions"][[0, -1]], atol=1e-9
    )


def test_too_few_performances_are_refused_with_the_reasons(bends: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"too few performances.*1 of 2.*missing for too long"):
        ingest.run(
            folder_data(bends, pattern="a_*"), OWN_JOINTS, 1, 2, Store(tmp_path), purpose="performances"
        )


def test_an_unknown_cut_is_refused(bends: Path, tmp_path: Path) -> None:
    options = folder_data(bends, performances=RecordedPerformances(cut="halves"))
    with pytest.raises(InvalidInput, match=r"data.performances.cut.*whole or cycles.*halves"):
        ingest.run(options, OWN_JOINTS, 1, 2, Store(tmp_path), purpose="performances")


def test_the_middle_cycle_of_a_walk_begins_and_ends_at_phase_zero(tmp_path: Path) -> None:
    people = walking_population(
        np.random.default_rng(2), male=2, female=2, duration_s=6.0, frame_rate_hz=100.0, marker_noise_mm=0.0
    )
    for n, motion in enumerate(people.positions_mm):
        trc.write(tmp_path / f"p{n}_1.trc", WALKER15.joints, motion, 100.0)
    options = folder_data(
        tmp_path,
        performances=RecordedPerformances(cut="cycles"),
        steady=Steady(locomotion="treadmill"),
    )
    made = ingest.run(options, OWN_JOINTS, 1, 2, Store(tmp_path / "store"), purpose="performances")
    assert len(made.arrays["clip"]) == 4
    for n, (a, b) in enumerate(zip(made.arrays["first"][:-1], made.arrays["first"][1:], strict=True)):
        cycle = made.arrays["positions"][a:b]
        whole = fourier.represent(people.positions_mm[n], 100.0)
        assert b - a == round(100.0 / whole.frequency_hz) + 1
        # The fundamental of left minus right ankle along the walk rises through zero at both ends.
        ankles = (cycle[:, 11, 1] - cycle[:, 14, 1])[:-1]
        turn = np.exp(-2j * np.pi * np.arange(len(ankles)) / len(ankles))
        phase = np.angle((ankles * turn).sum() * 1j)
        assert abs(phase) < 0.1
        assert np.linalg.norm(cycle[0] - cycle[-1], axis=-1).mean() < 30.0, "a cycle closes, nearly"


def test_synthetic_clips_come_in_turn_and_are_long_enough() -> None:
    arrays, notes = varied.synthetic_clips(SyntheticClips(clips=5, seconds=4.0), 3)
    assert list(arrays["action"]) == ["walking", "bending", "smooth angles", "walking", "bending"]
    lengths = np.diff(arrays["first"])
    assert (lengths[[0, 2, 3]] == 121).all()
    assert {row["verdict"] for row in notes["report"]} == {"kept"}
    one, _ = varied.synthetic_clips(SyntheticClips(clips=5, limit=1), 3)
    assert list(one["clip"]) == ["walking_001"]


def test_stretches_are_of_one_length_and_short_clips_are_named(bends: Path, tmp_path: Path) -> None:
    store = Store(tmp_path)
    made = ingest.run(folder_data(bends), OWN_JOINTS, 1, 2, store, purpose="clips")
    frames = np.diff(made.arrays["first"])
    shortest = int(np.sort(frames)[0] / 2) + 4
    cut = dataset.run(LimbDataset(frames=shortest, frame_rate_hz=30.0, stretches=3), made, 2, store)
    assert cut.arrays["positions"].shape[1:] == (shortest, 15, 3)
    assert len(cut.notes["remarks"]) == 1
    assert "shorter than" in cut.notes["remarks"][0]
    ends = WALKER15.joints.index("left_knee"), WALKER15.joints.index("left_hip")
    thigh = np.linalg.norm(np.subtract(*(cut.arrays["positions"][:, :, e] for e in ends)), axis=-1)
    assert np.isclose(cut.arrays["lengths_mm"], thigh.mean(axis=1)[:, None]).any(axis=1).all()
    with pytest.raises(InvalidInput, match="no clip is long enough"):
        dataset.run(LimbDataset(frames=5000), made, 2, store)


def test_a_gap_leaves_the_longest_stretch(bends: Path, tmp_path: Path) -> None:
    made = ingest.run(folder_data(bends), OWN_JOINTS, 1, 2, Store(tmp_path), purpose="clips")
    rows = {row["clip"]: row for row in made.notes["report"]}
    broken = rows["a_2.trc"]
    assert (broken["first_frame"], broken["last_frame"]) in ((0, 29), (60, broken["frames"] - 1))
    assert broken["last_frame"] - broken["first_frame"] + 1 >= broken["frames"] - 60 - 30


@pytest.mark.parametrize(("data", "count", "people"), [("hdm05", 32, 5), ("hdm05_squat", 52, 5)])
def test_the_recorded_actions_are_read_whole(
    data: str, count: int, people: int, mocap_mirror: Path, tmp_path: Path
) -> None:
    options = compose(["experiment=zhang2007_fig2", f"data={data}", f"data.mirror={mocap_mirror}"]).data
    made = ingest.run(options, OWN_JOINTS, 1, 2, Store(tmp_path), purpose="performances")
    assert len(made.arrays["clip"]) == count
    assert len(set(made.arrays["person"])) == people
    assert set(made.arrays["frame_rate_hz"]) == {120.0}
