"""Tests of the conversion from time stamps to frames: rates, lost rows, decimation, units and rounded times."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.formats import text
from pipeline.formats.points.even_times import at_equal_intervals, frames_of, unit_of_times
from tests.rejects import rejects


def line(k: int) -> str:
    """Return the location of a row for messages."""
    return f"line {k + 1}"


def frames(times_s: np.ndarray, declared_hz: float | None = None) -> tuple[list[float], float, int]:
    """Return the frame numbers, the frame rate and the number of notes for the given times."""
    notes: list[str] = []
    numbers, rate = frames_of(times_s, declared_hz, line, notes)
    return numbers.tolist(), rate, len(notes)


def test_printed_times_are_even_within_their_last_digit() -> None:
    times = np.round(np.arange(61) / 300.0, 3)
    assert frames(times) == (list(range(61)), 300.0, 0)
    late = times.copy()
    late[30] += 0.001  # further off than rounding explains
    numbers, rate, notes = frames(late)
    assert rate == pytest.approx(300.0, rel=2e-3)
    assert notes == 1
    assert numbers[30] == pytest.approx(late[30] * rate)


def test_lost_rows_are_missing_frames() -> None:
    present = np.array([0, 1, 2, 5, 6])
    positions = np.arange(15.0).reshape(5, 1, 3)
    notes: list[str] = []
    filled, rate = at_equal_intervals(present / 50.0, positions, None, line, notes)
    assert (rate, filled.shape, len(notes)) == (50.0, (7, 1, 3), 1)
    np.testing.assert_array_equal(filled[present], positions)
    assert np.isnan(filled[3:5]).all()
    assert "2 frames" in notes[0]


def test_uneven_times_are_interpolated_along_a_parabola() -> None:
    """Interpolation at uneven times reproduces a parabola exactly at all inner frames."""
    times = np.array([0.0, 0.9, 2.0, 3.2, 4.0, 5.1, 6.0, 7.0]) / 10.0
    positions = (100.0 * times**2 + 3.0)[:, None, None] * np.array([1.0, -2.0, 0.5])
    resampled, rate = at_equal_intervals(times, positions, 10.0, line, [])
    assert rate == 10.0
    at = np.arange(len(resampled)) / rate
    exact = (100.0 * at**2 + 3.0)[:, None, None] * np.array([1.0, -2.0, 0.5])
    np.testing.assert_allclose(resampled[1:6], exact[1:6], atol=1e-9)


def test_two_uneven_rows_and_a_gap() -> None:
    # One gap of three intervals between uneven rows stays empty.
    times = np.array([0.0, 1.1, 2.0, 3.05, 6.05, 7.1, 7.95, 9.0]) / 20.0
    positions = np.tile(times[:, None, None], (1, 1, 3))
    resampled, rate = at_equal_intervals(times, positions, 20.0, line, [])
    missing = np.isnan(resampled[:, 0, 0])
    assert np.flatnonzero(missing).tolist() == [4, 5, 6]
    np.testing.assert_allclose(
        resampled[~missing, 0, 0], np.arange(len(resampled))[~missing] / rate, atol=2e-3
    )


@pytest.mark.parametrize(("spacing", "rate"), [(1, 100.0), (2, 50.0), (4, 25.0)])
def test_a_decimated_recording_has_the_rate_of_its_rows(spacing: int, rate: float) -> None:
    numbers, found_hz, notes = frames(np.arange(9) * spacing / 100.0, 100.0)
    assert (numbers, found_hz, notes) == (list(range(9)), rate, int(spacing > 1))


def test_times_and_header_may_differ_by_one_percent() -> None:
    assert frames(np.arange(9) / 100.5, 100.0)[1] == 100.0
    with rejects("rate_contradiction", "line 2", stated_hz=100.0):
        frames_of(np.arange(99) / 103.0, 100.0, line, [])


def test_a_single_row_has_the_rate_of_the_header() -> None:
    assert frames(np.array([3.0]), 25.0) == ([0.0], 25.0, 0)
    with rejects("unknown_rate", "line 1"):
        frames_of(np.array([3.0]), None, line, [])


@pytest.mark.parametrize(
    ("step", "declared_hz", "unit"),
    [
        (10.0, None, ("milliseconds", 1e3)),
        (1500.0, None, ("milliseconds", 1e3)),
        (1501.0, None, ("microseconds", 1e6)),
        (50_000.0, None, ("microseconds", 1e6)),
        (50_001.0, None, None),
        (199_999.0, None, None),
        (200_000.0, None, ("ticks of 100 ns", 1e7)),
        (2e6, None, ("ticks of 100 ns", 1e7)),
        (1e7, None, ("nanoseconds", 1e9)),
        (100_000.0, 10.0, ("microseconds", 1e6)),
        (100_000.0, 100.0, ("ticks of 100 ns", 1e7)),
        (105_000.0, 100.0, ("ticks of 100 ns", 1e7)),
    ],
)
def test_the_unit_of_times(step: float, declared_hz: float | None, unit: tuple[str, float] | None) -> None:
    assert unit_of_times(step, declared_hz) == unit


def test_times_in_milliseconds_are_divided() -> None:
    assert frames(np.arange(5) * 20.0) == ([0.0, 1.0, 2.0, 3.0, 4.0], 50.0, 1)
    assert frames(np.arange(5) * 1.6)[1] == 625.0
    with rejects("not_seconds", "line 2"):  # steps up to 1.5 are seconds
        frames_of(np.arange(5) * 1.5, None, line, [])


@pytest.mark.parametrize(
    ("times", "code", "where"),
    [
        ([0.0, 0.1, 0.1], "time_order", "line 3"),
        ([0.0, 0.2, 0.1], "time_order", "line 3"),
        ([np.nan, 0.1, 0.2], "time_order", "line 1"),
        ([0.0, 0.1, np.nan], "time_order", "line 3"),
    ],
)
def test_times_that_do_not_increase_are_refused(times: list[float], code: str, where: str) -> None:
    with rejects(code, where):
        frames_of(np.array(times), None, line, [])


@pytest.mark.parametrize(
    ("units", "size"),
    [
        ("mm", 1.0),
        ("cm", 10.0),
        ("m", 1000.0),
        ("in", 25.4),
        ("ft", 304.8),
        ("m/2", 500.0),
        ("in/0.45", 25.4 / 0.45),
    ],
)
def test_sizes_of_units(units: str, size: float) -> None:
    assert text.millimetres_in(units, "a file") == pytest.approx(size)


@pytest.mark.parametrize("units", ["mile", "m/0", "m/-1", "m/x", "mm/2000000", "m/1e-4", ""])
def test_sizes_that_are_none(units: str) -> None:
    with rejects("unknown_unit", "a file", unit=units):
        text.millimetres_in(units, "a file")


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("Metres", "m"),
        ("meter", "m"),
        ("Centimetre", "cm"),
        ("feet", "ft"),
        ("Foot", "ft"),
        ("inches", "in"),
        ("px", "px"),
    ],
)
def test_names_of_units(words: str, name: str) -> None:
    assert text.unit_of(words) == name
