"""Tests of tables that Nexus, QTM and Motive export: layouts, gaps, truncation and damage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract
from tests.rejects import rejects

NEXUS = """\
Trajectories
120
,,Anna:Head Top,,,Anna:Hip,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm
695,0,1,2,3,4,5,6
696,0,1.5,2,3,,,
697,0,2,2,3,4,,6
"""
NEXUS_WITH_DEVICES = (
    "Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n\n" + NEXUS + "\nModel Outputs\n120\n"
)
NEXUS_WITH_EVENTS = (
    "Events\n100\nSubject,Context,Name,Time (s)\nAnna,Left,Foot Off,5.8\n\n" + NEXUS_WITH_DEVICES
)
QUALISYS = (FIXTURES / "tsv_qualisys.tsv").read_text(encoding="utf-8")
OPTITRACK = """\
Format Version,1.23,Take Name,Take 1,Capture Frame Rate,120.000000,Export Frame Rate,120.000000,\
Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global

,Type,Bone,Bone,Bone,Bone,Bone,Bone,Bone,Marker,Marker,Marker,Marker
,Name,S:Hip,S:Hip,S:Hip,S:Hip,S:Hip,S:Hip,S:Hip,S:Top,S:Top,S:Top,S:Top
,ID,1,1,1,1,1,1,1,2,2,2,2
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position,Mean Marker Error
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,
0,0.000000,0,0,0,1,4,5,6,1,2,3,0.1
1,0.008333,0,0,0,1,,,,1.5,2,3,0.1
2,0.016667,0,0,0,1,4,,6,2,2,3,0.1
"""
TOP = np.array([[1.0, 2, 3], [1.5, 2, 3], [2, 2, 3]])
HIP = np.array([[4.0, 5, 6], [np.nan] * 3, [np.nan] * 3])


def read(folder: Path, text: str, suffix: str = ".csv", **options: object) -> MotionCapture:
    path = folder / f"made{suffix}"
    path.write_bytes(text.encode())
    motion = formats.read(path, **options)  # type: ignore[arg-type]
    check_contract(motion)
    return motion


def assert_is_the_example(motion: MotionCapture) -> None:
    top = next(k for k, name in enumerate(motion.names) if name.endswith("Top"))
    np.testing.assert_array_equal(motion.positions_mm[:, top], TOP)
    np.testing.assert_array_equal(motion.positions_mm[:, 1 - top], HIP)
    assert (motion.frame_rate_hz, motion.units) == (120.0, "mm")


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        (NEXUS, ".csv"),
        (NEXUS_WITH_DEVICES, ".csv"),
        (NEXUS_WITH_EVENTS, ".csv"),
        (NEXUS.replace("\n", "\r\n"), ".csv"),
        (NEXUS.replace(".", "#").replace(",", ";").replace("#", ","), ".csv"),
        (NEXUS.replace(",,,\n6", ",\n6").replace(",,\n6", "\n6"), ".csv"),
        (QUALISYS, ".tsv"),
        (QUALISYS, ".csv"),
        (QUALISYS.replace("Hip\n", "Hip\nFrame\tTime\tHead Top X\tY\tZ\tHip X\tY\tZ\n")
         .replace("\n1.000", "\n1\t0.00000\t1.000").replace("\n1.500", "\n2\t0.00833\t1.500")
         .replace("\n2.000", "\n3\t0.01667\t2.000"), ".tsv"),
        (QUALISYS.replace("\t", ";"), ".csv"),
        (QUALISYS.replace(".", ","), ".tsv"),
        (NEXUS.replace(",,,\n", ",9999,9999,9999\n").replace(",4,,6\n", ",9999,9999,9999\n"), ".csv"),
        (OPTITRACK, ".csv"),
        (OPTITRACK.replace("Marker,", "Labeled Marker,"), ".csv"),
        (OPTITRACK.replace(",", ";").replace(".", ","), ".csv"),
        (OPTITRACK.replace("\n\n,Type", "\n,Type"), ".csv"),
        (OPTITRACK.replace(",Type,", ",,").replace(",Name,", ",,").replace(",ID,", ",,"), ".csv"),
        ("\ufeff" + OPTITRACK, ".csv"),
    ],
)  # fmt: skip
def test_every_layout_gives_the_same_recording(text: str, suffix: str, tmp_path: Path) -> None:
    assert_is_the_example(read(tmp_path, text, suffix))


def test_names_keep_their_subject_and_a_bone_is_told_from_a_marker(tmp_path: Path) -> None:
    assert read(tmp_path, NEXUS).names == ("Anna:Head Top", "Anna:Hip")
    assert read(tmp_path, OPTITRACK.replace("S:Top", "S:Hip")).names == ("S:Hip", "S:Hip_marker")


def test_frames_without_a_line_are_missing(tmp_path: Path) -> None:
    motion = read(tmp_path, NEXUS.replace("697,", "699,"))
    assert motion.valid[:, 0].tolist() == [True, True, False, False, True]
    assert motion.notes == ("2 frames have no row and are missing.",)


QUALISYS_WITH_TIMES = "".join(
    f"{k + 1}\t{k / 60:.5f}\t{line}" if (k := n - 10) >= 0 else line
    for n, line in enumerate(QUALISYS.splitlines(keepends=True))
)


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        (NEXUS.replace("696,", "697,").replace("697,0,2,", "699,0,2,"), ".csv"),
        (QUALISYS_WITH_TIMES, ".tsv"),
        (OPTITRACK.replace("0.016667", "0.033333").replace("0.008333", "0.016667"), ".csv"),
    ],
)
def test_rows_that_are_two_frames_apart_have_half_the_rate_of_the_header(
    text: str, suffix: str, tmp_path: Path
) -> None:
    motion = read(tmp_path, text, suffix)
    top = next(k for k, name in enumerate(motion.names) if name.endswith("Top"))
    np.testing.assert_array_equal(motion.positions_mm[:, top], TOP)
    assert motion.frame_rate_hz == 60.0
    assert motion.notes == (
        "All rows are 2 frames apart: their rate of 60 Hz is used instead of 120 Hz from the header or the option.",
    )


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        (QUALISYS, ".tsv"),
        (OPTITRACK.replace("Rotation Type", "Total Exported Frames,3,Rotation Type"), ".csv"),
    ],
)
def test_frames_that_are_declared_and_absent_are_noted(text: str, suffix: str, tmp_path: Path) -> None:
    assert read(tmp_path, text, suffix).notes == ()
    motion = read(tmp_path, "".join(text.splitlines(keepends=True)[:-1]), suffix)
    assert len(motion.valid) == 2
    assert motion.notes == ("The file declares 3 frames but has 2; all 2 are read.",)


@pytest.mark.parametrize("text", [NEXUS, QUALISYS, OPTITRACK])
def test_a_cut_table_is_refused_or_says_so(text: str, tmp_path: Path) -> None:
    for size in range(len(text) - 1):
        path = tmp_path / "made.csv"
        path.write_text(text[:size], encoding="utf-8")
        try:
            motion = formats.read(path)
        except InvalidInput:
            continue
        check_contract(motion)
        assert motion.notes or text[size] == "\n" or text[size - 1] == "\n", size


def test_a_skeleton_of_qualisys_is_a_plain_table_below_its_settings(tmp_path: Path) -> None:
    turned = ("X", "Y", "Z", "QX", "QY", "QZ", "QW")
    titles = "\t".join(
        ["Frame", "Time", *(f"{name} {axis}" for name in ("Head Top", "Hip") for axis in turned)]
    )
    rows = [
        "\t".join([str(k + 1), f"{k / 120:.5f}", *(str(value) for at in pair for value in (*at, 0, 0, 0, 1))])
        for k, pair in enumerate(zip(TOP, HIP, strict=True))
    ]
    settings = ["NO_OF_FRAMES\t3", "FREQUENCY\t120", "REFERENCE\tGLOBAL", "SOLVER\tFull Body"]
    assert_is_the_example(read(tmp_path, "\n".join([*settings, titles, *rows]) + "\n", ".tsv"))


@pytest.mark.parametrize(
    ("text", "code", "where", "values"),
    [
        (NEXUS.replace("120", "fast"), "unusable_rate", "line 2", {}),
        (NEXUS.replace(",,Anna:Hip", ",Anna:Hip,"), "misplaced_names", "line 3", {}),
        (NEXUS.replace("697,", "696,"), "frame_order", "line 8", {}),
        (NEXUS.replace("4,5,6", "4,5,six"), "not_number", "line 6, cell 8", {"text": "six"}),
        (NEXUS.replace("4,5,6", "4,5,6,7"), "wrong_count", "line 6", {}),
        ("Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n", "no_trajectories", "", {}),
        ("Objects\n100\n,,Global Angle a:a,,\nFrame,Sub Frame,TX,TY,TZ\n1,0,1,2,3\n", "no_trajectories", "", {}),
        (QUALISYS.replace("\t3D", "\t6D"), "no_markers", "", {"kind": "6D"}),
        (QUALISYS.replace("FREQUENCY\t120", "FREQUENCY\t0", 1), "unknown_rate", "", {}),
        (OPTITRACK.replace("Millimeters", "Parsec"), "unknown_unit", "line 1, Length Units", {"unit": "parsec"}),
        (OPTITRACK.replace("Bone,", "Rigid Body Marker,").replace("Marker,Marker,Marker,Marker", "F,F,F,F"),
         "no_points", "", {}),
        (OPTITRACK.replace(",Type,", ",Sort,"), "unreadable_header", "", {}),
        (OPTITRACK.replace("0.016667", "0.001"), "time_order", "line 10", {}),
    ],
)  # fmt: skip
def test_damage_is_named_by_its_place(
    text: str, code: str, where: str, values: dict[str, object], tmp_path: Path
) -> None:
    with rejects(code, where, **values) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_older_exports_of_vicon_have_no_line_of_units(tmp_path: Path) -> None:
    older = NEXUS.replace("Trajectories", "TRAJECTORIES").replace(",,mm,mm,mm,mm,mm,mm\n", "")
    for name, text in (("a.csv", NEXUS), ("b.csv", older)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    first, second = (formats.read(tmp_path / name) for name in ("a.csv", "b.csv"))
    np.testing.assert_array_equal(first.positions_mm, second.positions_mm)


def test_rows_of_commas_above_the_first_section_of_nexus(tmp_path: Path) -> None:
    blank = "," * 7 + "\n"
    padded = "".join(
        line + "," * (7 - line.count(",")) + "\n" for line in NEXUS_WITH_DEVICES.split("\n")[:-1]
    )
    assert_is_the_example(read(tmp_path, 3 * blank + NEXUS_WITH_DEVICES))
    assert_is_the_example(read(tmp_path, blank + padded.replace("\n\n", f"\n{blank}")))


def test_columns_to_the_right_of_the_trajectories_are_no_points(tmp_path: Path) -> None:
    lines = NEXUS.split("\n")
    lines[2] += ",Magnitude( X ),Magnitude( Y ),Count"
    lines[3] += ",,,Count"
    lines[4] += ",mm,mm,"
    text = "\n".join(
        lines[:5] + [f"{line},1.5,2.5,2" if line.startswith("69") else line for line in lines[5:]]
    )
    text = text.replace("697,0,2,2,3,4,,6,1.5,2.5,2", "697,0,2,2,3,4,,6")  # the line may end before them
    motion = read(tmp_path, text)
    assert_is_the_example(motion)
    assert motion.notes == ("Columns that are not read: Magnitude( X ), Magnitude( Y ), Count.",)
    with rejects("wrong_count", "line 6"):
        read(tmp_path, text.replace("2.5,2\n", "2.5,2,7\n", 1))


@pytest.mark.parametrize("rate", ["0", "-120", "1000000", "1500000", "fast", ""])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate: str) -> None:
    (tmp_path / "a.csv").write_text(NEXUS.replace("\n120\n", f"\n{rate}\n"), encoding="utf-8")
    with rejects("unusable_rate", "line 2"):
        formats.read(tmp_path / "a.csv")


def test_the_rate_is_that_of_the_file(tmp_path: Path) -> None:
    for rate, expected in (("120", 120.0), ("999999", 999_999.0), ("1", 1.0)):
        assert read(tmp_path, NEXUS.replace("\n120\n", f"\n{rate}\n")).frame_rate_hz == expected
