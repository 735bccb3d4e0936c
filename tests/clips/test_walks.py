"""Tests of steady walks: synthetic walks, and recordings that are used or rejected with a reason."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.figures import _remarks_on
from pipeline.clips.kinds import WALKS, Walks
from pipeline.clips.options import Heading, Locomotion, Skeleton, Steady
from pipeline.clips.usable import PreparedClip, RawClip, refused, report_row
from pipeline.clips.walks import FAR_FREQUENCY, REPORT_COLUMNS, compared, steady_walk, synthetic_walks
from pipeline.core import fourier, walking
from pipeline.formats.points import trc
from pipeline.ingestion.data import FolderData, SyntheticData
from pipeline.skeleton import WALKER15
from pipeline.storage.sealed_folders import canonical
from pipeline.synthetic.walkers import walking_population
from pipeline.validation import InvalidInput


def assert_consistent(walks: Walks) -> None:
    """Assert that arrays, report and motions describe the same walks."""
    retained = [row for row in walks.report if row["verdict"] == "kept"]
    assert [row["clip"] for row in retained] == list(walks.clip)
    assert all(tuple(row) == (*REPORT_COLUMNS, "code", "values") for row in walks.report)
    assert walks.report_columns == list(REPORT_COLUMNS)
    for number in range(len(walks)):
        motion, rate = walks.motion(number), float(walks.frame_rate_hz[number])
        series = fourier.represent(motion, rate)
        assert series.frequency_hz == pytest.approx(walks.frequency_hz[number], rel=1e-4)
        assert series.residual_fraction == pytest.approx(walks.residual_share[number], rel=1e-3)
    assert len(walks.positions) == walks.first[-1]


def test_the_embedded_population_walks_steadily() -> None:
    options = SyntheticData(name="synthetic", walkers=5, duration_s=5.0)
    walks = synthetic_walks(options, 11, 2)
    assert_consistent(walks)
    assert list(walks.clip) == [f"synthetic_{r:03d}" for r in range(1, 6)]
    assert {row["verdict"] for row in walks.report} == {"kept"}
    assert walks.inputs == {}
    first = synthetic_walks(options, 11, 1)
    np.testing.assert_array_equal(first.positions, walks.positions)
    assert not set(synthetic_walks(options, 12, 1).frequency_hz) & set(walks.frequency_hz)


def test_a_recording_is_kept_or_refused_with_its_reason(tmp_path: Path) -> None:
    people = walking_population(
        np.random.default_rng(2), male=2, female=2, duration_s=5.0, frame_rate_hz=60.0
    )
    for n, motion in enumerate(people.positions_mm):
        motion = motion[:60] if n == 3 else motion  # less than a stride and a half
        trc.write(tmp_path / f"p{n}_1.trc", WALKER15.joints, motion, 60.0)
    (tmp_path / "p4_1.trc").write_text("no recording\n")
    data = FolderData(name="folder", path=str(tmp_path), steady=Steady(locomotion=Locomotion.treadmill))
    walks = data.request(WALKS, Skeleton(), 1, 2).make()
    assert isinstance(walks, Walks)
    assert_consistent(walks)
    assert list(walks.person) == ["p0", "p1", "p2"]
    assert set(walks.inputs) == {f"p{n}_1.trc" for n in range(5)}
    rows = {row["clip"]: row for row in walks.report if row["verdict"] == "refused"}
    assert {name: row["code"] for name, row in rows.items()} == {
        "p3_1.trc": "too_short",
        "p4_1.trc": "wrong_format",
    }
    assert all(row["reason"] for row in rows.values())
    assert str(tmp_path) not in str(walks.report)


def test_the_same_points_under_two_names_are_refused_naming_both(tmp_path: Path) -> None:
    people = walking_population(
        np.random.default_rng(2), male=2, female=1, duration_s=5.0, frame_rate_hz=60.0
    )
    for name, motion in zip(("a_1", "b_1", "c_1"), people.positions_mm, strict=True):
        trc.write(tmp_path / f"{name}.trc", WALKER15.joints, motion, 60.0)
    text = (tmp_path / "a_1.trc").read_text(encoding="utf-8")
    (tmp_path / "d_1.trc").write_text(text.replace("a_1", "d_1") + "\n", encoding="utf-8")  # other bytes
    (tmp_path / "b_2.trc").write_bytes((tmp_path / "b_1.trc").read_bytes())  # the same person's
    data = FolderData(name="folder", path=str(tmp_path), steady=Steady(locomotion=Locomotion.treadmill))
    walks = data.request(WALKS, Skeleton(), 1, 1).make()
    assert list(walks.person) == ["b", "b", "c"]
    rows = {row["clip"]: row for row in walks.report if row["verdict"] == "refused"}
    assert {name: (row["code"], row["values"]) for name, row in rows.items()} == {
        "a_1.trc": ("same_points", {"clip": "d_1.trc", "person": "d"}),
        "d_1.trc": ("same_points", {"clip": "a_1.trc", "person": "a"}),
    }


def with_noise(joint: str, noise_mm: float) -> np.ndarray:
    """Return a walk (T, 15, 3), mm, at 60 Hz, with noise on one joint."""
    output = walking_population(
        np.random.default_rng(2), male=1, female=0, duration_s=5.0, frame_rate_hz=60.0
    )
    motion = output.positions_mm[0].copy()
    motion[:, WALKER15.index(joint)] += np.random.default_rng(3).normal(scale=noise_mm, size=(len(motion), 3))
    return motion


def steady(motion: np.ndarray, **options: float) -> PreparedClip:
    return steady_walk(RawClip(report_row(REPORT_COLUMNS, clip="a"), motion, 60.0), Steady(**options))


def bent(motion: np.ndarray, lower_mm: float) -> np.ndarray:
    """Return a walk with the body lowered over bent knees, so that thighs and shanks keep their lengths."""
    crouched = motion.copy()
    hips, knees, ankles = ([9, 12], [10, 13], [11, 14])
    crouched[:, [j for j in range(15) if j not in (*knees, *ankles)], 2] -= lower_mm
    forward = np.cross([0.0, 0.0, 1.0], motion[:, 12] - motion[:, 9])[:, None]
    thigh = np.linalg.norm(motion[:, knees] - motion[:, hips], axis=-1, keepdims=True)
    shank = np.linalg.norm(motion[:, ankles] - motion[:, knees], axis=-1, keepdims=True)
    along = crouched[:, ankles] - crouched[:, hips]
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    along = along / length
    share = (length**2 + thigh**2 - shank**2) / (2.0 * length)
    aside = forward - (forward * along).sum(axis=-1, keepdims=True) * along
    aside /= np.linalg.norm(aside, axis=-1, keepdims=True)
    crouched[:, knees] = crouched[:, hips] + share * along + np.sqrt(thigh**2 - share**2) * aside
    return crouched


def test_a_crouched_walker_stays_with_a_remark_that_gives_the_number() -> None:
    motion = with_noise("head", 0.0)
    assert steady(motion).row["reason"] == ""
    walk = steady(bent(motion, 230.0))
    legs = walk.row["leg_length_mm"]
    assert legs == pytest.approx(walking.leg_length(motion), abs=1e-6)
    height = float(np.median((motion[:, [9, 12], 2] - motion[:, [11, 14], 2]).mean(axis=1))) - 230.0
    assert walk.row["verdict"] == "kept"
    assert f"crouched: the hips are {height:.0f} mm above the ankles" in walk.row["reason"]
    assert f"{height / legs:.2f} of the leg of {legs:.0f} mm" in walk.row["reason"]


@pytest.mark.parametrize(("width_mm", "verdict"), [(339.0, "kept"), (420.0, "refused")])
def test_hips_that_are_markers_on_the_skin_are_remarked_or_refused(width_mm: float, verdict: str) -> None:
    motion = with_noise("head", 0.0)
    across = motion[:, 12] - motion[:, 9]
    reference = np.linalg.norm(across, axis=-1, keepdims=True)
    motion[:, 12] += (width_mm - reference) / reference * across / 2.0
    motion[:, 9] -= (width_mm - reference) / reference * across / 2.0
    row = steady(motion).row
    assert row["verdict"] == verdict
    assert f"left_hip to right_hip: {width_mm:.0f} mm" in row["reason"]
    assert "map them as trochanters (skeleton=trochanters)" in row["reason"]


def test_one_bad_wrist_is_estimated_like_a_missing_one() -> None:
    whole, bad = with_noise("head", 0.0), with_noise("right_wrist", 300.0)
    result = steady(bad)
    assert result.positions is not None
    assert result.row["missing_joints"] == "right_wrist"
    assert "right_wrist is estimated: it had 9" in result.row["reason"]
    hidden = whole.copy()
    hidden[:, WALKER15.index("right_wrist")] = np.nan
    np.testing.assert_array_equal(result.positions, steady(hidden).positions)
    both = bad.copy()
    both[:, WALKER15.index("left_wrist")] += bad[::-1, WALKER15.index("right_wrist")] - whole[::-1, 7]
    assert steady(both).row["missing_joints"] == "left_wrist, right_wrist"


def test_a_bad_ankle_refuses_a_walk_by_name_and_what_takes_it_is_said() -> None:
    result = steady(with_noise("right_ankle", 230.0))
    assert result.positions is None
    reason, code, take = (result.row[name] for name in ("reason", "code", "values"))
    assert re.search(r"9\d% of it at right_ankle", reason) or code == "low_fundamental"
    assert all(option in reason for option in take["take"])
    options = dict(option.removeprefix("data.steady.").split("=") for option in take["take"])
    assert options
    assert set(options) <= {"residual_share", "fundamental_share"}
    assert (
        steady(with_noise("right_ankle", 230.0), **{k: float(v) for k, v in options.items()}).positions
        is not None
    )


@pytest.mark.parametrize("ambiguous", [False, True])
def test_a_frequency_far_from_the_others_is_a_code_of_the_row_whatever_its_sentence_says(
    ambiguous: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = walking_population(
        np.random.default_rng(2), male=3, female=0, duration_s=9.0, frame_rate_hz=60.0
    )
    result = [steady(motion) for motion in output.positions_mm[:2]]
    result.append(
        steady_walk(RawClip(report_row(REPORT_COLUMNS, clip="slow"), output.positions_mm[2], 30.0), Steady())
    )
    assert all(walk.positions is not None for walk in result)
    monkeypatch.setattr("pipeline.clips.walks.MAX_EQUAL_FIT_RATIO", np.inf if ambiguous else 1.5)
    *usual, slow = (walk.row for walk in compared(result, 1.6))
    assert [row["code"] for row in usual] == ["", ""]
    assert (slow["verdict"], slow["code"]) == ("refused" if ambiguous else "kept", FAR_FREQUENCY)
    assert all(option in slow["reason"] for option in slow["values"].get("take", []))
    assert bool(slow["values"].get("take")) == ambiguous


def test_a_run_points_at_clips_far_from_the_others_by_their_code() -> None:
    rows = [
        {"clip": "a", "verdict": "kept", "code": FAR_FREQUENCY, "reason": "strange"},
        {"clip": "b", "verdict": "kept", "code": "", "reason": "slower than the others"},
        {"clip": "c", "verdict": "refused", "code": FAR_FREQUENCY, "reason": "far off"},
    ]
    clips = dataclasses.replace(
        synthetic_walks(SyntheticData(name="s", walkers=3, duration_s=5.0), 1, 1), report=rows
    )
    assert [remark.partition(":")[0] for remark in _remarks_on(clips)] == [
        "a is strange", "1 of 3 clips are rejected; table_ingest.csv has the reasons (e.g. c"
    ]  # fmt: skip


def test_values_that_no_store_keeps_are_left_out_of_the_report() -> None:
    values = {"text": "a", "number": 1.5, "names": ["a"], "nothing": np.nan, "path": Path("a"), "bytes": b"a"}
    row = refused({}, InvalidInput("bad", code="fault", **values)).row
    assert (row["code"], row["values"]) == ("fault", {"text": "a", "number": 1.5, "names": ["a"]})
    canonical(row)


@pytest.mark.parametrize("decimals", [2, 3, 4])
def test_a_walk_just_beyond_a_bound_is_told_apart_from_it(decimals: int) -> None:
    motion = with_noise("right_ankle", 100.0)
    share = steady(motion, residual_share=1.0).row["residual_share"]
    bound = np.floor(share * 10**decimals) / 10**decimals
    reason = steady(motion, residual_share=bound).row["reason"]
    (expected, received) = re.findall(r"expected ([0-9.]+) or less, found ([0-9.]+)", reason)[0]
    assert float(expected) == bound < float(received)


def test_walks_head_where_their_steps_go_or_where_their_path_does() -> None:
    headings = {}
    for heading in Heading:
        walks = synthetic_walks(SyntheticData(name="s", walkers=3, duration_s=5.0, heading=heading), 11, 1)
        headings[heading] = [
            walking.step_heading(fourier.represent(walks.motion(n), 120.0).coefficients) for n in range(3)
        ]
    np.testing.assert_allclose(headings[Heading.steps], 0.0, atol=1e-6)
    assert 0.0 < np.abs(headings[Heading.path]).max() < np.radians(5.0)


@pytest.mark.parametrize("slope", [-0.09, 0.02, 0.05, 0.09, 0.6])
def test_a_ramp_is_taken_out_as_the_path_is_and_stairs_are_refused(slope: float) -> None:
    motion = with_noise("head", 0.0)[:200]
    way = 1.4 * np.arange(len(motion))[:, None] * 1000.0 / 60.0
    motion[..., 1] += way
    floor = steady(motion)
    motion[..., 2] += slope * way
    result = steady(motion)
    if slope > 0.1:
        assert result.positions is None
        assert result.row["code"] == "not_level"
        assert result.row["values"]["rise_mm"] == pytest.approx(slope * float(np.ptp(way)), rel=0.1)
        return
    assert result.positions is not None
    assert floor.positions is not None
    assert ("slope of" in result.row["reason"]) == (abs(slope) > 0.025)
    if abs(slope) > 0.025:
        (percent,) = re.findall(r"a slope of (-?[0-9.]+) %", result.row["reason"])
        assert float(percent) == pytest.approx(100 * slope, abs=0.3)
        moved = result.positions - floor.positions
        assert np.abs(moved - moved.mean(axis=(0, 1))).max() < 10.0
