"""Tests that the package's readers and ezc3d read the exported motion from files of every format."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.cli.inspect import inspect, summary
from pipeline.cli.walkers import keypoint_walk
from pipeline.core import fourier
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage.store import packed
from pipeline.synthetic import walkers
from tests.rejects import rejects
from walk3d.export.bvh import write as write_bvh
from walk3d.export.c3d import write as write_c3d
from walk3d.export.command import export

HZ = 50.0
TO_BVH = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
TO_OPENSIM = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """Return the walk of one walker on a treadmill (T, 15, 3), mm."""
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=1, duration_s=3.0, frame_rate_hz=HZ
    )
    return np.asarray(output.positions_mm[0])


@pytest.fixture(scope="module")
def figure(walk: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a figure with one walker, seen from 30 degrees, whose head was estimated."""
    folder = tmp_path_factory.mktemp("figure")
    series = fourier.represent(walk, HZ)
    angle = np.radians(30)
    missing = -np.sin(angle) * series.coefficients[..., 0] + np.cos(angle) * series.coefficients[..., 1]
    arrays = {
        "walker": np.array(["anna_1"]),
        "methods": np.array(["map"]),
        "demonstration_view_deg": np.array([30.0]),
        "missing": missing[None, None, None] + 5.0,
        "original": series.coefficients[None],
        "stride_hz": np.array([series.frequency_hz]),
        "unmeasured": np.arange(15)[None] == 0,
    }
    (folder / "arrays.npz").write_bytes(packed(arrays))
    return folder


@pytest.mark.parametrize(
    ("target", "turned", "off_mm"),
    [
        ("a.c3d", np.eye(3), 1e-4),
        ("a.trc", TO_OPENSIM, 1e-9),
        ("a.bvh", TO_BVH, 1e-9),
        ("a.csv", np.eye(3), 0.0),
        ("a.csv layout=wide", np.eye(3), 0.0),
        ("a.npz", np.eye(3), 0.0),
    ],
)
def test_a_reconstruction_is_read_back(
    figure: Path, tmp_path: Path, target: str, turned: np.ndarray, off_mm: float
) -> None:
    name, *options = target.split()
    inputs = [
        str(figure),
        f"to={tmp_path / name}",
        "view_angle_deg=30",
        "cycles=2",
        "frame_rate_hz=80",
        *options,
    ]
    motion = formats.read(export(inputs))
    with np.load(figure / "arrays.npz", allow_pickle=False) as arrays:
        original, stride = arrays["original"][0], float(arrays["stride_hz"][0])
    names = [n for n in motion.names if not n.endswith("_end")]
    plain = [f"{joint}{'_estimated' if k == 0 else ''}" for k, joint in enumerate(WALKER15.joints)]
    again = [f"{joint}_map{'_estimated' if k == 0 else ''}" for k, joint in enumerate(WALKER15.joints)]
    assert sorted(names) == sorted(plain + again)
    times = np.arange(len(motion.positions_mm)) / 80
    assert len(times) == round(2 / stride * 80)
    expected = fourier.synthesise(original, stride, times) @ turned.T
    result = motion.positions_mm[:, [motion.names.index(n) for n in plain]]
    np.testing.assert_allclose(result, expected, rtol=0, atol=off_mm)
    # The reconstruction is 5 mm off in the missing dimension at its mean, and nowhere else.
    other = motion.positions_mm[:, [motion.names.index(n) for n in again]] @ turned
    off = (other - result @ turned).mean(axis=0)
    across = off @ np.array([-np.sin(np.radians(30)), np.cos(np.radians(30)), 0])
    assert np.isfinite(across).all()
    np.testing.assert_allclose(
        off @ np.array([np.cos(np.radians(30)), np.sin(np.radians(30)), 0]), 0, atol=1e-3
    )
    assert motion.frame_rate_hz == pytest.approx(80)


@pytest.mark.parametrize("wanted", [50.0, 40.0])
def test_a_recording_at_a_lower_rate_is_the_same_motion(tmp_path: Path, wanted: float) -> None:
    times = np.arange(101) / 100.0
    path = np.stack([times, times**2, -times], axis=-1)[:, None] * 1000.0
    trc.write(tmp_path / "a.trc", ["a"], path, 100.0)
    motion = formats.read(
        export([str(tmp_path / "a.trc"), f"frame_rate_hz={wanted:g}", f"to={tmp_path / 'b.csv'}"])
    )
    at = np.arange(wanted + 1.0) / wanted  # the whole second
    assert motion.frame_rate_hz == wanted
    expected = np.stack([at, at**2, -at], axis=-1) * 1000.0
    np.testing.assert_allclose(motion.positions_mm[:, 0], expected, atol=0.1)


