"""Keypoints as JSON: one file per frame in a folder (OpenPose, OpenPifPaf, EasyMocap), or one file (AlphaPose, …).

A file contains frames, a frame people, a person points, under any keys; points are flat numbers, lists or objects.
Files of a folder may also be lines of text, as YOLO writes pose labels.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import coordinates, role_of
from pipeline.formats.text import number, read_text
from walk3d.film.keypoints.contract import DEPTH, MAX_PEOPLE, MEDIAPIPE, Detections, detections, timed


def load(path: Path) -> Any:
    """Return the content of a JSON file, or of a file with one JSON value per line.

    The lines become a list.  If the first line contains settings, the lines after it become its frames.

    Raises
    ------
    InvalidInput
        If it is not JSON; the message gives the character.
    """
    text = read_text(path)[0]
    try:
        try:
            return json.loads(text)
        except json.JSONDecodeError as error:
            if error.msg != "Extra data":
                raise
            first, *lines = [json.loads(line) for line in text.splitlines() if line.strip()]
            if _has(first) and settings(first)[0] and _first(lines[0], first) is None:
                return first | {"frames": lines}
            return [first, *lines]
    except json.JSONDecodeError as error:
        raise damaged(
            "this is not JSON", f"{path.name}, character {error.pos}", received=error.msg, code="not_json"
        ) from None


def numbers(values: Any, where: str, columns: int = 3) -> np.ndarray:
    """Return points (K, columns) from a flat list of numbers.

    Raises
    ------
    InvalidInput
        If it is not a list of numbers, or their count is not a multiple of `columns`.
    """
    try:
        flat = np.array([np.nan if value is None else value for value in values], float)
    except (TypeError, ValueError, OverflowError):
        raise damaged(
            "keypoints must be numbers", where, received=f"{values!r:.40}", code="not_number"
        ) from None
    if flat.ndim != 1 or not flat.size or flat.size % columns:
        raise damaged(
            "keypoints must be a flat list of x, y, confidence",
            where,
            received=f"{flat.size} numbers",
            code="not_in_threes",
        )
    return flat.reshape(-1, columns)


def identity_of(value: Any) -> str:
    """Return a person's identity as a string; if the identity is a list, its first member is used.

    The string is empty if the identity is negative or missing.

    Examples
    --------
    >>> identity_of([2.0]), identity_of(-1), identity_of(None), identity_of("a")
    ('2', '', '', 'a')
    """
    while isinstance(value, list):
        value = (*value, None)[0]
    if value is None or isinstance(value, bool):
        return ""
    if isinstance(value, int | float):
        return f"{value:g}" if 0 <= value < np.inf else ""
    return str(value)


def _has(item: Any, *keys: str) -> bool:
    """Return True if a value is an object that has all the given keys."""
    return isinstance(item, dict) and set(keys) <= set(item)


def frames_by_name(names: Iterable[str]) -> tuple[dict[str, int], list[str]]:
    """Return the frame number, from 0, of each file or image name, and notes for the user.

    The frame is the last number in the names that differs between all names.

    Examples of names: ``walk_000012_keypoints.json``, ``12_keypoints_25.json``.
    """
    digits_of = {name: re.findall(r"\d+", Path(name).stem)[::-1] for name in names}
    for digits in zip(*digits_of.values(), strict=False):
        numbers = list(map(int, digits))
        if len(set(numbers)) == len(digits_of):
            first = min(numbers)
            return {name: number - first for name, number in zip(digits_of, numbers, strict=True)}, []
    note = "The names do not number the frames, which are taken in the order of the names."
    return {name: n for n, name in enumerate(digits_of)}, [note]


def read_folder(path: Path) -> Detections:
    """Read a folder of keypoint files: one file per frame, with the frame number in its name, or a single file."""
    files = sorted(path.glob("[!.]*.json"))
    labels = sorted(path.glob("*[0-9].txt"))
    if labels and not any(map(holds_keypoints, files)):
        people = [(file.name, _labelled(file) if file.stat().st_size else []) for file in labels]
        return _detections("yolo", path.name, people, {})
    if len(files) == 1:
        return read(files[0])
    if not files:
        raise damaged(
            "there is no JSON file in the folder",
            path.name,
            "one file per frame, as OpenPose writes them",
            code="no_recordings",
        )
    frames = [(file.name, load(file)) for file in files]
    wrong = [
        name
        for name, content in frames
        if content
        and (
            not _is_frame(content)
            or any(_first(person, _WHICH_FRAME) for person in _crowd(content) or content)
        )
    ]
    if wrong:
        raise damaged(
            "this is not a file of OpenPose",
            wrong[0],
            "the people of one frame per file; for other programs, the path of the one file",
            code="not_openpose",
        )
    return _detections("openpose", path.name, frames, {})


def _labelled(path: Path) -> list[dict[str, Any]]:
    """Return the people in a YOLO label file.

    Each line has class, box, 17 points as shares of the image size, score and identity.
    """
    people = []
    for line, words in enumerate(read_text(path)[0].splitlines(), 1):
        values = np.array(list(map(number, words.split())))[5:]
        width, more = divmod(len(values), 17)
        if width not in (2, 3) or more > 2 or np.isinf(values).any():
            where = f"{path.name}, line {line}"
            raise damaged(
                "this is not a pose label",
                where,
                "class, box and 17 points",
                words[:40],
                code="not_pose_label",
            )
        identity = values[-1] if more and values[-1] % 1 == 0 else None
        people.append({"keypoints": values[: 17 * width].reshape(17, width).tolist(), "idx": identity})
    return people


def holds_keypoints(path: Path) -> bool:
    """Return True if a JSON file contains keypoints, and not only the settings of a table in the same folder."""
    content = load(path)
    return bool(_frames(content, path.name)) or _is_frame(content)


def read(path: Path) -> Detections:
    """Read a file with one JSON value, or with one JSON value per line, that contains several frames."""
    content, where = load(path), path.name
    settled = content if _has(content) else {}
    if frames := _frames(content, where):
        keys = [*settled, *(frames[0][1] if _has(frames[0][1]) else ())]
        return _detections(_first(_PROGRAMS, keys) or "json", where, frames, settled)
    if _people(content, where) or _has(content, "people"):
        raise damaged(
            "a single frame is not a walk",
            where,
            "all frames of a film; for OpenPose, the folder of its files",
            code="one_frame",
        )
    raise damaged(
        "the keypoints' format is unknown", where,
        "AlphaPose (a list with image_id and keypoints), COCO (images and annotations), MMPose (instance_info), "
        "MediaPipe (33 landmarks a frame)", f"{content!r:.80}", code="unknown_keypoints"
    )  # fmt: skip


_PROGRAMS = {"images": "coco", "image_id": "alphapose", "bodies": "alphapose", "instances": "mmpose"}
"""Program that writes JSON files with each of these keys, by key."""
_FRAMES = ("instance_info", "frames", "annotations", "results", "data", "predictions")
_PEOPLE = (
    "people", "instances", "bodies", "annots", "persons", "poses", "pose", "detections", "predictions", "tracks",
    "pedestrians", "humans", "subjects", "skeletons", "instance_info",
)  # fmt: skip
_POINTS = (
    "pose_keypoints_2d", "keypoints_2d", "keypoints2d", "joints_2d", "pose_landmarks_2d",
    "pose_keypoints", "keypoints", "pred_keypoints", "keypoints_xy", "keypoints_px", "kpts", "kps",
    "pose_landmarks", "poseLandmarks", "landmarks", "landmark", "joints", "points",
    "pose_world_landmarks", "poseWorldLandmarks", "worldLandmarks", "world_landmarks",
)  # fmt: skip
_WHICH_FRAME = (
    "frame_id",
    "frame",
    "frame_index",
    "frame_idx",
    "frame_number",
    "image_id",
    "image",
    "file_name",
    "Frame",
    "frameIndex",
    "frameNumber",
)
_WHO = ("idx", "track_id", "person_id", "personID", "instance_id")
_SURE = ("visibility", "score", "confidence", "likelihood", "conf", "visible", "vis", "prob", "c", "presence")
_SCORES = ("keypoint_scores", "scores", "confidence", "confidences", "score")
_WIDTHS = {34: 2, 50: 2, 52: 2, 4 * len(MEDIAPIPE): 4}
_NAME = ("name", "part", "body_part", "label", "keypoint")
_NUMBER = ("id", "index", "landmark_id")
"""Alternative keys in JSON files of keypoints, for frames, people, points, names, identities and confidences.

