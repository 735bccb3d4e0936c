"""TRC files: marker trajectories as text, the format of OpenSim and of markerless pipelines.

Five lines of header (kind of file, names of the settings, their values, marker names, axis names), then
one line for each frame: number, time in seconds, x, y, z of each marker.  Columns are separated by tabs, where
a blank cell is a missing coordinate, or by spaces, where every cell must be written.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.contract import LARGEST, damaged, motion_capture
from pipeline.formats.points.cells import positions_to_write, read_cells
from pipeline.formats.text import millimetres_in, number, read_text
from pipeline.skeleton import MotionCapture


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the markers of a TRC file, in the file's axes.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Not used: the file states it.
    units : str, optional
        Unit of length if the file has no setting Units.

    Returns
    -------
    MotionCapture
        A marker with a blank or NaN coordinate is NaN and not valid in that frame.

    Raises
    ------
    InvalidInput
        If the file is not TRC, has more or fewer frames, markers or cells than it declares, its unit of length
        is unknown, or its times contradict its frame rate.
    """
    where = Path(path).name
    text, notes = read_text(Path(path))
    lines = text.split("\n")
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        expected = "five lines of header that begin with PathFileType"
        raise damaged("this is not a TRC file", f"{where}, line 1", expected, f"{lines[0]!r:.40}")
    settings = dict(zip(_cells(lines[1]), _cells(lines[2]), strict=False))
    rate = _setting(settings, "DataRate", where)
    frames, markers = (int(_setting(settings, key, where)) for key in ("NumFrames", "NumMarkers"))
    unit = settings.get("Units", "").lower() or units or ""
    millimetres = millimetres_in(unit, f"{where}, Units in line 3")
    heading = _cells(lines[3])
    names = tuple(name for name in heading[2:] if name)
    if heading[0].lower() != "frame#" or len(names) != markers:
        expected, received = f"Frame#, Time and {markers} names", f"{len(names)} after {heading[:2]!r:.40}"
        raise damaged("the marker names do not match NumMarkers", f"{where}, line 4", expected, received)
    rows = [(number, line) for number, line in enumerate(lines[5:], start=6) if line.strip()]
    if len(rows) != frames or not frames:
        what, expected = "the file is truncated, or NumFrames is wrong", f"{frames or 'some'} frames"
        raise damaged(what, f"{where}, NumFrames in line 3", expected, len(rows))
    numbers = _numbers(rows, 2 + 3 * markers, where)
    _check_times(numbers[:, 0], numbers[:, 1], rate, rows, where)
    positions = numbers[:, 2:].reshape(frames, markers, 3) * millimetres
    return motion_capture(names, positions, rate, unit, notes)


def write(path: str | Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float) -> None:
    """Write marker positions as TRC in millimetres, every digit kept, missing samples blank.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P marker names.
    positions_mm : (T, P, 3) array
        Millimetres; NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, a rate or a coordinate cannot be written.
    """
    positions = positions_to_write(names, positions_mm, frame_rate_hz, Path(path).name, distinct=False)
    rate = repr(float(frame_rate_hz))
    frames, markers = positions.shape[:2]
    axes = (f"{axis}{k}" for k in range(1, markers + 1) for axis in "XYZ")
    # The settings of a file that was never cut or resampled: the original is what is written.
    settings = {
        "DataRate": rate,
        "CameraRate": rate,
        "NumFrames": str(frames),
        "NumMarkers": str(markers),
        "Units": "mm",
        "OrigDataRate": rate,
        "OrigDataStartFrame": "1",
        "OrigNumFrames": str(frames),
    }
    header = [
        ("PathFileType", "4", "(X/Y/Z)", Path(path).name),
        tuple(settings),
        tuple(settings.values()),
        ("Frame#", "Time", *itertools.chain.from_iterable((name, "", "") for name in names)),
        ("", "", *axes),
    ]
    rows = (
        (str(k + 1), f"{k / frame_rate_hz:.12g}", *("" if x != x else repr(x) for x in row))
        for k, row in enumerate(positions.reshape(frames, -1).tolist())
    )
    text = "".join("\t".join(cells) + "\n" for cells in itertools.chain(header, rows))
    Path(path).write_text(text, encoding="utf-8", newline="\n")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split() or [""]


def _setting(settings: dict[str, str], key: str, where: str) -> float:
    """A positive setting of the header."""
    value = number(settings.get(key, ""))
    if not 0 < value < LARGEST:
        received = f"{settings.get(key, 'nothing'):.40}"
        raise damaged(f"{key} is unusable", f"{where}, line 3", "a positive number", received)
    return value


def _numbers(rows: list[tuple[int, str]], columns: int, where: str) -> np.ndarray:
    """The cells (T, columns) as float64, NaN where blank."""
    cells: list[str] = []
    for line, text in rows:
        found = _cells(text)
        while len(found) > columns and not found[-1]:
            found.pop()  # tabs at the end of the line
        if len(found) != columns:
            what = "the line has another number of cells than the header asks for"
            raise damaged(what, f"{where}, line {line}", columns, len(found))
        cells += found

    def place(n: int) -> str:
        return f"{where}, line {rows[n // columns][0]}, cell {n % columns + 1}"

    return read_cells(cells, place).reshape(len(rows), columns)


def _check_times(
    numbers: np.ndarray, times_s: np.ndarray, rate: float, rows: list[tuple[int, str]], where: str
) -> None:
    """Raise InvalidInput if frame numbers (T,) jump or times (T,) contradict the frame rate (Hz)."""
    steps, intervals = np.diff(numbers), np.diff(times_s)
    # Printed times are rounded, so one interval may be half wrong, but not their mean.
    wrong = np.flatnonzero(~((steps == 1) & (np.abs(intervals * rate - 1) < 0.5)))
    if wrong.size or not (np.isfinite(numbers[0]) and np.isfinite(times_s[0])):
        k = int(wrong[0]) + 1 if wrong.size else 0
        what, place = (
            "the frame number or the time does not follow the line before",
            f"{where}, line {rows[k][0]}",
        )
        raise damaged(what, place, f"one frame and {1 / rate:g} s more", f"{numbers[k]:g}, {times_s[k]:g} s")
    if steps.size and abs(intervals.mean() * rate - 1) > 0.01 + 1e-3 / steps.size * rate:
        place, received = f"{where}, column Time", f"{1 / intervals.mean():g} Hz"
        raise damaged("the times contradict DataRate", place, f"{rate:g} Hz", received)
