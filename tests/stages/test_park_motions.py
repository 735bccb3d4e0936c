"""Figure 4 of park2011 and the face-off on small data: columns, and what must be true of the numbers."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline import recordings
from pipeline.__main__ import compose
from pipeline.cli.figures import Outcome, make_figure
from pipeline.core import camera as parallel
from pipeline.core import fourier
from pipeline.core.camera_paths import still
from pipeline.core.linear_model import LinearModel
from pipeline.skeleton import WALKER15
from pipeline.stages import dataset, ingest
from pipeline.storage import tables
from pipeline.storage.store import Artefact, Store
from pipeline.studies.face_off import comparison as face_off
from pipeline.studies.face_off.methods import SeenWalk, mean_walker, series_of_seen
from pipeline.studies.limbs import motions
from pipeline.studies.options import FaceOffSweep, MotionsSweep, TrajectoryBasisModel
from pipeline.validation import InvalidInput
from tests.stages.promised import PROMISED

COLUMNS = {name: PROMISED[name] for name in ("park2011_fig4", "park2011_face_off")}
ENTITIES = {
    "park2011_fig4": {
        "world/truth/walking_001", "world/trajectories/truth/walking_001", "world/trajectories/still/walking_001",
        "image/still/walking_001", "image/shaky/walking_001",
    },
    "park2011_face_off": {
        "world/original", "world/reconstructed/still/map", "world/reconstructed/moving/articulated_hinges",
        "image/observed/still", "curves/error_mm/still/least_squares", "curves/error_mm/moving/articulated",
    },
}  # fmt: skip
SMALL = {
    "park2011_fig4": ("sweep.cameras=[still,shaky]", "sweep.clips=2", "sweep.time_limit_s=0.05"),
    "park2011_face_off": (
        "sweep.cameras=[still,moving]", "sweep.view_angle_deg=[30,90]", "sweep.noise_px=[0,3]",
        "sweep.occluded=[0,0.3]",
    ),
}  # fmt: skip
Columns = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Artefacts of all figures here."""
    return Store(tmp_path_factory.mktemp("motions"))


def make(store: Store, name: str, *overrides: str) -> Outcome:
    """One figure at smoke scale and smaller."""
    config = compose(
        [f"experiment={name}", "scale=smoke", f"results={store.results}", *SMALL[name], *overrides]
    )
    return make_figure(config, store.results / config.data.name / name, store=store)


@pytest.fixture(scope="module")
def made(store: Store) -> Path:
    """Folder of both figures, with pictures and recordings."""
    for name in COLUMNS:
        make(store, name)
    return store.results / "synthetic"


@pytest.fixture(scope="module")
def stretches(store: Store) -> Artefact:
    """Stretches of the synthetic clips of smoke scale."""
    config = compose(["experiment=park2011_fig4", "scale=smoke"])
    clips = ingest.run(config.data, config.skeleton, config.seed, 1, store, purpose="clips")
    return dataset.run(config.dataset, clips, 1, store)


def read(folder: Path, name: str, table: str = "table") -> Columns:
    """One table of one figure."""
    return tables.read(folder / name / f"{table}.csv")


def of(columns: Columns, name: str, **labels: object) -> np.ndarray:
    """A column's rows that carry labels in other columns."""
    here = np.ones(len(columns[name]), dtype=bool)
    for column, label in labels.items():
        here &= columns[column] == label
    return columns[name][here]


@pytest.mark.parametrize("name", list(COLUMNS))
def test_tables_and_recording_are_those_promised(made: Path, name: str) -> None:
    for table, columns in COLUMNS[name].items():
        found = read(made, name, table)
        assert list(found) == columns
        for column, values in found.items():
            assert values.dtype.kind in "Ub" or np.isfinite(values).all(), (table, column)
    path = made / name / "recording.rrd"
    recordings.verify(path)
    assert {"about"} | ENTITIES[name] <= set(recordings.entities(path))
    assert (made / name / "figure.png").stat().st_size > 20_000


# --- figure 4 ---------------------------------------------------------------------------------------------


