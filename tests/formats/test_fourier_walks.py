"""Tests of walks that are stored as Fourier series: average walkers in JavaScript, JSON, MAT and ``mm`` files."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import pipeline as gait
from pipeline import formats
from pipeline.core import fourier, walking
from pipeline.formats import fourier_walks
from pipeline.formats.fourier_walks import FourierWalk, series
from pipeline.skeleton import WALKER15
from tests import made_up_walker
from tests.formats.contract import FIXTURES, check_contract, replace
from tests.rejects import rejects

MEAN, AXES = made_up_walker.walker()


def coefficients(blocks: np.ndarray) -> np.ndarray:
    """Return the coefficients (5, 15, 3) of a walker in the file layout (5, 46)."""
    return np.array([[[block[15 * x + j] for x in range(3)] for j in range(15)] for block in blocks])


def in_our_frame(gender: float) -> np.ndarray:
    """Return a synthetic walker (5, 15, 3), relative to its mean pelvis position and walking along y."""
    ours = made_up_walker.synthetic_walker(gender)[0].copy()
    ours[0] -= ours[0, WALKER15.index("pelvis")]
    return walking.turn_about_vertical(ours, -walking.step_heading(ours))


@pytest.mark.parametrize("name", made_up_walker.MADE)
def test_the_fixtures_are_made_up(name: str) -> None:
    assert (FIXTURES / name).read_text("utf-8") == made_up_walker.MADE[name]()


@pytest.mark.parametrize("name", ["js_made_up.js", "json_made_up.json"])
def test_the_average_walker_and_its_axes(name: str) -> None:
    walker = fourier_walks.average_walker(FIXTURES / name)
    np.testing.assert_array_equal(walker.mean, MEAN)
    assert list(walker.axes) == ["gender", "weight", "nervous", "happy"]
    for axis, values in AXES.items():
        np.testing.assert_array_equal(walker.axes[axis], values)
    heavy = walker.at(weight=3.0, happy=-1.0)
    blocks = MEAN + 3.0 * AXES["weight"] - AXES["happy"]
    np.testing.assert_allclose(heavy.coefficients, coefficients(blocks), atol=1e-9)
    assert heavy.stride_hz == pytest.approx(120.0 / blocks[0, -1])
    assert heavy.speed_mm_s == pytest.approx(120.0 * blocks[2, -1])


def test_a_walker_beyond_the_axes_is_refused() -> None:
    walker = fourier_walks.average_walker(FIXTURES / "json_made_up.json")
    with rejects("out_of_range", "weight", value=6.5):
        walker.at(weight=6.5)
    with rejects("unknown_choice", "axis"):
        walker.at(age=1.0)


@pytest.mark.parametrize("name", made_up_walker.MADE)
def test_the_walk_that_is_read_is_the_series(name: str) -> None:
    motion = formats.read(FIXTURES / name)
    check_contract(motion)
    assert motion.names == tuple(WALKER15.joints)
    times = np.arange(len(motion.valid)) / motion.frame_rate_hz
    series = fourier.synthesise(coefficients(MEAN), 120.0 / MEAN[0, -1], times)
    np.testing.assert_allclose(motion.positions_mm, series, atol=1e-6)
    assert times[-1] * 120.0 / MEAN[0, -1] > 10, (
        "with more than ten strides little of a fitted path is the walk's"
    )


@pytest.mark.parametrize("name", made_up_walker.MADE)
def test_the_library_represents_it_in_our_frame(name: str) -> None:
    walk = gait.represent(FIXTURES / name)
    assert walk.frequency_hz == pytest.approx(120.0 / MEAN[0, -1], abs=1e-6)
    assert walk.residual_fraction < 1e-3
    np.testing.assert_allclose(walk.coefficients, in_our_frame(0.5), atol=0.3)


def test_source_and_terms_go_with_the_average_walker(tmp_path: Path) -> None:
    path = tmp_path / "a.js"
    path.write_text("// Copyright (c) 2022 … and Nikolaus Troje\n" + made_up_walker.javascript(), "utf-8")
    assert fourier_walks.average_walker(path).source == fourier_walks.SOURCE
    assert any(fourier_walks.SOURCE in note for note in formats.read(path).notes)
    assert "CC BY-NC-SA 4.0" in fourier_walks.SOURCE
    path = tmp_path / "a.json"
    stated = {"source": "a laboratory\n", "terms": "ask \x1b[31mthem"}
    path.write_text(json.dumps(json.loads(made_up_walker.as_json()) | stated), "utf-8")
    assert "Source: a laboratory ; ask [31mthem." in formats.read(path).notes


def test_numbers_are_read_and_nothing_is_run(tmp_path: Path) -> None:
    path = tmp_path / "a.js"
    path.write_text(made_up_walker.javascript(), "utf-8")
    replace(path, "this.meanwalker[0] = new Array(\n", "this.meanwalker[0] = new Array(\n      alert(1),\n")
    with rejects("no_walkers", "a.js"):
        formats.read(path)
    path.write_text(made_up_walker.javascript().replace(f"      {MEAN[0, 0]},", "      x,", 1), "utf-8")
    with rejects("not_number", "a.js", text="x"):
        formats.read(path)


def test_an_array_of_another_length_is_refused(tmp_path: Path) -> None:
    content = json.loads(made_up_walker.as_json())
    path = tmp_path / "a.json"
    for change, code in (
        ({"mean_walker": content["mean_walker"][:-1]}, "wrong_count"),
        ({"mean_walker": ["1"] * 230}, "no_walkers"),
        ({"axes": {}}, "no_walkers"),
        ({"mean_walker": [0.0] * 230}, "unusable_period"),
        ({"mean_walker": [float("nan")] * 230}, "wrong_count"),
    ):
        path.write_text(json.dumps(content | change), "utf-8")
        with rejects(code, "a.json"):
            formats.read(path)


def test_keypoints_in_json_are_told_where_to_go(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"people": []}', "utf-8")
    with rejects("no_walkers", "a.json") as refused:
        formats.read(path)
    assert formats.ADVICE[".json"] in str(refused.value)
    assert not formats.is_recording(path)
    assert all(formats.is_recording(FIXTURES / name) for name in made_up_walker.MADE)


# --- mm files ---------------------------------------------------------------------------------------------


def test_an_mm_file_by_hand(tmp_path: Path) -> None:
    """An mm file with one marker that moves 20 mm forwards and 3 mm up twice per stride is read correctly."""
    path = tmp_path / "a.mm"
    path.write_text("100 0 20 0 0\n0,0,0,0,0\n900 0 0 3 0\n\n60 1.5 10 0 0\n", "utf-8")
    motion = formats.read(path)
    assert motion.names == ("marker_1",)
    stride = motion.frame_rate_hz / 2.0  # frames: 60 of 120 Hz are half a second
    quarter = round(stride / 4)
    assert 4 * quarter == stride
    np.testing.assert_allclose(motion.positions_mm[0, 0], [100, 0, 903])
    np.testing.assert_allclose(motion.positions_mm[quarter, 0], [120, 0, 897], atol=1e-9)
    assert any("size 1.5" in note and "1.2 m/s" in note for note in motion.notes)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    walk = FourierWalk(rng.normal(0.0, 500.0, (5, 7, 3)), 111.25, 0.975, 10.5)
    fourier_walks.write_mm(tmp_path / "a.mm", walk)
    rows = [line.split() for line in (tmp_path / "a.mm").read_text("utf-8").splitlines()]
    assert [len(rows), {len(row) for row in rows}] == [22, {5}]
    # Sine 1 of the second marker's y is the third column of row 7 + 2.
    assert float(rows[8][2]) == pytest.approx(walk.coefficients[1, 1, 1], abs=1e-6)
    assert [float(value) for value in rows[-1]] == [111.25, 0.975, 10.5, 0.0, 0.0]
    motion = formats.read(tmp_path / "a.mm")
    times = np.arange(len(motion.valid)) / motion.frame_rate_hz
    np.testing.assert_allclose(motion.positions_mm, walk.positions(times), atol=1e-5)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("1 2 3 4 5\n" * 3, "wrong_count"),
        ("1 2 3 4 5\n" * 5, "wrong_count"),
        ("1 2 3 4\n" * 4, "unusable_line"),
        ("1 2 3 4 nan\n" * 4, "unusable_line"),
        ("1 2 3 4 x\n" * 4, "not_number"),
        ("1 2 3 4 5\n" * 4, "unusable_period"),
        ("1 2 3 4 5\n" * 1003, "too_many_rows"),
    ],
)
def test_what_is_no_mm_file_is_refused(text: str, code: str, tmp_path: Path) -> None:
    (tmp_path / "a.mm").write_text(text, "utf-8")
    with rejects(code, "a.mm"):
        formats.read(tmp_path / "a.mm")


def test_a_walker_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with rejects("wrong_shape", "the walker"):
        fourier_walks.write_mm(tmp_path / "a.mm", FourierWalk(np.zeros((3, 15, 3)), 120.0))
    with rejects("not_number", "a.mm"):
        fourier_walks.write_mm(tmp_path / "a.mm", FourierWalk(np.full((5, 15, 3), np.nan), 120.0))


# --- MAT files --------------------------------------------------------------------------------------------

MAT_ORDER = (
    "head", "right_wrist", "right_elbow", "right_shoulder", "sternum", "left_shoulder", "left_elbow", "left_wrist",
    "right_ankle", "right_knee", "right_hip", "pelvis", "left_hip", "left_knee", "left_ankle",
)  # fmt: skip


def matrix(gender: float) -> np.ndarray:
    """Return a synthetic walker (45, 5) in the layout of the MAT file, with x to the right and y forwards."""
    walker = made_up_walker.synthetic_walker(gender)[0]
    return np.array([[block[WALKER15.index(j), x] for block in walker] for x in range(3) for j in MAT_ORDER])


@pytest.mark.parametrize("compressed", [False, True])
def test_two_people_in_a_mat_file(compressed: bool, tmp_path: Path) -> None:
    path = tmp_path / "walkers.mat"
    savemat(path, {"F": matrix(-1.0), "H": np.ones((63, 3)), "M": matrix(1.0)}, do_compression=compressed)
    motion = formats.read(path)
    check_contract(motion)
    assert motion.names[:2] == ("F:head", "F:sternum")
    assert motion.names[15] == "M:head"
    for who, gender in (("F", -1.0), ("M", 1.0)):
        walk = gait.represent(path, subject=who)
        np.testing.assert_allclose(walk.coefficients, in_our_frame(gender), atol=0.5)
        assert walk.frequency_hz == pytest.approx(1.0, abs=1e-5), "which the file does not state"


def test_a_mat_file_without_walkers_or_with_one_that_is_no_number_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"H": np.ones((63, 3))})
    with rejects("no_walkers", "a.mat"):
        fourier_walks.mean_walkers(tmp_path / "a.mat")
    savemat(tmp_path / "b.mat", {"F": np.full((45, 5), np.inf)})
    with rejects("not_number", "b.mat"):
        formats.read(tmp_path / "b.mat")


# --- the author's files -----------------------------------------------------------------------------------


def author_file(name: str) -> Path:
    """Return the path of an author's file in the folder of public recordings; skip the test if it is missing."""
    mirrors = [Path(folder) for folder in os.environ.get("MOCAP_MIRROR", "").split(os.pathsep) if folder]
    result = [
        path for folder in mirrors for path in (folder / name, folder / "author" / name) if path.is_file()
    ]
    if not result:
        pytest.skip(f"needs MOCAP_MIRROR with the author's {name}")
    return result[0]


