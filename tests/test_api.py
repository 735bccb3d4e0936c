"""Tests of the Python interface, from files to a reconstructed view, and of the installed package."""

from __future__ import annotations

import importlib
import inspect
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

import gait_pipeline
import pipeline
import walk3d
import walk3d.api
from pipeline import fit, joints, read, represent, to_dataframe, to_xarray
from pipeline.core import articulated_trajectory, camera, camera_paths, errors, fourier
from pipeline.core.linear_model import LinearModel
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.synthetic import limbs, walkers
from tests.pages import blocks
from tests.rejects import rejects
from tests.wheels import build
from walk3d import calibrate, from_view
from walk3d.anatomy.joint_angles import flexion
from walk3d.export.c3d import write as write_c3d
from walk3d.film.reconstruct.clip import Input, Labels

ROOT = Path(__file__).resolve().parent.parent


def test_from_files_to_a_reconstruction(tmp_path: Path) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=6, female=6, duration_s=3.0, frame_rate_hz=40.0
    )
    for k, walk in enumerate(output.positions_mm):
        trc.write(tmp_path / f"p{k:02d}.trc", WALKER15.joints, walk, 40.0)
    files = sorted(tmp_path.glob("*.trc"))
    positions, valid = joints(read(files[0]))
    np.testing.assert_allclose(positions, output.positions_mm[0])
    assert valid.all()
    walks = [represent(path) for path in files]
    model = fit(walks[1:])
    result = from_view(model, walks[0], 30.0).coefficients
    np.testing.assert_array_equal(result, pipeline.from_view(model, walks[0], 30.0))
    off = np.sqrt(
        errors.absolute_error(np.moveaxis(result - walks[0].coefficients, -1, 0)).sum(axis=0).mean()
    )
    average = model.mean.reshape(5, 15, 3)
    without = np.sqrt(
        errors.absolute_error(np.moveaxis(average - walks[0].coefficients, -1, 0)).sum(axis=0).mean()
    )
    assert off < 0.8 * without
    with rejects("no_file", "missing.trc"):
        represent(tmp_path / "missing.trc")
    header = ",".join(f"{joint}_{axis}" for joint in WALKER15.joints for axis in "xyz")
    rows = output.positions_mm[0].reshape(len(positions), -1) / 1000.0
    np.savetxt(tmp_path / "bare.csv", rows, "%.9f", ",", header=header, comments="")
    bare = represent(tmp_path / "bare.csv", frame_rate_hz=40.0, units="m")
    np.testing.assert_allclose(bare.coefficients, walks[0].coefficients, atol=1e-3)


def test_hidden_joints_are_reconstructed_and_cost_little_elsewhere() -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=12, female=12, duration_s=3.0, frame_rate_hz=40.0
    )
    walks = [fourier.represent(walk, 40.0) for walk in output.positions_mm]
    model = fit(walks[1:])
    observed = from_view(model, walks[0], 30.0).coefficients
    assert np.array_equal(observed, from_view(model, walks[0], 30.0, hidden=[]).coefficients)
    wrists = [WALKER15.index(joint) for joint in ("left_wrist", "right_wrist")]
    completed = from_view(model, walks[0], 30.0, hidden=["left_wrist", "right_wrist"]).coefficients
    off = np.linalg.norm(completed - walks[0].coefficients, axis=-1)
    average = np.linalg.norm(model.mean.reshape(5, 15, 3) - walks[0].coefficients, axis=-1)
    assert off[:, wrists].max() > 0
    assert off[:, wrists].mean() < average[:, wrists].mean()
    others = np.delete(np.arange(15), wrists)
    image = camera.project(completed - walks[0].coefficients, np.radians(30.0))
    assert np.abs(image[:, others]).max() < 1e-9, "what the image shows is kept"
    assert np.abs(image[:, wrists]).max() > 1.0
    with rejects("unknown_choice", "hidden", value="left_toe"):
        from_view(model, walks[0], 30.0, hidden=["left_toe"])


