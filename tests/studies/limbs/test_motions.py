"""Tests of figure 4 of park2011 at smoke scale: relations between numbers, and reconstructions with less input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.summary import Outcome
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.limbs.motions import Lengths, MotionsSweep, Root
from pipeline.studies.limbs.trials import ROOT
from tests.recordings import reading, viewer
from tests.studies.limbs.inputs import measure, stretches_of

BASIS = TrajectoryBasisModel()
COARSE = TrajectoryBasisModel(components=12)
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def stretches() -> LimbStretches:
    """Motion stretches of the synthetic clips at smoke scale."""
    return stretches_of("park2011_fig4")


@pytest.fixture
def folder(smoke_results: Path) -> Path:
    """Folder of figure 4 of park2011 at smoke scale."""
    return smoke_results / "synthetic" / "smoke" / "park2011_fig4"


def read(folder: Path, table: str = "table") -> Columns:
    """Return one table of figure 4 of park2011 as columns by name."""
    return tables.read(folder / f"{table}.csv")


def of(columns: Columns, name: str, **labels: object) -> np.ndarray:
    """Return the entries of a column in the rows where other columns have the given labels."""
    start = np.ones(len(columns[name]), dtype=bool)
    for column, label in labels.items():
        start &= columns[column] == label
    return columns[name][start]


def test_the_recording_and_the_picture_are_whole(folder: Path) -> None:
    viewer.verify(folder / "recording.rrd")
    target = {
        "about", "world/original/walking_001", "world/trajectories/original/walking_001",
        "world/cameras/still/walking_001/seen",
        "world/trajectories/still/walking_001", "world/cameras/shaky/walking_001/seen",
    }  # fmt: skip
    assert target <= set(reading.entities(folder / "recording.rrd"))
    assert (folder / "figure.png").stat().st_size > 20_000


def test_clips_are_means_of_their_joints_and_keep_their_lengths(folder: Path) -> None:
    joints, clips = read(folder), read(folder, "table_clips")
    assert set(joints["joint"]) == set(WALKER15.joints) - {"pelvis"}
    for clip, camera, error in zip(clips["clip"], clips["camera"], clips["error_mm"], strict=True):
        assert of(joints, "error_mm", clip=clip, camera=camera).mean() == pytest.approx(error, rel=1e-8)
    assert clips["length_change_max"].max() < 1e-9
    assert (joints["imputed_share"] == 0).all(), "nothing is hidden here"
    # The noise of one pixel in two coordinates is what a trajectory can explain, or a little less.
    assert (clips["reprojection_error_px"] < 2 * np.sqrt(2)).all()


def test_with_the_better_mirror_of_each_limb_errors_are_much_smaller(folder: Path) -> None:
    clips = read(folder, "table_clips")
    assert clips["error_up_to_mirror_mm"].mean() < 0.6 * clips["error_mm"].mean()


def test_a_camera_that_shakes_is_better_than_one_that_stands(folder: Path) -> None:
    clips = read(folder, "table_clips")
    means = {camera: of(clips, "error_mm", camera=camera).mean() for camera in ("still", "shaky")}
    assert means["shaky"] < means["still"]


def test_bounds_are_below_what_was_taken_and_confidence_follows_margins(folder: Path) -> None:
    limbs = read(folder, "table_limbs")
    assert (limbs["lower_bound"] <= limbs["best_objective"] * (1 + 1e-9)).all()
    assert (limbs["best_objective"] <= limbs["objective"] * (1 + 1e-9)).all()
    proved = limbs["proved"]
    assert proved.any()
    np.testing.assert_allclose(limbs["lower_bound"][proved], limbs["best_objective"][proved], rtol=1e-3)
    for confidence, low, high in (("red", 0.0, 1.25), ("amber", 1.25, 2.0), ("green", 2.0, np.inf)):
        margin = of(limbs, "mirror_margin", confidence=confidence)
        assert ((margin >= low) & (margin <= high)).all()


def test_neither_workers_nor_certificates_change_a_reconstruction(stretches: LimbStretches) -> None:
    options = MotionsSweep(cameras=[Camera.moving], clips=2, time_limit_s=0.0)
    first = measure(options, stretches, COARSE)
    two = measure(replace(options, time_limit_s=0.03), stretches, COARSE, workers=2)
    np.testing.assert_array_equal(first.as_chosen.positions, two.as_chosen.positions)
    np.testing.assert_array_equal(first.clips["error_up_to_mirror_mm"], two.clips["error_up_to_mirror_mm"])
    assert two.limbs["proved"].sum() > first.limbs["proved"].sum()
    other = measure(options, stretches, COARSE, seed=8)
    assert not np.array_equal(first.as_chosen.images, other.as_chosen.images)


def test_the_root_and_the_lengths_can_be_guessed(stretches: LimbStretches) -> None:
    options = MotionsSweep(
        cameras=[Camera.still],
        clips=1,
        noise_px=0.0,
        root=Root.unit_depth,
        lengths=Lengths.anthropometric,
        time_limit_s=0.0,
    )
    result = measure(options, stretches, COARSE).as_chosen
    distance = result.positions[0, 0, :, ROOT] - result.truth[0, :, ROOT]
    middle = len(distance) // 2
    assert np.abs(distance[middle]).max() < 1e-6, "at the depth of the middle frame it is true there"
    assert np.abs(distance).max() > 1.0
    thigh = np.linalg.norm(np.diff(result.positions[0, 0][:, [9, 10]], axis=1)[:, 0], axis=-1)
    true = np.linalg.norm(np.diff(result.truth[0][:, [[9, 10], [12, 13]]], axis=2)[:, :, 0], axis=-1)
    np.testing.assert_allclose(thigh, true.mean(), rtol=1e-6)


def test_mirrors_are_tried_beside(stretches: LimbStretches) -> None:
    options = MotionsSweep(cameras=[Camera.still], clips=2, time_limit_s=0.0)
    both = measure(options, stretches, BASIS)
    np.testing.assert_array_equal(both.mirrors_tried.images, both.as_chosen.images)
    clips, limbs = (
        dict(iter(rows.set_index("clip").groupby("mirrors_tried"))) for rows in (both.clips, both.limbs)
    )
    assert (limbs[True]["mirrored"] != limbs[False]["mirrored"]).any()
    error = "reprojection_error_px"
    assert (clips[True][error] <= clips[False][error] + 0.05).all()
    assert clips[True]["error_mm"].mean() < 0.8 * clips[False]["error_mm"].mean()
    assert (limbs[True]["objective"] >= limbs[True]["lower_bound"] - 1e-6).all()


def test_lengths_may_come_from_the_rays(stretches: LimbStretches) -> None:
    """Limb lengths that are estimated from the rays are within 15 % of the true lengths on average."""
    options = MotionsSweep(cameras=[Camera.shaky], clips=1, lengths=Lengths.estimated, time_limit_s=0.0)
    result = measure(options, stretches, BASIS)
    limbs = result.limbs[~result.limbs["mirrors_tried"]]
    ratio = limbs["length_ratio"]
    assert 0.0 < np.abs(ratio - 1.0).mean() < 0.15
    positions = result.as_chosen.positions[0, 0]
    sizes = np.linalg.norm(np.diff(positions[:, [9, 10]], axis=1)[:, 0], axis=-1)
    assert np.ptp(sizes) < 1e-6, "an estimated length is kept as any other"
    inputs = measure(replace(options, lengths=Lengths.true), stretches, BASIS).limbs
    np.testing.assert_allclose(inputs["length_ratio"], 1.0)
    assert (inputs["components"] == 20).all()


def test_recorded_motion_makes_figure_4(
    figure: Callable[..., Outcome], mocap_mirror: Path, tmp_path: Path
) -> None:
    outcome = figure(tmp_path, "park2011_fig4", "data=cmu", "sweep.clips=2", "sweep.time_limit_s=0")
    clips = read(outcome.folder, "table_clips")
    assert len(clips["clip"]) == 2 * 3
    assert np.isfinite(clips["error_mm"]).all()
