"""Keypoints as tables: CSV wide and long, TRC in pixels (Sports2D, Pose2Sim), arrays of numpy."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np

from pipeline.formats.arrays import load_npy
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged
from pipeline.formats.keypoints.contract import Detections, detections
from pipeline.formats.keypoints.landmarks import MEDIAPIPE
from pipeline.formats.keypoints.people_json import identity_of, load, settings
from pipeline.formats.text import read_text

_CONFIDENCE = ("confidence", "score", "visibility", "likelihood", "conf", "c", "p")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _frame(text: str, where: str) -> int:
    value = _number(text)
    if not np.isfinite(value) or value != int(value) or not 0 <= value < 1e7:
        raise damaged("a frame must be a whole number", where, received=f"{text!r:.20}")
    return int(value)


def read_csv(path: Path) -> Detections:
    """Read CSV: wide (``left_knee_x, left_knee_y``, …) or long (``frame, keypoint, x, y``).

    Frame rate and image size come from a ``.json`` of the same name beside it, if there is one.
    """
    text, notes = read_text(path)
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise damaged("the table has no rows", path.name, "a heading and one row a frame")
    heading = [cell.strip() for cell in rows[0]]
    ragged = [n for n, row in enumerate(rows) if len(row) != len(heading)]
    if ragged:
        raise damaged("a row has a wrong number of cells", f"{path.name}, row {ragged[0] + 1}", len(heading),
                      len(rows[ragged[0]]))  # fmt: skip
    lower = [cell.lower() for cell in heading]
    rate, size = 0.0, (0, 0)
    beside = path.with_suffix(".json")
    if beside.is_file():
        content = load(beside)
        if isinstance(content, dict):
            rate, size = settings(content)
            if rate or size[0]:
                notes = [*notes, f"Frame rate and image size are those of {beside.name}."]
    if not rate and "time_s" in lower:
        times = np.array([_number(row[lower.index("time_s")]) for row in rows[1:]])
        steps = np.diff(np.unique(times[np.isfinite(times)]))
        if len(steps) and float(np.median(steps)) > 0:
            rate = 1.0 / float(np.median(steps))
    if {"x", "y"} <= set(lower):
        return _long(rows[1:], lower, path.name, rate, size, notes)
    return _wide(rows[1:], heading, path.name, rate, size, notes)


def _column(lower: list[str], *names: str) -> int | None:
    return next((lower.index(name) for name in names if name in lower), None)


def _long(
    rows: list[list[str]], lower: list[str], where: str, rate: float, size: tuple[int, int], notes: list[str]
) -> Detections:
    frame, name = _column(lower, "frame"), _column(lower, "keypoint", "joint", "name", "landmark", "point")
    if frame is None or name is None:
        raise damaged(
            "a long table needs the columns frame and keypoint", where, received=", ".join(lower[:8])
        )
    person, confidence = _column(lower, "person", "track", "id", "person_id"), _column(lower, *_CONFIDENCE)
    names = list(dict.fromkeys(row[name].strip() for row in rows))
    place = {point: number for number, point in enumerate(names)}
    x, y = lower.index("x"), lower.index("y")
    keys = [
        (_frame(row[frame], f"{where}, row {number}"), row[person].strip() if person is not None else "")
        for number, row in enumerate(rows, start=2)
    ]
    require_points(len(set(keys)), len(names), where)
    found: dict[tuple[int, str], np.ndarray] = {}
    for key, row in zip(keys, rows, strict=True):
        if key not in found:
            found[key] = np.full((len(names), 3), np.nan)
        points = found[key]
        sure = _number(row[confidence]) if confidence is not None else 1.0
        points[place[row[name].strip()]] = _number(row[x]), _number(row[y]), sure
    first = min(key[0] for key in found)
    listed = [(key[0] - first, key[1], points) for key, points in found.items()]
    last = max(key[0] for key in found)
    return detections("csv", where, listed, last - first + 1, names=names, frame_rate_hz=rate, image_size=size,
                      notes=notes)  # fmt: skip


def _wide(
    rows: list[list[str]],
    heading: list[str],
    where: str,
    rate: float,
    size: tuple[int, int],
    notes: list[str],
) -> Detections:
    columns: dict[str, dict[str, int]] = {}
    for number, cell in enumerate(heading):
        match = re.fullmatch(r"(.+?)[_. ]([a-z]+)", cell, re.IGNORECASE)
        if match and match[2].lower() in ("x", "y", *_CONFIDENCE):
            kind = match[2].lower()
            columns.setdefault(match[1], {})["confidence" if kind in _CONFIDENCE else kind] = number
    whole = {name: of for name, of in columns.items() if {"x", "y"} <= set(of)}
    names = list(whole)
    if not names:
        raise damaged("no keypoints in the table", where, "columns such as left_knee_x and left_knee_y",
                      ", ".join(heading[:6]))  # fmt: skip
    lower = [cell.lower() for cell in heading]
    frame, person = _column(lower, "frame"), _column(lower, "person", "track", "person_id")
    found = []
    for number, row in enumerate(rows):
        points = np.array([
            (_number(row[of["x"]]), _number(row[of["y"]]),
             _number(row[of["confidence"]]) if "confidence" in of else 1.0)
            for of in whole.values()
        ])  # fmt: skip
        at = number if frame is None else _frame(row[frame], f"{where}, row {number + 2}")
        if np.isfinite(points[:, :2]).any():
            found.append((at, row[person].strip() if person is not None else "", points))
    if frame is None:
        notes = [*notes, "Rows are taken as frames, there being no column frame."]
    frames = max(len(rows), max((at for at, _, _ in found), default=0) + 1) if person is None else 0
    if (empty := len(rows) - len(found)) > 0:
        notes = [*notes, f"{empty} of {len(rows)} frames are without people."]
    kind = "mediapipe" if set(MEDIAPIPE) <= set(names) else "csv"
    return detections(
        kind, where, found, frames, names=names, frame_rate_hz=rate, image_size=size, notes=notes
    )


def read_trc(path: Path) -> Detections:
    """Read TRC in pixels, as Sports2D and Pose2Sim write it; the third coordinate is left out."""
    text, notes = read_text(path)
    lines = text.split("\n")
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        raise damaged("this is not a TRC file", f"{path.name}, line 1", "five lines of header")
    stated = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    units = stated.get("Units", "").strip().lower()
    if units not in ("px", "pixel", "pixels"):
        raise damaged("the points of this TRC file are not in pixels", f"{path.name}, Units in line 3",
                      "px, as Sports2D writes with save_px", units or "nothing")  # fmt: skip
    names = [cell.strip() for cell in lines[3].split("\t")[2:] if cell.strip()]
    require_points(len(lines), len(names), path.name)
    rate = _number(stated.get("DataRate", ""))
    rows: list[tuple[int, str, np.ndarray]] = []
    count = 0
    for number, line in enumerate(lines[5:], start=6):
        if not line.strip():
            continue
        cells = line.rstrip("\r").split("\t")[2:]
        cells += [""] * (3 * len(names) - len(cells))
        values = np.array([_number(cell) for cell in cells[: 3 * len(names)]]).reshape(-1, 3)
        if len(cells) > 3 * len(names) and any(cell.strip() for cell in cells[3 * len(names) :]):
            raise damaged("a frame has a wrong number of values", f"{path.name}, line {number}", 3 * len(names),
                          len(cells))  # fmt: skip
        if np.isfinite(values[:, :2]).any():
            rows.append((count, "", np.column_stack([values[:, :2], np.ones(len(values))])))
        count += 1
    rate = rate if np.isfinite(rate) and rate > 0 else 0.0
    return detections("trc", path.name, rows, count, names=names, frame_rate_hz=rate, notes=notes)


def read_array(path: Path) -> Detections:
    """Read an array of numpy: (frame, point, 2 or 3), the third being the confidence."""
    array = load_npy(path)
    if array.ndim != 3 or array.shape[2] not in (2, 3) or array.dtype.kind not in "fiu":
        raise damaged(
            "keypoints must be an array (frame, point, 2 or 3)", path.name, received=str(array.shape)
        )
    values = array.astype(float)
    if values.shape[2] == 2:
        values = np.concatenate([values, np.ones((*values.shape[:2], 1))], axis=2)
    rows = [(number, identity_of(None), points) for number, points in enumerate(values)]
    return detections("npy", path.name, rows, len(values))