In order: frames, people, points, a frame's name, an identity, a point's confidence, all confidences.

Then the numbers per point for lengths of lists that are not 3 per point, and keys of a point's name and number.
"""


def _first(item: Any, keys: Iterable[str]) -> Any:
    """Return an object's value for the first key that the object contains, or None if no key matches."""
    return next((item[key] for key in keys if key in item), None) if _has(item) else None


def _frames(content: Any, where: str) -> list[tuple[str, Any]]:
    """Return the frames or detections in a JSON file, each with the name of its frame.

    The list is empty if the file has no people.

    In a table with columns such as left_knee_x, the coordinates of each point are combined.
    """
    if _has(content, "columns", "data"):  # written by pandas
        content = [dict(zip(content["columns"], row, strict=False)) for row in content["data"]]
    frames = _listed(content, where)
    if any(_is_frame(item) for _, item in frames):
        return frames
    for table in (frames, _listed(_by_frames(content), where)):
        rows = [item for _, item in table if _has(item)]
        titles = [] if any(map(_is_points, rows)) else [*{title: 0 for row in rows for title in row}]
        for point, axis, _, column in coordinates(titles, "xy", ("z", *_SURE)):
            for row in rows:
                point_values = row.get(point, {})  # or the confidence of the point
                row[point] = (point_values if _has(point_values) else {"score": point_values}) | {
                    axis: row.pop(titles[column], None)
                }
        if any(map(_is_points, rows)):
            return table
    return []


