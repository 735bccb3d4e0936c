"""Keypoints as tables: CSV wide and long, TRC in pixels (Sports2D, Pose2Sim), arrays of numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.formats.arrays import load_npy, load_npz
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, read_bytes
from pipeline.formats.keypoints.contract import MEDIAPIPE, MOST_FRAMES, Detections, detections
from pipeline.formats.keypoints.people_json import load, settings
from pipeline.formats.points import trc
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import coordinates, read_table, role_of, set_to_seconds

_WHO = ("person", "track", "person_id")
_CONFIDENCE = ("confidence", "score", "visibility", "likelihood", "conf", "c", "p")


def read_csv(path: Path) -> Detections:
    """Read CSV: wide (``left_knee_x, left_knee_y``, …) or long (``frame, keypoint, x, y``).

    Frame rate and image size come from a ``.json`` of the same name beside it, if there is one.
    """
    table = read_table(path)
    lower = [title.lower() for title in table.header]
    rate, size = 0.0, (0, 0)
    beside = path.with_suffix(".json")
    if beside.is_file() and isinstance(content := load(beside), dict):
        rate, size = settings(content)
        if rate or size[0]:
            table.notes.append(f"Frame rate and image size are those of {beside.name}.")
    timed = [k for k, title in enumerate(lower) if role_of(title)[0] == "time"]
    if not rate and timed:
        set_to_seconds(table, timed[0])
        times = table.numbers(timed)
        steps = np.diff(np.unique(times[np.isfinite(times)]))
        if len(steps):
            rate = 1.0 / float(np.median(steps))
    read = _long if {"x", "y"} <= set(lower) else _wide
    return read(table, lower, rate, size)


def _column(lower: list[str], *names: str) -> int | None:
    return next((lower.index(name) for name in names if name in lower), None)


def _frames(table: Rows, column: int) -> np.ndarray:
    frames = table.column(column)
    wrong = np.flatnonzero((frames != np.round(frames)) | (frames < 0) | (frames >= MOST_FRAMES))
    if wrong.size:
        k = int(wrong[0])
        raise damaged("a frame must be a whole number", table.place(k), received=f"{frames[k]:g}")
    return frames.astype(int)


def _people(table: Rows, lower: list[str], *names: str) -> list[str]:
    column = _column(lower, *names)
    return [""] * len(table.cells) if column is None else table.texts(column)


def _long(table: Rows, lower: list[str], rate: float, size: tuple[int, int]) -> Detections:
    frame, name = _column(lower, "frame"), _column(lower, "keypoint", "joint", "name", "landmark", "point")
    if frame is None or name is None:
        raise damaged(
            "a long table needs the columns frame and keypoint", table.where, received=", ".join(lower[:8])
        )
    frames, named = _frames(table, frame), table.texts(name)
    whose = list(zip(frames.tolist(), _people(table, lower, *_WHO, "id"), strict=True))
    bodies = {key: n for n, key in enumerate(dict.fromkeys(whose))}
    points = {point: n for n, point in enumerate(dict.fromkeys(named))}
    require_points(len(bodies), len(points), table.where)
    found = np.full((len(bodies), len(points), 3), np.nan)
    rows, columns = [bodies[key] for key in whose], [points[point] for point in named]
    found[rows, columns] = _points(table, lower.index("x"), lower.index("y"), _column(lower, *_CONFIDENCE))
    first = frames.min()
    listed = [(int(at - first), who, body) for (at, who), body in zip(bodies, found, strict=True)]
    return detections("csv", table.where, listed, int(frames.max() - first) + 1, names=list(points),
                      frame_rate_hz=rate, image_size=size, notes=table.notes)  # fmt: skip


def _points(table: Rows, x: int, y: int, confidence: int | None) -> np.ndarray:
    """Column, row and confidence (R, 3) of a point in each row."""
    if confidence is not None:
        return table.numbers([x, y, confidence])
    return np.column_stack([table.numbers([x, y]), np.ones(len(table.cells))])


def _wide(table: Rows, lower: list[str], rate: float, size: tuple[int, int]) -> Detections:
    columns: dict[str, dict[str, int]] = {}
    for point, kind, _, number in coordinates(table.header, "xy", _CONFIDENCE):
        columns.setdefault(point, {})["confidence" if kind in _CONFIDENCE else kind] = number
    whole = {name: of for name, of in columns.items() if {"x", "y"} <= set(of)}
    if not whole:
        raise damaged(
            "no keypoints in the table",
            table.where,
            "columns such as left_knee_x and left_knee_y",
            ", ".join(table.header[:6]),
        )
    count, frame = len(table.cells), _column(lower, "frame")
    require_points(count, len(whole), table.where)
    points = np.stack(
        [_points(table, of["x"], of["y"], of.get("confidence")) for of in whole.values()], axis=1
    )
    at = np.arange(count) if frame is None else _frames(table, frame)
    people = _people(table, lower, *_WHO)
    seen = np.flatnonzero(np.isfinite(points[..., :2]).any(axis=(1, 2)))
    if frame is None:
        table.notes.append("Rows are taken as frames, there being no column frame.")
    if len(seen) < count:
        table.notes.append(f"{count - len(seen)} of {count} frames are without people.")
    frames = max(count, int(at[seen].max(initial=0)) + 1) if _column(lower, *_WHO) is None else 0
    kind = "mediapipe" if set(MEDIAPIPE) <= set(whole) else "csv"
    rows = [(int(at[n]), people[n], points[n]) for n in seen]
    return detections(
        kind,
        table.where,
        rows,
        frames,
        names=list(whole),
        frame_rate_hz=rate,
        image_size=size,
        notes=table.notes,
    )


def read_trc(path: Path) -> Detections:
    """Read TRC in pixels, as Sports2D and Pose2Sim write it; the third coordinate is left out."""
    table = trc.read_table(path)
    units = table.settings.get("units", "").lower()
    if units not in ("px", "pixel", "pixels"):
        raise damaged("the points of this TRC file are not in pixels", f"{path.name}, Units in line 3",
                      "px, as Sports2D writes with save_px", units or "nothing")  # fmt: skip
    values = table.positions
    values[..., 2] = 1.0
    rows = [(n, "", points) for n, points in enumerate(values) if np.isfinite(points).all(axis=-1).any()]
    return detections(
        "trc",
        path.name,
        rows,
        len(values),
        names=table.names,
        frame_rate_hz=table.rate or 0.0,
        notes=table.notes,
    )


def read_array(path: Path) -> Detections:
    """Read an array of numpy, (frame, point, 2 or 3), the third being the confidence, or with a person after the frame.

    In an NPZ file it is called ``keypoints`` or is the only one of such a shape; beside it may stand ``names``,
    ``scores`` or ``confidence``, ``fps``, ``width`` and ``height``.
    """
    arrays = (
        load_npz(read_bytes(path), path.name)[0] if path.suffix.lower() == ".npz" else {"": load_npy(path)}
    )
    fitting = [
        name
        for name, array in arrays.items()
        if array.ndim in (3, 4) and array.shape[-1] in (2, 3, 4) and array.dtype.kind in "fiu"
    ]
    if "keypoints" not in fitting and len(fitting) != 1:
        shapes = ", ".join(f"{name} {array.shape}".strip() for name, array in arrays.items())
        expected = "(frame, point, 2 or 3) or (frame, person, point, 2 or 3)"
        raise damaged("keypoints must be one array", path.name, expected, f"{shapes:.200}")
    found = arrays["keypoints" if "keypoints" in fitting else fitting[0]].astype(float)
    sure = found[..., -1] if found.shape[-1] > 2 else np.ones(found.shape[:-1])
    sure = next((arrays[name] for name in ("scores", "confidence") if name in arrays), sure)
    values = np.concatenate([found[..., :2], sure.reshape(*found.shape[:-1], 1)], axis=-1)
    if values.ndim == 4 and len(values) < values.shape[1]:
        values = values.swapaxes(0, 1)  # people first
    rows = [
        (number, "", points)
        for number, frame in enumerate(values)
        for points in frame.reshape(-1, *found.shape[-2:-1], 3)
    ]
    numbers = {name: array.item() for name, array in arrays.items() if array.size == 1}
    rate, size = settings(numbers)
    names = arrays["names"].astype(str).ravel().tolist() if "names" in arrays else []
    return detections(
        path.suffix[1:].lower(),
        path.name,
        rows,
        len(values),
        names=names,
        frame_rate_hz=rate,
        image_size=size,
    )