@pytest.fixture
def motion(tmp_path: Path) -> MotionCapture:
    """Recording of two points over three frames, with one missing sample."""
    positions = np.arange(18.0).reshape(3, 2, 3)
    valid = np.array([[True, True], [True, False], [True, True]])
    return MotionCapture(("a", "b"), positions, valid, 50.0, "mm")


def test_a_recording_as_a_table(motion: MotionCapture) -> None:
    table = to_dataframe(motion, individual="anna")
    assert table.columns.tolist() == ["time_s", "individual", "keypoint", "x_mm", "y_mm", "z_mm"]
    row = table[(table["time_s"] == 0.02) & (table["keypoint"] == "a")]
    assert row[["x_mm", "y_mm", "z_mm"]].to_numpy().tolist() == [[6.0, 7.0, 8.0]]
    assert table["x_mm"].isna().sum() == 1
    assert set(table["individual"]) == {"anna"}


def test_a_recording_as_a_data_set_of_xarray(motion: MotionCapture) -> None:
    pytest.importorskip("xarray")
    data = to_xarray(motion)
    assert data["position"].dims == ("time", "space", "keypoint", "individual")
    assert data["confidence"].dims == ("time", "keypoint", "individual")
    at = data["position"].sel(time=0.04, space="z", keypoint="b", individual="individual_0")
    assert float(at) == 17.0
    assert bool(data["position"].sel(time=0.02, keypoint="b").isnull().all())
    assert (data.attrs["fps"], data.attrs["ds_type"]) == (50.0, "poses")


def test_results_are_shown_in_a_line(motion: MotionCapture) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    series = fourier.represent(output.positions_mm[0], 40.0)
    for thing in (
        motion,
        output,
        series,
        fit([fourier.represent(walk, 40.0) for walk in output.positions_mm]),
    ):
        assert len(repr(thing)) < 400, repr(thing)
        assert "array(" not in repr(thing)
    assert "coefficients: (5, 15, 3), frequency_hz=" in repr(series)


def test_a_result_of_park2011_is_shown_in_a_few_lines() -> None:
    body = limbs.synthetic_body(np.random.default_rng(1), 40)
    camera = camera_paths.around(40, target=body.root_mm, sweep_rad=1.0)
    result = articulated_trajectory.reconstruct(
        camera.project(body.positions_mm), camera, body.root_mm, body.lengths_mm, frame_rate_hz=30
    )
    for thing in (body, camera, result, *result.limbs.values(), result.refined):
        assert len(repr(thing)) < 600, repr(thing)
        assert "array(" not in repr(thing)


def test_a_motion_goes_round(tmp_path: Path) -> None:
    """Fourier coefficients survive the conversion to a motion and to a file; the player shows the same positions."""
    output = walkers.walking_population(
        np.random.default_rng(8), male=1, female=1, duration_s=4.0, frame_rate_hz=40.0
    )
    walk = fourier.represent(output.positions_mm[0], 40.0)
    capture = pipeline.motion(walk.coefficients, walk.frequency_hz, n_cycles=4, frame_rate_hz=60)
    assert capture.names == WALKER15.joints
    assert len(capture.positions_mm) == round(4 / walk.frequency_hz * 60)
    times = np.array([0.0, 1.0 / 60.0])
    reference = fourier.synthesise(walk.coefficients, walk.frequency_hz, times)
    np.testing.assert_allclose(capture.positions_mm[:2], reference)
    for again in (represent(capture), represent(walk3d.write(capture, tmp_path / "walk.trc"))):
        assert again.frequency_hz == pytest.approx(walk.frequency_hz, rel=1e-3)
        centred = walk.coefficients.copy()
        centred[0] -= centred[0, WALKER15.index("pelvis")]
        assert np.abs(again.coefficients - centred).max() < 10.0
    table = walk3d.angles(capture)
    knee = np.degrees(flexion(capture.positions_mm)[:, 1, 0])
    np.testing.assert_allclose(table["left_knee_deg"], knee)
    assert table["time_s"][1] == pytest.approx(1 / 60)
    lights = walk3d.pointlight(capture, view_angle_rad=np.pi / 2)
    assert lights.positions.shape[1:] == (15, 2)
    assert len(lights.positions) == round(60.0 / represent(capture).frequency_hz)
    assert lights._repr_html_().startswith("<svg")
    content = json.loads(re.search(r"} = (\{.*?\}), canvas", capture._repr_html_(), re.DOTALL)[1])  # type: ignore[index]
    np.testing.assert_allclose(content["frames"][0], capture.positions_mm[0], atol=0.51)
    assert [0, 1] in content["bones"] or [1, 0] in content["bones"]
    with rejects("wrong_shape", "coefficients"):
        pipeline.motion(walk.coefficients[:, :3], 1.0)
    with rejects("out_of_range", "n_cycles"):
        pipeline.motion(walk.coefficients, 1.0, n_cycles=0)