def _by_frames(content: Any) -> list[dict[str, Any]]:
    """Return one entry per frame, from an object whose keys are coordinates or points and whose values are lists."""
    frames = defaultdict[str, dict[str, Any]](dict)
    for name, value in content.items() if _has(content) else ():
        each: Any = _by_frames(value) if _has(value, "x", "y") else value
        for frame, entry in each.items() if _has(each) else enumerate(each if isinstance(each, list) else []):
            frames[str(frame)][name] = entry
    return [{"frame": frame} | entry for frame, entry in frames.items()]


def _listed(content: Any, where: str) -> list[tuple[str, Any]]:
    """Return the frames or detections in a JSON file, each with the name of its frame, even if no person is in them."""
    if _has(content, "images", "annotations"):
        names = {image["id"]: str(image.get("file_name", image["id"])) for image in content["images"]}
        listed = [(names.get(item.get("image_id"), ""), item) for item in content["annotations"]]
        if unknown := [k for k, (name, _) in enumerate(listed) if not name]:
            raise damaged(
                "the annotation belongs to no image",
                f"{where}, annotation {unknown[0]}",
                "image_id",
                code="no_image",
            )
        return [*((name, {"people": []}) for name in names.values()), *listed]
    people = _first(content, _PEOPLE)
    if people and isinstance(people, list) and all(_has(person, "frames") for person in people):
        content = {
            identity_of(_first(person, (*_WHO, "id", "name"))) or str(k): person
            for k, person in enumerate(people)
        }
    if _has(content):
        if isinstance(inner := _first(content, _FRAMES), dict | list):
            return _listed(inner, where)
        if (points := _first(content, _POINTS)) and (inner := _frames(points, where)):
            return inner  # these are frames, not points
        listed = [
            (name, {"idx": identity, "keypoints": item} | (item if _has(item) else {}))
            for identity, track in content.items()
            if identity not in _POINTS and not _is_points(track)
            for frames in [_listed(track, where)]
            # People are few, and fewer than their frames; these are not the people of frames.
            if len(content) <= min(MAX_PEOPLE, len(frames) - 1) and "3d" not in identity.lower()
            for name, item in frames
        ]
        if any(_is_frame(item["keypoints"]) for _, item in listed):
            return listed
        numbered = content and all(re.search(r"\d", key) for key in content)
        return list(content.items()) if numbered and not _is_points(content) else []
    if not isinstance(content, list) or _is_points(content):
        return []
    frame_names = [_first(item, _WHICH_FRAME) for item in content]
    named = all(isinstance(name, int | float | str) for name in frame_names)
    if not named and any(_has(item, "image_id") for item in content):
        raise damaged(
            "a detection has no image_id or keypoints",
            f"{where}, detection {frame_names.index(None)}",
            code="no_image",
        )
    return [
        (str(name if named else k), item)
        for k, (name, item) in enumerate(zip(frame_names, content, strict=True))
    ]


