"""Tests that the written files of a reconstructed walk can be read: motion in every format, recording, and page."""

from __future__ import annotations

import html
import json
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.storage.publishing import publish
from tests.processes import python
from tests.recordings import reading, viewer
from tests.rejects import rejects
from tests.walk3d.film.reconstruct.walks import ERROR, alphapose, given, in_layout
from tests.walk3d.film.walk.walkers import clip, walks
from walk3d.export.bvh import Names
from walk3d.film import command
from walk3d.film.reconstruct.cycle import scale_mm
from walk3d.film.reconstruct.motion import Format, in_walkers_axes
from walk3d.film.reconstruct.writing import Output, Reconstruct, run


def test_what_is_written_can_be_read(model: Path, tmp_path: Path) -> None:
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    options = Reconstruct(
        input=given(path, focal_px=sim.focal_px, stature_mm=1700.0),
        output=Output(path=str(tmp_path / "out")),
        model_folder=str(model),
    )
    _, summary, folder = run(options)
    stored = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(summary))
    assert stored["verdict"] in ("walk", "doubtful")
    low, high = stored["view_angle_deg"]["interval_95"]
    assert low < stored["view_angle_deg"]["value"] < high
    assert stored["view_angle_deg"]["heading_deg"] == pytest.approx(-30.0, abs=12.0)
    assert "towards the camera" in stored["view_angle_deg"]["words"]
    assert stored["cadence"]["strides_per_s"] == pytest.approx(walks()[0].frequency_hz, rel=0.03)
    assert 300.0 < stored["step_length"]["mm"] < 1000.0
    table = tables.read(folder / "joints.csv")
    assert set(table["joint"]) >= {"left_knee", "pelvis"}
    legs = [table[a][table["joint"] == "left_knee"] - table[a][table["joint"] == "left_ankle"] for a in "xyz"]
    assert 300.0 < np.sqrt(np.sum(np.square(legs), axis=0)).mean() < 500.0
    assert set(table["observed"][table["joint"] == "sternum"]) == {0}


def test_motion_is_read_back(model: Path, tmp_path: Path) -> None:
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    options = Reconstruct(
        input=given(path, focal_px=sim.focal_px, stature_mm=1700.0),
        output=Output(path=str(tmp_path / "out"), formats=list(Format), recording=False, page=False),
        model_folder=str(model),
    )
    walk, summary, folder = run(options)
    assert walk.best.reconstruction is not None
    truth = in_walkers_axes(walk.best.reconstruction) * scale_mm(walk)
    # The walk goes along y, and the head is above the ankles.
    assert truth[-1, 8, 1] - truth[0, 8, 1] > 5 * abs(truth[-1, 8, 0] - truth[0, 8, 0])
    assert truth[:, 0, 2].min() > 1000.0
    axes = {"trc": [[0, 1, 0], [0, 0, 1], [1, 0, 0]], "bvh": [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]}
    for file in ("walk.c3d", "walk.trc", "walk.bvh", "walk.csv", "walk_wide.csv"):
        read = formats.read(folder / file)
        assert set(WALKER15.joints) <= set(read.names)
        back = np.array(axes.get(file[5:], np.eye(3)))
        # Limbs of a BVH have their mean lengths: its root alone is exact.
        bound = 80.0 if file == "walk.bvh" else 1e-2
        for number, name in enumerate(read.names):
            if name in WALKER15.joints:
                off = read.positions_mm[:, number] @ back - truth[:, WALKER15.index(name)]
                if file == "walk.bvh":  # stands on soles
                    off[:, 2] -= off[:, 2].mean()
                assert np.abs(off).max() < (1e-2 if name == "pelvis" else bound), (file, name)
        assert read.frame_rate_hz == pytest.approx(30.0)
    message = (folder / "motion.txt").read_text(encoding="utf-8")
    assert all(joint in message.splitlines()[0] for joint in summary["estimated_joints"])
    assert "sternum" in summary["estimated_joints"]
    assert not (folder / "recording.rrd").exists()
    assert not (folder / "walk.html").exists()
    rows = tables.read(folder / "cycle.csv")
    assert set(rows["angle"]) == {"knee", "hip", "shank", "elbow", "shoulder", "trunk"}
    numbers = tables.read(folder / "numbers.csv")
    step = numbers["value"][(numbers["number"] == "step_length") & (numbers["side"] == "left")]
    assert step.tolist() == [summary["gait_cycle"]["numbers"]["step_length"]["left"]["value"]]


@pytest.mark.parametrize("in_place", [False, True])
def test_one_cycle_loops(model: Path, tmp_path: Path, in_place: bool) -> None:
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    options = Reconstruct(
        input=given(path, focal_px=sim.focal_px, stature_mm=1700.0),
        output=Output(path=str(tmp_path / "out"), formats=[Format.bvh], names=Names.rokoko, in_place=in_place,
                      recording=False, page=False),
        model_folder=str(model),
    )  # fmt: skip
    _, summary, folder = run(options)
    loop = formats.read(folder / "walk_cycle.bvh")
    stride = summary["gait_cycle"]["numbers"]["stride_length"]["both"]["value"]
    ahead = loop.positions_mm[-1] - loop.positions_mm[0]
    np.testing.assert_allclose(ahead, np.tile([0, 0, 0 if in_place else stride], (len(ahead), 1)), atol=0.51)
    last = (folder / "walk_cycle.bvh").read_text(encoding="utf-8").splitlines()
    first = next(number for number, line in enumerate(last) if line.startswith("Frame Time")) + 1
    turned = [np.array(line.split()[3:], dtype=float) for line in (last[first], last[-1])]
    np.testing.assert_allclose(*turned, atol=1e-9)
    duration = (len(loop.positions_mm) - 1) / loop.frame_rate_hz
    assert duration == pytest.approx(1 / summary["cadence"]["strides_per_s"], rel=1e-3)
    whole = formats.read(folder / "walk.bvh").positions_mm
    forwards = whole[-1, 0, 2] - whole[0, 0, 2]
    assert (abs(forwards) < 1e-3) if in_place else (forwards > 1000)
    assert {"Hips", "LeftThigh", "RightShin", "LeftToe", "Spine4"} - set(loop.names) == {"Spine4"}


