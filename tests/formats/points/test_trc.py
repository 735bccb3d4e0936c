"""Tests of the TRC reader and writer: variants of the format, damaged files, and a write-read cycle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.formats.points import trc
from pipeline.skeleton.recorded import MILLIMETRES, MotionCapture
from pipeline.validation import InvalidInput, harmless
from tests.formats.contract import FIXTURES
from tests.rejects import rejects

FIXTURE = FIXTURES / "trc_two_markers.trc"

HEADER = (
    "PathFileType\t4\t(X/Y/Z)\tmade.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "{rate}\t{rate}\t{frames}\t{markers}\t{units}\t{rate}\t1\t{frames}\n"
    "Frame#\tTime\tHead Top\t\t\tHip\t\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
    "\n"
)
ROWS = (
    "1\t0.000\t1\t2\t3\t4\t5\t6\n",
    "2\t0.008\t1.5\t2\t3\t\t\t\n",
    "3\t0.017\t2\t2\t3\t4\tnan\t6\n",
)


def made(
    rows: tuple[str, ...] = ROWS,
    *,
    rate: str = "120.00",
    frames: str = "3",
    markers: str = "2",
    units: str = "mm",
) -> str:
    return HEADER.format(rate=rate, frames=frames, markers=markers, units=units) + "".join(rows)


def read(tmp_path: Path, text: str | bytes, units: str | None = None) -> MotionCapture:
    path = tmp_path / "made.trc"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return trc.read(path, units=units)


EXPECTED = np.array(
    [
        [[1, 2, 3], [4, 5, 6]],
        [[1.5, 2, 3], [np.nan] * 3],
        [[2, 2, 3], [np.nan] * 3],
    ]
)


def assert_is_the_example(motion: MotionCapture, names: tuple[str, ...] = ("Head Top", "Hip")) -> None:
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED)
    np.testing.assert_array_equal(motion.valid, [[True, True], [True, False], [True, False]])
    assert motion.names == names
    assert (motion.frame_rate_hz, motion.units) == (120.0, "mm")


def test_the_fixture(tmp_path: Path) -> None:
    assert FIXTURE.read_text(encoding="utf-8") == made()
    motion = trc.read(FIXTURE)
    assert_is_the_example(motion)
    assert motion.notes == ()


@pytest.mark.parametrize(
    "dialect",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("Z2\n\n", "Z2\n"),
        lambda text: text.replace("6\n", "6\t\t\n"),
        lambda text: text + "\n  \n",
        lambda text: text.replace("Hip\t\t\t\n", "Hip\n"),
        lambda text: text.replace("DataRate\t", "DataRate \t"),
        lambda text: "\n\n" + text,
    ],
    ids=[
        "crlf",
        "cr",
        "bom",
        "no blank line",
        "tabs at the end",
        "blank end",
        "no tabs after names",
        "blanks",
        "blank lines above",
    ],
)
def test_dialects_of_the_same_file(tmp_path: Path, dialect) -> None:  # type: ignore[no-untyped-def]
    assert_is_the_example(read(tmp_path, dialect(made())))


def test_spaces_instead_of_tabs(tmp_path: Path) -> None:
    text = made().replace("Head Top", "Head").replace("\t\t\t\n", "\tnan\tnan\tnan\n", 2).replace("\t", "  ")
    assert_is_the_example(read(tmp_path, text.replace("Hip  nan  nan  nan", "Hip")), ("Head", "Hip"))


@pytest.mark.parametrize("unit", MILLIMETRES)
def test_every_unit_becomes_millimetres(tmp_path: Path, unit: str) -> None:
    motion = read(tmp_path, made(units=unit))
    np.testing.assert_allclose(motion.positions_mm, EXPECTED * MILLIMETRES[unit])
    assert motion.units == unit


@pytest.mark.parametrize(("written", "unit"), [("Meters", "m"), ("millimetres", "mm"), ("inches", "in")])
def test_a_unit_may_be_a_word(tmp_path: Path, written: str, unit: str) -> None:
    motion = read(tmp_path, made(units=written))
    np.testing.assert_allclose(motion.positions_mm, EXPECTED * MILLIMETRES[unit])
    assert motion.units == unit


def test_a_unit_that_the_file_does_not_state_is_assumed(tmp_path: Path) -> None:
    text = made().replace("Units", "Colour")
    motion = read(tmp_path, text)
    assert (motion.units, motion.units_assumed) == ("mm", True)
    np.testing.assert_allclose(motion.positions_mm, EXPECTED)
    np.testing.assert_allclose(read(tmp_path, text, units="m").positions_mm, EXPECTED * 1000)
    assert read(tmp_path, made(), units="m").units == "mm"


def test_doubled_names_and_a_missing_line_end_are_noted(tmp_path: Path) -> None:
    motion = read(tmp_path, made().replace("Hip", "Head Top").rstrip("\n"))
    assert "no line end" in motion.notes[0]
    assert "names are repeated" in motion.notes[1]
    latin = read(tmp_path, made().replace("Hip", "Hüfte").encode("latin-1"))
    assert latin.names[1] == "Hüfte"
    assert "Latin-1" in latin.notes[0]


@pytest.mark.parametrize(
    ("text", "code", "where", "values"),
    [
        ("time,x\n" * 9, "wrong_format", "line 1", {}),
        (made()[:90], "wrong_format", "line 1", {}),
        (made(units="ell"), "unknown_unit", "Units in line 3", {"unit": "ell"}),
        (made(rate="fast"), "unusable_rate", "line 3", {"text": "fast"}),
        (made(rate="nan"), "unusable_rate", "line 3", {"text": "nan"}),
        (made(rate="90"), "rate_contradiction", "", {"stated_hz": 90.0}),
        (made((), frames="0"), "no_frames", "", {}),
        (made().replace("Hip", "Hip\tKnee\tAnkle"), "misplaced_names", "line 4", {"count": 4}),
        (made().replace("Frame#", "Row"), "unreadable_header", "line 4", {}),
        (made((*ROWS[:2], ROWS[2][:-1] + "\t7\n")), "wrong_count", "line 9", {"needed": 8, "count": 9}),
        (made((ROWS[0], "2\t0.008\t1.5\t2\n", ROWS[2])), "wrong_count", "line 8", {"needed": 8, "count": 4}),
        (made((*ROWS[:2], ROWS[2].replace("6", "six"))), "not_number", "line 9, cell 8", {"text": "six"}),
        (made((*ROWS[:2], ROWS[2].replace("6", "1_0"))), "not_number", "line 9, cell 8", {"text": "1_0"}),
        (made((*ROWS[:2], ROWS[2].replace("6", "1e400"))), "not_number", "line 9, cell 8", {"text": "1e400"}),
        (made((ROWS[0], ROWS[1], ROWS[0])), "time_order", "line 9", {}),
        (made((*ROWS[:2], ROWS[2].replace("0.017", ""))), "time_order", "line 9", {}),
        (made((*ROWS[:2], ROWS[2].replace("0.017", "9e5"))), "times_jump", "line 9", {}),
        (made().replace("Hip", "Hi\0p"), "zero_byte", "", {}),
    ],
)
def test_damage_is_named_by_its_line(
    tmp_path: Path, text: str, code: str, where: str, values: dict[str, object]
) -> None:
    with rejects(code, where, **values):
        read(tmp_path, text)


def test_a_file_cut_anywhere_is_refused_or_says_so(tmp_path: Path) -> None:
    data = made().encode()
    for size in range(len(data) - 1):
        try:
            motion = read(tmp_path, data[:size])
        except InvalidInput:
            continue
        assert any("The last line" in note or "declares 3 frames" in note for note in motion.notes), size
        # A cut line is left out, so whatever was read is right, but for the last number of a file cut within it.
        sure = len(motion.positions_mm) - (len(motion.positions_mm) == 3)
        np.testing.assert_array_equal(motion.positions_mm[:sure], EXPECTED[:sure])


COMMAS = made().replace("\t", ",").replace("nan", "")


@pytest.mark.parametrize(
    ("text", "notes"),
    [
        (COMMAS, []),
        (COMMAS.replace("made.trc", "made.trc,,,,,,,"), []),
        (made().replace("\t", ";"), []),
        (made().replace("DataRate\t", "DataRate\t\t").replace("120.00\t", "120.00\t\t", 1), []),
        (made().replace("Time\tHead Top", "Time\t\tHead Top").replace("\t\tX1", "\t\t\tX1"), []),
        (made().replace("Head Top\t\t\t", "Head Top\t\t\t\t").replace("Z1\t", "Z1\t\t"), []),
        (made().replace("Head Top\t\t\tHip\t\t\t", "Head Top\tHead Top\tHead Top\tHip\tHip\tHip"), []),
        (made().replace("Head Top\t\t\t", "Head Top\t"), []),
        (made().replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n", ""), []),
        (made(markers="3"), ["declares 3 markers but names 2"]),
        (made(frames="9"), ["declares 9 frames but has 3"]),
        (made(frames="x").replace("x\t2", "\t2"), []),
        (made((*ROWS, "4\t0.025\t2\t2"), frames="9"), ["last line (10) is truncated", "declares 9 frames"]),
    ],
    ids=lambda value: None if isinstance(value, str) else "; ".join(value),
)
def test_blank_doubled_and_separated_otherwise(tmp_path: Path, text: str, notes: list[str]) -> None:
    motion = read(tmp_path, text)
    assert_is_the_example(motion)
    described = [note for note in motion.notes if "no line end" not in note]
    assert len(described) == len(notes)
    assert all(words in note for words, note in zip(notes, described, strict=True))


def test_a_marker_without_a_name_is_called_by_its_place(tmp_path: Path) -> None:
    motion = read(tmp_path, made().replace("Head Top", ""))
    assert motion.names == ("point_1", "Hip")
    assert "1 markers have no name" in motion.notes[-1]


def line(times: np.ndarray, rate: str = "0") -> str:
    """Return a TRC file of two markers whose coordinates are linear and quadratic in time."""
    rows = [f"{k}\t{t!r}\t{t!r}\t{t * t!r}\t1\t0\t0\t{-t!r}\n" for k, t in enumerate(times.tolist(), start=1)]
    return made(tuple(rows), rate=rate, frames=str(len(rows)))


def test_the_rate_comes_from_the_times_if_the_header_says_zero(tmp_path: Path) -> None:
    motion = read(tmp_path, line(np.arange(40) / 91))
    assert motion.frame_rate_hz == pytest.approx(91)
    assert motion.notes == ()
    with rejects(
        "coarse_times", rate_hz=pytest.approx(117.6, abs=0.1), doubt=pytest.approx(0.059, abs=0.001)
    ):
        read(tmp_path, made(rate="0"))


def test_times_may_be_milliseconds(tmp_path: Path) -> None:
    motion = read(tmp_path, line(np.arange(20.0) * 10, rate="100"))
    assert (motion.frame_rate_hz, len(motion.valid)) == (100.0, 20)
    assert "The times are read as milliseconds: frames are 10 apart." in motion.notes


def test_uneven_times_are_resampled_and_said(tmp_path: Path) -> None:
    times = np.cumsum(np.random.default_rng(3).uniform(0.008, 0.014, 60))
    motion = read(tmp_path, line(times))
    assert "not evenly spaced" in motion.notes[0]
    at = times[0] + np.arange(len(motion.positions_mm)) / motion.frame_rate_hz
    assert at[-1] <= times[-1] + 1e-9
    expected = np.stack([at, at**2, np.ones_like(at)], axis=-1)
    # Next to the last row the slope is that of a chord.
    np.testing.assert_allclose(motion.positions_mm[:-1, 0], expected[:-1], rtol=1e-9, atol=1e-9)


def test_a_missing_line_is_a_missing_frame(tmp_path: Path) -> None:
    motion = read(tmp_path, line(np.delete(np.arange(20) / 100, [5, 6]), rate="100"))
    assert len(motion.valid) == 20
    assert np.flatnonzero(~motion.valid.all(axis=1)).tolist() == [5, 6]
    assert motion.notes == ("2 frames have no row and are missing.",)
    described = read(tmp_path, line(np.delete(np.arange(20) / 128, [5, 6])))  # the rate is that of most steps
    assert described.frame_rate_hz == 128.0
    np.testing.assert_array_equal(described.valid, motion.valid)


@pytest.mark.parametrize("apart", [2, 3, 10, 40])
@pytest.mark.parametrize("rate", [100.0, 240.0, 119.88])
@pytest.mark.parametrize("decimals", [3, 9])
def test_rows_that_are_whole_frames_apart_have_the_rate_of_their_times(
    tmp_path: Path, apart: int, rate: float, decimals: int
) -> None:
    times = np.round(apart * np.arange(40) / rate, decimals)
    motion = read(tmp_path, line(times, rate=f"{rate:g}"))
    assert motion.frame_rate_hz == pytest.approx(rate / apart)
    assert motion.valid.all()
    np.testing.assert_allclose(motion.positions_mm[:, 0, 0], times)
    assert motion.notes == (
        f"All rows are {apart} frames apart: their rate of {rate / apart:g} Hz is used "
        f"instead of {rate:g} Hz from the header or the option.",
    )
    lost = read(tmp_path, line(np.delete(times, [5, 6]), rate=f"{rate:g}"))
    assert lost.frame_rate_hz == pytest.approx(rate / apart)
    assert np.flatnonzero(~lost.valid.all(axis=1)).tolist() == [5, 6]


def test_times_of_no_whole_number_of_frames_contradict_the_header(tmp_path: Path) -> None:
    for rate, decimals in ((250, 9), (1000, 3)):  # 2.08 and 8.33 frames apart
        times = np.round(np.arange(40) / 120, decimals)
        with rejects("rate_contradiction", stated_hz=rate, times_hz=pytest.approx(120.0, abs=0.5)):
            read(tmp_path, line(times, rate=str(rate)))


def test_rows_that_are_lost_again_and_again_leave_the_rate_of_the_header(tmp_path: Path) -> None:
    frames = np.cumsum(np.tile([2, 3, 2, 4], 10))
    motion = read(tmp_path, line(frames / 128, rate="128"))
    assert motion.frame_rate_hz == 128.0
    assert np.flatnonzero(motion.valid.all(axis=1)).tolist() == (frames - 2).tolist()


def test_nothing_is_interpolated_across_a_gap_between_uneven_times(tmp_path: Path) -> None:
    steps = np.random.default_rng(3).uniform(0.008, 0.014, 60)
    steps[30] = 0.1
    times = np.cumsum(steps)
    motion = read(tmp_path, line(times))
    at = times[0] + np.arange(len(motion.valid)) / motion.frame_rate_hz
    inside = (at > times[29]) & (at < times[30])
    assert inside.sum() >= 5
    np.testing.assert_array_equal(motion.valid[:, 0], ~inside)


def test_frames_are_numbered_from_one_and_timed_from_zero(tmp_path: Path) -> None:
    trc.write(tmp_path / "a.trc", ["a"], np.zeros((3, 1, 3)), 50.0)
    rows = (tmp_path / "a.trc").read_text(encoding="utf-8").splitlines()[5:]
    assert [row.split("\t")[:2] for row in rows] == [["1", "0"], ["2", "0.02"], ["3", "0.04"]]


NAMES = (
    st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "S", "Zs")), min_size=1, max_size=12)
    .filter(lambda name: name == name.strip() and name.isprintable())
    .filter(lambda name: name == name.strip('"') and name == harmless(name))
)


@given(
    names=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    frames=st.integers(1, 5),
    rate=st.floats(1, 1e4),
    data=st.data(),
)
def test_what_is_written_is_read_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, names: list[str], frames: int, rate: float, data: st.DataObject
) -> None:
    coordinate = st.floats(-1e9, 1e9)
    positions = data.draw(hnp.arrays(float, (frames, len(names), 3), elements=coordinate))
    positions[(positions == positions[..., :1]).all(axis=-1)] = 1.0, 2.0, 3.0  # gaps, see test_contract
    positions[1:][data.draw(hnp.arrays(bool, (frames - 1, len(names))))] = np.nan
    path = tmp_path_factory.getbasetemp() / "round_trip.trc"
    trc.write(path, names, positions, rate)
    motion = trc.read(path)
    np.testing.assert_array_equal(motion.positions_mm, positions)
    np.testing.assert_array_equal(motion.valid, np.isfinite(positions).all(axis=-1))
    assert (motion.names, motion.frame_rate_hz, motion.units) == (tuple(names), rate, "mm")


@pytest.mark.parametrize(
    ("names", "positions", "rate", "code"),
    [
        (["a"], np.zeros((2, 2, 3)), 100.0, "wrong_shape"),
        (["a"], np.zeros((0, 1, 3)), 100.0, "wrong_shape"),
        ([""], np.zeros((2, 1, 3)), 100.0, "unwritable_name"),
        (["a\tb"], np.zeros((2, 1, 3)), 100.0, "unwritable_name"),
        ([" a"], np.zeros((2, 1, 3)), 100.0, "unwritable_name"),
        (["a"], np.full((2, 1, 3), np.inf), 100.0, "not_finite"),
        (["a"], np.zeros((2, 1, 3)), 0.0, "out_of_range"),
    ],
)
def test_what_the_format_cannot_hold_is_not_written(
    tmp_path: Path, names: list[str], positions: np.ndarray, rate: float, code: str
) -> None:
    with rejects(code, "out.trc"):
        trc.write(tmp_path / "out.trc", names, positions, rate)
    assert not (tmp_path / "out.trc").exists()


@pytest.mark.parametrize("rate", ["0", "-120.00"])
def test_a_rate_that_is_none_is_taken_from_the_times(tmp_path: Path, rate: str) -> None:
    rows = tuple(f"{k + 1}\t{k / 120:.9f}\t1\t2\t3\t4\t5\t6\n" for k in range(3))
    assert read(tmp_path, made(rows, rate=rate)).frame_rate_hz == pytest.approx(120)


def test_decimal_commas_between_tabs(tmp_path: Path) -> None:
    header, rows = HEADER.format(rate="120,00", frames="3", markers="2", units="mm"), "".join(ROWS)
    motion = read(tmp_path, header + rows.replace(".", ",").replace("1\t0,000\t1\t", "1\t0,000\t1,0\t", 1))
    np.testing.assert_array_equal(motion.positions_mm, EXPECTED)
    assert "decimal points" in motion.notes[0]


def test_utf16_as_spreadsheets_write_it(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read(tmp_path, made().encode("utf-16")).positions_mm, EXPECTED)
    with pytest.raises(UnicodeDecodeError):
        read(tmp_path, made().encode("utf-16") + b"\x00")


def test_more_markers_are_declared_than_named(tmp_path: Path) -> None:
    axes = "\t\tX1\tY1\tZ1\tX2\tY2\tZ2"
    more = "".join(f"\tX{k}\tY{k}\tZ{k}" for k in (3, 4))
    for text in (
        made(markers="4"),
        made(markers="4").replace(axes, axes + more),
        made(tuple(row.replace("\n", "\t7\t8\t9\t7\t8\t9\n") for row in ROWS), markers="4"),
    ):
        motion = read(tmp_path, text)
        assert motion.names == ("Head Top", "Hip")
        np.testing.assert_array_equal(motion.positions_mm, EXPECTED)
        assert "The file declares 4 markers but names 2; the names are used." in motion.notes
    with rejects("wrong_count"):
        read(tmp_path, made(tuple(row.replace("\n", "\t7\t8\t9\n") for row in ROWS), markers="4"))