def _is_mark(value: Any) -> bool:
    """Return True if a JSON value describes a single keypoint."""
    if isinstance(value, list):
        return 2 <= len(value) <= 4 and not any(isinstance(number, list | dict | str) for number in value)
    return _has(value, "x", "y") or _has(value, "position")


def _is_points(value: Any) -> bool:
    """Return True if a JSON value describes all keypoints of a person, not a single keypoint."""
    if _has(value):
        if _has(value, "x", "y"):
            return isinstance(value["x"], list)
        return sum(map(_is_mark, value.values())) > 5  # joints, next to other entries
    if not isinstance(value, list) or _is_mark(value):
        return False
    flat = not any(isinstance(member, list | dict | str) for member in value or [[]])
    return flat or (len(value) > 1 and _is_mark(value[0]))


def _crowd(item: Any) -> Any:
    """Return the people in a frame of a JSON file, or None if the value does not describe a frame.

    The keys of the frame may be the identities of the people.
    """
    people = _first(item, _PEOPLE)
    if people is None and item and _has(item):
        numbered = all(map(str.isdigit, item)) and any(map(_is_frame, item.values()))
        if numbered or all(map(_is_points, item.values())):
            people = [{"idx": identity, "keypoints": points} for identity, points in item.items()]
    return people


def _is_frame(item: Any) -> bool:
    """Return True if a JSON value describes a frame, with or without people."""
    if isinstance(item, list) and not _is_points(item):
        return any(map(_is_frame, item))
    return _is_points(item) or _crowd(item) is not None or _first(item, _POINTS) is not None


def _people(item: Any, where: str) -> list[tuple[str, list[str], np.ndarray]]:
    """Return the identity, the names of the points and the points (K, 3) of each person in a frame.

    The names are empty if the points have no names.
    """
    if isinstance(item, list) and not _is_points(item):
        return [person for inner in item for person in _people(inner, where)]
    points = _first(item, _POINTS)
    if points is None:
        return [("", *_points(item, None, where))] if _is_points(item) else _people(_crowd(item) or [], where)
    if not points:  # pipelines that match people between cameras leave these empty
        return []
    identity = identity_of(_first(item, _WHO))
    if not _is_points(points) and _is_frame(points):
        return [
            (inner or identity, names, inner_points) for inner, names, inner_points in _people(points, where)
        ]
    scores = next((item[key] for key in _SCORES if np.size(item.get(key)) > 1), None)  # not the person's
    return [(identity, *_points(points, scores, where))]


def _points(value: Any, scores: Any, where: str) -> tuple[list[str], np.ndarray]:
    """Return the names of a person's K points, and an array (K, 3) of their columns, rows and confidences.

    The names are empty if the points have no names.  The confidence is 1 if the file does not contain it.
    """
    names: list[str] = []
    if _has(value, "x", "y"):
        value = _by_frames(value)
    elif _has(value):
        value = {name: mark for name, mark in value.items() if _is_mark(mark) and "box" not in name.lower()}
        names, value = list(value), list(value.values())
    if value and _has(value[0]):
        value = [mark | mark.get("position", {}) for mark in value]
        names = names or [name for mark in value if isinstance(name := _first(mark, _NAME), str)]
        names = names or [
            str(int(number)) for mark in value if (number := _first(mark, _NUMBER)) in range(len(MEDIAPIPE))
        ]
        value = [
            [mark.get("x"), mark.get("y"), _first({"presence": DEPTH if "z" in mark else 1.0} | mark, _SURE)]
            for mark in value
        ]
    if value and isinstance(value[0], list):
        width = len(value[0])
        value = [number for mark in value for number in mark]
    else:
        count = len(value) if isinstance(value, list) else 0
        width = 2 if count == 2 * len(scores or ()) else _WIDTHS.get(count, 3)
    table = numbers(value, where, width)[:, [0, 1, *([] if width < 3 else [-1])]]
    if scores or table.shape[1] == 2:
        sure = np.asarray(scores or np.ones(len(table)), float).ravel()
        if len(sure) != len(table):
            raise damaged(
                "scores and keypoints differ in number",
                where,
                len(table),
                len(sure),
                code="wrong_count",
                needed=len(table),
                count=len(sure),
            )
        table = np.column_stack([table[:, :2], sure])
    return names if len({*names}) == len(table) else [], table


