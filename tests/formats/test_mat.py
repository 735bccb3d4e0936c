"""Tests of MAT files: trials of Qualisys Track Manager are read, and other content is rejected with a message."""

from __future__ import annotations

import io
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from pipeline import formats, joints
from pipeline.formats.budget import MIN_BYTES, PER_BYTE
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.formats.contract import check_contract
from tests.rejects import rejects

DATA = np.arange(1.0, 17.0).reshape(2, 4, 2)


def trial(data: np.ndarray = DATA, **others: Any) -> dict[str, Any]:
    """Return an export of QTM as nested arrays: labels, trajectories with residuals, and force plates."""
    labels, force = (
        np.empty((1, 2), object),
        np.zeros((1, 2), dtype=[("ForcePlateName", object), ("Force", object)]),
    )
    labels[0] = "LÄNK", "R ankle"
    for k in range(2):
        force[0, k] = f"plate {k}", np.ones((3, 20))
    labeled = {"Count": 2.0, "Labels": labels, "Data": data, "Type": np.ones((2, 2), np.uint8)}
    unidentified = {"Count": 1.0, "Data": np.full((1, 4, 2), np.nan)}
    return {
        "File": "C:\\walk.qtm",
        "Frames": 2.0,
        "FrameRate": 120.0,
        "Trajectories": {"Labeled": labeled, "Unidentified": unidentified},
        "Force": force,
        **others,
    }


def written(path: Path, variables: dict[str, Any], *, compressed: bool = False) -> Path:
    savemat(path, variables, do_compression=compressed, oned_as="row")
    return path


@pytest.mark.parametrize("compressed", [False, True])
def test_the_labelled_markers_of_a_trial(compressed: bool, tmp_path: Path) -> None:
    data = DATA.copy()
    data[1, :, 0] = np.nan
    motion = formats.read(written(tmp_path / "a.MAT", {"walk_1": trial(data)}, compressed=compressed))
    check_contract(motion)
    assert (motion.names, motion.frame_rate_hz, motion.units) == (("LÄNK", "R ankle"), 120.0, "mm")
    assert (motion.units_assumed, motion.valid.tolist()) == (False, [[True, False], [True, True]])
    np.testing.assert_array_equal(motion.positions_mm[:, 0], [[1, 3, 5], [2, 4, 6]])
    np.testing.assert_array_equal(motion.positions_mm[1, 1], [10, 12, 14])


@pytest.mark.parametrize("labelled", [None, np.empty((0, 0), object)])
def test_without_markers_the_segments_of_skeletons_are_read(labelled: object, tmp_path: Path) -> None:
    skeletons = np.zeros(
        (1, 2), dtype=[(key, object) for key in ("SkeletonName", "SegmentLabels", "PositionData")]
    )
    cells = np.empty((1, 2), object)
    cells[0] = "Hips", "Head"
    for k, who in enumerate(("Anna", "Bob")):
        skeletons[0, k] = who, cells, np.arange(24.0).reshape(3, 2, 4) + 100 * k
    others = {"Labeled": {"Labels": labelled, "Data": np.zeros((0, 0))}, "Unidentified": {"Count": 0.0}}
    if labelled is None:
        del others["Labeled"]
    motion = formats.read(written(tmp_path / "a.mat", {"a": trial(Trajectories=others, Skeletons=skeletons)}))
    check_contract(motion)
    assert motion.names == ("Anna:Hips", "Anna:Head", "Bob:Hips", "Bob:Head")
    assert motion.positions_mm[1].tolist() == [[1, 9, 17], [5, 13, 21], [101, 109, 117], [105, 113, 121]]


def test_of_one_frame_matlab_leaves_the_last_dimension_out(tmp_path: Path) -> None:
    motion = formats.read(written(tmp_path / "a.mat", {"static": trial(DATA[..., 0])}))
    np.testing.assert_array_equal(motion.positions_mm, [[[1, 3, 5], [9, 11, 13]]])


