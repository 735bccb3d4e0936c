"""TRC files: marker trajectories as text, the format of OpenSim and of markerless pipelines.

Five lines of header (kind of file, names of the settings, their values, marker names, axis names), then
one line per frame: number, time in seconds, x, y, z of each marker.  Columns are separated by tabs, and
then a blank cell is a missing coordinate, or by spaces, and then every cell must be written.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.formats.points.point_table import (
    notes_on_the_end,
    number_in,
    positions_to_write,
    read_characters,
)
from pipeline.formats.text import LARGEST
from pipeline.skeleton import MILLIMETRES, MotionCapture
from pipeline.validation import InvalidInput


def read(path: str | Path) -> MotionCapture:
    """The markers of a TRC file, in millimetres and in the file's own axes.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    MotionCapture
        A marker with a blank or NaN coordinate is NaN and not valid in that frame.

    Raises
    ------
    InvalidInput
        If the file is not TRC, has more or fewer frames, markers or cells than it declares, names a unit
        of length that is not in `pipeline.skeleton.MILLIMETRES`, or its times contradict its frame rate.
    """
    where = str(path)
    text, notes = read_characters(Path(path))
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise InvalidInput(
            "this is not a TRC file",
            where=f"{where}, line 1",
            expected="five lines of header that begin with PathFileType",
            received=repr(lines[0][:30]) if text else "an empty file",
        )
    settings = dict(zip(_cells(lines[1]), _cells(lines[2]), strict=False))
    rate = _setting(settings, "DataRate", where)
    frames, markers = (int(_setting(settings, key, where)) for key in ("NumFrames", "NumMarkers"))
    unit = settings.get("Units", "").lower()
    if unit not in MILLIMETRES:
        raise InvalidInput(
            "the unit of length is unknown",
            where=f"{where}, Units in line 3",
            expected="one of " + ", ".join(MILLIMETRES),
            received=repr(unit),
        )
    heading = _cells(lines[3])
    names = tuple(name for name in heading[2:] if name)
    if heading[0].lower() != "frame#" or len(names) != markers:
        raise InvalidInput(
            "the marker names do not match NumMarkers",
            where=f"{where}, line 4",
            expected=f"Frame#, Time and {markers} names",
            received=f"{len(names)} names after {', '.join(heading[:2])}",
        )
    if len(set(names)) < markers:
        notes.append(f"{markers - len(set(names))} marker names stand more than once.")
    rows = [(number, line) for number, line in enumerate(lines[5:], start=6) if line.strip()]
    if len(rows) != frames or not frames:
        raise InvalidInput(
            "the file is truncated, or its number of frames is wrong",
            where=f"{where}, NumFrames in line 3",
            expected=f"{frames} frames" if frames else "at least one frame",
            received=f"{len(rows)}",
        )
    notes += notes_on_the_end(text)
    numbers = _numbers(rows, 2 + 3 * markers, where)
    _check_times(numbers[:, 0], numbers[:, 1], rate, rows, where)
    positions: np.ndarray = numbers[:, 2:].reshape(frames, markers, 3) * MILLIMETRES[unit]
    valid = np.isfinite(positions).all(axis=-1)
    positions[~valid] = np.nan
    return MotionCapture(
        names=names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=rate,
        units=unit,
        channels=(),
        angles_deg=np.empty((frames, 0)),
        notes=tuple(notes),
    )


def write(path: str | Path, names: Sequence[str], positions_mm: np.ndarray, frame_rate_hz: float) -> None:
    """Write marker positions as TRC in millimetres, every digit kept, missing samples blank.

    Parameters
    ----------
    path : str or Path
    names : sequence of str
        P marker names.
    positions_mm : (T, P, 3) array
        NaN where missing.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the shapes do not fit each other, or a name, a rate or a coordinate cannot be written.
    """
    positions = positions_to_write(
        names,
        positions_mm,
        frame_rate_hz,
        str(path),
        cannot_hold="TRC cannot hold the marker name",
        distinct=False,
    )
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
    try:
        value = float(settings[key])
    except (KeyError, ValueError):
        value = math.nan
    if not 0 < value < 1e9:
        raise InvalidInput(
            f"{key} is unusable",
            where=f"{where}, line 3",
            expected="a positive number",
            received=settings.get(key, "nothing"),
        )
    return value


def _numbers(rows: list[tuple[int, str]], columns: int, where: str) -> np.ndarray:
    """The cells (T, columns) as float64, NaN where blank."""
    table = np.empty((len(rows), columns))
    for k, (number, line) in enumerate(rows):
        cells = _cells(line)
        while len(cells) > columns and not cells[-1]:
            cells.pop()  # tabs at the end of the line
        if len(cells) != columns:
            raise InvalidInput(
                "the line has another number of cells than the header asks for",
                where=f"{where}, line {number}",
                expected=f"{columns}",
                received=f"{len(cells)}",
            )
        values = list(map(number_in, cells))
        if None in values:
            cell = cells[values.index(None)]
            raise InvalidInput(
                "the cell is not a number", where=f"{where}, line {number}", received=repr(cell[:30])
            )
        table[k] = values
    beyond = np.argwhere(np.abs(table) > LARGEST)
    if beyond.size:
        k, column = beyond[0]
        raise InvalidInput(
            "the number is too large for a position",
            where=f"{where}, line {rows[k][0]}, cell {column + 1}",
            received=f"{table[k, column]:g}",
        )
    return table


def _check_times(
    numbers: np.ndarray, times_s: np.ndarray, rate: float, rows: list[tuple[int, str]], where: str
) -> None:
    """Refuse frame numbers that jump and times that contradict the frame rate."""
    steps, intervals = np.diff(numbers), np.diff(times_s)
    # Printed times are rounded, so one interval may be half wrong, but not their mean.
    wrong = np.flatnonzero(~((steps == 1) & (np.abs(intervals * rate - 1) < 0.5)))
    if wrong.size or not (np.isfinite(numbers[0]) and np.isfinite(times_s[0])):
        k = int(wrong[0]) + 1 if wrong.size else 0
        raise InvalidInput(
            "the frame number or the time does not follow from the line before",
            where=f"{where}, line {rows[k][0]}",
            expected=f"one frame and {1 / rate:g} s more",
            received=f"frame {numbers[k]:g}, {times_s[k]:g} s",
        )
    if steps.size and abs(intervals.mean() * rate - 1) > 0.01 + 1e-3 / steps.size * rate:
        raise InvalidInput(
            "the times contradict DataRate",
            where=f"{where}, column Time",
            expected=f"{rate:g} Hz",
            received=f"{1 / intervals.mean():g} Hz",
        )
