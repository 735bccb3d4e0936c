"""Keypoints as JSON: OpenPose (a folder, one file a frame), AlphaPose, MMPose and MediaPipe (one file)."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.keypoints.contract import MEDIAPIPE, Detections, detections
from pipeline.formats.text import read_text

Row = tuple[int, str, np.ndarray]


def load(path: Path) -> Any:
    """Content of a JSON file.

    Raises
    ------
    InvalidInput
        If it is not JSON; the sentence gives the character.
    """
    try:
        return json.loads(read_text(path)[0])
    except json.JSONDecodeError as error:
        raise damaged("this is not JSON", f"{path.name}, character {error.pos}", received=error.msg) from None


def numbers(values: Any, where: str, columns: int = 3) -> np.ndarray:
    """Points (K, columns) of a flat list of numbers.

    Raises
    ------
    InvalidInput
        If it is not a list of numbers, or their count is no multiple of `columns`.
    """
    try:
        found = np.array([np.nan if value is None else value for value in values], dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise damaged("keypoints must be numbers", where, received=f"{values!r:.40}") from None
    if found.ndim != 1 or not found.size or found.size % columns:
        raise damaged("keypoints must be x, y, confidence in turn", where, received=f"{found.size} numbers")
    return found.reshape(-1, columns)


def identity_of(value: Any) -> str:
    """Identity as a text; a list is its first member, and a negative or missing one is none.

    Examples
    --------
    >>> identity_of([2.0]), identity_of(-1), identity_of(None), identity_of("a")
    ('2', '', '', 'a')
    """
    while isinstance(value, list):
        value = value[0] if value else None
    if _is_number(value):
        return f"{value:g}" if 0 <= value < np.inf else ""
    return "" if value is None or isinstance(value, bool) else str(value)


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _has(item: Any, *keys: str) -> bool:
    """Whether something is an object with these keys."""
    return isinstance(item, dict) and set(keys) <= set(item)


def _frames(names: Iterable[str]) -> tuple[dict[str, int], list[str]]:
    """Frame of each file or image, the first 0, by the last number in the names that differs from name to name.

    ``walk_000012_keypoints.json``, ``12_keypoints_25.json``
    """
    found = {name: re.findall(r"\d+", Path(name).stem)[::-1] for name in names}
    for digits in zip(*found.values(), strict=False):
        numbers = [int(number) for number in digits]
        if len(set(numbers)) == len(found):
            first = min(numbers)
            return {name: number - first for name, number in zip(found, numbers, strict=True)}, []
    note = "Frames are taken in the order of their names, which do not number them."
    return {name: n for n, name in enumerate(found)}, [note]


def read_folder(path: Path) -> Detections:
    """Read a folder of OpenPose's files, one for each frame, by the numbers in their names."""
    files = sorted(file for file in path.glob("*.json") if not file.name.startswith("."))
    if not files:
        raise damaged("no JSON file in the folder", path.name, "one file a frame, as OpenPose writes them")
    frames, notes = _frames(file.name for file in files)
    rows: list[Row] = []
    empty = 0
    for file in files:
        content = load(file)
        people = content["people"] if _has(content, "people") else None
        if not isinstance(people, list):
            raise damaged("not a file of OpenPose", file.name, "an object with a list of people")
        found = [_openpose_person(person, file.name) for person in people]
        empty += not any(len(row) for _, row in found)
        rows += [(frames[file.name], identity, row) for identity, row in found if len(row)]
    if empty:
        notes.append(f"{empty} of {len(files)} frames are without people.")
    span = max(frames.values()) + 1
    if span != len(files):
        notes.append(f"{span - len(files)} frames are missing between the first and the last file.")
    return detections("openpose", path.name, rows, span, notes=notes)


def _openpose_person(person: Any, where: str) -> tuple[str, np.ndarray]:
    if not isinstance(person, dict):
        raise damaged("a person is not an object", where, "pose_keypoints_2d", type(person).__name__)
    values = person.get("pose_keypoints_2d")  # pipelines that match people between cameras leave empty ones
    identity = identity_of(person.get("person_id"))
    return identity, numbers(values, where) if values else np.empty((0, 3))


def read(path: Path) -> Detections:
    """Read one JSON file by its structure: AlphaPose, MMPose or MediaPipe; of OpenPose one frame is no walk."""
    content = load(path)
    for reader in (_alphapose, _mmpose, _mediapipe):
        if (found := reader(content, path.name)) is not None:
            return found
    if _has(content, "people"):
        raise damaged("one frame of OpenPose is no walk", path.name, "the folder of all its files")
    raise damaged(
        "the keypoints' format is unknown", path.name,
        "AlphaPose (a list with image_id and keypoints), MMPose (instance_info), MediaPipe (33 landmarks a frame)",
        _shape_of(content),
    )  # fmt: skip


