"""Tests that files which declare far larger data than they contain are rejected before the memory is allocated."""

from __future__ import annotations

import io
import json
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.formats.budget import MAX_BYTES, MIN_BYTES, PER_BYTE, read_one, require_memory
from pipeline.formats.text import read_text
from tests.rejects import rejects
from walk3d.film import keypoints
from walk3d.film.keypoints import contract
from walk3d.film.walk.tracks import find_tracks

ENDS = "End Site\n{\nOFFSET 0 1 0\n}\n"
BVH = (
    "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n{ends}}}\n"
    "MOTION\nFrames: {frames}\nFrame Time: 0.01\n"
)
ASF = """:version 1.10
:name A
:units
  mass 1.0
  length 1.0
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
"""


def bone(k: int) -> str:
    return f"begin\nid {k}\nname b{k}\ndirection 1 0 0\nlength 1\naxis 0 0 0 XYZ\nend\n"


def refused(
    path: Path, code: str, where: str = "", read: Callable[[Path], object] = formats.read, **values: object
) -> None:
    """Assert that a file is rejected with this code, and with memory in proportion to its size."""
    size = sum(file.stat().st_size for file in (path.iterdir() if path.is_dir() else [path]))
    tracemalloc.start()
    try:
        with rejects(code, where, **values):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < min(max(PER_BYTE * size, MIN_BYTES), MAX_BYTES)
    finally:
        tracemalloc.stop()


def test_joints_that_do_not_move_are_out_of_proportion(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH.format(ends=ENDS * 1500, frames=20000) + "0\n" * 20000, encoding="utf-8")
    refused(path, "too_many_points", "a.bvh")


def test_too_many_joints_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH.format(ends=ENDS * 20000, frames=1) + "0\n", encoding="utf-8")
    refused(path, "too_many_joints", "a.bvh, line ", most=2000)


def test_bones_that_do_not_move_are_out_of_proportion(tmp_path: Path) -> None:
    names = [f"b{k}" for k in range(1500)]
    hierarchy = ":hierarchy\nbegin\nroot " + " ".join(names) + "\nend\n"
    (tmp_path / "a.asf").write_text(ASF + "".join(map(bone, range(1500))) + hierarchy, encoding="utf-8")
    frames = "".join(f"{k}\nroot 0 0 0 0 0 0\n" for k in range(1, 5001))
    (tmp_path / "a.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n" + frames, encoding="utf-8")
    refused(tmp_path / "a.amc", "too_many_points", "a.amc")


@pytest.mark.parametrize(
    "error", [MemoryError(), RecursionError("too deep"), KeyError("x"), OSError(5, "broken")]
)
def test_any_error_is_the_refusal_of_its_file(error: Exception, tmp_path: Path) -> None:
    def fail(path: Path) -> None:
        raise error

    with rejects("unreadable", "walk.c3d", error=type(error).__name__) as refusal:
        read_one(tmp_path / "walk.c3d", fail)
    assert refusal.value.__cause__ is error
    with pytest.raises(KeyboardInterrupt):  # which is no property of the file
        read_one(tmp_path / "walk.c3d", lambda path: (_ for _ in ()).throw(KeyboardInterrupt))