def test_clips_are_means_of_their_joints_and_keep_their_lengths(made: Path) -> None:
    joints, clips = read(made, "park2011_fig4"), read(made, "park2011_fig4", "table_clips")
    assert set(joints["joint"]) == set(WALKER15.joints) - {"pelvis"}
    for clip, camera, error in zip(clips["clip"], clips["camera"], clips["error_mm"], strict=True):
        assert of(joints, "error_mm", clip=clip, camera=camera).mean() == pytest.approx(error, rel=1e-8)
    assert clips["length_change_max"].max() < 1e-9
    assert (joints["imputed_share"] == 0).all(), "nothing is hidden here"
    # The noise of one pixel in two coordinates is what a trajectory can explain, or a little less.
    assert (clips["reprojection_error_px"] < 2 * np.sqrt(2)).all()


def test_with_the_better_mirror_of_each_limb_errors_are_much_smaller(made: Path) -> None:
    clips = read(made, "park2011_fig4", "table_clips")
    assert clips["error_up_to_mirror_mm"].mean() < 0.6 * clips["error_mm"].mean()


def test_a_camera_that_shakes_is_better_than_one_that_stands(made: Path) -> None:
    clips = read(made, "park2011_fig4", "table_clips")
    means = {camera: of(clips, "error_mm", camera=camera).mean() for camera in ("still", "shaky")}
    assert means["shaky"] < means["still"]


def test_bounds_are_below_what_was_taken_and_lights_follow_margins(made: Path) -> None:
    limbs = read(made, "park2011_fig4", "table_limbs")
    assert (limbs["lower_bound"] <= limbs["best_objective"] * (1 + 1e-9)).all()
    assert (limbs["best_objective"] <= limbs["objective"] * (1 + 1e-9)).all()
    proved = limbs["proved"]
    assert proved.any()
    np.testing.assert_allclose(limbs["lower_bound"][proved], limbs["best_objective"][proved], rtol=1e-3)
    for light, low, high in (("red", 0.0, 1.25), ("amber", 1.25, 2.0), ("green", 2.0, np.inf)):
        margin = of(limbs, "mirror_margin", light=light)
        assert ((margin >= low) & (margin <= high)).all()


def test_neither_workers_nor_the_clock_change_a_reconstruction(stretches: Artefact) -> None:
    options = MotionsSweep(cameras=["moving"], clips=2, time_limit_s=0.0)
    basis = TrajectoryBasisModel(components=12)
    one, _ = motions.measure(options, stretches, basis, 1, 7)
    two, notes = motions.measure(replace(options, time_limit_s=0.03), stretches, basis, 2, 7)
    np.testing.assert_array_equal(one["positions"], two["positions"])
    np.testing.assert_array_equal(one["error_up_to_mirror_mm"], two["error_up_to_mirror_mm"])
    assert two["proved"].sum() > one["proved"].sum()
    assert notes["unproved_limbs"] == (~two["proved"]).sum()
    other, _ = motions.measure(options, stretches, basis, 1, 8)
    assert not np.array_equal(one["images"], other["images"])


def test_the_root_and_the_lengths_can_be_guessed(stretches: Artefact) -> None:
    options = MotionsSweep(
        cameras=["still"],
        clips=1,
        noise_px=0.0,
        root="unit_depth",
        lengths="anthropometric",
        time_limit_s=0.0,
    )
    basis = TrajectoryBasisModel(components=12)
    arrays, notes = motions.measure(options, stretches, basis, 1, 7)
    assert notes["lengths"] == "anthropometric"
    apart = arrays["positions"][0, 0, :, motions.ROOT] - arrays["truth"][0, :, motions.ROOT]
    middle = len(apart) // 2
    assert np.abs(apart[middle]).max() < 1e-6, "at the depth of the middle frame it is true there"
    assert np.abs(apart).max() > 1.0
    thigh = np.linalg.norm(np.diff(arrays["positions"][0, 0][:, [9, 10]], axis=1)[:, 0], axis=-1)
    true = np.linalg.norm(np.diff(arrays["truth"][0][:, [[9, 10], [12, 13]]], axis=2)[:, :, 0], axis=-1)
    np.testing.assert_allclose(thigh, true.mean(), rtol=1e-6)


