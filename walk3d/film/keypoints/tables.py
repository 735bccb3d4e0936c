"""Keypoints as tables: wide or long CSV, TRC in pixels (Sports2D, Pose2Sim), and NumPy arrays."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.formats.arrays import load_npy, load_npz
from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged, read_bytes
from pipeline.formats.points import trc
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import UNSURE, coordinates, read_table, role_of
from pipeline.formats.points.even_times import frames_of
from pipeline.formats.text import number
from pipeline.skeleton.complaint import Remark
from pipeline.validation import InvalidInput
from walk3d.film.keypoints.contract import IN_3D, MAX_FRAMES, MEDIAPIPE, Detections, detections, timed
from walk3d.film.keypoints.people_json import frames_by_name, load, settings

_CONFIDENCE = ("confidence", "score", "visibility", "likelihood", "conf", "vis", "prob", "c", "p", "v")

_ROLES = {
    "video": "person",  # films one after the other
    "video_name": "person",
    "image": "frame",
    "image_id": "frame",
    "image_name": "frame",
}
"""Meaning of columns that occur in tables of keypoints but not in tables of markers."""


_NUMBER = re.compile(r"(?<!\w)-?(?:nan|None|[\d.]+(?:e[+-]?\d+)?)")
_KINDS = {2: "xy", 3: "xyc", 4: "xyzc"}
"""Names of the coordinates in a table cell with 2, 3 or 4 numbers; c is the confidence."""
_SOMEBODY = re.compile(
    r"^(?:.*?\d|(?!left|right|filt|smooth|(?:[lr]|raw)[ _.:-])[^\W\d_]+)[ _.:-]+(?=\D)", re.IGNORECASE
)
"""Pattern for the prefix of a column name that identifies a person.

