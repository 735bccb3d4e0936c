"""Tests of the CSV reader and writer: wide and long tables, variants, damaged files, and a write-read cycle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline import formats, mappings
from pipeline.formats.points import csv
from pipeline.formats.points.csv.table import role_of
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.validation import InvalidInput, harmless
from tests.formats.contract import FIXTURES
from tests.rejects import rejects

WIDE = """\
time,head_x,head_y,head_z,left hip_x,left hip_y,left hip_z
0.00,1,2,3,4,5,6
0.01,1.5,2,3,,,
0.02,2,2,3,4,nan,6
"""
LONG = """\
frame,time,joint,x,y,z
7,0.00,head,1,2,3
7,0.00,left hip,4,5,6
8,0.01,head,1.5,2,3
8,0.01,left hip,,,
9,0.02,head,2,2,3
9,0.02,left hip,4,nan,6
"""
EXPECTED = np.array(
    [
        [[1, 2, 3], [4, 5, 6]],
        [[1.5, 2, 3], [np.nan] * 3],
        [[2, 2, 3], [np.nan] * 3],
    ]
)


def read(tmp_path: Path, text: str | bytes, **options: object) -> MotionCapture:
    path = tmp_path / "made.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return csv.read(path, **options)  # type: ignore[arg-type]


def assert_is_the_example(motion: MotionCapture) -> None:
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED)
    np.testing.assert_array_equal(motion.valid, [[True, True], [True, False], [True, False]])
    assert motion.names == ("head", "left hip")
    assert (motion.frame_rate_hz, motion.units) == (100.0, "mm")


@pytest.mark.parametrize(("name", "text"), [("csv_wide.csv", WIDE), ("csv_long.csv", LONG)])
def test_the_fixtures(name: str, text: str) -> None:
    assert (FIXTURES / name).read_text(encoding="utf-8") == text
    motion = csv.read(FIXTURES / name)
    assert_is_the_example(motion)
    assert motion.notes == ()


def _milliseconds(text: str) -> str:
    return text.replace("0.00", "0").replace("0.01", "10").replace("0.02", "20")


DIALECTS = {
    "crlf": lambda text: text.replace("\n", "\r\n"),
    "bom": lambda text: "\ufeff" + text,
    "semicolons": lambda text: text.replace(",", ";"),
    "decimal commas": lambda text: text.replace(",", ";").replace(".", ","),
    "tabs": lambda text: text.replace(",", "\t"),
    "capital columns": lambda text: (
        text.replace("time", "Time").replace("frame", "FRAME").replace("_x", "_X").replace(",x,y", ",X,Y")
    ),
    "dots": lambda text: text.replace("_x", ".x").replace("_y", ".y").replace("_z", ".z"),
    "blanks": lambda text: text.replace("_x", " x").replace("_y", " y").replace("_z", " z"),
    "colons": lambda text: text.replace("_x", ":x").replace("_y", ":y").replace("_z", ":z"),
    "hyphens": lambda text: text.replace("_x", "-x").replace("_y", "-y").replace("_z", "-z"),
    "units in names": lambda text: text.replace("_x", "_x_mm").replace(",x,y,z", ",x_mm,y_mm,z_mm"),
    "units in brackets": lambda text: text.replace("_x", "_x (mm)").replace(",x,", ",x [mm],"),
    "seconds in the name": lambda text: text.replace("time", "time_s"),
    "delimiters at the end": lambda text: text.replace("\n", ",\n"),
    "blank lines": lambda text: "\n" + text.replace("\n", "\n\n"),
    "quotes": lambda text: (
        text.replace("left hip", '"left hip"').replace('"left hip"_', '"left hip_')
        if "joint" in text
        else text.replace("left hip_x", '"left hip_x"')
    ),
    "marker": lambda text: text.replace("joint", "Marker"),
    "name": lambda text: text.replace("joint", "name"),
    "milliseconds": lambda text: _milliseconds(text).replace("time", "time [ms]"),
    "a title above": lambda text: "Walk of anna\nVersion 3, of 2024\n\n" + text,
    "other words for nothing": lambda text: text.replace("nan", "-1.#IND").replace(",,", ",-nan(ind),"),
}


@pytest.mark.parametrize("text", [WIDE, LONG], ids=["wide", "long"])
@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects_of_the_same_table(tmp_path: Path, dialect: str, text: str) -> None:
    assert_is_the_example(read(tmp_path, DIALECTS[dialect](text)))


@pytest.mark.parametrize(
    "written",
    ["{1}_{0}", "{0}{1}", "{0}_t{1}", "{0}_{2}", "{0} ({1})", "{0} ({1}) [mm]", "{0}_{1}_millimetres"],
)
def test_names_and_axes_in_whatever_order(tmp_path: Path, written: str) -> None:
    titles = [written.format(name, "xyz"[k], k + 1) for name in ("head", "left hip") for k in range(3)]
    text = WIDE.replace(WIDE.split("\n")[0], ",".join(["time", *titles, "Max"])).replace("\n", ",1\n")
    motion = read(tmp_path, text.replace("Max,1", "Max"))
    assert_is_the_example(motion)
    assert motion.notes == ("Columns that are not read: Max.",)


@pytest.mark.parametrize("nothing", ["nan", "NA", "", "null", "-nan(ind)"])
def test_a_first_row_of_nothing_is_no_title(tmp_path: Path, nothing: str) -> None:
    first = f"-0.01{f',{nothing}' * 6}"
    motion = read(tmp_path, WIDE.replace("0.00,1", f"{first}\n0.00,1"))
    assert (motion.valid.shape, motion.names) == ((4, 2), ("head", "left hip"))
    assert not motion.valid[0].any()


@pytest.mark.parametrize("text", [WIDE, LONG], ids=["wide", "long"])
def test_blanks_between_cells_below_a_title(tmp_path: Path, text: str) -> None:
    blanks = text.replace(",,,", ",na,na,na").replace("left hip", "left_hip").replace(",", "  ")
    motion = read(tmp_path, "Walk 3 of anna\n" + blanks)
    assert motion.names == ("head", "left_hip")
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED)


TITLES = WIDE.split("\n")[0]


@pytest.mark.parametrize(
    "titles",
    [
        "time,head,,,left hip,,\n,x,y,z,x,y,z",
        "time,head,head,head,left hip,left hip,left hip\n,X,Y,Z,X,Y,Z",
        f"{TITLES}\ns,mm,mm,mm,mm,mm,mm",
        f"A study of 2024,,,,,,\n{TITLES}",
    ],
)
def test_titles_in_several_lines(tmp_path: Path, titles: str) -> None:
    assert_is_the_example(read(tmp_path, WIDE.replace(TITLES, titles)))


@pytest.mark.parametrize(
    "time",
    [
        "2024-05-01 10:00:59.9{}0",
        "10:00:00.0{}0",
        "17000000000{}0",
        "1700000000.0{}",
        "2024-05-01T10:00:59.9{}0Z",
        "2024-05-01T10:00:59.9{}0-05:00",
    ],
)
def test_times_of_a_calendar(tmp_path: Path, time: str) -> None:
    text = WIDE.replace("time", "timestamp_ms" if "." not in time else "timestamp")
    for k in range(3):
        text = text.replace(f"0.0{k}", time.format(k))
    assert_is_the_example(read(tmp_path, text))


@pytest.mark.parametrize(
    "title", ["joint_name", "Marker Name", "landmark_index", "bodypart", "Bone", "JointType"]
)
def test_a_long_table_that_says_what_of_a_point_it_names(tmp_path: Path, title: str) -> None:
    assert_is_the_example(read(tmp_path, LONG.replace("joint", title)))


@pytest.mark.parametrize(
    ("title", "is_time"), [("__time", True), ("%time", True), ("# Time", True), ("Time %", False)]
)
def test_titles_may_begin_with_signs(title: str, is_time: bool) -> None:
    assert (role_of(title)[0] == "time") is is_time


@pytest.mark.parametrize(
    ("title", "usual"),
    [
        ("item", "frame"),
        ("FrameNumber", "frame"),
        ("Tempo", "time"),
        ("bone", "joint"),
        ("joint_id", "joint"),
    ],
)
@pytest.mark.parametrize("first", [False, True])
def test_titles_that_mean_something_else_beside_others(
    title: str, usual: str, first: bool, tmp_path: Path
) -> None:
    header, *rows = LONG.splitlines()
    both = f"{title},{usual}" if first else f"{usual},{title}"
    at = header.split(",").index(usual)
    lines = [header.replace(usual, both)]
    for row in rows:
        cells = row.split(",")
        cells.insert(at if first else at + 1, "7")
        lines.append(",".join(cells))
    assert_is_the_example(read(tmp_path, "\n".join(lines) + "\n"))


@pytest.mark.parametrize("title", ["FrameNumber", "frame"])
def test_frames_of_slower_cameras_stand_again(title: str, tmp_path: Path) -> None:
    header, *rows = WIDE.splitlines()
    text = "\n".join([f"{title},{header}", *(f"{k // 2},{row}" for k, row in enumerate(rows))])
    if title == "frame":
        with rejects("point_twice"):
            read(tmp_path, text)
    else:
        assert_is_the_example(read(tmp_path, text))


def test_a_long_table_with_positions_twice(tmp_path: Path) -> None:
    header, *rows = LONG.splitlines()
    lines = [f"{header},pos_x,pos_y,pos_z", *(f"{row},0,0,0" for row in rows)]
    assert_is_the_example(read(tmp_path, "\n".join(lines) + "\n"))


def test_a_long_table_with_rotations_beside_positions(tmp_path: Path) -> None:
    header, *rows = LONG.splitlines()
    header = header.replace("x,y,z", "pos_x,pos_y,pos_z,rot_x,rot_y,rot_z,rot_w").replace("time", "ts_s")
    motion = read(
        tmp_path, "\n".join([header.replace("frame", "FrameNo"), *(f"{row},0,0,0,1" for row in rows)])
    )
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED)
    assert "Columns that are not read: rot_w, rot_x, rot_y, rot_z." in motion.notes


def test_tracks_of_bts() -> None:
    assert_is_the_example(formats.read(FIXTURES / "emt_two_markers.emt"))


BTS = (FIXTURES / "emt_two_markers.emt").read_text(encoding="utf-8")


def test_tracks_of_bts_that_were_cut(tmp_path: Path) -> None:
    motion = read(tmp_path, "".join(BTS.splitlines(keepends=True)[:-1]))
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED[:2])
    assert motion.notes == ("The file declares 3 frames but has 2; all 2 are read.",)


def test_tracks_of_bts_that_were_decimated(tmp_path: Path) -> None:
    motion = read(tmp_path, BTS.replace("100 Hz", "500 Hz"))
    assert_is_the_example(motion)
    assert motion.notes == (
        "All rows are 5 frames apart: their rate of 100 Hz is used instead of 500 Hz from the header or the option.",
    )


def test_signs_at_the_end_tell_points_apart(tmp_path: Path) -> None:
    names = [f"{axis}_{name}" for name in ("A", "A-") for axis in "xyz"]
    motion = read(tmp_path, f"time,{','.join(names)}\n0,1,2,3,4,5,6\n0.01,1,2,3,4,5,6\n")
    assert (motion.names, motion.notes) == (("A", "A-"), ())


def test_microseconds_by_their_title(tmp_path: Path) -> None:
    text = WIDE.replace("time", "timestamp_usec")
    for k in range(3):
        text = text.replace(f"0.0{k}", f"70{k}000")
    assert read(tmp_path, text).frame_rate_hz == 1000.0


def test_a_long_table_whose_coordinates_have_a_prefix(tmp_path: Path) -> None:
    assert_is_the_example(read(tmp_path, LONG.replace("joint,x,y,z", "Label,pos_x,pos_y,pos_z")))


@pytest.mark.parametrize(("unit", "zeros"), [("milliseconds", ""), ("microseconds", "000")])
def test_times_that_would_be_too_slow_are_parts_of_a_second(tmp_path: Path, unit: str, zeros: str) -> None:
    motion = read(tmp_path, WIDE.replace("0.01", f"10{zeros}").replace("0.02", f"20{zeros}"))
    assert_is_the_example(motion)
    assert motion.notes == (f"The times are read as {unit}: frames are 10{zeros} apart.",)


def test_ticks_and_nanoseconds_and_what_may_be_two_units(tmp_path: Path) -> None:
    motion = read(tmp_path, WIDE.replace("0.01", "333333").replace("0.02", "666667"))
    assert motion.frame_rate_hz == pytest.approx(30, rel=1e-5)
    assert motion.notes == ("The times are read as ticks of 100 ns: frames are 333334 apart.",)
    ticks = WIDE.replace("0.01", "100000").replace("0.02", "200000")
    with rejects("unclear_time_unit"):
        read(tmp_path, ticks)
    assert_is_the_example(read(tmp_path, ticks, frame_rate_hz=100.0))
    late = read(tmp_path, WIDE.replace("0.01", "1000000000").replace("0.02", "2000000000"))
    assert (late.frame_rate_hz, late.notes) == (
        1.0,
        ("The times are read as nanoseconds.",),
    )


def test_a_rate_of_which_most_frames_would_be_missing_gives_way_to_the_times(tmp_path: Path) -> None:
    text = WIDE.replace("0.01", "0.75").replace("0.02", "1.5") + "2.25" + WIDE.splitlines()[-1][4:] + "\n"
    motion = read(tmp_path, text, frame_rate_hz=120.0)
    assert (motion.frame_rate_hz, len(motion.valid)) == (pytest.approx(1 / 0.75), 4)
    assert motion.notes == (
        "All rows are 90 frames apart: their rate of 1.33333 Hz is used "
        "instead of 120 Hz from the header or the option.",
    )
    uneven = "time,a_x,a_y,a_z\n" + "".join(f"{t},{t},0,0\n" for t in (0.0, 0.091, 0.2, 0.313, 0.398, 0.5))
    with rejects("rate_contradiction", stated_hz=1000.0):
        read(tmp_path, uneven, frame_rate_hz=1000.0)


@pytest.mark.parametrize("unit", MILLIMETRES)
def test_units_by_option_by_column_name_and_by_column(tmp_path: Path, unit: str) -> None:
    column = LONG.replace("x,y,z", "x,y,z,unit").replace("\n", f",{unit}\n").replace(f"unit,{unit}", "unit")
    named = WIDE.replace("_x", f"_x_{unit}").replace("_y", f"_y_{unit}").replace("_z", f"_z_{unit}")
    for motion in (
        read(tmp_path, WIDE, units=unit),
        read(tmp_path, column, units="cm"),
        read(tmp_path, named, units="cm"),
    ):
        np.testing.assert_allclose(motion.positions_mm, EXPECTED * MILLIMETRES[unit])
        assert motion.units == unit


def test_frames_alone_need_the_rate(tmp_path: Path) -> None:
    text = WIDE.replace("time", "frame").replace("0.00", "3").replace("0.01", "4").replace("0.02", "5")
    assert_is_the_example(read(tmp_path, text, frame_rate_hz=100.0))
    with rejects("unknown_rate"):
        read(tmp_path, text)
    with rejects("out_of_range", "the frame rate", value=0.0):
        formats.read(tmp_path / "made.csv", frame_rate_hz=0.0)


def test_times_alone_order_the_frames_of_a_long_table(tmp_path: Path) -> None:
    lines = [line.split(",", 1)[1] for line in LONG.splitlines()]
    shuffled = [lines[0], lines[1], lines[2], lines[5], lines[4], lines[3], lines[6]]
    motion = read(tmp_path, "\n".join(shuffled) + "\n")
    assert_is_the_example(motion)


def test_a_rate_that_is_given_must_agree_with_the_times(tmp_path: Path) -> None:
    assert read(tmp_path, WIDE, frame_rate_hz=99.5).frame_rate_hz == 99.5
    with rejects("rate_contradiction", stated_hz=120.0, times_hz=pytest.approx(100.0)):
        read(tmp_path, WIDE, frame_rate_hz=120.0)


def test_rounded_times_give_the_rate_that_they_can_bear(tmp_path: Path) -> None:
    def times(frames: int, rate: float) -> str:
        return "time,a_x,a_y,a_z\n" + "".join(f"{k / rate:.3f},{k},0,0\n" for k in range(frames))

    assert read(tmp_path, times(40, 120)).frame_rate_hz == 120.0
    assert read(tmp_path, times(2000, 119.88)).frame_rate_hz == pytest.approx(119.88, rel=1e-4)
    assert read(tmp_path, times(3, 100)).frame_rate_hz == 100.0
    coarse = read(tmp_path, times(300, 300))  # of milliseconds, not of a camera of 1000 Hz
    assert (coarse.frame_rate_hz, len(coarse.positions_mm)) == (300.0, 300)
    assert read(tmp_path, times(300, 300).replace("0.050,15,0,0\n", "")).frame_rate_hz == 300.0
    assert read(tmp_path, times(5, 120), frame_rate_hz=120.0).frame_rate_hz == 120.0
    lines = times(120, 30).splitlines(keepends=True)
    gap = read(tmp_path, "".join(lines[:41] + lines[81:]))
    assert (gap.frame_rate_hz, gap.notes) == (30.0, ("40 frames have no row and are missing.",))
    with rejects("coarse_times", doubt=pytest.approx(0.03, abs=0.001)):
        read(tmp_path, times(5, 120))
    uneven = read(tmp_path, times(40, 120).replace("0.167", "0.171"))
    assert uneven.frame_rate_hz == 120.0
    assert any("not evenly spaced" in note for note in uneven.notes)


def test_absent_rows_are_missing_samples_and_noted(tmp_path: Path) -> None:
    text = "".join(line for line in LONG.splitlines(keepends=True) if line != "8,0.01,left hip,,,\n")
    motion = read(tmp_path, text)
    assert_is_the_example(motion)
    assert motion.notes == ("1 of 6 samples have no row and are missing.",)
    gap = "".join(line for line in WIDE.splitlines(keepends=True) if not line.startswith("0.01"))
    assert read(tmp_path, gap.replace("0.02", "0.01")).positions_mm.shape == (2, 2, 3)
    frames = gap.replace("time", "frame").replace("0.00", "0").replace("0.02", "2")
    motion = read(tmp_path, frames, frame_rate_hz=120.0)
    np.testing.assert_array_equal(motion.positions_mm[[0, 2]], EXPECTED[[0, 2]])
    assert not motion.valid[1].any()


def test_columns_that_are_not_read_and_line_ends_are_noted(tmp_path: Path) -> None:
    text = WIDE.replace("\n", ",0.9\n").replace("hip_z,0.9", "hip_z,confidence").rstrip("\n")
    motion = read(tmp_path, text)
    assert_is_the_example(motion)
    assert motion.notes[0].startswith("The last line has no line end")
    assert motion.notes[1] == "Columns that are not read: confidence."
    latin = read(tmp_path, WIDE.replace("left hip", "hüfte").encode("latin-1"))
    assert latin.names[1] == "hüfte"
    assert "Latin-1" in latin.notes[0]


@pytest.mark.parametrize(
    ("text", "code", "where", "values"),
    [
        ("time,head_x,head_y,head_z\n", "no_table", "", {"rows": 1}),
        ("time,speed\n0,1\n", "no_points", "line 1", {}),
        ("time,x,y,z\n0,1,2,3\n", "no_points", "line 1", {}),
        (WIDE.replace("time", "moment"), "no_times", "line 1", {}),
        (WIDE.replace("hip_z", "hip_w"), "missing_axis", "line 1", {"point": "left hip", "axes": ["x", "y"]}),
        (LONG.replace(",z", ",w"), "missing_axis", "line 1", {"point": ""}),
        (WIDE.replace("hip_z", "hip_y"), "column_twice", "line 1", {"columns": ["left hip_y", "left hip_y"]}),
        (LONG.replace("time", "frame"), "column_twice", "line 1", {"columns": ["frame", "frame"]}),
        (
            WIDE.replace("head_x", "head_x_m").replace("hip_x", "hip_x_mm"),
            "mixed_units",
            "",
            {"units": ["m", "mm"]},
        ),
        (WIDE.replace("1.5", "one"), "not_number", "line 3, column 'head_x'", {"text": "one"}),
        (WIDE.replace("1.5", "1_5"), "not_number", "line 3, column 'head_x'", {"text": "1_5"}),
        (WIDE.replace("1.5", "1e300"), "not_number", "line 3, column 'head_x'", {"text": "1e300"}),
        (WIDE.replace("1.5", "inf"), "not_number", "line 3, column 'head_x'", {"text": "inf"}),
        (WIDE.replace("0.01", ""), "missing_number", "line 3, column 'time'", {}),
        (WIDE.replace("0.01", "0.012"), "coarse_times", "line 2", {}),
        (WIDE.replace("4,nan,6", "4,nan"), "wrong_count", "line 4", {"needed": 7, "count": 6}),
        (WIDE.replace("4,nan,6", "4,nan,6,7"), "wrong_count", "line 4", {"needed": 7, "count": 8}),
        (WIDE.replace("0.01", "0.00"), "point_twice", "line 3", {"point": "head"}),
        (LONG.replace("7,0.00,left hip", "7,0.00,head"), "point_twice", "line 3", {"point": "head"}),
        (LONG.replace("8,0.01,left", "7,0.01,left"), "point_twice", "line 5", {"point": "left hip"}),
        (LONG.replace("8,0.01", "8,0.03"), "time_order", "line 6", {}),
        (LONG.replace("9,0.02", "9.5,0.02"), "frame_not_whole", "line 6", {"frame": 9.5}),
        (LONG.replace("9,0.02,head", "9,0.02,"), "no_name", "line 6", {}),
        (LONG.replace("time", "pause").replace("9,0.02,head", "99999999,0,head"), "unknown_rate", "", {}),
        (WIDE.replace("0.01", '"0.01'), "broken_quotes", "", {}),
        (WIDE.replace("head", "he\0ad"), "zero_byte", "", {}),
    ],
)
def test_damage_is_named_by_its_place(
    tmp_path: Path, text: str, code: str, where: str, values: dict[str, object]
) -> None:
    with rejects(code, where, **values):
        read(tmp_path, text)


def test_memory_stays_in_proportion_to_the_table(tmp_path: Path) -> None:
    far = "frame,joint,x,y,z\n1,head,1,2,3\n900000000,head,1,2,3\n"
    with rejects("times_jump", "line 3"):
        read(tmp_path, far, frame_rate_hz=100.0)
    rows = "".join(f"{k},name{k},1,2,3\n" for k in range(500))
    path = tmp_path / "made.csv"
    path.write_text("frame,joint,x,y,z\n" + rows, encoding="utf-8")
    with rejects("nearly_empty"):
        formats.read(path, frame_rate_hz=100.0)


@pytest.mark.parametrize("unit", ["ell", ""])
def test_a_unit_that_is_not_known_is_refused(tmp_path: Path, unit: str) -> None:
    with rejects("unknown_unit", unit=unit):
        read(tmp_path, WIDE, units=unit)


@pytest.mark.parametrize("text", [WIDE, LONG], ids=["wide", "long"])
def test_a_file_cut_anywhere_is_refused_or_says_so(tmp_path: Path, text: str) -> None:
    data = text.encode()
    for size in range(len(data)):
        try:
            motion = read(tmp_path, data[:size])
        except InvalidInput:
            continue
        # A table does not state its length: cut between rows it is a shorter table; cut in a cell it says so.
        if not data[:size].endswith(b"\n"):
            assert any("no line end" in note for note in motion.notes), size
        whole = motion.valid.shape[0]
        np.testing.assert_array_equal(motion.positions_mm[: whole - 1], EXPECTED[: whole - 1])


NAMES = st.text(
    st.characters(codec="utf-8", categories=("L", "N", "P", "S", "Zs")), min_size=1, max_size=12
).filter(lambda name: name == name.strip() and name.isprintable() and name == harmless(name))


@given(
    names=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    frames=st.integers(2, 6),
    rate=st.floats(1, 1e4),
    data=st.data(),
)
def test_what_is_written_is_read_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, names: list[str], frames: int, rate: float, data: st.DataObject
) -> None:
    positions = data.draw(hnp.arrays(float, (frames, len(names), 3), elements=st.floats(-1e9, 1e9)))
    positions[(positions == positions[..., :1]).all(axis=-1)] = 1.0, 2.0, 3.0  # gaps, see test_contract
    positions[1:][data.draw(hnp.arrays(bool, (frames - 1, len(names))))] = np.nan
    path = tmp_path_factory.getbasetemp() / "round_trip.csv"
    csv.write(path, names, positions, rate)
    motion = csv.read(path)
    np.testing.assert_array_equal(motion.positions_mm, positions)
    np.testing.assert_array_equal(motion.valid, np.isfinite(positions).all(axis=-1))
    assert (motion.names, motion.units, motion.notes) == (tuple(names), "mm", ())
    assert motion.frame_rate_hz == pytest.approx(rate, rel=1e-9)


def test_a_name_that_begins_with_an_apostrophe_of_its_own_is_not_remarked(tmp_path: Path) -> None:
    csv.write(tmp_path / "walk.csv", ["'toe"], np.zeros((2, 1, 3)), 100.0)
    motion = csv.read(tmp_path / "walk.csv")
    assert (motion.names, motion.notes) == (("'toe",), ())


@pytest.mark.parametrize(
    ("names", "positions", "rate", "code"),
    [
        (["a"], np.zeros((2, 2, 3)), 100.0, "wrong_shape"),
        (["a"], np.zeros((0, 1, 3)), 100.0, "wrong_shape"),
        (["a", "a"], np.zeros((2, 2, 3)), 100.0, "unwritable_name"),
        ([""], np.zeros((2, 1, 3)), 100.0, "unwritable_name"),
        (["a\nb"], np.zeros((2, 1, 3)), 100.0, "unwritable_name"),
        (["a"], np.full((2, 1, 3), np.inf), 100.0, "not_finite"),
        (["a"], np.zeros((2, 1, 3)), np.nan, "out_of_range"),
    ],
)
def test_what_the_table_cannot_hold_is_not_written(
    tmp_path: Path, names: list[str], positions: np.ndarray, rate: float, code: str
) -> None:
    with rejects(code, "out.csv"):
        csv.write(tmp_path / "out.csv", names, positions, rate)
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize("word", ["NA", "N/A", "#N/A", "None", "null", "-", "NaN"])
def test_words_for_a_missing_value(tmp_path: Path, word: str) -> None:
    assert_is_the_example(read(tmp_path, WIDE.replace(",nan,", f",{word},")))


@pytest.mark.parametrize("remark", ["# walk of 3 May, lab 2\n", "// a\n% b\n", "#\n"])
def test_remarks_before_the_header_are_skipped(tmp_path: Path, remark: str) -> None:
    assert_is_the_example(read(tmp_path, remark + WIDE))
    with rejects("not_number", f"line {4 + remark.count(chr(10))}", text="x"):
        read(tmp_path, remark + WIDE.replace("2,2,3", "2,x,3"))


def test_rows_without_times_are_frames_at_the_rate_that_is_given(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("head_x,head_y,head_z\n1,2,3\n4,5,6\n", encoding="utf-8")
    with rejects("no_times"):
        csv.read(path)
    motion = csv.read(path, frame_rate_hz=30.0)
    assert motion.frame_rate_hz == 30.0
    np.testing.assert_array_equal(motion.positions_mm[:, 0], [[1, 2, 3], [4, 5, 6]])


def test_positions_beside_rotations(tmp_path: Path) -> None:
    head = [f"Hips_{kind}_{axis}" for kind in ("position", "rotation") for axis in "xyz"]
    path = tmp_path / "a.csv"
    path.write_text(f"Timestamp,{','.join(head)}\n0.0,1,2,3,7,7,7\n0.01,4,5,6,7,7,7\n", encoding="utf-8")
    motion = csv.read(path, units="m")
    assert (motion.names, motion.frame_rate_hz) == (("Hips",), 100.0)
    np.testing.assert_array_equal(motion.positions_mm[:, 0], [[1000, 2000, 3000], [4000, 5000, 6000]])
    assert any("Hips_rotation_x" in note for note in motion.notes)


def test_names_and_numbers_without_a_header_are_frames_in_turn(tmp_path: Path) -> None:
    """In a table without a header, as KinectGait writes it, a repeated point name begins a new frame."""
    text = "Head;0.4;0.8;2.6\nHip;0.3;0.1;2.5\nHip;0.2;0.1;2.5\nHead;0.4;0.7;2.6\n"
    path = tmp_path / "a.txt"
    path.write_text(text)
    motion = formats.read(path, frame_rate_hz=30.0, units="m")
    assert motion.names == ("Head", "Hip")
    np.testing.assert_allclose(motion.positions_mm[:, :, 1], [[800, 100], [700, 100]])
    with rejects("unknown_rate"):
        formats.read(path)


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        ("Head;0,4;0,8;2,6\nHip;0,3;0,1;2,5\n", True),
        ("Time\tLASIX\tLASIY\tLASIZ\n0.0\t1\t2\t3\n0.1\t-1e-3\t2\t3\n", True),
        ("Measured in 2019, by 3 people.\nSee the paper; 12 walks, 100 Hz.\n", False),
        ("", False),
    ],
)
def test_a_text_is_a_recording_if_it_begins_with_lines_of_numbers(
    tmp_path: Path, text: str, counts: bool
) -> None:
    (tmp_path / "a.txt").write_text(text)
    assert formats.is_recording(tmp_path / "a.txt") is counts


def test_frames_that_are_lost_again_and_again_do_not_tell_the_rate(tmp_path: Path) -> None:
    frames = np.cumsum([0, *([1, 1, 3] * 13)])
    path = tmp_path / "a.csv"
    path.write_text("time,a_x,a_y,a_z\n" + "".join(f"{frame / 50.0:.2f},1,2,3\n" for frame in frames))
    motion = formats.read(path)
    assert motion.frame_rate_hz == 50.0
    assert np.flatnonzero(motion.valid[:, 0]).tolist() == frames.tolist()


CHANNELS = """name\tcomponent\ttype\ttracked_point\tunits
t\tn/a\tLATENCY\tn/a\ts
q_x\tx\tORNT\tHead\tn/a
h_x\tx\tPOS\tHead\tm
h_y\ty\tPOS\tHead\tm
h_z\tz\tPOS\tHead\tm
"""


def test_bids_motion_has_its_titles_and_its_rate_in_files_beside_it(tmp_path: Path) -> None:
    path, channels, settings = (
        tmp_path / f"sub-1_tracksys-omc_{ending}" for ending in ("motion.tsv", "channels.tsv", "motion.json")
    )
    path.write_text("0\t.7\t1\t2\t3\n0.01\t.7\t1.5\tn/a\t3\n0.02\t.7\t2\t2\t3\n")
    with rejects("no_points"):
        formats.read(path)
    channels.write_text(CHANNELS)
    with rejects("unreadable_channels", "motion.tsv"):
        formats.read(path)
    settings.write_text('{"SamplingFrequency": 100}')
    motion = formats.read(path)
    assert (motion.names, motion.frame_rate_hz, motion.units) == (("Head",), 100.0, "m")
    np.testing.assert_array_equal(motion.positions_mm[[0, 2], 0], [[1000, 2000, 3000], [2000, 2000, 3000]])
    assert not motion.valid[1, 0]
    channels.write_text(CHANNELS.replace("LATENCY", "MISC"))
    assert formats.read(path).frame_rate_hz == 100.0
    requested = formats.read(path, frame_rate_hz=50.0)
    assert requested.frame_rate_hz == 50.0
    note = "The file states 100 frames per second; the requested 50 are used instead."
    assert note in requested.notes
    path.write_text("0\t.7\t1\t2\t3\n0.01\t.7\tx\t2\t3\n")
    with rejects("not_number", "motion.tsv, line 2, column 'Head_x_m'"):
        formats.read(path)
    rates = [f'{{"SamplingFrequency": {rate}}}' for rate in ('"fast"', "NaN", 0, -5)]
    for damage in ("{}", "[]", "{", *rates):
        settings.write_text(damage)
        with rejects("unreadable_channels", "motion.tsv"):
            formats.read(path)


def test_files_beside_bids_motion_may_be_above_it(tmp_path: Path) -> None:
    folder = tmp_path / "sub-1" / "ses-1" / "motion"
    folder.mkdir(parents=True)
    path = folder / "sub-1_ses-1_task-walk_tracksys-omc_motion.tsv"
    path.write_text("0\t.7\t1\t2\t3\n0.01\t.7\t1.5\t2\t3\n")
    (tmp_path / "task-walk_channels.tsv").write_text(CHANNELS.replace("\tm\n", "\tcm\n"))
    (tmp_path / "task-run_channels.tsv").write_text(CHANNELS)
    (tmp_path / "task-run_motion.json").write_text('{"SamplingFrequency": 50}')
    with rejects("unreadable_channels", files=["task-walk_channels.tsv"]):
        formats.read(path)
    (tmp_path / "motion.json").write_text('{"SamplingFrequency": 100}')
    motion = formats.read(path)
    assert (motion.names, motion.frame_rate_hz, motion.units) == (("Head",), 100.0, "cm")
    (folder / "sub-1_ses-1_tracksys-omc_channels.tsv").write_text(CHANNELS)
    (folder / "sub-2_ses-1_tracksys-omc_channels.tsv").write_text(CHANNELS.replace("\tm\n", "\tmm\n"))
    (folder / "sub-1_ses-1_channels.tsv").write_text(CHANNELS.replace("\tm\n", "\tmm\n"))
    assert formats.read(path).units == "m"
    (folder / "sub-1_ses-1_motion.json").write_text('{"SamplingFrequency": 200}')
    assert formats.read(path).frame_rate_hz == 200.0
    (folder / "sub-1_ses-1_motion.json").write_text('{"TrackingSystemName": "omc"}')
    assert formats.read(path).frame_rate_hz == 100.0  # of all settings together
    assert [file for file in tmp_path.rglob("*") if formats.is_recording(file)] == [path]


@pytest.mark.parametrize("signals", ["ProxEndPos", "CGPos ProxEndPos"])
@pytest.mark.parametrize("timed", [False, True])
def test_segments_as_visual3d_exports_them(signals: str, timed: bool, tmp_path: Path) -> None:
    segments = ["LTH", "RTH", "LSK", "RSK", "LFT", "RFT", "RPV"]
    columns = [("TIME", "FRAME_NUMBERS", "ORIGINAL", "X")] * timed
    columns += [
        (signal, "KINETIC_KINEMATIC", segment, axis)
        for signal in signals.split()
        for segment in segments
        for axis in "XYZ"
    ]
    lines = [["", *["C:\\walk.c3d"] * len(columns)], *(["", *words] for words in zip(*columns, strict=True))]
    lines[-1][0] = "ITEM"
    lines += [
        [f"{k}" for k in (row, *[row / 100] * timed, *range(len(columns) - timed))] for row in (1, 2, 3)
    ]
    text = "".join("\t".join(line) + "\n" for line in lines)
    if not timed:
        with rejects("unknown_rate"):
            read(tmp_path, text)
    motion = read(tmp_path, text, frame_rate_hz=100.0)
    fit = mappings.suggest(motion, mappings.shipped().values())
    assert (fit.usable, fit.mapping.name, motion.frame_rate_hz) == (True, "visual3d", 100.0)
    left_hip = motion.names.index("ProxEndPos_KINETIC_KINEMATIC_LTH")
    assert motion.positions_mm[0, left_hip].tolist() == [3 * left_hip, 3 * left_hip + 1, 3 * left_hip + 2]


def test_of_original_and_processed_targets_of_visual3d_the_processed_are_read(tmp_path: Path) -> None:
    columns = [("TIME", "FRAME_NUMBERS", "ORIGINAL", "X")]
    columns += [("LKNE", "TARGET", folder, axis) for folder in ("PROCESSED", "ORIGINAL") for axis in "XYZ"]
    lines = [["", *words] for words in zip(*columns, strict=True)]
    lines[-1][0] = "ITEM"
    lines += [[f"{row}", f"{row / 100}", *"123456"] for row in (1, 2, 3)]
    motion = read(tmp_path, "".join("\t".join(line) + "\n" for line in [[""] + ["a.c3d"] * 7, *lines]))
    assert (motion.names, motion.frame_rate_hz) == (("LKNE_TARGET",), 100.0)
    assert motion.positions_mm[0].tolist() == [[1, 2, 3]]