def test_mirrors_are_tried_if_asked(stretches: Artefact) -> None:
    options = MotionsSweep(cameras=["still"], clips=2, time_limit_s=0.0)
    plain, _ = motions.measure(options, stretches, TrajectoryBasisModel(), 1, 7)
    tried, _ = motions.measure(replace(options, try_mirrors=True), stretches, TrajectoryBasisModel(), 1, 7)
    np.testing.assert_array_equal(tried["images"], plain["images"])
    assert (tried["mirrored"] != plain["mirrored"]).any()
    assert (tried["reprojection_error_px"] <= plain["reprojection_error_px"] + 0.05).all()
    assert tried["error_mm"].mean() < 0.8 * plain["error_mm"].mean()
    assert (tried["objective"] >= tried["lower_bound"] - 1e-6).all()


def test_lengths_may_come_from_the_rays_and_components_from_the_rule(stretches: Artefact) -> None:
    """Nothing of the person is then known but the root: ratios say how wrong the lengths are, and K how fine."""
    options = MotionsSweep(cameras=["shaky"], clips=1, lengths="estimated", time_limit_s=0.0)
    arrays, notes = motions.measure(options, stretches, TrajectoryBasisModel(components=0), 1, 7)
    assert notes["lengths"] == "estimated"
    ratio, components = arrays["length_ratio"][0, 0], arrays["components"][0, 0]
    assert 0.0 < np.abs(ratio - 1.0).mean() < 0.15
    assert ((components >= 1) & (components <= 50)).all()
    assert np.ptp(components) > 0
    sizes = np.linalg.norm(np.diff(arrays["positions"][0, 0][:, [9, 10]], axis=1)[:, 0], axis=-1)
    assert np.ptp(sizes) < 1e-6, "an estimated length is kept as any other"
    given, _ = motions.measure(replace(options, lengths="true"), stretches, TrajectoryBasisModel(), 1, 7)
    np.testing.assert_allclose(given["length_ratio"], 1.0)
    assert (given["components"] == 20).all()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"cameras": []}, "sweep.cameras"),
        ({"cameras": ["flying"]}, "sweep.cameras"),
        ({"lengths": "guessed"}, "sweep.lengths"),
        ({"root": "none"}, "sweep.root"),
        ({"noise_px": -1.0}, "sweep.noise_px"),
    ],
)
def test_options_that_make_no_motions_are_refused(
    stretches: Artefact, changed: dict[str, object], words: str
) -> None:
    options = replace(MotionsSweep(), **changed)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match=words):
        motions.measure(options, stretches, TrajectoryBasisModel(), 1, 7)


# --- face-off ---------------------------------------------------------------------------------------------


def test_eigenwalkers_are_scored_where_the_camera_stands_and_only_there(made: Path) -> None:
    columns = read(made, "park2011_face_off", "table_summary")
    assert set(of(columns, "method", camera="still")) == set(face_off.METHODS)
    assert set(of(columns, "method", camera="moving")) == set(face_off.METHODS) - set(face_off.EIGENWALKERS)


def test_from_a_still_camera_what_was_learnt_from_walks_wins(made: Path) -> None:
    columns = read(made, "park2011_face_off")
    learnt = of(columns, "error_mm", camera="still", method="map")
    assert (learnt < 0.5 * of(columns, "error_mm", camera="still", method="articulated_hinges")).all()


def test_the_average_walker_is_the_same_before_every_camera(made: Path) -> None:
    columns = read(made, "park2011_face_off")
    for walker in np.unique(columns["walker"]):
        errors = of(columns, "error_mm", walker=walker, method="mean_walker")
        np.testing.assert_allclose(errors, errors[0], rtol=1e-8)


def test_noise_and_hidden_joints_cost_eigenwalkers_something(made: Path) -> None:
    columns = read(made, "park2011_face_off", "table_summary")
    for varied, column in (("noise", "noise_px"), ("occlusion", "occluded")):
        rows = {"varied": varied, "camera": "still", "method": "least_squares"}
        order = np.argsort(of(columns, column, **rows))
        assert (np.diff(of(columns, "error_mm", **rows)[order]) > 0).all()


