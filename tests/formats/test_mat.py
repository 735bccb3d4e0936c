"""MAT files: trials of Qualisys Track Manager are read, other content is rejected in a sentence."""

from __future__ import annotations

import io
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from pipeline import formats
from pipeline.formats.budget import MIN_BYTES, PER_BYTE
from tests.formats.contract import check_contract
from tests.rejects import rejects

DATA = np.arange(1.0, 17.0).reshape(2, 4, 2)


def trial(data: np.ndarray = DATA, **others: Any) -> dict[str, Any]:
    """Return an export of QTM: cells of labels; x, y, z and residual of each by frame; structs of force plates."""
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