The prefix ends with a digit, or is a word other than a side of the body.
"""


def read_csv(path: Path) -> Detections:
    """Read keypoints from a wide (``left_knee_x, left_knee_y``, …) or long (``frame, keypoint, x, y``) CSV table.

    Frame rate and image size come from a ``.json`` of the same name next to it, if it exists.
    """
    table = read_table(path)
    sidecar = path.with_suffix(".json")
    content = load(sidecar) if sidecar.is_file() else None
    rate, size = settings(content if isinstance(content, dict) else {})
    if rate or size[0]:
        table.notes.append(f"Frame rate and image size are those of {sidecar.name}.")
    _split_points(table)
    titled = list(enumerate(map(role_of, table.header)))[::-1]
    titled.sort(key=lambda entry: not UNSURE.fullmatch(entry[1][1]))
    roles = {role or _ROLES.get(plain, ""): column for column, (role, plain) in titled}
    columns = _columns(table, "point" in roles)
    kinds = set[str]().union(*columns.values())
    if "z" in kinds and "c" not in kinds:
        table.notes.append(f"Columns z are ignored.  {IN_3D}")
    names, is_long, rows = list(columns), "" in columns, np.arange(len(table.cells))
    if is_long and not ("point" in roles and {"frame", "time"} & set(roles)):
        received = ", ".join(table.header[:8])
        raise damaged(
            "a long table needs the columns frame and keypoint",
            table.where,
            received=received,
            code="no_frame_column",
        )
    people = table.texts(roles["person"]) if "person" in roles else [""] * len(rows)
    frames = _frames(table, roles["frame"]) if "frame" in roles else rows
    if "time" in roles:
        unnumbered = "frame" not in roles and (is_long or "person" in roles)
        frames, rate = timed(table, roles["time"], None if unnumbered else frames, rate)
    elif "frame" not in roles:
        table.notes.append("Each row is taken as one frame, because the table has no column called frame.")
    _note_cut(frames, table.notes)
    points = np.ones((len(rows), len(names), 3))
    for k, axes in enumerate(columns.values()):
        read = [axes[kind] for kind in "xyc" if kind in axes]
        points[:, k, : len(read)] = table.numbers(read)
    bodies = [*zip(frames.tolist(), people, points, strict=True)]
    if is_long:
        names, bodies = _side_by_side(bodies, table.texts(roles["point"]), table.where)
    crowd, names = _crowd(names)
    people_rows = [
        (frame, inner or identity, marks)
        for frame, identity, body in bodies
        for inner, marks in zip(crowd, body.reshape(len(crowd), -1, 3), strict=True)
    ]
    kind = "mediapipe" if set(MEDIAPIPE) <= set(names) else "csv"
    return detections(kind, table.where, people_rows, int(frames.max()) + 1, names=names, frame_rate_hz=rate,
                      image_size=size, notes=table.notes)  # fmt: skip


def _note_cut(frames: np.ndarray, notes: list[str]) -> None:
    """Add a note that the file may be truncated, if the last frame has fewer rows than all other frames."""
    *others, last = np.unique(frames, return_counts=True)[1].tolist()
    if others and last < min(others):
        notes.append(
            f"The last frame has {last} rows, every other {min(others)} or more: the file may be cut off."
        )


def _split_points(table: Rows) -> None:
    """Split table columns with points such as ``(0.7, 0.1, 0.9)`` into one column per number, in place."""
    point_columns = {k for row in table.cells for k, cell in enumerate(row) if cell.startswith(("[", "("))}
    for column in sorted(point_columns, reverse=True):
        title, marks = table.header[column], list(map(_NUMBER.findall, table.texts(column)))
        if (kinds := _KINDS.get(max(map(len, marks)))) and "box" not in title.lower():
            table.header[column : column + 1] = [f"{title}_{kind}" for kind in kinds]
            for row, mark in zip(table.cells, marks, strict=True):
                row[column : column + 1] = (mark + [""] * 4)[: len(kinds)]


def _columns(table: Rows, is_long: bool) -> dict[str, dict[str, int]]:
    """Return, for each point of a table, the columns of x and y and, if present, of z and the confidence c.

    In a long table, the only name is ``""``.
    """
    columns: dict[str, dict[str, int]] = {}
    for point, kind, _, column in coordinates(table.header, "xy", ("z", *_CONFIDENCE)):
        columns.setdefault(point, {})[kind if kind in "xyz" else "c"] = column
    complete = {name: axes for name, axes in columns.items() if {"x", "y"} <= set(axes)}
    if not complete:
        expected = "columns such as left_knee_x and left_knee_y, or keypoint, x and y"
        raise damaged(
            "there are no keypoints in the table",
            table.where,
            expected,
            ", ".join(table.header[:6]),
            code="no_points",
        )
    if len(complete) > 1 and not is_long:
        complete.pop("", None)  # a person's bounding box
    return {"": complete[""]} if "" in complete else complete


def _side_by_side(bodies: list[Any], parts: list[str], where: str) -> tuple[list[str], list[Any]]:
    """Combine table rows of single points into the keypoints of each person in each frame.

    Return the names of the points, and the frame, identity and points of each body.

    A point that recurs in a frame belongs to another body, even without an identity.
    """
    column_of = {name: k for k, name in enumerate(dict.fromkeys(parts))}
    keys, before = [], Counter[Any]()
    for (frame, identity, _), part in zip(bodies, parts, strict=True):
        keys.append((frame, identity, before[frame, identity, part]))
        before[frame, identity, part] += 1
    require_points(len({*keys}), len(column_of), where)
    merged = {key: np.full((len(column_of), 3), np.nan) for key in dict.fromkeys(keys)}
    for key, part, (*_, marks) in zip(keys, parts, bodies, strict=True):
        merged[key][column_of[part]] = marks[0]
    return list(column_of), [(frame, identity, marks) for (frame, identity, _), marks in merged.items()]


def _crowd(names: list[str]) -> tuple[list[str], list[str]]:
    """Return the people in a table and the names of their points, from column names such as ``person1_nose``.

    A prefix without a number may be a side, unless each person has two knees: ``near_knee``, ``far_knee``.
    """
    parts = [_SOMEBODY.sub("", name) for name in names]
    point_names = parts[: len({*parts})]
    people = [name.removesuffix(point_names[0])[:-1] for name in names[:: len(point_names)]]
    has_people = people[0][-1:].isdigit() or (
        len(people) > 1 and "".join(point_names).lower().count("knee") > 1
    )
    return (people, point_names) if has_people and parts == point_names * len(people) else ([""], names)


def _frames(table: Rows, column: int) -> np.ndarray:
    names = table.texts(column)
    if all(number(name.replace(",", ".")) == np.inf for name in names):  # names of images
        numbers, notes = frames_by_name(names)
        table.notes += notes
        return np.array([numbers[name] for name in names])
    frames = table.column(column)
    wrong = np.flatnonzero((frames != np.round(frames)) | (frames < 0) | (frames >= MAX_FRAMES))
    if wrong.size:
        k = int(wrong[0])
        raise damaged(
            "a frame must be a whole number",
            table.place(k),
            received=f"{frames[k]:g}",
            code="frame_not_whole",
            frame=float(frames[k]),
        )
    return frames.astype(int)


def read_trc(path: Path) -> Detections:
    """Read keypoints in pixels from a TRC file that Sports2D or Pose2Sim wrote.

    The third coordinate is ignored.
    """
    table = trc.read_table(path)
    units = table.settings.get("units", "").lower()
    if units not in ("px", "pixel", "pixels"):
        raise damaged("the points of this TRC file are not in pixels", f"{path.name}, Units in line 3",
                      "px, as Sports2D writes with save_px", units or "nothing",
                      code="not_pixels", unit=units)  # fmt: skip
    values, rate, notes = table.positions, table.rate, table.rows.notes
    values[..., 2] = 1.0
    frames = np.arange(float(len(values)))
    if np.isfinite(table.times).all():
        try:
            frames, rate = frames_of(table.times, rate, table.rows.place, notes)
        except InvalidInput as error:
            notes.append(Remark(f"The times are ignored: {error}.", "times"))
    rows = [(frame, "", points) for frame, points in zip(frames.round(5).tolist(), values, strict=True)]
    return detections(
        "trc", path.name, rows, int(frames[-1]) + 1, names=table.names, frame_rate_hz=rate or 0.0, notes=notes
    )


def read_array(path: Path) -> Detections:
    """Read keypoints from a NumPy array (frame, point, 2 or 3) or (frame, person, point, 2 or 3).

    The last of three coordinates is the confidence.

    In an NPZ file it is called ``keypoints`` or is the only array of such a shape.  The file may also have ``names``,
    ``scores`` or ``confidence``, ``fps``, ``width`` and ``height``.
    """
    arrays = (
        load_npz(read_bytes(path), path.name)[0] if path.suffix.lower() == ".npz" else {"": load_npy(path)}
    )
    fitting = [
        name
        for name, values_of in arrays.items()
        if values_of.ndim in (3, 4) and values_of.shape[-1] in (2, 3, 4) and values_of.dtype.kind in "fiu"
    ]
    if "keypoints" not in fitting and len(fitting) != 1:
        shapes = ", ".join(f"{name} {values_of.shape}".strip() for name, values_of in arrays.items())
        expected = "(frame, point, 2 or 3) or (frame, person, point, 2 or 3)"
        raise damaged(
            "keypoints must be one array", path.name, expected, f"{shapes:.200}", code="not_one_array"
        )
    keypoints = arrays["keypoints" if "keypoints" in fitting else fitting[0]].astype(float)
    sure = keypoints[..., -1] if keypoints.shape[-1] > 2 else np.ones(keypoints.shape[:-1])
    sure = next((arrays[name] for name in ("scores", "confidence") if name in arrays), sure)
    values = np.concatenate([keypoints[..., :2], sure.reshape(*keypoints.shape[:-1], 1)], axis=-1)
    if values.ndim == 4 and len(values) < values.shape[1]:
        values = values.swapaxes(0, 1)  # people were first
    rows = [
        (number, "", points)
        for number, frame in enumerate(values)
        for points in frame.reshape(-1, *keypoints.shape[-2:-1], 3)
    ]
    rate, size = settings(
        {name: values_of.item() for name, values_of in arrays.items() if values_of.size == 1}
    )
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