def _detections(
    program: str, where: str, frames: list[tuple[str, Any]], content: dict[str, Any]
) -> Detections:
    """Return one detection for each person in each frame."""
    number, notes = frames_by_name(name for name, _ in frames)
    rate, size = settings((content.get("images") or [{}])[0] | content)
    keys = (key for _, item in frames if _has(item) for key in item)
    if title := next((key for key in keys if role_of(key)[0] == "time"), ""):
        stamps = {name: str(_first(item, [title])) for name, item in frames}
        lines = range(1, len(stamps) + 1)
        table = Rows(f"{where}, times", [[stamp] for stamp in stamps.values()], lines, notes, header=[title])
        # Points of a person without a frame number belong to the frame of their time.
        in_turn = all(
            _first(entry, _WHO) is None or _first(entry, _WHICH_FRAME) is not None for _, entry in frames
        )
        at, rate = timed(table, 0, np.array([*number.values()]) if in_turn else None, rate)
        number = dict(zip(number, at, strict=True))
    people = [
        (number[name], *entry) for name, item in frames for entry in _people(item, f"{where}, frame {name}")
    ]
    listed = _first(content.get("meta_info"), ["keypoint_id2name"]) or content.get("skeleton")
    if isinstance(listed, dict) and all(map(str.isdigit, listed)):
        names = [listed[key] for key in sorted(listed, key=int)]
    else:
        names = _first((*(content.get("categories") or ()), None)[0], ["keypoints"])
        names = names or list(dict.fromkeys(name for _, _, point_names, _ in people for name in point_names))
    rows = []
    for frame, identity, point_names, points in people:
        if point_names and point_names != names and (point_names[0] in names or not point_names[0].isdigit()):
            points, file_points = np.full((len(names), 3), np.nan), points
            points[[names.index(name) for name in point_names]] = file_points
        if _has(content.get("skeleton")):  # easy_ViTPose has rows before columns
            points = points[:, [1, 0, 2]]
        rows.append((frame, identity, points))
    count = len(rows[0][2]) if rows else 0
    parts = [content, *filter(_has, content.values())]  # may have the names of all points
    lists = (entry for part in parts for entry in part.values() if isinstance(entry, list))
    names = names or next((entry for entry in lists if [*map(type, entry)] == [str] * count), [])
    if count == len(MEDIAPIPE) and {*names} <= {*map(str, range(count))}:
        program, names = "mediapipe", [MEDIAPIPE[int(name)] for name in names] or list(MEDIAPIPE)
    return detections(program, where, rows, int(max(number.values())) + 1, names=list(map(str, names)),
                      frame_rate_hz=rate, image_size=size, notes=notes)  # fmt: skip


def settings(content: dict[str, Any]) -> tuple[float, tuple[int, int]]:
    """Return the frame rate, Hz, and the image size, px, that a JSON object states; values that are not stated are 0.

    They may be stated in objects within it, such as meta.
    """
    within = [part for part in content.values() if _has(part, "fps") or _has(part, "width")]
    stating = {key: value for part in [*within, content] for key, value in part.items()}

    def stated(*keys: str) -> float:
        values = (number(str(stating.get(key, ""))) for key in keys)
        return next((value for value in values if 0 < value < np.inf), 0.0)

    rate = stated("fps", "frame_rate", "frame_rate_hz", "frameRate")
    return rate, (int(stated("width", "image_width")), int(stated("height", "image_height")))