def test_the_authors_average_walker_is_symmetric_and_walks_as_he_says() -> None:
    walker = fourier_walks.average_walker(author_file("bmwalker.json")).at()
    left, right = (WALKER15.index(f"{side}_ankle") for side in ("left", "right"))
    along = walker.coefficients[:, left, 0] - walker.coefficients[:, right, 0]
    assert along[2] > 600
    np.testing.assert_allclose(along[[0, 1, 3, 4]], 0.0, atol=0.01)
    assert walker.stride_hz == pytest.approx(0.952, abs=1e-3)
    assert walker.speed_mm_s == pytest.approx(1360, abs=10)
    heights = walker.coefficients[0, :, 2]
    assert (
        np.diff(heights[[WALKER15.index(j) for j in ("head", "sternum", "pelvis", "left_knee")]]) < 0
    ).all()


def test_the_mean_woman_and_man_walk_forwards() -> None:
    walks = fourier_walks.mean_walkers(author_file("walkers.mat"))
    assert list(walks) == ["F", "M"]
    for walk in walks.values():
        times = np.arange(100) / 100.0
        for side in ("left", "right"):
            ankle = walk.positions(times)[:, WALKER15.index(f"{side}_ankle")]
            lifted = ankle[:, 2].argmax()
            assert np.gradient(ankle[:, 0])[lifted] > 0, "a lifted foot swings forwards"
        hips = walk.coefficients[0, [WALKER15.index(f"{side}_hip") for side in ("left", "right")], 1]
        assert hips[0] > 0 > hips[1]


def test_axes_of_the_file_and_of_the_world() -> None:
    """In the file x is forwards and y to the left; in the world x is to the right and y forwards."""
    np.testing.assert_array_equal(series.in_world(np.array([[1.0, 2.0, 3.0]])), [[-2.0, 1.0, 3.0]])
    np.testing.assert_array_equal(series.from_world(np.array([[-2.0, 1.0, 3.0]])), [[1.0, 2.0, 3.0]])