def test_a_player_finds_the_axis_that_points_up() -> None:
    """The player turns the y axis up for two points that lie one above the other along y, and marks a missing point."""
    positions = np.zeros((3, 2, 3))
    positions[:, 1] = [100.0, 1000.0, 200.0]
    capture = MotionCapture(("a", "b"), positions, np.array([[1, 1], [1, 1], [1, 0]], bool), 50.0, "mm")
    content = capture._repr_html_()
    assert "[[0, 0, 0], [200, 100, 1000]]" in content
    assert "[[0, 0, 0], [-1073741824, -1073741824, -1073741824]]" in content


def test_the_typed_facts_about_a_film_are_the_options_of_its_input() -> None:
    facts = get_type_hints(walk3d.api._Known)
    options = {f.name: f.type for f in fields(Input) if f.name != "path"}
    assert [*facts] == [*options]
    assert {name: kind.__name__ for name, kind in facts.items() if name != "labels"} == {
        name: str(kind) for name, kind in options.items() if name != "labels"
    }
    assert set(get_args(facts["labels"])) == {*Labels}
    with rejects("unknown_choice", "labels", value="exchanged"):
        walk3d.reconstruct("film.json", labels="exchanged")  # type: ignore[arg-type]


def test_the_public_names() -> None:
    names = "InvalidInput __version__ fit from_view joints motion read represent to_dataframe to_xarray"
    assert sorted(pipeline.__all__) == names.split()
    assert walk3d.__all__ == [
        "angles", "calibrate", "from_view", "pointlight", "reconstruct", "walkers", "write",
    ]  # fmt: skip
    for package in (pipeline, gait_pipeline, walk3d):
        assert all(getattr(package, name) is not None for name in package.__all__)


def test_the_version_is_that_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert pipeline.__version__ == project["version"]
    assert set(pipeline.__all__) <= set(dir(gait_pipeline)) | set(gait_pipeline.__all__)
    assert gait_pipeline.__all__ == pipeline.__all__
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {project['version']}" in changes


def test_what_is_no_recording_no_view_or_no_other_walk_is_refused(tmp_path: Path) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    walks = [fourier.represent(positions, 40.0) for positions in output.positions_mm]
    model = fit(walks[1:])
    for angle in (float("nan"), float("inf")):
        with rejects("out_of_range", "view_angle_deg", value=angle):
            from_view(model, walks[0], angle)
    for walk in walks[1:]:
        with rejects("same_walk", "model"):
            from_view(model, walk, 30.0)
    assert from_view(model, walks[0], 30.0).coefficients.shape == (5, 15, 3)
    for few in ([], walks[:1]):
        with rejects("too_few_people"):
            fit(few)
    with rejects("wrong_type", "motion"):
        joints(tmp_path / "walk.c3d")  # type: ignore[arg-type]


