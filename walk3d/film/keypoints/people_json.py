"""Keypoints as JSON: a folder, one file a frame (OpenPose, OpenPifPaf, EasyMocap), or one file (AlphaPose, MMPose, …).

A file holds frames, a frame people, a person points, under whatever keys; points are numbers in turn, lists, objects.
In a folder they may also be lines of text, as YOLO writes labels of poses.
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
from walk3d.film.keypoints.contract import CROWD, DEPTH, MEDIAPIPE, Detections, detections, timed


def load(path: Path) -> Any:
    """Content of a JSON file; a list, where each line has a JSON text of its own, within settings in the first.

    Raises
    ------
    InvalidInput
        If it is not JSON; the sentence gives the character.
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
    """Points (K, columns) of a flat list of numbers.

    Raises
    ------
    InvalidInput
        If it is not a list of numbers, or their count is no multiple of `columns`.
    """
    try:
        found = np.array([np.nan if value is None else value for value in values], float)
    except (TypeError, ValueError, OverflowError):
        raise damaged(
            "keypoints must be numbers", where, received=f"{values!r:.40}", code="not_number"
        ) from None
    if found.ndim != 1 or not found.size or found.size % columns:
        raise damaged(
            "keypoints must be x, y, confidence in turn",
            where,
            received=f"{found.size} numbers",
            code="not_in_threes",
        )
    return found.reshape(-1, columns)


def identity_of(value: Any) -> str:
    """Identity as a text; a list is its first member, and a negative or missing one is none.

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
    """Whether something is an object with these keys."""
    return isinstance(item, dict) and set(keys) <= set(item)


def frames_by_name(names: Iterable[str]) -> tuple[dict[str, int], list[str]]:
    """Frame of each file or image, the first 0, by the last number in the names that differs from name to name.

    ``walk_000012_keypoints.json``, ``12_keypoints_25.json``
    """
    found = {name: re.findall(r"\d+", Path(name).stem)[::-1] for name in names}
    for digits in zip(*found.values(), strict=False):
        numbers = list(map(int, digits))
        if len(set(numbers)) == len(found):
            first = min(numbers)
            return {name: number - first for name, number in zip(found, numbers, strict=True)}, []
    note = "Frames are taken in the order of their names, which do not number them."
    return {name: n for n, name in enumerate(found)}, [note]


def read_folder(path: Path) -> Detections:
    """Read a folder with a file to each frame, by the numbers in their names; or the one file in it."""
    files = sorted(path.glob("[!.]*.json"))
    labels = sorted(path.glob("*[0-9].txt"))
    if labels and not any(map(holds_keypoints, files)):
        people = [(file.name, _labelled(file) if file.stat().st_size else []) for file in labels]
        return _detections("yolo", path.name, people, {})
    if len(files) == 1:
        return read(files[0])
    if not files:
        raise damaged(
            "no JSON file in the folder",
            path.name,
            "one file a frame, as OpenPose writes them",
            code="no_recordings",
        )
    frames = [(file.name, load(file)) for file in files]
    wrong = [
        name
        for name, content in frames
        if content
        and (not _is_frame(content) or any(_first(one, _WHICH_FRAME) for one in _crowd(content) or content))
    ]
    if wrong:
        raise damaged(
            "not a file of OpenPose",
            wrong[0],
            "the people of one frame, a file to each frame; of other programs name the one file",
            code="not_openpose",
        )
    return _detections("openpose", path.name, frames, {})


def _labelled(path: Path) -> list[dict[str, Any]]:
    """The people of a file of YOLO's labels: class, box, 17 points in shares of the image; then a score, who it is."""
    people = []
    for line, words in enumerate(read_text(path)[0].splitlines(), 1):
        values = np.array(list(map(number, words.split())))[5:]
        width, more = divmod(len(values), 17)
        if width not in (2, 3) or more > 2 or np.isinf(values).any():
            place = f"{path.name}, line {line}"
            raise damaged(
                "not a label of a pose", place, "class, box and 17 points", words[:40], code="not_pose_label"
            )
        who = values[-1] if more and values[-1] % 1 == 0 else None
        people.append({"keypoints": values[: 17 * width].reshape(17, width).tolist(), "idx": who})
    return people