def test_a_recording_goes_from_format_to_format(walk: np.ndarray, tmp_path: Path) -> None:
    source = tmp_path / "a.trc"
    holed = walk.copy()
    holed[10:20, 3] = np.nan
    trc.write(source, WALKER15.joints, holed, HZ)
    for name in ("b.c3d", "b.csv", "b.trc"):
        motion = formats.read(export([str(source), f"to={tmp_path / name}"]))
        np.testing.assert_allclose(motion.positions_mm, holed, atol=1e-3)
        assert (motion.names, motion.frame_rate_hz) == (WALKER15.joints, HZ)
    with rejects("missing_sample", joint="left_elbow", frame=10):
        export([str(source), f"to={tmp_path / 'b.bvh'}", "skeleton=auto"])
    archive = export([str(source), f"to={tmp_path / 'b.npz'}", "skeleton=walker15"])
    with np.load(archive, allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["positions_mm"], holed)


@pytest.mark.parametrize(("before", "unit", "factor"), [("", "m", 1000), ("q", "mm", 1)])
def test_a_recording_without_a_unit_is_exported_in_that_of_human_legs(
    walk: np.ndarray, tmp_path: Path, capsys: pytest.CaptureFixture[str], before: str, unit: str, factor: int
) -> None:
    source = tmp_path / "a.trc"
    names = [f"{before}{number if before else joint}" for number, joint in enumerate(WALKER15.joints)]
    trc.write(source, names, walk / 1000, HZ)
    source.write_text(source.read_text().replace("\tmm\t", "\t\t"))
    motion = formats.read(export([str(source), f"to={tmp_path / 'b.c3d'}"]))
    np.testing.assert_allclose(motion.positions_mm, walk / 1000 * factor, atol=1.0)
    assert f"no unit; its numbers are taken as {unit}, " in capsys.readouterr().out