def test_the_budget_follows_what_was_read_of_the_clip(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(b"1 " * MIN_BYTES)

    def ask(path: Path, needed: int) -> int:
        read_text(path)
        require_memory(needed, path.name)
        return needed

    enough = PER_BYTE * 2 * MIN_BYTES
    assert read_one(tmp_path / "a.txt", ask, needed=enough) == enough
    with rejects("too_much_memory", "a.txt", budget=enough):
        read_one(tmp_path / "a.txt", ask, needed=enough + 1)


def archive(path: Path, **headers: tuple[str, tuple[int, ...]]) -> None:
    """Write an NPZ file whose arrays have the declared types and shapes but only a thousand zero bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, (dtype, shape) in headers.items():
            head = io.BytesIO()
            np.lib.format.write_array_header_1_0(
                head, {"descr": dtype, "fortran_order": False, "shape": shape}
            )
            packed.writestr(f"{name}.npy", head.getvalue() + bytes(1000))


@pytest.mark.parametrize("shape", [(10**8, 1000, 3), (2**62, 2, 3), (10**30, 2, 3)])
def test_an_array_is_measured_by_its_header(shape: tuple[int, ...], tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    archive(path, names=("<U1", (2,)), positions_mm=("<f8", shape))
    refused(path, "too_much_memory", "a.npz, array positions_mm")
    archive(path, names=("<U0", (10**12,)), positions_mm=("<f8", (1, 2, 3)))  # 10¹² empty names
    refused(path, "too_much_memory", "a.npz, array names")
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    (tmp_path / "a.npy").write_bytes(head.getvalue())
    refused(tmp_path / "a.npy", "too_much_memory", "a.npy", keypoints.read)


def test_an_archive_is_not_unpacked_beyond_its_budget(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", names=np.array(["a"]), positions_mm=np.zeros((400_000, 1, 3)))
    assert (tmp_path / "a.npz").stat().st_size < 20_000
    refused(tmp_path / "a.npz", "too_much_memory", "a.npz")


@pytest.mark.parametrize(
    ("read", "suffix"),
    [
        (read, suffix)
        for read, readers in ((formats.read, formats.READERS), (keypoints.read, keypoints.READERS))
        for suffix in readers
    ],
)
def test_a_file_of_three_gigabytes_is_not_read(
    read: Callable[[Path], object], suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"a{suffix}"
    with path.open("wb") as file:
        file.truncate(3 * 2**30)
    tracemalloc.start()
    with rejects("file_too_large", f"a{suffix}"):
        read(path)
    assert tracemalloc.get_traced_memory()[1] < MIN_BYTES
    tracemalloc.stop()


def test_words_are_counted_before_a_large_text_is_split(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("pipeline.formats.text.MAX_BYTES", 2**20)
    monkeypatch.setattr("pipeline.formats.budget.MAX_BYTES", 2**20)
    path = tmp_path / "a.txt"
    path.write_text("1 2 3\n" * 5000, encoding="utf-8")
    with rejects("file_too_large", budget=2**20):
        read_text(path)
    path.write_text("1.23456789\n" * 3000, encoding="utf-8")
    assert len(read_text(path)[0]) == 33_000


def test_a_table_of_keypoints_with_a_name_for_each_row(tmp_path: Path) -> None:
    rows = "".join(f"{k},p{k},1,2\n" for k in range(20_000))
    (tmp_path / "a.csv").write_text("frame,keypoint,x,y\n" + rows, encoding="utf-8")
    refused(tmp_path / "a.csv", "too_many_points", read=keypoints.read)
    (tmp_path / "a.csv").write_text("frame,keypoint,x,y\n1,a,1,2\n9999999,a,1,2\n" + "", encoding="utf-8")
    assert keypoints.read(tmp_path / "a.csv").n_frames == 10_000_000


def test_titles_without_numbers(tmp_path: Path) -> None:
    many = 5000
    nexus = f"Trajectories\n100\n,{',a,,' * many}\nFrame,Sub Frame{',X,Y,Z' * many}\n\n" + "1,0\n" * many
    (tmp_path / "a.csv").write_text(nexus.replace("\n\n", "\n,,mm\n"), encoding="utf-8")
    refused(tmp_path / "a.csv", "titles_alone")
    names = "".join(f"a{k}\t\t\t" for k in range(many))
    pixels = f"PathFileType\t4\nDataRate\tUnits\n30\tpx\nFrame#\tTime\t{names}\n\t\tX1\n" + "1\t0\n" * many
    (tmp_path / "a.trc").write_text(pixels, encoding="utf-8")
    refused(tmp_path / "a.trc", "wrong_count", read=keypoints.read)


def test_a_long_identity_is_kept_short(tmp_path: Path) -> None:
    people = [
        {"image_id": f"{k}.jpg", "keypoints": [1, 2, 1], "idx": "x" * (1 + k % 2 * 10_000)} for k in range(9)
    ]
    (tmp_path / "a.json").write_text(json.dumps(people), encoding="utf-8")
    assert keypoints.read(tmp_path / "a.json").identity.dtype == np.dtype("<U80")


def test_a_crowd_is_followed_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    body = rng.normal(size=(15, 2))
    places = rng.permutation(300)[:, None, None] * 40.0
    pixels = np.concatenate([body + places + shift for shift in (0.0, 0.05, 0.1)])
    tracks = find_tracks(np.repeat(np.arange(3), 300), np.full(900, ""), pixels, 30.0)
    assert sorted(track.rows.tolist() for track in tracks) == [[k, 300 + k, 600 + k] for k in range(300)]
    monkeypatch.setattr(contract, "MAX_PAIRS", 3 * 300**2 - 1)
    rows = [(frame, "", np.ones((1, 3))) for frame in range(3) for _ in range(300)]
    with rejects("too_many_people", people=300):
        keypoints.detections("csv", "a.csv", rows, 3)


def test_frames_may_not_jump(tmp_path: Path) -> None:
    people = [{"image_id": f"{k}.jpg", "keypoints": [1, 2, 1]} for k in (1, 10**15)]
    (tmp_path / "a.json").write_text(json.dumps(people), encoding="utf-8")
    refused(tmp_path / "a.json", "frames_jump", read=keypoints.read)


def test_names_are_no_formulas(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,=1+1_x,=1+1_y,=1+1_z\n0,1,2,3\n1,1,2,3\n", encoding="utf-8")
    motion = formats.read(tmp_path / "a.csv")
    assert motion.names == ("'=1+1",)
    assert motion.notes == (
        "Names that a spreadsheet would run as formulas get an apostrophe in front: '=1+1.",
    )
    (tmp_path / "b.csv").write_text("frame,person,keypoint,x,y\n0,@SUM(A1),=cmd,1,2\n", encoding="utf-8")
    recording = keypoints.read(tmp_path / "b.csv")
    assert (recording.names, recording.identity.tolist()) == (("'=cmd",), ["'@SUM(A1)"])