def holds_keypoints(path: Path) -> bool:
    """Whether a JSON file is more than what is known of a table beside it."""
    content = load(path)
    return bool(_frames(content, path.name)) or _is_frame(content)


def read(path: Path) -> Detections:
    """Read one JSON file, or a JSON text in each line, by its structure; one frame is no walk."""
    content, where = load(path), path.name
    settled = content if _has(content) else {}
    if frames := _frames(content, where):
        keys = [*settled, *(frames[0][1] if _has(frames[0][1]) else ())]
        return _detections(_first(_PROGRAMS, keys) or "json", where, frames, settled)
    if _people(content, where) or _has(content, "people"):
        raise damaged(
            "one frame is no walk",
            where,
            "all frames of a film; of OpenPose the folder of its files",
            code="one_frame",
        )
    raise damaged(
        "the keypoints' format is unknown", where,
        "AlphaPose (a list with image_id and keypoints), COCO (images and annotations), MMPose (instance_info), "
        "MediaPipe (33 landmarks a frame)", f"{content!r:.80}", code="unknown_keypoints"
    )  # fmt: skip


_PROGRAMS = {"images": "coco", "image_id": "alphapose", "bodies": "alphapose", "instances": "mmpose"}
"""Who writes files with these keys."""
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
"""Keys of all frames, of the people in one, of somebody's points; of a frame's name, of a person's, of how sure a
point is, of all points; numbers of each point where these in turn are not 3; keys of a point's name, of its number."""


def _first(item: Any, keys: Iterable[str]) -> Any:
    """What an object has under the first of some keys; None if it has none of them."""
    return next((item[key] for key in keys if key in item), None) if _has(item) else None


def _frames(content: Any, where: str) -> list[tuple[str, Any]]:
    """The frames of a file, or the detections in them, each with the name of its frame; nothing if it holds nobody.

    Of a table with columns such as left_knee_x the numbers of a point are put together.
    """
    if _has(content, "columns", "data"):  # of pandas
        content = [dict(zip(content["columns"], row, strict=False)) for row in content["data"]]
    frames = _listed(content, where)
    if any(_is_frame(item) for _, item in frames):
        return frames
    for table in (frames, _listed(_by_frames(content), where)):
        rows = [item for _, item in table if _has(item)]
        titles = [] if any(map(_is_points, rows)) else [*{title: 0 for row in rows for title in row}]
        for point, axis, _, column in coordinates(titles, "xy", ("z", *_SURE)):
            for row in rows:
                held = row.get(point, {})  # or how sure the point is
                row[point] = (held if _has(held) else {"score": held}) | {axis: row.pop(titles[column], None)}
        if any(map(_is_points, rows)):
            return table
    return []


def _by_frames(content: Any) -> list[dict[str, Any]]:
    """Frames of an object that has a list of all frames, or an object with a key to each, of each number or point."""
    frames = defaultdict[str, dict[str, Any]](dict)
    for name, of in content.items() if _has(content) else ():
        each: Any = _by_frames(of) if _has(of, "x", "y") else of
        for frame, one in each.items() if _has(each) else enumerate(each if isinstance(each, list) else []):
            frames[str(frame)][name] = one
    return [{"frame": frame} | one for frame, one in frames.items()]


