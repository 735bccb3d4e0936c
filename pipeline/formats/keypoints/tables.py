"""Keypoints as tables: CSV wide and long, TRC in pixels (Sports2D, Pose2Sim), arrays of numpy."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pipeline.formats.arrays import load_npy, load_npz
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, read_bytes
from pipeline.formats.keypoints.contract import MEDIAPIPE, MOST_FRAMES, Detections, detections, timed
from pipeline.formats.keypoints.people_json import load, settings
from pipeline.formats.points import trc
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import coordinates, read_table, role_of

_CONFIDENCE = ("confidence", "score", "visibility", "likelihood", "conf", "vis", "prob", "c", "p", "v")

_ROLES = {
    **dict.fromkeys(("bodypart", "body_part", "joint_name", "landmark_name", "keypoint_name"), "point"),
    **dict.fromkeys(("video", "video_name"), "person"),  # films one below the other
}
"""What columns are that are none of these in tables of markers."""


def read_csv(path: Path) -> Detections:
    """Read CSV: wide (``left_knee_x, left_knee_y``, …) or long (``frame, keypoint, x, y``).

    Frame rate and image size come from a ``.json`` of the same name beside it, if there is one.
    """
    table = read_table(path)
    rate, size = 0.0, (0, 0)
    beside = path.with_suffix(".json")
    if beside.is_file() and isinstance(content := load(beside), dict):
        rate, size = settings(content)
        if rate or size[0]:
            table.notes.append(f"Frame rate and image size are those of {beside.name}.")
    roles = {
        role or _ROLES.get(plain, ""): column
        for column, (role, plain) in reversed(list(enumerate(map(role_of, table.header))))
    }
    columns: dict[str, dict[str, int]] = {}
    for point, kind, _, number in coordinates(table.header, "xy", _CONFIDENCE):
        columns.setdefault(point, {})[kind if kind in "xy" else "confidence"] = number
    whole = {name: of for name, of in columns.items() if {"x", "y"} <= set(of)}
    if not whole:
        expected = "columns such as left_knee_x and left_knee_y, or keypoint, x and y"
        raise damaged("no keypoints in the table", table.where, expected, ", ".join(table.header[:6]))
    if len(whole) > 1 and "point" not in roles:
        whole.pop("", None)  # of a box around somebody
    count, is_long = len(table.cells), "" in whole
    people = table.texts(roles["person"]) if "person" in roles else [""] * count
    frames = _frames(table, roles["frame"]) if "frame" in roles else np.arange(count)
    if "time" in roles:
        unnumbered = "frame" not in roles and (is_long or "person" in roles)
        frames, rate = timed(table, roles["time"], None if unnumbered else frames, rate)
        roles["frame"] = roles["time"]
    names, which = list(whole), [0] * count
    body = first_row = np.arange(count)
    if is_long:
        if not {"frame", "point"} <= set(roles):
            received = ", ".join(table.header[:8])
            raise damaged("a long table needs the columns frame and keypoint", table.where, received=received)
        whole = {"": whole[""]}
        place: dict[str, int] = {}
        which = [place.setdefault(name, len(place)) for name in table.texts(roles["point"])]
        names = list(place)
        keys = [f"{frame} {who}" for frame, who in zip(frames, people, strict=True)]
        _, first_row, body = np.unique(keys, return_index=True, return_inverse=True)
    bodies = len(first_row)
    require_points(bodies, len(names), table.where)
    points = np.full((bodies, len(names), 3), [np.nan, np.nan, 1.0])
    for k, of in enumerate(whole.values()):
        points[body, np.add(which, k), : len(of)] = table.numbers(
            [of[kind] for kind in ("x", "y", "confidence") if kind in of]
        )
    seen = np.flatnonzero(np.isfinite(points[..., 0]).any(axis=1))
    if "frame" not in roles:
        table.notes.append("Rows are taken as frames, there being no column frame.")
    if len(seen) < bodies:
        table.notes.append(f"{bodies - len(seen)} of {bodies} frames are without people.")
    parts = [re.sub(r"^.*?\d[ _.:-]+(?=\D)", "", name) for name in names]
    own = parts[: len({*parts})]
    crowd = [name.removesuffix(own[0])[:-1] for name in names[:: len(own)]]
    if parts != own * len(crowd):
        own, crowd = names, [""]
    rows = [
        (frames[first_row[n]], who or people[first_row[n]], marks)
        for n in seen
        for who, marks in zip(crowd, points[n].reshape(len(crowd), -1, 3), strict=True)
    ]
    kind = "mediapipe" if set(MEDIAPIPE) <= set(own) else "csv"
    return detections(kind, table.where, rows, int(frames.max()) + 1, names=own, frame_rate_hz=rate,
                      image_size=size, notes=table.notes)  # fmt: skip


def _frames(table: Rows, column: int) -> np.ndarray:
    frames = table.column(column)
    wrong = np.flatnonzero((frames != np.round(frames)) | (frames < 0) | (frames >= MOST_FRAMES))
    if wrong.size:
        k = int(wrong[0])
        raise damaged("a frame must be a whole number", table.place(k), received=f"{frames[k]:g}")
    return frames.astype(int)


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
