"""The face-off on small data: what must be true of the numbers, and of what each family is given."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.cli.summary import Outcome
from pipeline.core import camera as parallel
from pipeline.core import fourier
from pipeline.core.linear_model import LinearModel
from pipeline.storage import tables
from pipeline.studies.face_off.comparison import KEEP_THE_IMAGE, METHODS
from pipeline.studies.face_off.methods import SeenWalk, mean_walker, series_of_seen
from tests.core.cameras import still
from tests.recordings import reading, viewer

Columns = dict[str, np.ndarray]


@pytest.fixture
def folder(smoke_results: Path) -> Path:
    """The face-off at smoke scale."""
    return smoke_results / "synthetic" / "smoke" / "park2011_face_off"


def read(folder: Path, table: str = "table") -> Columns:
    """One table."""
    return tables.read(folder / f"{table}.csv")


def of(columns: Columns, name: str, **labels: object) -> np.ndarray:
    """A column's rows that carry labels in other columns."""
    here = np.ones(len(columns[name]), dtype=bool)
    for column, label in labels.items():
        here &= columns[column] == label
    return columns[name][here]


def test_the_recording_and_the_picture_are_whole(folder: Path) -> None:
    viewer.verify(folder / "recording.rrd")
    wanted = {
        "about", "world/original", "world/reconstructed/still/map", "world/reconstructed/moving/articulated_hinges",
        "image/observed/still", "curves/error_mm/still/least_squares", "curves/error_mm/moving/articulated",
    }  # fmt: skip
    assert wanted <= set(reading.entities(folder / "recording.rrd"))
    assert (folder / "figure.png").stat().st_size > 20_000


def test_eigenwalkers_are_scored_where_the_camera_stands_and_only_there(folder: Path) -> None:
    columns = read(folder, "table_summary")
    assert set(of(columns, "method", camera="still")) == set(METHODS)
    assert set(of(columns, "method", camera="moving")) == set(METHODS) - set(KEEP_THE_IMAGE)


def test_from_a_still_camera_what_was_learnt_from_walks_wins(folder: Path) -> None:
    columns = read(folder)
    learnt = of(columns, "error_mm", camera="still", method="map")
    assert (learnt < 0.5 * of(columns, "error_mm", camera="still", method="articulated_hinges")).all()


def test_anatomy_brings_the_depth_nearer_than_approach_two_does(folder: Path) -> None:
    columns = read(folder, "table_summary")
    rows = {"camera": "still", "varied": "none"}
    nearer, approach_two = (of(columns, "error_mm", method=m, **rows) for m in ("anatomical", "map"))
    assert len(nearer) == 4
    assert nearer.mean() < approach_two.mean()


def test_the_average_walker_is_the_same_before_every_camera(folder: Path) -> None:
    columns = read(folder)
    for walker in np.unique(columns["walker"]):
        errors = of(columns, "error_mm", walker=walker, method="mean_walker", heading_error_deg=0)
        np.testing.assert_allclose(errors, errors[0], rtol=1e-8)


def test_a_wrong_heading_costs_what_was_learnt_and_nothing_else(folder: Path) -> None:
    columns = read(folder, "table_summary")
    for method in METHODS:
        rows = {"varied": "heading", "camera": "still", "method": method}
        errors = of(columns, "error_mm", **rows)[np.argsort(of(columns, "heading_error_deg", **rows))]
        if method.startswith("articulated"):
            np.testing.assert_allclose(errors, errors[0], rtol=1e-12)
        else:
            assert errors[-1] > 1.1 * errors[0], method


def test_with_the_average_walkers_depth_the_image_is_kept(folder: Path) -> None:
    """What is left is along the axis of the camera, but for its perspective."""
    columns = read(folder, "table_summary")
    rows = {"varied": "none", "camera": "still"}
    kept, average = (
        of(columns, "error_mm", method=method, **rows) for method in ("image_and_average", "mean_walker")
    )
    missing = of(columns, "missing_dimension_error_mm", method="image_and_average", **rows)
    assert (kept < average).all()
    assert (missing > 0.6 * kept).all()


def test_noise_and_hidden_joints_cost_eigenwalkers_something(folder: Path) -> None:
    columns = read(folder, "table_summary")
    for varied, column in (("noise", "noise_px"), ("occlusion", "occluded")):
        rows = {"varied": varied, "camera": "still", "method": "least_squares"}
        order = np.argsort(of(columns, column, **rows))
        assert (np.diff(of(columns, "error_mm", **rows)[order]) > 0).all()


def test_summaries_are_means_of_walkers_and_of_joints(folder: Path) -> None:
    each, summary = (read(folder, t) for t in ("table", "table_summary"))
    joints = read(folder, "table_joints")
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
    walk = SeenWalk(camera.project(motion), camera, root, 30.0, 2, view)
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


def test_recorded_walks_make_the_face_off(
    figure: Callable[..., Outcome], mocap_mirror: Path, tmp_path: Path
) -> None:
    summary = read(figure(tmp_path, "park2011_face_off", "data=cmu").folder, "table_summary")
    rows = {"camera": "still", "varied": "none"}
    learnt = of(summary, "error_mm", method="map", **rows).mean()
    assert learnt < 0.5 * of(summary, "error_mm", method="articulated", **rows).mean()