def _listed(content: Any, where: str) -> list[tuple[str, Any]]:
    """The frames of a file, or the detections in them, each with the name of its frame."""
    if _has(content, "images", "annotations"):
        names = {image["id"]: str(image.get("file_name", image["id"])) for image in content["images"]}
        found = [(names.get(item.get("image_id"), ""), item) for item in content["annotations"]]
        if unknown := [k for k, (name, _) in enumerate(found) if not name]:
            raise damaged(
                "the annotation is of no image",
                f"{where}, annotation {unknown[0]}",
                "image_id",
                code="no_image",
            )
        return [*((name, {"people": []}) for name in names.values()), *found]
    people = _first(content, _PEOPLE)
    if people and isinstance(people, list) and all(_has(one, "frames") for one in people):
        content = {
            identity_of(_first(one, (*_WHO, "id", "name"))) or str(k): one for k, one in enumerate(people)
        }
    if _has(content):
        if isinstance(inner := _first(content, _FRAMES), dict | list):
            return _listed(inner, where)
        if (points := _first(content, _POINTS)) and (inner := _frames(points, where)):
            return inner  # frames, not points
        found = [
            (name, {"idx": who, "keypoints": item} | (item if _has(item) else {}))
            for who, of_one in content.items()
            if who not in _POINTS and not _is_points(of_one)
            for frames in [_listed(of_one, where)]
            # Of people, who are few, and fewer than their frames; not the people of frames.
            if len(content) <= min(CROWD, len(frames) - 1) and "3d" not in who.lower()
            for name, item in frames
        ]
        if any(_is_frame(item["keypoints"]) for _, item in found):
            return found
        numbered = content and all(re.search(r"\d", key) for key in content)
        return list(content.items()) if numbered and not _is_points(content) else []
    if not isinstance(content, list) or _is_points(content):
        return []
    given = [_first(item, _WHICH_FRAME) for item in content]
    named = all(isinstance(name, int | float | str) for name in given)
    if not named and any(_has(item, "image_id") for item in content):
        raise damaged(
            "a detection has no image_id or keypoints",
            f"{where}, detection {given.index(None)}",
            code="no_image",
        )
    return [
        (str(name if named else k), item) for k, (name, item) in enumerate(zip(given, content, strict=True))
    ]


def _is_mark(value: Any) -> bool:
    """Whether something is one point."""
    if isinstance(value, list):
        return 2 <= len(value) <= 4 and not any(isinstance(number, list | dict | str) for number in value)
    return _has(value, "x", "y") or _has(value, "position")


def _is_points(value: Any) -> bool:
    """Whether something is all points of somebody, not one of them."""
    if _has(value):
        if _has(value, "x", "y"):
            return isinstance(value["x"], list)
        return sum(map(_is_mark, value.values())) > 5  # joints, and whatever else
    if not isinstance(value, list) or _is_mark(value):
        return False
    flat = not any(isinstance(one, list | dict | str) for one in value or [[]])
    return flat or (len(value) > 1 and _is_mark(value[0]))


def _crowd(item: Any) -> Any:
    """The people in a frame, whom keys may name; None if it is none."""
    found = _first(item, _PEOPLE)
    if found is None and item and _has(item):
        numbered = all(map(str.isdigit, item)) and any(map(_is_frame, item.values()))
        if numbered or all(map(_is_points, item.values())):
            found = [{"idx": who, "keypoints": points} for who, points in item.items()]
    return found


def _is_frame(item: Any) -> bool:
    """Whether something holds people, even if none is in it."""
    if isinstance(item, list) and not _is_points(item):
        return any(map(_is_frame, item))
    return _is_points(item) or _crowd(item) is not None or _first(item, _POINTS) is not None


def _people(item: Any, place: str) -> list[tuple[str, list[str], np.ndarray]]:
    """Who is in a frame: identity, names of the points if they have some, and points (K, 3)."""
    if isinstance(item, list) and not _is_points(item):
        return [person for inner in item for person in _people(inner, place)]
    points = _first(item, _POINTS)
    if points is None:
        return [("", *_points(item, None, place))] if _is_points(item) else _people(_crowd(item) or [], place)
    if not points:  # pipelines that match people between cameras leave empty ones
        return []
    who = identity_of(_first(item, _WHO))
    if not _is_points(points) and _is_frame(points):
        return [(inner or who, names, found) for inner, names, found in _people(points, place)]
    scores = next((item[key] for key in _SCORES if np.size(item.get(key)) > 1), None)  # not the person's
    return [(who, *_points(points, scores, place))]