@pytest.mark.parametrize("points", [1, 256])
def test_ezc3d_reads_what_is_written(points: int, tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    positions = np.random.default_rng(1).normal(size=(7, points, 3)) * 1000
    positions[2, 0] = np.nan
    names = [f"point number {k}" for k in range(points)]
    write_c3d(tmp_path / "a.c3d", names, positions, 59.94)
    theirs = ezc3d.c3d(str(tmp_path / "a.c3d"))
    np.testing.assert_array_equal(
        theirs["data"]["points"][:3].transpose(2, 1, 0), positions.astype(np.float32).astype(float)
    )
    assert theirs["parameters"]["POINT"]["RATE"]["value"][0] == pytest.approx(59.94)
    assert theirs["parameters"]["POINT"]["LABELS"]["value"][:255] == names[:255]
    ours = formats.read(tmp_path / "a.c3d")
    assert ours.names == tuple(names)
    assert not ours.valid[2, 0]
    assert ours.valid.sum() == 7 * points - 1


def test_more_frames_than_a_counter_of_16_bits_holds(tmp_path: Path) -> None:
    positions = np.ones((70_000, 1, 3))
    write_c3d(tmp_path / "a.c3d", ["a"], positions, 100.0)
    assert len(formats.read(tmp_path / "a.c3d").positions_mm) == 70_000


@pytest.mark.parametrize("name", ["b.c3d", "b.trc", "b.bvh", "b.csv", "b.npz"])
def test_a_reconstruction_alone_is_a_walk_again(figure: Path, tmp_path: Path, name: str) -> None:
    """An exported reconstruction is recognised as a walk.

    The names of its joints end in the method, and the estimated joint does not count as measured.
    """
    export([str(figure), f"to={tmp_path / name}", "motion=reconstructed", "cycles=4"])
    (result,) = inspect([str(tmp_path / name)])
    assert result.mapping == "walker15"
    assert result.strides == pytest.approx(4, abs=0.1)
    assert any("14 of 15 joints; estimated in walks: head" in line for line in result.lines)


def test_joints_that_another_program_has_written_again(walk: np.ndarray, tmp_path: Path) -> None:
    """A table of joints that another program wrote again is read, and is rejected without valid times.

    The numbers of stretches have become 0.0 in this table.
    """
    (tmp_path / "summary.json").write_text(json.dumps({"verdict": "walk", "stretches": [{"strides": 2.0}]}))
    for rate in (HZ, np.inf):
        rows = [[0.0, frame / rate, *joint] for frame, joints in enumerate(walk) for joint in joints]
        np.savetxt(tmp_path / "joints.csv", rows, delimiter=",", header="stretch,time_s,x,y,z", comments="")
        if rate == HZ:
            stride_hz = fourier.represent(walk, HZ).frequency_hz
            assert keypoint_walk(tmp_path).stride_hz == pytest.approx(stride_hz, rel=0.01)
    with rejects("unreadable", "joints.csv"):
        keypoint_walk(tmp_path)


@pytest.mark.parametrize("name", ["b.c3d", "b.trc", "b.bvh", "b.csv", "wide.csv", "b.npz"])
def test_what_is_exported_is_a_walk_again(walk: np.ndarray, tmp_path: Path, name: str) -> None:
    """An exported recording is recognised as a walk with ``skeleton=auto``, with either axis upwards."""
    trc.write(tmp_path / "a.trc", WALKER15.joints, walk, HZ)
    options = ["layout=wide"] if name == "wide.csv" else []
    export([str(tmp_path / "a.trc"), "skeleton=auto", f"to={tmp_path / name}", *options])
    (result,) = inspect([str(tmp_path / name)])
    assert (result.mapping, result.strides > 2) == ("walker15", True)


def test_a_bvh_keeps_its_tree(walk: np.ndarray, tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", WALKER15.joints, walk, HZ, WALKER15.parents)
    motion = formats.read(tmp_path / "a.bvh")
    for j, joint in enumerate(WALKER15.joints):
        np.testing.assert_allclose(motion.positions_mm[:, motion.names.index(joint)], walk[:, j], atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "code", "where"),
    [
        ([], "no_source", ""),
        (["FIGURE", "to=a.xyz"], "unknown_format", "to"),
        (["FIGURE", "to=no/such/folder/a.c3d"], "no_folder", "no/such/folder"),
        (["FIGURE", "to=a.c3d", "walker=ben"], "unknown_choice", "walker"),
        (["FIGURE", "to=a.c3d", "view_angle_deg=45"], "no_such_view", "view_angle_deg"),
        (["FIGURE", "to=a.c3d", "view_angle_deg=side"], "not_a_number", "view_angle_deg"),
        (["FIGURE", "to=a.c3d", "cycles=1e9"], "out_of_range", "cycles"),
        (["FIGURE", "to=a.c3d", "colour=red"], "unknown_option", "colour"),
        (["FIGURE", "to=a.c3d", "units=m"], "no_effect", "units"),
        ([".", "to=a.c3d"], "no_figure", "."),
    ],
)
def test_what_cannot_be_exported_is_refused(
    figure: Path, arguments: list[str], code: str, where: str
) -> None:
    with rejects(code, where):
        export([argument.replace("FIGURE", str(figure)) for argument in arguments])


def test_inspect_says_that_files_of_one_name_need_the_person(walk: np.ndarray, tmp_path: Path) -> None:
    for who in ("anna", "ben", "eva"):
        (tmp_path / who).mkdir()
        trc.write(tmp_path / who / "walk_1.trc", WALKER15.joints, walk, HZ)
    result = list(inspect([str(tmp_path)]))
    assert [first.name for first in result] == ["anna/walk_1.trc", "ben/walk_1.trc", "eva/walk_1.trc"]
    count, requested, following = summary(tmp_path, result)
    assert count.startswith("3 of 3 files contain walks, of 3 people: anna, ben, eva;")
    assert (
        "several folders have files of the same name: set data.person='^(.+?)/' if each folder" in requested
    )
    assert following.endswith("skeleton=auto data.person='^(.+?)/'")


def test_inspect_goes_on_after_a_file_of_two_people(walk: np.ndarray, tmp_path: Path) -> None:
    names = [f"{who}:{joint}" for who in ("anna", "ben") for joint in WALKER15.joints]
    write_c3d(tmp_path / "a.c3d", names, np.concatenate([walk, walk + 900], axis=1), HZ)
    trc.write(tmp_path / "b.trc", WALKER15.joints, walk, HZ)
    write_c3d(tmp_path / "c.c3d", WALKER15.joints, walk / 1000, HZ)
    both, first, metres = inspect([str(tmp_path)])
    assert both.people == ("anna", "ben")
    assert "select one with subject=" in both.lines[-2]
    assert both.lines[-1].endswith("subject=anna")
    assert first.people == ()
    assert first.strides > 2
    assert "units=m" in metres.lines[-1]
    (metres,) = inspect([str(tmp_path / "c.c3d"), "units=m"])
    assert metres.strides > 2
    (wrong,) = inspect([str(tmp_path / "c.c3d"), "units=cm"])
    again = f"next: python -m pipeline inspect {tmp_path / 'c.c3d'} units=m   (data.units= in runs)"
    assert wrong.lines[-1] == again
    (stated,) = inspect([str(tmp_path / "b.trc"), "units=m"])
    assert "The file states the unit 'mm'; the requested unit 'm' is used instead." in stated.lines
    (tmp_path / "take.fbx").touch()
    described = summary(tmp_path, [both, first, metres])
    assert described[0].startswith("2 of 3 files contain walks, of 2 people: b, c;")
    assert "data.person=" in described[1]
    assert described[2].startswith(f"next: python -m pipeline inspect {tmp_path} details=true")
    assert described[3] == "not read: 1 .fbx (export it as BVH, in Blender for instance)"
    (ben,) = inspect([str(tmp_path / "a.c3d"), "subject=ben"])
    assert ben.strides > 2
    assert "data.subject=ben" in ben.lines[-1]


def test_inspect_says_what_a_file_is_and_what_to_type(walk: np.ndarray, tmp_path: Path) -> None:
    trc.write(tmp_path / "anna_1.trc", WALKER15.joints[1:], walk[:, 1:], HZ)
    trc.write(tmp_path / "odd.trc", ["a", "b"], walk[:, :2], HZ)
    (tmp_path / "broken.bvh").write_text("HIERARCHY\n", encoding="utf-8")
    anna, broken, odd = inspect([str(tmp_path)])
    assert (anna.mapping, anna.strides > 2) == ("walker15", True)
    assert any("estimated in walks: head" in line for line in anna.lines)
    assert "skeleton=walker15" in anna.lines[-1]
    assert "cannot be read: broken.bvh" in broken.lines[0]
    assert "no mapping fits" in odd.lines[-2]
    assert "write=my_lab.yaml" in odd.lines[-1]
    with rejects("too_few_points"):
        list(inspect([str(tmp_path / "odd.trc"), f"write={tmp_path / 'my_lab.yaml'}"]))
    list(inspect([str(tmp_path / "anna_1.trc"), f"write={tmp_path / 'my_lab.yaml'}"]))
    assert (tmp_path / "my_lab.yaml").is_file()
    with rejects("not_replaced", "my_lab.yaml", why="exists"):
        list(inspect([str(tmp_path / "anna_1.trc"), f"write={tmp_path / 'my_lab.yaml'}"]))


def test_inspect_names_what_takes_a_walk_all_the_same_and_limbs_that_differ(
    walk: np.ndarray, tmp_path: Path
) -> None:
    odd = walk.copy()
    ankle, knee = (WALKER15.index(f"left_{part}") for part in ("ankle", "knee"))
    odd[:, ankle] += np.random.default_rng(1).normal(scale=230.0, size=(len(walk), 3))
    trc.write(tmp_path / "a.trc", WALKER15.joints, odd, HZ)
    (result,) = inspect([str(tmp_path / "a.trc")])
    described = "\n".join(result.lines)
    assert "got" not in described.split()
    assert re.search(r"expected [0-9.]+ or (more|less), found [0-9.]+", described)
    assert re.search(r"data=folder .* data\.steady\.residual_share=0\.\d+$", result.lines[-1])
    long = walk.copy()
    long[:, ankle] = long[:, knee] + 1.3 * (long[:, ankle] - long[:, knee])
    trc.write(tmp_path / "b.trc", WALKER15.joints, long, HZ)
    (result,) = inspect([str(tmp_path / "b.trc")])
    assert [line for line in result.lines if "the left shank is" in line]
    assert result.strides > 2


def test_inspect_names_the_nearest_mapping_only_if_a_point_of_it_is_there(
    walk: np.ndarray, tmp_path: Path
) -> None:
    trc.write(tmp_path / "a.trc", [f"p{k}" for k in range(15)], walk, HZ)
    trc.write(tmp_path / "b.trc", [*WALKER15.joints[:11], *(f"p{k}" for k in range(4))], walk, HZ)
    nothing, some = inspect([str(tmp_path)])
    assert "no mapping fits" in nothing.lines
    assert any("the nearest is walker15, which also needs: left_ankle" in line for line in some.lines)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "mm"), (0.001, "m"), (1 / 25.4, "in")])
def test_inspect_says_one_thing_about_a_unit_that_nobody_stated(
    walk: np.ndarray, tmp_path: Path, scale: float, unit: str
) -> None:
    columns = [f"{joint}_{axis}" for joint in WALKER15.joints for axis in "xyz"]
    rows = (",".join(map(repr, row.tolist())) for row in scale * walk.reshape(len(walk), -1))
    text = "\n".join([",".join(columns), *rows])
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    (result,) = inspect([str(tmp_path / "a.csv"), f"frame_rate_hz={HZ}"])
    assert result.strides > 2
    described = [line for line in result.lines if re.search("unit|taken as", line)]
    assert len(described) == 2
    assert "no unit stated" in described[0]
    assert f"taken as {unit}, which makes legs of" in described[1]