def test_summaries_are_means_of_walkers_and_of_joints(made: Path) -> None:
    each, summary = (read(made, "park2011_face_off", t) for t in ("table", "table_summary"))
    joints = read(made, "park2011_face_off", "table_joints")
    rows = {"camera": "still", "method": "map", "view_angle_deg": 90}
    (mean,) = of(summary, "error_mm", varied="none", **rows)
    assert of(each, "error_mm", varied="none", **rows).mean() == pytest.approx(mean, rel=1e-8)
    assert of(joints, "error_mm", **rows).mean() == pytest.approx(mean, rel=1e-8)
    assert len(of(joints, "error_mm", **rows)) == 14


def walk_of(seed: int, frames: int = 60) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (5, 15, 3), motion (F, 15, 3) at 30 Hz of them, and their frequency."""
    generator = np.random.default_rng(seed)
    coefficients = generator.normal(0.0, 100.0, (5, 15, 3))
    frequency_hz = float(generator.uniform(0.7, 1.2))
    return (
        coefficients,
        fourier.synthesise(coefficients, frequency_hz, np.arange(frames) / 30.0),
        frequency_hz,
    )


@given(seed=st.integers(0, 2**32 - 1), view=st.floats(-np.pi, np.pi))
def test_far_away_the_image_is_the_parallel_projection(seed: int, view: float) -> None:
    _, motion, _ = walk_of(seed, frames=5)
    root = motion[:, 8]
    camera = still(5, target=root.mean(axis=0), distance_mm=1e9, azimuth_rad=view + np.pi, px_per_mm=0.25)
    walk = SeenWalk(camera.project(motion), camera, root, 30.0, view)
    np.testing.assert_allclose(walk.weak_perspective(), parallel.project(motion, view), atol=0.01)


@given(seed=st.integers(0, 2**32 - 1), hidden=st.floats(0.0, 0.5))
def test_a_series_is_found_from_the_frames_that_were_seen(seed: int, hidden: float) -> None:
    coefficients, motion, frequency_hz = walk_of(seed)
    image = motion[..., :2].copy()
    image[np.random.default_rng(seed).random(image.shape[:2]) < hidden] = np.nan
    found = series_of_seen(image, 30.0, frequency_hz, harmonics=2)
    np.testing.assert_allclose(found, coefficients[..., :2], atol=1e-6)


@given(seed=st.integers(0, 2**32 - 1), phase=st.floats(-np.pi, np.pi))
def test_the_average_walker_walks_with_the_phase_that_it_is_given(seed: int, phase: float) -> None:
    coefficients, motion, frequency_hz = walk_of(seed)
    mean = fourier.shift(coefficients, phase).ravel()
    model = LinearModel(mean, np.zeros((1, 225)), np.zeros(1), 0.0, 1.0)
    again = mean_walker(model, np.arange(60) / 30.0, frequency_hz, phase)
    np.testing.assert_allclose(again, motion, atol=1e-8)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"view_angle_deg": []}, "sweep.view_angle_deg"),
        ({"occluded": [0.0, 0.95]}, "sweep.occluded"),
        ({"noise_px": [1.0, 0.0]}, "sweep.noise_px"),
        ({"cameras": ["flying"]}, "sweep.cameras"),
        ({"frames": 3}, "sweep.frames"),
        ({"noise_variance_mm2": 0.0}, "noise variance"),
    ],
)
def test_options_that_make_no_face_off_are_refused(changed: dict[str, object], words: str) -> None:
    nothing = Artefact("none", "0" * 16, {}, {}, False, 0.0, "")
    with pytest.raises(InvalidInput, match=words):
        face_off.measure(replace(FaceOffSweep(), **changed), nothing, nothing, nothing, 1, 7)  # type: ignore[arg-type]


# --- recorded ---------------------------------------------------------------------------------------------


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
def test_recorded_motion_makes_both_figures(store: Store) -> None:
    quick = ("data=cmu", "report.picture=false", "report.recording=false")
    for name in COLUMNS:
        make(store, name, *quick)
        for table, columns in COLUMNS[name].items():
            assert list(read(store.results / "cmu", name, table)) == columns
    summary = read(store.results / "cmu", "park2011_face_off", "table_summary")
    still = {"camera": "still", "varied": "none"}
    assert (
        of(summary, "error_mm", method="map", **still).mean()
        < 0.5 * of(summary, "error_mm", method="articulated", **still).mean()
    )
