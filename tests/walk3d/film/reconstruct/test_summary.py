"""Tests that the numbers in the summary are those of the simulated walk, with their units and error bars."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, given, in_layout
from tests.walk3d.film.walk.walkers import clip, walks
from walk3d.anatomy.prior import stance_rows
from walk3d.film.reconstruct import cycle, words
from walk3d.film.reconstruct.clip import Walk, reconstruct_clip
from walk3d.film.reconstruct.motion import in_walkers_axes
from walk3d.film.reconstruct.summary import half_widths_mm, summarise, table_rows, world_mm
from walk3d.film.walk import errors
from walk3d.film.walk.calibration import ANYBODY, AS_OURS, Calibration, angle_half_widths
from walk3d.film.walk.cycle import NUMBERS, gait_cycle
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.verdict import Judgement, Verdict
from walk3d.film.walk.view import level_axes


@pytest.fixture(scope="module")
def walk(model: Path, tmp_path_factory: pytest.TempPathFactory) -> Walk:
    """Return the reconstructed walk of a person of known stature, with the error bars for `anybody`."""
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path_factory.mktemp("clip") / "a.json", in_layout(sim, "coco17"))
    options = given(path, focal_px=sim.focal_px, stature_mm=1700.0)
    walk = reconstruct_clip(options, model)
    assert walk.bars_for == ANYBODY  # the layout's joints were not measured
    return walk


def test_angles_stand_under_their_own_names_with_their_own_bars(walk: Walk) -> None:
    result = walk.best.reconstruction
    assert result is not None
    reference = result.posterior.positions_mm @ level_axes(errors.headings(result))
    at = dict(zip(WALKER15.joints, np.moveaxis(reference, 1, 0), strict=True))
    half = np.degrees(angle_half_widths(walk.calibration, result.posterior.angles_sd_rad, 2)).mean(axis=0)
    message = summarise(walk)["angles_deg"]
    assert list(message) == list(ANGLES)

    def inclined(upper: str, lower: str) -> np.ndarray:
        _, y, z = (at[lower] - at[upper]).T
        return np.degrees(np.arctan2(y, -z))

    trunk = inclined("sternum", "pelvis")
    expected = {"trunk": -trunk}
    for side in ("left", "right"):
        thigh, shank = inclined(f"{side}_hip", f"{side}_knee"), inclined(f"{side}_knee", f"{side}_ankle")
        arm, forearm = (
            inclined(f"{side}_shoulder", f"{side}_elbow"),
            inclined(f"{side}_elbow", f"{side}_wrist"),
        )
        angles = {"knee": thigh - shank, "hip": thigh - trunk, "shank": -shank, "elbow": forearm - arm}
        expected |= {f"{side}_{kind}": angle for kind, angle in (angles | {"shoulder": arm - trunk}).items()}
    for number, name in enumerate(ANGLES):
        angle = expected[name]
        assert message[name]["least"] == pytest.approx(angle.min(), abs=0.06)
        assert message[name]["most"] == pytest.approx(angle.max(), abs=0.06)
        assert message[name]["mean_half_width_95"] == pytest.approx(half[number], abs=0.06)
    assert message["left_hip"]["least"] < 0 < message["left_hip"]["most"]  # extension is negative


def test_numbers_of_the_cycle_are_those_of_the_walker_in_its_units(walk: Walk) -> None:
    result = walk.best.reconstruction
    assert result is not None
    message = summarise(walk)["gait_cycle"]
    numbers, truth = message["numbers"], clip_cycle()
    assert numbers["stride_time"]["both"]["value"] == pytest.approx(1 / walks()[0].frequency_hz, rel=0.03)
    assert numbers["stance"]["left"]["value"] + numbers["swing"]["left"]["value"] == pytest.approx(100)
    assert numbers["stance"]["difference"]["value"] == pytest.approx(
        numbers["stance"]["left"]["value"] - numbers["stance"]["right"]["value"], abs=0.11
    )
    for name, owner in numbers.items():
        low, high = owner["walkers_95"]
        assert low < high, name
        for side in ("left", "right", "difference", "both"):
            if side in owner:
                assert owner[side]["half_width_95"] > 0
        if "difference" in owner:
            larger = abs(owner["difference"]["value"]) > owner["difference"]["half_width_95"]
            assert owner["difference"]["larger_than_its_bar"] == larger
    for name, kind in (("greatest_knee_flexion", "knee_most"), ("least_hip_flexion", "hip_least")):
        assert numbers[name]["left"]["value"] == pytest.approx(np.degrees(truth[kind, "left"]), abs=15)
    # A step of a stature of 1700 mm, and as its share.
    shares = summarise(replace(walk, stature_mm=0.0))["gait_cycle"]["numbers"]["step_length"]
    step = numbers["step_length"]
    assert (step["unit"], shares["unit"]) == ("mm", "% of stature")
    assert step["left"]["value"] == pytest.approx(17.0 * shares["left"]["value"], abs=1.4)
    # Events are a step apart, within the clip, each with a bar.
    contacts = sorted(t for side in ("left", "right") for t in message["events"][f"{side}_contact"]["time_s"])
    steps = numbers["step_time"]
    for distance in np.diff(contacts):
        assert min(abs(distance - steps[side]["value"]) for side in ("left", "right")) < 0.003
    assert min(contacts) >= walk.best.first_frame / 30 - 1e-3
    assert max(contacts) <= walk.best.last_frame / 30 + 1e-3


def clip_cycle() -> dict[tuple[str, str], float]:
    """Return the gait-cycle numbers of the simulated walker, by kind and side."""
    walk = walks()[0]
    values = gait_cycle(walk.walker, walk.frequency_hz, stance_rows(walk.walker)[1]).values
    return dict(zip(NUMBERS, values.tolist(), strict=True))


def test_tables_hold_the_curves_and_the_angles(walk: Walk) -> None:
    result = walk.best.reconstruction
    assert result is not None
    drawn = cycle.curves(walk, result)
    rows = {name: np.array(column) for name, column in cycle.curve_rows(drawn).items()}
    knee = rows["angle"] == "knee"
    most = np.degrees(dict(zip(NUMBERS, result.cycle.values.tolist(), strict=True))["knee_most", "right"])
    assert rows["right_deg"][knee].max() == pytest.approx(most, abs=0.1)
    np.testing.assert_allclose(rows["left_deg"][knee][[0]], rows["left_deg"][knee][[-1]], atol=0.01)
    assert (rows["walkers_low_deg"] < rows["walkers_high_deg"]).all()
    frames = cycle.angle_rows(walk)
    displayed = np.degrees(result.posterior.angles_rad[:, list(ANGLES).index("right_hip")])
    np.testing.assert_allclose(frames["right_hip_deg"], displayed, atol=0.006)
    assert frames["frame"].tolist() == list(range(walk.best.first_frame, walk.best.last_frame + 1))


def test_the_range_of_a_knee_has_the_bars_of_the_table_of_numbers(walk: Walk) -> None:
    message = summarise(walk)
    table = cycle.number_rows(message["gait_cycle"]["numbers"])
    rows = zip(table["number"], table["side"], table["value"], table["half_width_95"], strict=True)
    bars = {(number, side): (value, half) for number, side, value, half in rows}
    expected = ", ".join(
        "{} knee {:g}° (±{:g}°) to {:g}° (±{:g}°)".format(
            side, *bars["least_knee_flexion", side], *bars["greatest_knee_flexion", side]
        )
        for side in ("left", "right")
    )
    assert dict(words.facts(message))["Gait cycle"][0] == f"{expected.capitalize()}."
    assert (
        "half_width_95" not in message["angles_deg"]["left_knee"]
    )  # the mean bar of an angle in a frame is another


def test_nothing_is_said_of_sides_that_are_unsure(walk: Walk) -> None:
    calibrations = {  # a hundredth of the bars, so that sides differ
        group: Calibration(
            *(np.full_like(owner, 0.01) for owner in (first.joints, first.angles, first.cycle, first.view))
        )
        for group, first in walk.calibrations.items()
    }
    for unsure in (False, True):
        result = replace(walk.best.fitted, labels_unsure=unsure)
        message = summarise(
            replace(walk, calibrations=calibrations, stretches=(replace(walk.best, reconstruction=result),))
        )
        numbers = message["gait_cycle"]["numbers"].values()
        differ = [owner["difference"]["larger_than_its_bar"] for owner in numbers if "difference" in owner]
        assert any(differ) != unsure
        sentences = " ".join(dict(words.facts(message))["Gait cycle"]).lower()
        assert ("left-right differences larger than their bars: " in sentences) != unsure
        assert ("left" in sentences or "right" in sentences) != unsure
        assert ("one knee" in sentences and "the other knee" in sentences) == unsure


@pytest.mark.parametrize(("heading_deg", "speed", "locomotion"), [
    (90.0, 1200.0, "Overground."), (90.0, 0.0, "In place, on a treadmill, or the camera follows."),
])  # fmt: skip
def test_who_does_not_cross_the_image_may_be_followed_by_the_camera(
    heading_deg: float, speed: float, locomotion: str, model: Path, tmp_path: Path
) -> None:
    sim = clip(heading_deg, ERROR, speed=speed)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    message = summarise(reconstruct_clip(given(path, focal_px=sim.focal_px), model))
    assert dict(words.facts(message))["Steps"][-1] == locomotion


def test_lengths_are_told_with_their_unit(walk: Walk) -> None:
    message = summarise(replace(walk, stature_mm=0.0))
    assert "1500 mm" in message["units"]
    assert dict(words.facts(message))["Bars"][-1] == f"Lengths are in {message['units']}."


def test_a_doubtful_walk_says_what_is_usable(walk: Walk) -> None:
    doubted = replace(walk.best, judgement=Judgement(Verdict.doubtful, ("odd",)))
    message = summarise(replace(walk, stretches=(doubted,)))
    assert message["usable"]
    assert all(sentence.startswith("Usable") for sentence in message["usable"])
    assert message["usable"][0] in dict(words.facts(message))["Verdict"]
    assert (
        summarise(replace(walk, stretches=(replace(walk.best, judgement=Judgement(Verdict.walk, ())),)))[
            "usable"
        ]
        == []
    )


def test_every_bar_is_of_the_calibration_that_is_named(walk: Walk) -> None:
    widths = {group: [np.full(shape, wide) for shape in ((8, 3, 3), (6, 3), (20, 3), (2, 3))]
              for group, wide in ((AS_OURS, 100.0), (ANYBODY, 200.0))}  # fmt: skip
    walk = replace(walk, calibrations={group: Calibration(*owner) for group, owner in widths.items()})
    first, other = (summarise(replace(walk, bars_for=group)) for group in (AS_OURS, ANYBODY))
    assert [message["bars"]["for"] for message in (first, other)] == [AS_OURS, ANYBODY]
    narrow, wide = (first["bars"]["mean_half_width_95_mm"][group] for group in (AS_OURS, ANYBODY))
    assert wide == pytest.approx(2 * narrow, abs=0.2)
    assert first["bars"]["mean_half_width_95_mm"] == other["bars"]["mean_half_width_95_mm"]
    for name in ANGLES:
        narrow, wide = (message["angles_deg"][name]["mean_half_width_95"] for message in (first, other))
        assert wide == pytest.approx(2 * narrow, abs=0.2)
    for joint, narrow in first["half_width_95_mm"].items():
        assert other["half_width_95_mm"][joint] == pytest.approx(2 * np.array(narrow), abs=2)
    for owner, key in (
        ("view_angle_deg", "interval_95"), ("cadence", "interval_95_steps_per_min")
    ):  # fmt: skip
        narrow, wide = (np.ptp(message[owner][key]) for message in (first, other))
        assert wide == pytest.approx(2 * narrow, rel=0.01)


def test_rows_have_the_axes_that_they_are_called_by(walk: Walk) -> None:
    result = walk.best.reconstruction
    assert result is not None
    rows = {name: np.array(column) for name, column in table_rows(walk).items()}
    scale = half_widths_mm(walk, result).max() / half_widths_mm(replace(walk, stature_mm=0.0), result).max()
    shape = (-1, len(WALKER15.joints))
    right, down, away = np.moveaxis(world_mm(result) * scale, -1, 0)
    for name, expected in (("x", right), ("y", away), ("z", -down)):
        np.testing.assert_allclose(rows[name].reshape(shape), expected, atol=0.006)
    for name, bar in zip(
        ("half_x", "half_z", "half_y"), np.moveaxis(half_widths_mm(walk, result), -1, 0), strict=True
    ):
        np.testing.assert_allclose(rows[name].reshape(shape), bar, atol=0.006)


def test_a_walk_in_its_own_axes_stands_on_the_floor(walk: Walk) -> None:
    result = walk.best.reconstruction
    assert result is not None
    walked = in_walkers_axes(result)
    ankles = [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")]
    assert walked[:, ankles, 2].min() == 0.0
    assert walked[len(walked) // 2, WALKER15.index("pelvis"), :2].tolist() == [0.0, 0.0]