def test_labels_as_matlab_writes_those_that_are_not_latin(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mat", {"walk": trial()})
    utf_8 = np.array([16, 5], "<u4").tobytes() + "LÄNK".encode().ljust(8, b"\0")
    utf_16 = np.array([4, 8], "<u4").tobytes() + "LÄNK".encode("utf-16-le")
    assert path.read_bytes().count(utf_8) == 1
    path.write_bytes(path.read_bytes().replace(utf_8, utf_16))
    assert formats.read(path).names == ("LÄNK", "R ankle")


@pytest.mark.parametrize(
    ("variables", "code"),
    [
        ({"x": np.ones(3)}, "wrong_format"),
        ({}, "wrong_format"),
        ({"a": {"b": "c"}}, "wrong_format"),
        ({"a": trial(), "b": trial()}, "wrong_format"),
        ({"a": trial(Trajectories={"Labeled": []})}, "wrong_format"),
        ({"a": trial(DATA[:1])}, "arrays_disagree"),
        ({"a": trial(DATA[..., :0])}, "arrays_disagree"),
        ({"a": trial(FrameRate=0.0)}, "unknown_rate"),
    ],
)
@pytest.mark.parametrize("compressed", [False, True])
def test_what_is_no_trial_is_refused(
    variables: dict[str, Any], code: str, compressed: bool, tmp_path: Path
) -> None:
    with rejects(code, "a.mat"):
        formats.read(written(tmp_path / "a.mat", variables, compressed=compressed))


def toolbox(positions: np.ndarray, names: list[str], rate: float = 120.0) -> dict[str, Any]:
    """Return a motion-capture struct of the MoCap Toolbox."""
    labels = np.empty((len(names), 1), object)
    labels[:, 0] = names
    return {
        "type": "MoCap data", "filename": "walk.tsv", "nFrames": float(len(positions)), "nCameras": 8.0,
        "nMarkers": float(len(names)), "freq": rate, "timederOrder": 0.0, "markerName": labels,
        "data": positions.reshape(len(positions), -1), "other": {"descr": "DESCRIPTION\t--"},
    }  # fmt: skip


@pytest.mark.parametrize("compressed", [False, True])
def test_a_struct_of_the_mocap_toolbox(compressed: bool, tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(0.0, 500.0, (6, 3, 3))
    positions[2, 1] = np.nan
    take = toolbox(positions, ["Hip_FL", "Knee_L", "Toe_L"])
    motion = formats.read(written(tmp_path / "a.mat", {"walk1": take}, compressed=compressed), units="mm")
    check_contract(motion)
    assert (motion.names, motion.frame_rate_hz) == (("Hip_FL", "Knee_L", "Toe_L"), 120.0)
    np.testing.assert_array_equal(motion.positions_mm, positions)
    assert formats.read(tmp_path / "a.mat").units_assumed


def test_several_structs_of_the_mocap_toolbox_are_several_people(tmp_path: Path) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=1, female=1, duration_s=3.0, frame_rate_hz=40.0
    )
    first, second = output.positions_mm
    takes = {"walk1": (first, 40.0), "walk2": (second[:90] + 3000.0, 40.0)}
    structs = {name: toolbox(take, list(WALKER15.joints), rate) for name, (take, rate) in takes.items()}
    path = written(tmp_path / "a.mat", structs)
    positions, valid = joints(formats.read(path), subject="walk2")
    np.testing.assert_allclose(positions[:90], second[:90] + 3000.0, atol=1e-6)
    assert valid.sum(axis=0).tolist() == [90] * 15
    structs["walk2"] = toolbox(second, list(WALKER15.joints), 50.0)
    with rejects("unknown_rate", "a.mat"):
        formats.read(written(tmp_path / "a.mat", structs))


@pytest.mark.parametrize("form", ["(T, 3)", "(3, T)", "(4, T)", "fields"])
def test_one_matrix_for_each_marker(form: str, tmp_path: Path) -> None:
    """MAT files with one matrix per marker are read with their frame rate, and other matrices are ignored."""
    positions = np.random.default_rng(1).normal(0.0, 0.5, (7, 3, 3))
    points = dict(zip(("LASI", "RASI", "SACR"), positions.swapaxes(0, 1), strict=True))
    if form in ("(3, T)", "(4, T)"):
        homogeneous = np.ones((1 if form == "(4, T)" else 0, 7))
        points = {name: np.concatenate([value.T, homogeneous]) for name, value in points.items()}
    others = {"force": np.zeros((70, 6)), "events": np.zeros((9, 3)), "Fs": 100.0, "note": "text"}
    markers = {"markers": points} if form == "fields" else points
    motion = formats.read(written(tmp_path / "a.mat", {**markers, **others}), units="m")
    assert (motion.names, motion.frame_rate_hz) == (("LASI", "RASI", "SACR"), 100.0)
    np.testing.assert_allclose(motion.positions_mm, 1000.0 * positions)
    del others["Fs"]
    written(tmp_path / "a.mat", {**markers, **others})
    with rejects("unknown_rate", "a.mat"):
        formats.read(tmp_path / "a.mat")
    assert formats.read(tmp_path / "a.mat", frame_rate_hz=50.0).frame_rate_hz == 50.0


def test_without_markers_the_content_is_listed(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mat", {"force": np.zeros((70, 6)), "info": {"who": "anna", "age": 30.0}})
    with rejects("wrong_format", "a.mat") as refusal:
        formats.read(path)
    assert "force (70, 6), age (1, 1), struct info (who, age)" in str(refusal.value)


def test_hdf5_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path, header = tmp_path / "a.mat", b"MATLAB 7.3 MAT-file, Platform: PCWIN64 HDF5 schema 1.00 ."
    path.write_bytes(header.ljust(124) + b"\0\2IM" + bytes(384) + b"\x89HDF\r\n\x1a\n")
    with rejects("wrong_format", "a.mat", begins=header[:19]):
        formats.read(path)


@pytest.mark.parametrize("times", [1, 3])
def test_compression_is_no_way_to_ask_for_memory(times: int, tmp_path: Path) -> None:
    path, stream = tmp_path / "a.mat", io.BytesIO()
    savemat(stream, {"walk": trial(np.zeros((2, 4, 10**6)))})
    content = stream.getvalue()[128:]
    for _ in range(times):
        content = zlib.compress(content)
        content = np.array([15, len(content)], "<u4").tobytes() + content
    path.write_bytes(stream.getvalue()[:128] + content)
    tracemalloc.start()
    try:
        with rejects("wrong_format", "a.mat"):
            formats.read(path)
        assert tracemalloc.get_traced_memory()[1] < max(PER_BYTE * path.stat().st_size, MIN_BYTES)
    finally:
        tracemalloc.stop()