def _points(value: Any, scores: Any, place: str) -> tuple[list[str], np.ndarray]:
    """Names, if points have some, and column, row, confidence (K, 3), 1 where none is said; depths are left out."""
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
    table = numbers(value, place, width)[:, [0, 1, *([] if width < 3 else [-1])]]
    if scores or table.shape[1] == 2:
        sure = np.asarray(scores or np.ones(len(table)), float).ravel()
        if len(sure) != len(table):
            raise damaged(
                "scores and keypoints differ in number",
                place,
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
    """The people in all frames; those of a list of detections come one by one."""
    number, notes = frames_by_name(name for name, _ in frames)
    rate, size = settings((content.get("images") or [{}])[0] | content)
    keys = (key for _, item in frames if _has(item) for key in item)
    if title := next((key for key in keys if role_of(key)[0] == "time"), ""):
        stamps = {name: str(_first(item, [title])) for name, item in frames}
        lines = range(1, len(stamps) + 1)
        table = Rows(f"{where}, times", [[stamp] for stamp in stamps.values()], lines, notes, header=[title])
        # Somebody's points without a frame's number are of the frame that their time says.
        in_turn = all(_first(one, _WHO) is None or _first(one, _WHICH_FRAME) is not None for _, one in frames)
        at, rate = timed(table, 0, np.array([*number.values()]) if in_turn else None, rate)
        number = dict(zip(number, at, strict=True))
    found = [(number[name], *one) for name, item in frames for one in _people(item, f"{where}, frame {name}")]
    listed = _first(content.get("meta_info"), ["keypoint_id2name"]) or content.get("skeleton")
    if isinstance(listed, dict) and all(map(str.isdigit, listed)):
        names = [listed[key] for key in sorted(listed, key=int)]
    else:
        names = _first((*(content.get("categories") or ()), None)[0], ["keypoints"])
        names = names or list(dict.fromkeys(name for _, _, of_one, _ in found for name in of_one))
    rows = []
    for frame, who, of_one, points in found:
        if of_one and of_one != names and (of_one[0] in names or not of_one[0].isdigit()):
            points, own = np.full((len(names), 3), np.nan), points
            points[[names.index(name) for name in of_one]] = own
        if _has(content.get("skeleton")):  # easy_ViTPose has rows before columns
            points = points[:, [1, 0, 2]]
        rows.append((frame, who, points))
    count = len(rows[0][2]) if rows else 0
    parts = [content, *filter(_has, content.values())]  # where names of all points may stand
    lists = (one for part in parts for one in part.values() if isinstance(one, list))
    names = names or next((one for one in lists if [*map(type, one)] == [str] * count), [])
    if count == len(MEDIAPIPE) and {*names} <= {*map(str, range(count))}:
        program, names = "mediapipe", [MEDIAPIPE[int(name)] for name in names] or list(MEDIAPIPE)
    return detections(program, where, rows, int(max(number.values())) + 1, names=list(map(str, names)),
                      frame_rate_hz=rate, image_size=size, notes=notes)  # fmt: skip


def settings(content: dict[str, Any]) -> tuple[float, tuple[int, int]]:
    """Frame rate and image size that an object or one in it (meta, metadata, …) states; 0 where none does."""
    within = [part for part in content.values() if _has(part, "fps") or _has(part, "width")]
    stating = {key: value for part in [*within, content] for key, value in part.items()}

    def stated(*keys: str) -> float:
        values = (number(str(stating.get(key, ""))) for key in keys)
        return next((value for value in values if 0 < value < np.inf), 0.0)

    rate = stated("fps", "frame_rate", "frame_rate_hz", "frameRate")
    return rate, (int(stated("width", "image_width")), int(stated("height", "image_height")))