def test_input_and_files_of_others_are_kept(model: Path, tmp_path: Path) -> None:
    sim = clip(-30.0, ERROR)
    out = tmp_path / "out"
    out.mkdir()
    path = alphapose(out / "walk.json", in_layout(sim, "coco17"))

    def again(source: Path, folder: Path) -> None:
        options = Reconstruct(
            input=given(source, focal_px=sim.focal_px),
            output=Output(path=str(folder), formats=[Format.csv], recording=False, page=False),
            model_folder=str(model),
        )
        run(options)

    before = path.read_bytes()
    with rejects("holds_input", "output.path"):
        again(path, out)
    assert [p.name for p in out.iterdir()] == ["walk.json"]
    path = path.rename(tmp_path / "walk.json")
    (out / "portrait.png").write_text("mine")
    with rejects("not_replaced", why="no_file"):
        again(path, out)
    assert [p.name for p in out.iterdir()] == ["portrait.png"]
    (out / "portrait.png").unlink()
    again(path, out)  # an empty folder
    (out / "notes.txt").write_text("mine")
    again(path, out)  # ours, with a file of the reader's
    assert (out / "notes.txt").read_text() == "mine"
    assert path.read_bytes() == before
    with rejects("inside_published"):
        again(path, out / "inside")
    with publish(tmp_path / "figure", having="figure") as publication:
        publication.facts = {"figure": "zhang2007_fig5"}
    with rejects("not_replaced", why="other_command"):
        again(path, tmp_path / "figure")


def test_recording_and_page_show_image_mean_samples_and_view(model: Path, tmp_path: Path) -> None:
    sim = clip(-30.0, ERROR)
    path = alphapose(tmp_path / "a.json", in_layout(sim, "coco17"))
    options = Reconstruct(
        input=given(path, focal_px=sim.focal_px),
        output=Output(path=str(tmp_path / "out"), formats=[]),
        model_folder=str(model),
    )
    walk, summary, folder = run(options)
    text = (folder / "walk.html").read_text(encoding="utf-8")
    assert html.escape(summary["view_angle_deg"]["words"]) in text
    file = folder / "recording.rrd"
    viewer.verify(file)
    assert file.stat().st_size < 5_000_000
    T = len(walk.best.pixels)
    _, mean = reading.read_column(file, "world/reconstructed", "Points3D:positions", "time")
    _, samples = reading.read_column(file, "world/samples", "Points3D:positions", "time")
    assert mean.shape == (T, 15, 3)
    drawn = samples.reshape(T, -1, 15, 3)
    # Walks drawn from the posterior stand about its mean, the wrists farther from it than the hips.
    spread = 1e3 * (drawn - mean[:, None]).std(axis=1).mean(axis=(0, 2))
    assert spread[8] < 1e-2
    assert spread[[4, 7]].mean() > 1.2 * spread[[9, 12]].mean()
    _, observed = reading.read_column(file, "image/observed", "Points2D:positions", "time")
    _, output = reading.read_column(file, "image/reprojection", "Points2D:positions", "time")
    assert np.nanmedian(np.abs(observed - output)) < 15.0
    # The camera of the recording shows the walk of its space where the image has it.
    _, walked = reading.read_column(file, "walked/reconstructed", "Points3D:positions", "time")
    centre, axes, inner = (
        reading.read_column(file, "image", name)[1].ravel()
        for name in ("Transform3D:translation", "Transform3D:mat3x3", "Pinhole:image_from_camera")
    )
    projected = (walked - centre) @ axes.reshape(3, 3).T @ inner.reshape(3, 3)
    assert np.median(np.abs(projected[..., :2] / projected[..., 2:] - output)) < 5.0
    assert walked[:, [11, 14], 2].min() == pytest.approx(0.0, abs=0.05)  # ankles on the ground


@pytest.mark.parametrize(("verdict", "status"), [("walk", 0), ("doubtful", 0), ("not_a_walk", 1)])
def test_the_exit_status_says_on_request_that_a_clip_is_not_a_walk(
    verdict: str, status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "clip=2.json"
    source.write_text("[]", encoding="utf-8")
    options = []
    monkeypatch.setattr(
        command, "run", lambda given, *_: (options.append(given), {"verdict": verdict}, tmp_path)
    )
    monkeypatch.setattr(command.words, "facts", lambda summary: [("", ["the reason"])])
    assert command.reconstruct([str(source), "input.width=640", "--fail-if-not-a-walk"]) == status
    assert command.reconstruct([str(source), "input.width=640"]) == 0
    assert [(each.input.path, each.input.width) for each in options] == [(str(source), 640)] * 2


def test_the_command_loads_no_more_than_it_needs() -> None:
    """The command does not load packages that take longer to load than a reconstruction."""
    heavy = "pandas", "numba", "matplotlib", "rerun", "jinja2"
    script = (
        f"import sys, pipeline.cli.main, walk3d.film.command; print([m for m in {heavy} if m in sys.modules])"
    )
    message = python("-c", script)
    assert message.stdout.strip() == "[]", message.stdout + message.stderr
