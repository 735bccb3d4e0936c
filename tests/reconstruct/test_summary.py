"""Numbers of a summary against the walk that they are said of, by name, axis and width of their bars."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.core.keypoint_walk import ANGLES
from pipeline.core.keypoint_walk.calibration import angle_half_widths
from pipeline.reconstruct.clip import Input, Walk, reconstruct_clip
from pipeline.reconstruct.motion import in_walkers_axes
from pipeline.reconstruct.summary import half_widths_mm, summarise, table_rows, world_mm
from pipeline.skeleton import WALKER15
from tests.core.keypoint_walk.walkers import clip
from tests.reconstruct.walks import ERROR, alphapose, given, in_layout


@pytest.fixture(scope="module")
def case(model: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Walk, Input]:
    """A walk of somebody of known stature, whose bars are widened."""
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path_factory.mktemp("clip") / "a.json", in_layout(sim, "coco17"))
    options = given(path, focal_px=sim.focal_px, stature_mm=1700.0)
    return replace(reconstruct_clip(options, model), bars_factor=1.5), options


def test_angles_stand_under_their_own_names_with_their_own_bars(case: tuple[Walk, Input]) -> None:
    walk, found = case[0], case[0].best.found
    assert found is not None
    at = dict(zip(WALKER15.joints, np.moveaxis(found.posterior.positions_mm, 1, 0), strict=True))
    half = np.degrees(angle_half_widths(walk.calibration, found.posterior.angles_sd_rad, 2)).mean(axis=0)
    said = summarise(*case)["angles_deg"]
    assert list(said) == list(ANGLES)
    for number, name in enumerate(ANGLES):
        side, joint = name.split("_")
        upper, middle, end = ("shoulder", "elbow", "wrist") if joint == "elbow" else ("hip", "knee", "ankle")
        first = at[f"{side}_{middle}"] - at[f"{side}_{upper}"]
        second = at[f"{side}_{end}"] - at[f"{side}_{middle}"]
        if joint == "hip":
            first, second = at["pelvis"] - at["sternum"], first
        elif joint == "shank":
            first = np.array([0.0, 1.0, 0.0])  # down
        cosine = (
            (first * second).sum(axis=-1) / np.linalg.norm(first, axis=-1) / np.linalg.norm(second, axis=-1)
        )
        angle = np.degrees(np.arccos(cosine))
        assert said[name]["least"] == pytest.approx(angle.min(), abs=0.06)
        assert said[name]["most"] == pytest.approx(angle.max(), abs=0.06)
        assert said[name]["half_width_95"] == pytest.approx(1.5 * half[number], abs=0.06)


def test_every_bar_is_widened_alike(case: tuple[Walk, Input]) -> None:
    walk, options = case
    one, other = (summarise(replace(walk, bars_factor=factor), options) for factor in (10.0, 20.0))
    for name in ANGLES:
        narrow, wide = (said["angles_deg"][name]["half_width_95"] for said in (one, other))
        assert wide == pytest.approx(2 * narrow, abs=0.2)
    for joint, narrow in one["half_width_95_mm"].items():
        assert other["half_width_95_mm"][joint] == pytest.approx(2 * np.array(narrow), abs=2)
    narrow, wide = (np.ptp(said["view_angle_deg"]["interval_95"]) for said in (one, other))
    assert wide == pytest.approx(2 * narrow, abs=0.4)


def test_rows_have_the_axes_that_they_are_called_by(case: tuple[Walk, Input]) -> None:
    walk, options = case
    found = walk.best.found
    assert found is not None
    rows = {name: np.array(column) for name, column in table_rows(walk, options).items()}
    scale = (
        half_widths_mm(walk, found, options).max()
        / half_widths_mm(walk, found, replace(options, stature_mm=0.0)).max()
    )
    shape = (-1, len(WALKER15.joints))
    right, down, away = np.moveaxis(world_mm(found) * scale, -1, 0)
    for name, expected in (("x", right), ("y", away), ("z", -down)):
        np.testing.assert_allclose(rows[name].reshape(shape), expected, atol=0.006)
    for name, bar in zip(
        ("half_x", "half_z", "half_y"), np.moveaxis(half_widths_mm(walk, found, options), -1, 0), strict=True
    ):
        np.testing.assert_allclose(rows[name].reshape(shape), bar, atol=0.006)


def test_a_walk_in_its_own_axes_stands_on_the_floor(case: tuple[Walk, Input]) -> None:
    found = case[0].best.found
    assert found is not None
    walked = in_walkers_axes(found)
    ankles = [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")]
    assert walked[:, ankles, 2].min() == 0.0
    assert walked[len(walked) // 2, WALKER15.index("pelvis"), :2].tolist() == [0.0, 0.0]