@pytest.mark.parametrize("laboratory", ["known", "unknown"])
def test_what_gives_no_reconstruction_is_refused_in_one_sentence(laboratory: str) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    first, *others = (fourier.represent(positions, 40.0) for positions in output.positions_mm)
    model = fit(others)
    metres = fourier.represent(output.positions_mm[0] / 1000.0, 40.0)
    for options, code, where in (
        ({"hidden": WALKER15.joints}, "nothing_seen", "hidden"),
        ({"noise_variance_mm2": -1.0}, "out_of_range", "noise_variance_mm2"),
        ({"noise_variance_mm2": None}, "out_of_range", "noise_variance_mm2"),
        ({"walk": metres}, "wrong_unit", "walk"),
        ({"walk": first.coefficients}, "wrong_type", "walk"),
        ({"walk": fourier.represent(output.positions_mm[0], 40.0, harmonics=3)}, "wrong_type", "walk"),
        ({"model": first}, "wrong_type", "model"),
    ):
        requested: dict[str, Any] = {"model": model, "walk": first, "laboratory": laboratory} | options
        with rejects(code, where):
            from_view(view_angle_deg=30.0, **requested)
    with rejects("wrong_type", "walk"):
        fit([*others, None])  # type: ignore[list-item]
    masked = np.ma.masked_less(output.positions_mm[0], output.positions_mm[0].min() + 1.0)
    with rejects("masked", "positions"):
        fourier.represent(masked, 40.0)


def test_a_walk_is_found_among_others() -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=1, female=1, duration_s=3.0, frame_rate_hz=40.0
    )
    walks = [fourier.represent(positions, 40.0) for positions in output.positions_mm]
    assert (walks.index(walks[1]), walks[0] in walks[1:], len({*walks, *walks})) == (1, False, 2)


def test_the_ten_lines_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    (tmp_path / "my_walks").mkdir()
    for k, walk in enumerate(output.positions_mm):
        write_c3d(tmp_path / "my_walks" / f"p{k}.c3d", WALKER15.joints, walk, 40.0)
    (code,) = (block for block in blocks("README.md", "py") if "from gait_pipeline import" in block)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert np.shape(names["coefficients"]) == (5, 15, 3)
    again = read(tmp_path / "reconstructed.c3d")
    walk = represent(tmp_path / "my_walks" / "p0.c3d")
    assert len(again.positions_mm) == round(300.0 / walk.frequency_hz)
    first = fourier.synthesise(names["coefficients"], walk.frequency_hz, np.zeros(1))
    np.testing.assert_allclose(again.positions_mm[:1], first, atol=0.01)


def test_numpy_is_not_loaded_before_somebody_asks() -> None:
    code = "import sys, pipeline; assert 'numpy' not in sys.modules; assert not hasattr(pipeline, 'nothing')"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


@pytest.mark.skipif(not os.environ.get("BUILD_PACKAGE"), reason="needs BUILD_PACKAGE: builds two wheels")
def test_the_wheel_works_in_an_empty_folder_and_has_the_same_bytes_twice(tmp_path: Path) -> None:
    wheel = build(tmp_path / "source", tmp_path / "one", 0o022)
    again = build(tmp_path / "copied elsewhere", tmp_path / "two", 0o077)
    assert again.read_bytes() == wheel.read_bytes()
    empty, installed = tmp_path / "empty", tmp_path / "installed"
    empty.mkdir()
    zipfile.ZipFile(wheel).extractall(installed)
    assert (installed / "pipeline" / "py.typed").is_file()
    assert (installed / "gait_pipeline" / "py.typed").is_file()
    run = [sys.executable, "-m", "pipeline", "experiment=zhang2007_fig2", "scale=smoke"]
    subprocess.run(run, cwd=empty, env=os.environ | {"PYTHONPATH": str(installed)}, check=True)
    assert (empty / "results" / "synthetic" / "smoke" / "zhang2007_fig2" / "table.csv").is_file()


def test_a_walker_of_an_unknown_laboratory_is_nearer_than_as_if_it_were_known() -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=8, female=8, duration_s=3.0, frame_rate_hz=40.0
    )
    series = [fourier.represent(walk, 40.0) for walk in output.positions_mm]
    model = fit(series[2:])
    off = {"known": 0.0, "unknown": 0.0}
    for reference in series[:2]:
        larger = replace(reference, coefficients=1.15 * reference.coefficients)
        for laboratory in off:
            again = from_view(model, larger, 20.0, laboratory=laboratory).coefficients
            np.testing.assert_allclose(
                camera.project(again, np.radians(20.0)), camera.project(larger.coefficients, np.radians(20.0))
            )
            off[laboratory] += float(((again - larger.coefficients) ** 2).sum())
    assert off["unknown"] < 0.8 * off["known"]
    hidden = from_view(model, series[0], 20.0, hidden=["left_knee"], laboratory="unknown").coefficients
    observed = series[0].coefficients
    assert not np.allclose(hidden[:, 10], observed[:, 10])  # from the prior, not from the image
    assert np.sqrt(((hidden - observed)[0, 10] ** 2).sum()) < 150.0
    with rejects("unknown_choice", "laboratory", value="ours"):
        from_view(model, series[0], 20.0, laboratory="ours")
    with rejects("wrong_type", "model"):
        from_view(
            LinearModel(
                **{f: getattr(model, f) for f in ("mean", "components", "eigenvalues", "total_variance")}
            ),
            series[0],
            20.0,
            laboratory="unknown",
        )


