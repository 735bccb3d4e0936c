"""Tests that all file readers meet the same requirements: accepted files, rejected files, and error messages."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.formats import contract
from pipeline.formats.contract import motion_capture
from pipeline.formats.points import csv, trc
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, READABLE, check_contract
from tests.rejects import rejects
from walk3d.export.c3d import write as write_c3d

readable = pytest.mark.parametrize("path", READABLE, ids=[path.name for path in READABLE])


def test_there_is_a_correct_file_for_every_reader() -> None:
    assert {path.suffix for path in READABLE} == set(formats.READERS)


@readable
def test_a_correct_file_is_read(path: Path) -> None:
    motion = formats.read(path)
    check_contract(motion)
    again = formats.read(str(path))
    np.testing.assert_array_equal(again.positions_mm, motion.positions_mm)


@pytest.mark.parametrize("suffix", formats.READERS)
def test_readers_have_one_signature(suffix: str) -> None:
    assert inspect.signature(formats.READERS[suffix]) == inspect.signature(csv.read)


@readable
def test_options_are_taken_by_every_reader(path: Path) -> None:
    check_contract(formats.read(path, frame_rate_hz=formats.read(path).frame_rate_hz, units="mm"))


@readable
def test_a_rate_that_makes_no_sense_is_refused_and_another_one_than_the_files_own_said(
    path: Path,
) -> None:
    with rejects("out_of_range", "the frame rate", value=-1.0):
        formats.read(path, frame_rate_hz=-1.0)
    reference = formats.read(path).frame_rate_hz
    described = formats.read(path, frame_rate_hz=2.0 * reference)
    assert described.frame_rate_hz in (reference, 2.0 * reference)
    assert any("they are used instead" in note for note in described.notes) == (
        described.frame_rate_hz == reference
    )


@readable
def test_the_suffix_may_be_written_in_capitals(path: Path, tmp_path: Path) -> None:
    for source in FIXTURES.glob(f"{path.stem[:3]}*"):  # a motion needs its skeleton
        (tmp_path / source.name).write_bytes(source.read_bytes())
    (tmp_path / "asf_by_hand.asf").write_bytes((FIXTURES / "asf_by_hand.asf").read_bytes())
    capitals = (tmp_path / path.name).rename(tmp_path / (path.stem + path.suffix.upper()))
    check_contract(formats.read(capitals))


@pytest.mark.parametrize("suffix", formats.READERS)
def test_what_is_no_file_or_empty_is_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    with rejects("no_file", f"a{suffix}"):
        formats.read(path)
    for content in (b"", b" \r\n\t"):
        path.write_bytes(content)
        with rejects("empty_file", f"a{suffix}"):
            formats.read(path)
    path.unlink()
    path.mkdir()
    with rejects("no_file"):
        formats.read(path)


@pytest.mark.parametrize("suffix", formats.READERS)
@pytest.mark.parametrize("content", [b"\x00\xff" * 500, b"1\n", bytes(4096), b"<html></html>\n"])
def test_foreign_files_are_refused_by_name(suffix: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.asf").write_bytes((FIXTURES / "asf_by_hand.asf").read_bytes())
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(InvalidInput) as refused:
        formats.read(path)
    assert refused.value.code
    assert refused.value.where.startswith(f"a{suffix}")


def test_an_unknown_suffix_is_refused(tmp_path: Path) -> None:
    for name, suffix in (("a.fbx", ".fbx"), ("a", "")):
        with rejects("no_file", name):
            formats.read(tmp_path / name)
        (tmp_path / name).write_bytes(b"")
        with rejects("unknown_format", name, suffix=suffix):
            formats.read(tmp_path / name)


@readable
@pytest.mark.parametrize("units", ["parsec", "in/0", "in/x", "in/", "in/-1", "m/1e300", "m/nan"])
def test_an_unknown_unit_is_refused_also_where_the_file_states_its_own(path: Path, units: str) -> None:
    with rejects("unknown_unit", unit=units):
        formats.read(path, units=units)


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"\x1f\x8b\x08\x00abc", "gzip"),
        (b"PK\x03\x04abc", "zip"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git_lfs"),
        (b"\n<!DOCTYPE HTML>\n<title>Not found</title>", "web_page"),
    ],
)
@pytest.mark.parametrize("suffix", sorted(set(formats.READERS) - {".npz", ".amc"}))
def test_what_a_file_holds_instead_is_said(suffix: str, content: bytes, code: str, tmp_path: Path) -> None:
    (tmp_path / f"a{suffix}").write_bytes(content)
    with rejects(code, f"a{suffix}"):
        formats.read(tmp_path / f"a{suffix}")


def test_there_is_advice_on_files_without_a_reader_and_on_keypoints() -> None:
    assert set(formats.ADVICE) & set(formats.READERS) == {".json"}


@pytest.mark.parametrize("suffix", [suffix for suffix in formats.ADVICE if suffix not in formats.READERS])
def test_advice_on_files_of_other_kinds(suffix: str, tmp_path: Path) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"abc")
    with rejects("unknown_format", f"a{suffix}", suffix=suffix) as refused:
        formats.read(tmp_path / f"a{suffix}")
    assert formats.ADVICE[suffix] in str(refused.value)


def test_points_in_name_only_are_missing_points() -> None:
    positions = np.zeros((4, 3, 3))
    positions[:, 1] = np.nan
    positions[0, 2] = np.nan
    motion = motion_capture(["LANK", "LSHO", "RANK"], positions, 100.0, "mm", [])
    check_contract(motion)
    assert motion.names == ("LANK", "RANK")
    assert motion.valid[:, 1].tolist() == [False, True, True, True]
    assert motion.notes == ("Points without any measured sample are left out: LSHO.",)
    nothing = motion_capture(["LANK", "RANK"], np.full((2, 2, 3), np.nan), 100.0, "mm", [])
    assert nothing.names == ("LANK", "RANK")  # who asks says that nothing was measured


def test_the_second_of_two_equal_names_is_numbered() -> None:
    names = ["LKNE", "RKNE", "LKNE", "LANK", "RANK", "LKNE", "LKNE_2", "SACR"]
    positions = np.arange(len(names))[None, :, None] * np.full((3, 1, 3), 50.0)
    motion = motion_capture(names, positions, 100.0, "mm", [])
    assert motion.names == ("LKNE", "RKNE", "LKNE_3", "LANK", "RANK", "LKNE_4", "LKNE_2", "SACR")
    assert motion.notes == ("Repeated names are numbered: LKNE_3, LKNE_4.",)
    np.testing.assert_array_equal(motion.positions_mm, positions)
    positions[:, 2] = positions[:, 0]  # a copy of one point
    copied = motion_capture(names, positions, 100.0, "mm", [])
    assert copied.names[2] == "LKNE"
    assert "1 point names are repeated." in copied.notes
    two_people = motion_capture(["LKNE", "RKNE", "LKNE", "RKNE"], positions[:, :4], 100.0, "mm", [])
    assert two_people.names == ("LKNE", "RKNE", "LKNE", "RKNE")


@pytest.mark.parametrize("suffix", ["csv", "trc"])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_gaps_may_be_written_as_zeros(tmp_path: Path, suffix: str, unit: float) -> None:
    positions = np.random.default_rng(1).normal(900.0, 300.0, (1, 6, 3)) + np.arange(20.0)[:, None, None]
    positions[0, 0] = positions[5:8, 1] = positions[18:, 1] = positions[:, 2] = 0.0
    positions[:, 3] = np.arange(20)[:, None] * 10.0  # a root that begins at the origin
    path, names = tmp_path / f"walk.{suffix}", ["LASI", "RASI", "SACR", "root", "LKNE", "RKNE"]
    {"csv": csv, "trc": trc}[suffix].write(path, names, positions * unit, 100.0)
    motion = formats.read(path)
    assert motion.names == ("LASI", "RASI", "root", "LKNE", "RKNE")
    assert np.argwhere(~motion.valid).tolist() == [[0, 0], [5, 1], [6, 1], [7, 1], [18, 1], [19, 1]]
    assert any("26 samples lie exactly at the origin" in note for note in motion.notes)


@pytest.mark.parametrize("suffix", ["csv", "trc", "c3d"])
@pytest.mark.parametrize("number", [999.0, -9999.0, 1e6])
def test_gaps_may_be_written_as_a_number_that_is_no_place(tmp_path: Path, suffix: str, number: float) -> None:
    positions = np.random.default_rng(1).normal(300.0, 200.0, (1, 6, 3)) + np.arange(20.0)[:, None, None]
    positions[5:8, 1] = positions[18:, 1] = positions[:, 2] = number
    positions[4, 0] = 300.0  # all the same, but a place, and but once
    path, names = tmp_path / f"walk.{suffix}", ["LASI", "RASI", "SACR", "LTHI", "LKNE", "RKNE"]
    write = {"csv": csv.write, "trc": trc.write, "c3d": write_c3d}[suffix]
    write(path, names, positions, 100.0)
    motion = formats.read(path)
    assert motion.names == ("LASI", "RASI", "LTHI", "LKNE", "RKNE")
    assert np.argwhere(~motion.valid).tolist() == [[5, 1], [6, 1], [7, 1], [18, 1], [19, 1]]
    assert f"25 samples are {number:.6g} in every coordinate and count as missing." in motion.notes


def test_a_root_that_stays_at_the_origin_is_kept(tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(0.0, 300.0, (20, 6, 3))
    positions[:, 2] = 0.0
    trc.write(tmp_path / "walk.trc", list("abcdef"), positions, 100.0)
    assert formats.read(tmp_path / "walk.trc").valid.all()


@pytest.mark.parametrize("wide", [False, True])
def test_a_point_name_that_is_a_formula_is_none_in_a_table(tmp_path: Path, wide: bool) -> None:
    names, positions = ["=1+1", "@x", "head"], np.arange(18.0).reshape(2, 3, 3)
    csv.write(tmp_path / "a.csv", names, positions, 50.0, wide=wide)
    trc.write(tmp_path / "a.trc", names, positions, 50.0)
    cells = {
        cell
        for path in tmp_path.iterdir()
        for line in path.read_text("utf-8").split("\n")
        for cell in re.split("[,\t]", line)
    }
    assert not [cell for cell in cells if cell.startswith(("=", "@"))]
    for path in tmp_path.iterdir():
        motion = formats.read(path)
        assert motion.names == ("'=1+1", "'@x", "head")
        np.testing.assert_array_equal(motion.positions_mm, positions)


def test_as_many_joints_as_are_allowed_are_read() -> None:
    contract.require_joints(contract.MAX_JOINTS, "a.bvh")
    with rejects("too_many_joints", "a.bvh"):
        contract.require_joints(contract.MAX_JOINTS + 1, "a.bvh")