def _shape_of(content: Any) -> str:
    if isinstance(content, dict):
        return "an object with " + ", ".join(list(map(str, content))[:6])
    if isinstance(content, list):
        return f"a list of {len(content)}" + (f", first {_shape_of(content[0])}" if content else "")
    return type(content).__name__


def _alphapose(content: Any, where: str) -> Detections | None:
    if not isinstance(content, list) or not content or not _has(content[0], "image_id", "keypoints"):
        return None
    rows: list[tuple[str, str, np.ndarray]] = []
    for number, item in enumerate(content):
        place = f"{where}, detection {number}"
        if not _has(item, "image_id", "keypoints"):
            raise damaged("a detection has no image_id or keypoints", place)
        points = numbers(item["keypoints"], place)
        rows.append((str(item["image_id"]), identity_of(item.get("idx")), points))
    frames, notes = _frames(image for image, _, _ in rows)
    span = max(frames.values()) + 1
    if span > len(frames):
        notes.append(f"{span - len(frames)} frames are without people.")
    found = [(frames[image], identity, points) for image, identity, points in rows]
    return detections("alphapose", where, found, span, notes=notes)


def _mmpose(content: Any, where: str) -> Detections | None:
    frames = content.get("instance_info") if isinstance(content, dict) else content
    if not isinstance(frames, list) or not frames or not _has(frames[0], "instances"):
        return None
    names: list[str] = []
    if isinstance(content, dict) and isinstance(meta := content.get("meta_info"), dict):
        listed = meta.get("keypoint_id2name")
        if isinstance(listed, dict) and all(str(key).isdigit() for key in listed):
            names = [str(listed[key]) for key in sorted(listed, key=lambda key: int(key))]
    rows: list[Row] = []
    numbers_ = [
        int(f["frame_id"]) if str(f.get("frame_id", "")).isdigit() else k for k, f in enumerate(frames)
    ]
    first = min(numbers_)
    for number, item in zip(numbers_, frames, strict=True):
        for person in item.get("instances", ()):
            place = f"{where}, frame {number}"
            points = np.concatenate([numbers(point[:2], place, 2) for point in person.get("keypoints", ())] or [
                np.empty((0, 2))])  # fmt: skip
            if not len(points):
                continue
            scores = np.asarray(person.get("keypoint_scores") or np.ones(len(points)), dtype=float).ravel()
            if len(scores) != len(points):
                raise damaged("scores and keypoints differ in number", place, len(points), len(scores))
            identity = identity_of(person.get("track_id", person.get("instance_id")))
            rows.append((number - first, identity, np.column_stack([points, scores])))
    return detections("mmpose", where, rows, max(numbers_) - first + 1, names=names)


def _landmarks(item: Any) -> list[Any]:
    """The 33 landmarks of one frame of MediaPipe, however deep; empty if there are none."""
    if isinstance(item, dict):
        keys = ("landmarks", "pose_landmarks", "landmark", "keypoints")
        return next((_landmarks(item[key]) for key in keys if key in item), [])
    if isinstance(item, list) and len(item) == 1:
        return _landmarks(item[0])
    return item if isinstance(item, list) and len(item) == len(MEDIAPIPE) and _has(item[0], "x") else []


def _mediapipe(content: Any, where: str) -> Detections | None:
    listed = content.get("frames") if isinstance(content, dict) else content
    frames = [_landmarks(item) for item in listed] if isinstance(listed, list) else []
    if not any(frames):
        return None
    rows: list[Row] = []
    for number, marks in enumerate(frames):
        flat = [
            value
            for mark in marks
            for value in (mark.get("x"), mark.get("y"), mark.get("visibility", mark.get("score", 1.0)))
        ]
        if flat:
            rows.append((number, "", numbers(flat, f"{where}, frame {number}")))
    rate, size = settings(content if isinstance(content, dict) else {})
    return detections(
        "mediapipe", where, rows, len(frames), names=MEDIAPIPE, frame_rate_hz=rate, image_size=size
    )


def settings(content: dict[str, Any]) -> tuple[float, tuple[int, int]]:
    """Frame rate and image size that an object states; 0 where it does not."""

    def stated(*keys: str) -> float:
        values = (content.get(key) for key in keys)
        return next((float(v) for v in values if _is_number(v) and 0 < v < np.inf), 0.0)

    size = (int(stated("width", "image_width")), int(stated("height", "image_height")))
    return stated("fps", "frame_rate", "frame_rate_hz"), size