def test_two_known_people_of_a_laboratory_bring_its_others_nearer() -> None:
    output = walkers.walking_population(
        np.random.default_rng(9), male=9, female=9, duration_s=3.0, frame_rate_hz=40.0
    )
    series = [fourier.represent(walk, 40.0) for walk in output.positions_mm]
    moved = np.random.default_rng(3).normal(0.0, 20.0, (15, 3))
    moved = (moved + moved[list(WALKER15.mirror)] * [-1.0, 1.0, 1.0]) / np.sqrt(2.0)
    moved[WALKER15.index("pelvis")] = 0.0
    theirs = [replace(walk, coefficients=1.1 * walk.coefficients) for walk in series[:6]]
    for walk in theirs:
        walk.coefficients[0] += moved
    model = fit(series[6:])
    calibrated = calibrate(model, theirs[4:])
    off = [
        sum(
            float(
                (
                    (
                        from_view(m, reference, 90.0, laboratory="unknown").coefficients
                        - reference.coefficients
                    )
                    ** 2
                ).sum()
            )
            for reference in theirs[:4]
        )
        for m in (model, calibrated)
    ]
    assert off[1] < 0.85 * off[0]
    assert np.array_equal(
        from_view(calibrated, theirs[0], 20.0).coefficients,
        from_view(calibrated, theirs[0], 20.0, laboratory="unknown").coefficients,
    )
    # Two walks of one person are one person.
    first = calibrate(model, [theirs[4], theirs[4], theirs[5]], people=["a", "a", "b"])
    again, before = (from_view(m, theirs[0], 20.0).coefficients for m in (first, calibrated))
    np.testing.assert_allclose(again, before)
    with rejects("same_walk", "model"):
        from_view(calibrated, theirs[4], 20.0)
    with rejects("same_walk", "model"):
        calibrate(model, [series[7]])
    with rejects("no_walks"):
        calibrate(model, [])
    with rejects("wrong_count", "people", count=1):
        calibrate(model, theirs[4:], people=["a"])
    with rejects("wrong_type", "model"):
        calibrate("model.npz", theirs[4:])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("fourier.represent", "positions frame_rate_hz harmonics"),
        ("fourier.synthesise", "coefficients frequency_hz times_s"),
        ("linear_model.fit", "samples n_components"),
        ("linear_model.leave_one_out", "samples n_components"),
        ("reconstruction.least_squares", "E d"),
        ("reconstruction.maximum_a_posteriori", "E d eigenvalues noise_variance"),
        ("viewpoint.estimate", "model observed method noise_variance"),
        ("synchronization.synchronize", "x_n x_m max_disparity smoothness penalty start"),
        ("synchronization.distances", "sequences max_disparity smoothness penalty start"),
        ("synchronization.median_sequence", "distances"),
        ("trajectory_basis.cosine_basis", "F K"),
        ("articulation.ray_sphere", "cameras pixels parents radius"),
        ("binary_quadratic.minimise", "basis middle half_chord gap time_limit_s"),
        ("refinement.refine", "images camera root parents directions lengths basis"),
        ("reconstructibility.reconstructibility", "basis middle half_chord signs_true"),
    ],
)
def test_functions_that_others_call_keep_their_names_and_their_first_parameters(
    name: str, parameters: str
) -> None:
    module, _, function = name.partition(".")
    called = getattr(importlib.import_module(f"pipeline.core.{module}"), function)
    assert [*inspect.signature(called).parameters][: len(parameters.split())] == parameters.split()
