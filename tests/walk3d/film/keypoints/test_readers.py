"""Tests of the readers of keypoints: the content of each format, and rejected files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.validation import InvalidInput
from tests.rejects import rejects
from walk3d.film import keypoints
from walk3d.film.keypoints import detections
from walk3d.film.keypoints.people_json import frames_by_name, identity_of

POINTS = np.arange(1.0, 35.0).reshape(17, 2) * 3.0


def flat(points: np.ndarray = POINTS, confidence: float = 0.9) -> list[float]:
    """Return x, y and confidence of all points as one flat list."""
    return np.column_stack([points, np.full(len(points), confidence)]).ravel().tolist()


def write(path: Path, content: object) -> Path:
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_a_folder_of_openpose_with_empty_people_and_a_gap(tmp_path: Path) -> None:
    people = [{"person_id": [-1], "pose_keypoints_2d": flat()}]
    write(tmp_path / "walk_000000000007_keypoints.json", {"people": people})
    write(tmp_path / "walk_000000000008_keypoints.json", {"people": []})
    write(tmp_path / "walk_000000000010_keypoints.json", {"people": [{}, *people]})
    recording = keypoints.read(tmp_path)
    assert (recording.format, recording.n_frames, recording.frame.tolist()) == ("openpose", 4, [0, 3])
    np.testing.assert_allclose(recording.points[0], POINTS)
    assert recording.identity.tolist() == ["", ""]
    assert recording.notes == ("2 frames between the first and the last are missing or without people.",)


def test_folders_of_other_programs_with_a_file_to_each_frame(tmp_path: Path) -> None:
    person = {"keypoints": flat(), "score": 0.9, "category_id": 1}
    people = {
        "pifpaf": ("predictions.json", [person], []),
        "easymocap": ("json", {"annots": [person | {"personID": 0}]}, {"annots": []}),
        "sapiens": ("json", {"meta_info": {}, "instance_info": [person]}, {"instance_info": []}),
    }
    for program, (suffix, first, empty) in people.items():
        (folder := tmp_path / program).mkdir()
        for frame, content in ((3, first), (4, empty), (5, first)):
            write(folder / f"{frame:05d}.{suffix}", content)
        recording = keypoints.read(folder)
        assert (recording.n_frames, recording.frame.tolist()) == (3, [0, 2])
        np.testing.assert_allclose(recording.points, [POINTS] * 2)
    write(folder / "00006.json", [{"image_id": "1.jpg", "keypoints": flat()}])
    with rejects("not_openpose", "00006.json"):
        keypoints.read(folder)


@pytest.mark.parametrize(
    ("columns", "more", "who"), [(3, "", ""), (3, " 0.8 7", "7"), (2, " 3", "3"), (2, " 0.8", "")]
)
def test_labels_of_poses_of_yolo(tmp_path: Path, columns: int, more: str, who: str) -> None:
    shares = np.column_stack([POINTS / 200.0, np.full(17, 0.9)])[:, :columns]
    for frame in (9, 10, 12):
        line = "0 .5 .5 .2 .6 " + " ".join(map(repr, shares.ravel().tolist())) + more
        (tmp_path / f"walk_{frame}.txt").write_text(line + "\n", encoding="utf-8")
    (tmp_path / "walk_11.txt").write_text("", encoding="utf-8")  # no person
    (tmp_path / "classes.txt").write_text("person\n", encoding="utf-8")
    recording = keypoints.read(tmp_path)
    assert (recording.format, recording.n_frames, recording.frame.tolist()) == ("yolo", 4, [0, 1, 3])
    assert recording.identity.tolist() == [who] * 3
    np.testing.assert_allclose(recording.points, [POINTS / 200.0] * 3)
    np.testing.assert_allclose(recording.confidence, 0.9 if columns == 3 else 1.0)
    write(tmp_path / "camera.json", {"fps": 30})  # no keypoints
    assert keypoints.read(tmp_path).format == "yolo"
    (tmp_path / "walk_13.txt").write_text("0 .5 .5 .2 .6\n", encoding="utf-8")  # of a detector without poses
    with rejects("not_pose_label", "walk_13.txt, line 1"):
        keypoints.read(tmp_path)


def test_a_long_table_that_numbers_its_landmarks(tmp_path: Path) -> None:
    lines = [f"{frame},{k},{x},{y}" for frame in (0, 1) for k, (x, y) in enumerate(POINTS.tolist())]
    (tmp_path / "a.csv").write_text("\n".join(["frame,landmark_id,x,y", *lines, ""]), encoding="utf-8")
    np.testing.assert_allclose(keypoints.read(tmp_path / "a.csv").points, [POINTS] * 2)


def test_alphapose_with_identities_as_lists(tmp_path: Path) -> None:
    rows = [
        {"image_id": f"{frame}.jpg", "keypoints": flat(), "idx": idx, "score": 1.0}
        for frame, idx in ((10, [2.0]), (9, 1), (10, 1))
    ]
    recording = keypoints.read(write(tmp_path / "a.json", rows))
    assert recording.frame.tolist() == [0, 1, 1]
    assert recording.identity.tolist() == ["1", "2", "1"]
    np.testing.assert_array_equal(keypoints.read(tmp_path).points, recording.points)  # its folder, too


def test_mmpose_with_names_and_scores(tmp_path: Path) -> None:
    instances = [{"keypoints": POINTS.tolist(), "keypoint_scores": [0.5] * 17}]
    meta = {"keypoint_id2name": {str(k): f"point{k}" for k in range(17)}}
    frames = [{"frame_id": 5, "instances": instances}, {"frame_id": 7, "instances": instances}]
    recording = keypoints.read(write(tmp_path / "a.json", {"meta_info": meta, "instance_info": frames}))
    assert (recording.n_frames, recording.frame.tolist()) == (3, [0, 2])
    assert recording.names[:2] == ("point0", "point1")
    np.testing.assert_allclose(recording.confidence, 0.5)


def test_a_single_score_is_of_the_whole_person(tmp_path: Path) -> None:
    rows = [{"frame": frame, "keypoints": flat(), "score": [0.9]} for frame in range(2)]
    recording = keypoints.read(write(tmp_path / "a.json", rows))
    rows = [{"frame": frame, "keypoints": flat()} for frame in range(2)]
    np.testing.assert_array_equal(
        recording.confidence, keypoints.read(write(tmp_path / "a.json", rows)).confidence
    )


MARKS = np.column_stack([POINTS, np.linspace(-1, 1, 17), np.full(17, 0.9)])
NAMED = [f"part_{k}" for k in range(17)]


def objects(*keys: str) -> list[dict[str, float]]:
    """Return the points as JSON objects with x, y and further keys."""
    return [dict(zip(("x", "y", *keys), mark, strict=False)) for mark in MARKS[:, [0, 1, 3]].tolist()]


IN_TURN = {"keypoints": flat()}
WRITTEN = {
    "coco": {
        "images": [{"id": 70, "file_name": "f8.jpg", "width": 640, "height": 480}, {"id": 5, "file_name": "f7.jpg"}],
        "annotations": [{"id": 1, "image_id": image, "category_id": 1, **IN_TURN} for image in (70, 5)],
        "categories": [{"id": 1, "name": "person", "keypoints": NAMED}],
    },
    "alphapose cmu": {f"{k}.jpg": {"version": "AlphaPose v0.3", "bodies": [{"joints": flat()}]} for k in (0, 1)},
    "alphapose open": {f"{k}.jpg": {"people": [{"pose_keypoints_2d": flat()}]} for k in (0, 1)},
    "lists": [{"frame": k, "landmarks": MARKS.tolist()} for k in (3, 4)],
    "lists alone": [MARKS.tolist()] * 2,
    "confidences and pairs": [{"keypoints": POINTS.tolist(), "confidence": [0.9] * 17, "score": 0.5}] * 2,
    "confidences and numbers": [{"keypoints": POINTS.ravel().tolist(), "confidence": [0.9] * 17}] * 2,
    "objects": [objects("visibility")] * 2,
    "objects of tasks": [{"pose_landmarks": [objects("visibility")]}] * 2,
    "objects of a browser": [{"poseLandmarks": objects("visibility")}] * 2,
    "named objects": {"frames": [{"keypoints": dict(zip(NAMED, objects("score"), strict=True))}] * 2},
    "objects that are named": [
        {"keypoints": [m | {"name": n} for m, n in zip(objects("score"), NAMED, strict=True)]}
    ] * 2,
    "columns": [[{"name": "person", "keypoints": {"x": POINTS[:, 0].tolist(), "y": POINTS[:, 1].tolist(),
                  "visible": [0.9] * 17}}]] * 2,
    "all at once": {"keypoints": [flat()] * 2},
    "detectron2": [
        {"frame": k, "scores": [0.5], "pred_keypoints": [MARKS[:, [0, 1, 3]].tolist()]} for k in (3, 4)
    ],
    "rows before columns, named": {
        "keypoints": [{"7": MARKS[:, [1, 0, 3]].tolist()}] * 2,
        "skeleton": dict(zip(map(str, range(17)), NAMED, strict=True)),
    },
    "landmarks of the world": [{"worldLandmarks": objects("visibility")}] * 2,
    "people called otherwise": {"frames": [{"frame_idx": k, "pedestrians": [IN_TURN]} for k in (3, 4)]},
    "named, as points": {"frames": [{"points": dict(zip(NAMED, objects("visibility"), strict=True))}] * 2},
    "in 3D, too": [{"joints": [[0.1, 0.2, 0.3]] * 17, "joints_2d": MARKS[:, [0, 1, 3]].tolist()}] * 2,
    "in pixels": {"frames": [{"time_s": k, "keypoints_px": MARKS[:, [0, 1, 3]].tolist()} for k in (3, 4)]},
    "within a pose": {"metadata": {"fps": 30}, "frames": [{"frame_idx": k, "pose": IN_TURN} for k in (3, 4)]},
    "named, among others": [
        {"frame": k, "bbox": [1, 2, 3, 4], "note": "", **dict(zip(NAMED, objects("conf"), strict=True))} for k in (3, 4)
    ],
}  # fmt: skip


@pytest.mark.parametrize("written", WRITTEN)
@pytest.mark.parametrize("lines", ["", "json", "ndjson"])
def test_points_under_whatever_keys(written: str, lines: str, tmp_path: Path) -> None:
    content, path = WRITTEN[written], tmp_path / f"a.{lines or 'json'}"
    if lines and isinstance(content, list):
        path.write_text("".join(json.dumps(item) + "\n" for item in content), encoding="utf-8")
    recording = keypoints.read(path if path.exists() else write(path, content))
    assert (recording.n_frames, recording.frame.tolist()) == (2, [0, 1])
    np.testing.assert_allclose(recording.points, [POINTS] * 2)
    np.testing.assert_allclose(recording.confidence, 0.9)
    assert recording.names == (tuple(NAMED) if written == "coco" or "named" in written else ())
    assert recording.image_size == ((640, 480) if written == "coco" else (0, 0))


COLUMNS = [f"{name}_{axis}" for name in NAMED for axis in ("x", "y", "c")]
ROWS = [dict(zip(COLUMNS, flat(), strict=True))] * 9
LETTERS = [f"part_{letter}" for letter in "abcdefghijklmnopq"]
OF_EACH = {name: [mark] * 9 for name, mark in zip(LETTERS, MARKS[:, [0, 1, 3]].tolist(), strict=True)}
TABLES = {
    "records": ROWS,
    "records with a frame": [{"frame": frame, "box": None} | row for frame, row in enumerate(ROWS)],
    "index": {str(frame): row for frame, row in enumerate(ROWS)},
    "columns": {title: dict.fromkeys(map(str, range(9)), value) for title, value in ROWS[0].items()},
    "lists": {"names": ["a"]} | {title: [value] * 9 for title, value in ROWS[0].items()},
    "split": {"columns": COLUMNS, "index": [*range(9)], "data": [[*row.values()] for row in ROWS]},
    "table": {"schema": {"fields": []}, "data": ROWS},
    "points": OF_EACH,
    "points within": {"fps": 25, "joints": OF_EACH, "edges": [[0, 1], [1, 2]]},
    "columns of points": {
        name: {axis: [value] * 9 for axis, value in zip("xyc", mark[0], strict=True)} for name, mark in OF_EACH.items()
    },
}  # fmt: skip


@pytest.mark.parametrize("written", TABLES)
def test_a_table_as_json(written: str, tmp_path: Path) -> None:
    recording = keypoints.read(write(tmp_path / "a.json", TABLES[written]))
    names = LETTERS if "points" in written else NAMED
    assert (recording.names, recording.frame.tolist(), recording.n_frames) == (tuple(names), [*range(9)], 9)
    np.testing.assert_allclose(recording.points, [POINTS] * 9)
    np.testing.assert_allclose(recording.confidence, 0.9)


@pytest.mark.parametrize("written", ["index", "columns", "Frame", "frameIndex"])
def test_rows_of_a_json_may_be_numbered_and_empty(written: str, tmp_path: Path) -> None:
    rows = {"3": ROWS[0], "4": dict.fromkeys(COLUMNS), "6": ROWS[0]}
    content: object = rows
    if written == "columns":
        content = {title: {frame: row[title] for frame, row in rows.items()} for title in COLUMNS}
    elif written != "index":
        content = [{written: int(frame)} | row for frame, row in rows.items()]
    assert keypoints.read(write(tmp_path / "a.json", content)).frame.tolist() == [0, 3]


@pytest.mark.parametrize("within", [False, True])
def test_names_of_all_points_may_stand_once(within: bool, tmp_path: Path) -> None:
    stated = {"keypoint_names": NAMED[::-1], "people": ["bob"]}
    frames = [{"keypoints": MARKS[::-1, [0, 1, 3]].tolist()}] * 2
    content = {"meta": stated, "frames": frames} if within else {**stated, "frames": frames}
    assert keypoints.read(write(tmp_path / "a.json", content)).names == tuple(NAMED[::-1])


@pytest.mark.parametrize("left_out", [0, 1])
@pytest.mark.parametrize("kind", [int, float])
def test_numbers_of_points_are_their_names(left_out: int, kind: type[float], tmp_path: Path) -> None:
    marks = [mark | {"id": kind(k), "z": 0.1} for k, mark in enumerate(objects("visibility"))][
        :: 1 + left_out
    ]
    recording = keypoints.read(write(tmp_path / "a.json", [{"landmarks": marks}] * 2))
    assert recording.names == tuple(f"{mark['id']:.0f}" for mark in marks)
    mine = [{"landmarks": [mark | {"id": 7} for mark in marks]}] * 2  # whose, not which
    assert keypoints.read(write(tmp_path / "a.json", mine)).names == ()


def test_names_count_before_numbers(tmp_path: Path) -> None:
    marks = [mark | {"id": k} for k, mark in enumerate(objects("score"))]
    names = {"keypoint_id2name": {str(k): name for k, name in enumerate(NAMED)}}
    people = [{"frame_id": k, "instances": [{"keypoints": marks}]} for k in (1, 2)]
    content = {"meta_info": names, "instance_info": people}
    recording = keypoints.read(write(tmp_path / "a.json", content))
    assert recording.names == tuple(NAMED)
    np.testing.assert_allclose(recording.points[0], POINTS)
    frames = [
        {"landmarks": [{"id": 32 - k, "x": k + 1, "y": time + 1} for k in range(33)]} for time in range(2)
    ]
    recording = keypoints.read(write(tmp_path / "a.json", frames))
    assert (recording.format, recording.names[0], recording.names[-1]) == (
        "mediapipe",
        "right_foot_index",
        "nose",
    )


@pytest.mark.parametrize(("count", "width"), [(17, 2), (33, 4), (33, 3)])
def test_numbers_in_turn_are_two_three_or_four_of_a_point(count: int, width: int, tmp_path: Path) -> None:
    points = np.random.default_rng(0).uniform(0.1, 0.9, (count, width))
    recording = keypoints.read(
        write(tmp_path / "a.json", [{"frame": 0, "pose": points.ravel().tolist()}] * 2)
    )
    np.testing.assert_allclose(recording.points[0], points[:, :2])
    np.testing.assert_allclose(recording.confidence[0], points[:, -1] if width > 2 else 1.0)


@pytest.mark.parametrize("header", [{"fps": 25, "width": 640, "height": 480}, {"meta": {"fps": 25}}])
def test_the_first_of_the_lines_may_hold_settings(header: dict[str, object], tmp_path: Path) -> None:
    lines = [header, *({"frame": frame, **IN_TURN} for frame in (5, 7))]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, lines)) + "\n", encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.jsonl")
    assert (recording.n_frames, recording.frame.tolist(), recording.frame_rate_hz) == (3, [0, 2], 25.0)
    assert recording.image_size == ((640, 480) if "width" in header else (0, 0))


@pytest.mark.parametrize("first", [{"fps": 25, "frame": 0, **IN_TURN}, {"fps": 25} | ROWS[0]])
def test_the_first_of_the_lines_may_be_a_frame(first: dict[str, object], tmp_path: Path) -> None:
    lines = [
        first,
        {key: value for key, value in first.items() if key not in ("fps", "frame")} | {"frame": 1},
    ]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, lines)) + "\n", encoding="utf-8")
    assert len(keypoints.read(tmp_path / "a.jsonl").points) == 2


@pytest.mark.parametrize("second", ["5", "null"])
def test_a_line_that_is_no_frame_is_refused(second: str, tmp_path: Path) -> None:
    (tmp_path / "a.jsonl").write_text('{"fps": 25}\n' + second + "\n", encoding="utf-8")
    with rejects("unknown_keypoints"):
        keypoints.read(tmp_path / "a.jsonl")


def test_frames_that_are_none_hold_nobody(tmp_path: Path) -> None:
    recording = keypoints.read(write(tmp_path / "a.json", [5, {"keypoints": flat()}]))
    assert (recording.n_frames, recording.frame.tolist()) == (2, [1])


def test_names_of_joints_may_hold_how_sure_they_are(tmp_path: Path) -> None:
    axes = {title: value for title, value in ROWS[0].items() if title[-2:] != "_c"}
    recording = keypoints.read(write(tmp_path / "a.json", [dict.fromkeys(NAMED, 0.5) | axes] * 9))
    np.testing.assert_allclose(recording.points, [POINTS] * 9)
    np.testing.assert_allclose(recording.confidence, 0.5)


def test_what_stands_one_within_another_is_looked_at_once(tmp_path: Path) -> None:
    content: object = []
    for _ in range(40):
        content = {"keypoints": {"a": content}}
    with rejects("not_in_threes"):
        keypoints.read(write(tmp_path / "a.json", content))


@pytest.mark.parametrize("header", ["frame,tempo,time", "tempo,frame,time", "tempo,time,item,frame"])
def test_titles_that_mean_something_else_beside_others(header: str, tmp_path: Path) -> None:
    rows = [
        [{"frame": frame, "time": frame / 25}.get(title, 90) for title in header.split(",")]
        for frame in range(9)
    ]
    lines = [f"{header},hip_x,hip_y", *(",".join(map(str, [*row, 1, 2])) for row in rows)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.frame.tolist(), recording.frame_rate_hz) == ([*range(9)], 25.0)


@pytest.mark.parametrize("key", ["people", "tracks"])
@pytest.mark.parametrize(
    "who", [[{"id": 1}, {"id": 2}], [{"name": "1"}, {"name": "2"}], [{}, {"track_id": 2}]]
)
def test_a_list_of_people_with_frames(key: str, who: list[dict[str, object]], tmp_path: Path) -> None:
    frames = [MARKS[:, [0, 1, 3]].tolist()] * 9
    content = {"frameRate": 25, key: [first | {"frames": frames} for first in who]}
    recording = keypoints.read(write(tmp_path / "a.json", content))
    assert recording.frame.tolist() == np.repeat(range(9), 2).tolist()
    assert recording.identity.tolist() == ["1" if who[0] else "0", "2"] * 9
    assert recording.frame_rate_hz == 25.0


def test_names_that_are_joined_are_no_person(tmp_path: Path) -> None:
    content = {"edges": [["hip", "knee"], ["knee", "ankle"]], "bob": [MARKS[:, [0, 1, 3]].tolist()] * 9}
    assert set(keypoints.read(write(tmp_path / "a.json", content)).identity) == {"bob"}


def test_rate_and_size_within_a_json(tmp_path: Path) -> None:
    names = {f"p{k}": {"x": 0.1 * k, "y": 0.5, "visibility": 0.9} for k in range(17)}
    frames = [{"frame_idx": 0, "time_s": 0.0, "landmarks": names}, {"frame_idx": 1, "landmarks": {}}]
    meta = {"fps": 25.0, "width": 640, "height": 480, "n_frames": 2}
    recording = keypoints.read(write(tmp_path / "a.json", {"meta": meta, "subject": None, "frames": frames}))
    assert (recording.n_frames, recording.frame_rate_hz, recording.image_size) == (2, 25.0, (640, 480))


def test_mediapipe_as_json(tmp_path: Path) -> None:
    marks = [{"x": 0.1 + 0.01 * k, "y": 0.5, "z": 0.0, "visibility": 0.9} for k in range(33)]
    recording = keypoints.read(write(tmp_path / "a.json", {"fps": 30, "frames": [{"landmarks": marks}, {}]}))
    assert (recording.format, recording.n_frames, recording.frame_rate_hz) == ("mediapipe", 2, 30.0)
    assert recording.names == keypoints.MEDIAPIPE


def test_wide_and_long_tables_say_the_same(tmp_path: Path) -> None:
    wide, long = tmp_path / "wide.csv", tmp_path / "long.csv"
    wide.write_text(
        "frame,left_knee_x,left_knee_y,left_knee_score\n0,1,2,0.5\n1,,,\n2,3,4,0.7\n", encoding="utf-8"
    )
    long.write_text("frame,keypoint,x,y,score\n0,left_knee,1,2,0.5\n2,left_knee,3,4,0.7\n", encoding="utf-8")
    first, other = keypoints.read(wide), keypoints.read(long)
    assert first.names == other.names == ("left_knee",)
    assert first.frame.tolist() == other.frame.tolist() == [0, 2]
    np.testing.assert_array_equal(first.points, other.points)
    np.testing.assert_array_equal(first.confidence, other.confidence)


@pytest.mark.parametrize("frame", ["frame_idx", "frame_no", "Frame Number", "Frame No."])
@pytest.mark.parametrize(("suffix", "comma"), [("csv", ","), ("tsv", "\t"), ("txt", ";")])
def test_a_table_with_a_box_around_the_person(frame: str, suffix: str, comma: str, tmp_path: Path) -> None:
    rows = [
        f"video_name,{frame},x,y,w,h,left_knee_x,left_knee_y,left_knee_vis",
        "a,3,9,9,9,9,1,2,.5",
        "b,5,9,9,9,9,3,4,.7",
        "",
    ]
    path = tmp_path / f"a.{suffix}"
    path.write_text("\n".join(rows).replace(",", comma), encoding="utf-8")
    recording = keypoints.read(path)
    assert (recording.names, recording.frame.tolist(), *recording.identity) == (
        ("left_knee",),
        [3, 5],
        "a",
        "b",
    )
    np.testing.assert_array_equal(recording.points[:, 0], [[1, 2], [3, 4]])
    assert recording.confidence.tolist() == [[0.5], [0.7]]


@pytest.mark.parametrize(("title", "second"), [("timestamp", 1), ("time_ms", 1000), ("t_us", 10**6)])
def test_a_long_table_with_times_in_place_of_frames(tmp_path: Path, title: str, second: int) -> None:
    rows = [f"{t * second},{name},{x},2,0.5" for t, x in ((0.0, 1), (0.04, 3)) for name in ("hip", "knee")]
    (tmp_path / "a.csv").write_text("\n".join([f"{title},body_part,x,y,prob", *rows, ""]), encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.names, recording.frame.tolist(), recording.frame_rate_hz) == (
        ("hip", "knee"),
        [0, 1],
        25.0,
    )
    assert recording.points[:, 1].tolist() == [[1, 2], [3, 2]]


def test_rate_and_size_beside_a_table(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("left_knee_x,left_knee_y\n1,2\n3,4\n", encoding="utf-8")
    write(tmp_path / "a.json", {"fps": 25, "width": 640, "height": 480})
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.frame_rate_hz, recording.image_size) == (25.0, (640, 480))
    (tmp_path / "README.txt").write_text("whose film this is\n", encoding="utf-8")
    (tmp_path / "b.csv").mkdir()
    folder = keypoints.read(tmp_path)
    assert (folder.frame_rate_hz, folder.points.tolist()) == (25.0, recording.points.tolist())
    assert folder.notes[0] == "Only a.csv in the folder is read; other files, without keypoints: a.json."
    (tmp_path / "a.csv").write_text("time,left_knee_x,left_knee_y\nat once,1,2\n,3,4\n", encoding="utf-8")
    assert keypoints.read(tmp_path / "a.csv").frame_rate_hz == 25.0  # times say nothing more
    (tmp_path / "a.csv").write_text("time,x,y\n0,1,2\n1,3,4\n", encoding="utf-8")
    with rejects("no_frame_column"):
        keypoints.read(tmp_path / "a.csv")
    write(
        tmp_path / "a.json",
        [{"image_id": 0, "keypoints": [1, 2, 1]}, {"image_id": 1, "keypoints": [3, 4, 1]}],
    )
    assert keypoints.read(tmp_path).format == "alphapose"


@pytest.mark.parametrize(
    ("title", "unit"), [("time_s", 1), ("time", 1), ("time [ms]", 1000), ("timestamp", 1000), ("t", 10**7)]
)
def test_the_rate_of_a_table_is_that_of_most_steps(tmp_path: Path, title: str, unit: int) -> None:
    times = [unit * time for time in (0.0, 0.04, 0.08, 0.12, 1.2)]
    rows = "".join(f"{time},1,2\n" for time in times)
    (tmp_path / "a.csv").write_text(f"{title},left_knee_x,left_knee_y\n{rows}", encoding="utf-8")
    assert keypoints.read(tmp_path / "a.csv").frame_rate_hz == pytest.approx(25.0)


def timed(kind: str, times: Sequence[float | str], folder: Path, **more: float) -> keypoints.Detections:
    """Write points with time stamps to a file of the given kind, and read them.

    The columns of the points increase by one pixel per time stamp.
    """
    frames = [(k, time, (POINTS[:6] + np.array([k, 0.0])).tolist()) for k, time in enumerate(times)]
    path = folder / ("a.json" if kind == "json" else "a.csv")
    if kind == "json":
        rows = [{"timestamp": time, "keypoints": points} for _, time, points in frames]
        return keypoints.read(write(path, {**more, "frames": rows}))
    if kind == "long":
        lines = ["time,keypoint,x,y"]
        lines += [f"{time},p{n},{x},{y}" for _, time, points in frames for n, (x, y) in enumerate(points)]
    else:
        lines = [
            ("frame," if kind == "numbered" else "") + "time," + ",".join(f"p{n}_x,p{n}_y" for n in range(6))
        ]
        for k, time, points in frames:
            cells = ([7 + k] if kind == "numbered" else []) + [time, *np.ravel(points).tolist()]
            lines.append(",".join(map(str, cells)))
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    if more:
        write(folder / "a.json", more)
    return keypoints.read(path)


@pytest.mark.parametrize("kind", ["wide", "numbered", "long", "json"])
def test_gaps_in_time_are_missing_frames_and_uneven_times_are_places_between(
    kind: str, tmp_path: Path
) -> None:
    first = 7 if kind == "numbered" else 0
    result = timed(kind, [0.0, 0.04, 0.08, 0.6, 0.64], tmp_path)
    assert (result.frame_rate_hz, result.n_frames) == (25.0, 17 + first)
    assert (result.frame - first).tolist() == [0, 1, 2, 15, 16]
    assert result.notes == ("12 frames between the first and the last are missing or without people.",)
    uneven = timed(kind, [0.0, 0.04, 0.0704, 0.12, 0.52, 0.56], tmp_path)
    assert uneven.frame_rate_hz == 25.0
    np.testing.assert_allclose(uneven.frame - first, [0.0, 1.0, 1.76, 3.0, 13.0, 14.0])
    assert any("not evenly spaced" in note for note in uneven.notes)


@pytest.mark.parametrize("kind", ["wide", "numbered", "long", "json"])
def test_the_rate_is_the_camera_s_though_frames_are_lost_and_times_jitter(kind: str, tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    at = np.flatnonzero(generator.random(200) > 0.3)
    result = timed(kind, ((at + generator.uniform(-0.1, 0.1, len(at))) / 30.0).round(3).tolist(), tmp_path)
    assert result.frame_rate_hz == pytest.approx(30.0, rel=0.01)
    np.testing.assert_allclose(result.frame - result.frame[0], at - at[0], atol=0.6)


@pytest.mark.parametrize("kind", ["wide", "numbered", "json"])
def test_a_time_that_stands_twice_is_not_used(kind: str, tmp_path: Path) -> None:
    times = [k / 25 for k in range(40)]
    times[10] = times[9]
    result = timed(kind, times, tmp_path)
    assert (result.frame_rate_hz, np.diff(result.frame).tolist()) == (25.0, [1] * 39)
    assert "1 times repeat those of the row before, the first in a." in result.notes[0]
    times[20:24] = [times[19]] * 4
    with_rate = timed(kind, times, tmp_path, fps=30)
    assert with_rate.frame_rate_hz == 30.0
    assert any("The times are ignored" in note for note in with_rate.notes)


@pytest.mark.parametrize(
    ("key", "second"),
    [("timestamp_ms", 1e3), ("timeMs", 1e3), ("t_us", 1e6), ("timestamp_ns", 1e9), ("time_s", 1)],
)
def test_a_key_that_names_the_unit_of_times_is_believed(key: str, second: float, tmp_path: Path) -> None:
    rows = [{key: second * k / 1000.0, "keypoints": POINTS.tolist()} for k in range(9)]
    recording = keypoints.read(write(tmp_path / "a.json", rows))
    assert (recording.frame_rate_hz, recording.frame.tolist(), recording.notes) == (1000.0, [*range(9)], ())


@pytest.mark.parametrize("kind", ["wide", "numbered", "json"])
def test_frames_without_a_time_are_between_their_neighbours(kind: str, tmp_path: Path) -> None:
    result = timed(kind, [np.nan, 0.04, 0.08, np.nan, 0.16, 0.2, np.nan], tmp_path)
    assert (result.frame_rate_hz, set(np.diff(result.frame))) == (25.0, {1.0})


@pytest.mark.parametrize("kind", ["wide", "numbered", "json"])
def test_times_count_before_a_rate_that_is_declared_unless_they_are_none(kind: str, tmp_path: Path) -> None:
    assert timed(kind, [0.0, 0.0333, 0.0667, 0.1], tmp_path, fps=29.98).frame_rate_hz == 29.98
    result = timed(kind, [0.0, 0.1, 0.2, 0.3], tmp_path, fps=30)  # every third frame
    assert (result.frame_rate_hz, len(set(np.diff(result.frame)))) == (10.0, 1)
    assert "The times give 10 frames per second, not the declared 30." in result.notes
    for times in ([0.2, 0.1, 0.0], [0.0, 0.0, 0.1], [np.nan] * 3, ["a:b"] * 3):
        result = timed(kind, times, tmp_path, fps=30)
        assert (result.frame_rate_hz, np.diff(result.frame).tolist()) == (30.0, [1, 1])
        assert any("times are ignored" in note for note in result.notes)


@pytest.mark.parametrize(
    "written", ["deeplabcut", "sleap", "{who}_{part}_{axis}", "\"('{who}', '{part}', '{axis}')\""]
)
def test_tables_with_several_people(written: str, tmp_path: Path) -> None:
    parts, people = ("nose", "left_knee", "right_knee"), ("person1", "person2")
    if written == "sleap":
        lines = [
            "track,frame_idx,instance.score," + ",".join(f"{part}.x,{part}.y,{part}.score" for part in parts)
        ]
        lines += [f"{who},{t},.9," + ",".join(["1,2,.9"] * 3) for t in (0, 1) for who in people[: 2 - t]]
    else:
        columns = [(who, part, axis) for who in people for part in parts for axis in ("x", "y", "likelihood")]
        titles = ("individuals", "bodyparts", "coords")
        lines = [",".join(["scorer", *["net"] * 18])] + [
            ",".join([title, *cells]) for title, *cells in zip(titles, *columns, strict=True)
        ]
        if written != "deeplabcut":
            lines = ["frame," + ",".join(written.format(who=w, part=p, axis=a) for w, p, a in columns)]
        lines += [
            ",".join([str(t), *["1,2,.9"] * 3, *(["1,2,.9"] * 3 if t == 0 else [",,"] * 3)]) for t in (0, 1)
        ]
    (tmp_path / "a.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    observed = np.isfinite(recording.points).all(axis=(1, 2))
    assert recording.names == parts
    assert recording.frame[observed].tolist() == [0, 0, 1]
    assert recording.identity[observed].tolist() == ["person1", "person2", "person1"]
    np.testing.assert_array_equal(recording.points[observed], [[[1, 2]] * 3] * 3)


PEOPLE = {
    "lists": lambda frames: frames,
    "from the second frame on": lambda frames: [None, *frames[1:]],
    "numbered frames": lambda frames: {str(k): frame for k, frame in enumerate(frames)},
    "frames with a time": lambda frames: [
        {"timestamp": k / 25, "keypoints": frame} for k, frame in enumerate(frames)
    ],
    "within": lambda frames: {"fps": 25, "frames": frames},
    "named": lambda frames: [dict(zip(NAMED, frame, strict=True)) for frame in frames],
}


@pytest.mark.parametrize("written", PEOPLE)
@pytest.mark.parametrize("people", [["bob"], ["bob", "anna"], ["person1", "person2"]])
def test_a_json_may_begin_with_people(written: str, people: list[str], tmp_path: Path) -> None:
    frames = [MARKS[:, [0, 1, 3]].tolist()] * 9
    content = {"fps": 25, "edges": [[0, 1], [1, 2]], "keypoints_3d": [MARKS[:, :3].tolist()] * 9}
    recording = keypoints.read(
        write(tmp_path / "a.json", content | dict.fromkeys(people, PEOPLE[written](frames)))
    )
    first = int(written == "from the second frame on")
    assert recording.frame.tolist() == np.repeat(range(first, 9), len(people)).tolist()
    assert recording.identity.tolist() == people * (9 - first)
    np.testing.assert_allclose(recording.points, [POINTS] * len(recording.frame))
    assert (recording.frame_rate_hz, recording.names) == (25.0, tuple(NAMED) if written == "named" else ())


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_people_may_have_names_without_a_number(kind: str, tmp_path: Path) -> None:
    if kind == "json":
        frame = {who: MARKS[:, [0, 1, 3]].tolist() for who in ("bob", "anna")}
        recording = keypoints.read(write(tmp_path / "a.json", {"fps": 30, "frames": [frame] * 2}))
    else:
        titles = [
            f"{who}_{part}_{axis}"
            for who in ("bob", "anna")
            for part in ("left_knee", "right_knee")
            for axis in "xy"
        ]
        (tmp_path / "a.csv").write_text(f"{','.join(titles)}\n" + "1,2,3,4,5,6,7,8\n" * 2, encoding="utf-8")
        recording = keypoints.read(tmp_path / "a.csv")
        assert recording.names == ("left_knee", "right_knee")
    assert (recording.frame.tolist(), recording.identity.tolist()) == ([0, 0, 1, 1], ["bob", "anna"] * 2)


@pytest.mark.parametrize(
    ("worse", "better"), [("raw", "smooth"), ("", "filtered"), ("orig", ""), ("Raw", "interp")]
)
@pytest.mark.parametrize("written", ["{0}_{1}_{2}", "{1}_{0}_{2}", "{1}.{2}.{0}", "long"])
def test_raw_and_smoothed_points_are_one_person_s(
    written: str, worse: str, better: str, tmp_path: Path
) -> None:
    parts = ["left_knee", "right_knee"]
    if written == "long":
        titles = [
            "frame",
            "keypoint",
            *(f"{axis}_{word}".rstrip("_") for word in (better, worse) for axis in "xy"),
        ]
        rows = [f"{t},{part},1,2,3,4\n" for t in (0, 1) for part in parts]
    else:
        titles = [
            written.format(word, part, axis).strip("_.").replace("__", "_")
            for word in (better, worse)
            for part in parts
            for axis in "xy"
        ]
        rows = ["1,2,1,2,3,4,3,4\n"] * 2
    (tmp_path / "a.csv").write_text(",".join(titles) + "\n" + "".join(rows), encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.names, recording.identity.tolist()) == (tuple(parts), ["", ""])
    np.testing.assert_array_equal(recording.points, [[[1, 2]] * 2] * 2)
    assert recording.notes[0].startswith("Raw columns with a smoothed or filtered copy are not read: ")


@pytest.mark.parametrize(
    "names",
    [
        "left_hip left_knee right_hip right_knee",
        "hip_left hip_right knee_left knee_right",
        "L_knee R_knee",
        "near_hip near_knee far_hip far_knee",
        "lt_knee lt_hip rt_knee rt_hip",
        "raw_left_knee raw_right_knee",
    ],
)
def test_sides_and_joints_are_no_people(names: str, tmp_path: Path) -> None:
    titles = [f"{name}_{axis}" for name in names.split() for axis in "xy"]
    (tmp_path / "a.csv").write_text(
        f"{','.join(titles)}\n{','.join(map(str, range(len(titles))))}\n", encoding="utf-8"
    )
    assert keypoints.read(tmp_path / "a.csv").names == tuple(names.split())


def test_people_one_below_the_other_in_a_long_table_are_told_apart(tmp_path: Path) -> None:
    lines = [f"{t},{part},{who},7" for t in (0, 1) for who in (1, 2) for part in ("hip", "knee")]
    (tmp_path / "a.csv").write_text("\n".join(["frame,keypoint,x,y", *lines, ""]), encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.frame.tolist(), recording.points[:, 1, 0].tolist()) == ([0, 0, 1, 1], [1, 2, 1, 2])


@pytest.mark.parametrize(
    "cell", ["[{}, {}]", "({}, {}, 0.5)", "[{} {} -7 0.5]", "(np.float64({}), np.float64({}))"]
)
def test_cells_that_hold_a_point(cell: str, tmp_path: Path) -> None:
    rows = [f'{t},"{cell.format(1.5, 2)}","{cell.format(-3, "4e-1")}","[1, 2, 3, 4]"\n' for t in (0, 1)]
    (tmp_path / "a.csv").write_text(
        "frame,nose,left_knee,bbox\n" + "".join(rows) + "2,,,\n" * ("," in cell), encoding="utf-8"
    )
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.names, recording.frame.tolist()) == (("nose", "left_knee"), [0, 1])
    np.testing.assert_array_equal(recording.points, [[[1.5, 2], [-3, 0.4]]] * 2)
    assert set(recording.confidence.ravel().tolist()) == {0.5 if "0.5" in cell else 1.0}


@pytest.mark.parametrize(("titles", "noted"), [("x y z", True), ("x y z visibility", False), ("x y", False)])
def test_points_that_may_be_in_3d_are_remarked_on(titles: str, noted: bool, tmp_path: Path) -> None:
    header = ",".join(f"left_knee_{axis}" for axis in titles.split())
    row = ",".join("5678"[: len(titles.split())]) + "\n"
    (tmp_path / "a.csv").write_text(f"frame,{header}\n0,{row}1,{row}", encoding="utf-8")
    assert any("in 3D" in note for note in keypoints.read(tmp_path / "a.csv").notes) == noted


def test_names_of_people_that_have_other_points_are_names(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "frame,p1_a_x,p1_a_y,p1_b_x,p1_b_y,p2_b_x,p2_b_y\n0,1,2,3,4,5,6\n", encoding="utf-8"
    )
    assert keypoints.read(tmp_path / "a.csv").names == ("p1_a", "p1_b", "p2_b")


def test_names_that_are_not_as_many_as_the_points_are_none(tmp_path: Path) -> None:
    frames = [{"0": MARKS[:, [1, 0, 3]].tolist()}] * 2
    recording = keypoints.read(write(tmp_path / "a.json", {"keypoints": frames, "skeleton": {"0": "nose"}}))
    assert (recording.names, recording.identity.tolist()) == ((), ["0", "0"])


def test_all_frames_of_a_person_in_one_are_no_crowd(tmp_path: Path) -> None:
    content = [{"track_id": who, "keypoints": [MARKS[:, :2].tolist()] * 40} for who in (1, 2)]
    with rejects("too_many_people"):
        keypoints.read(write(tmp_path / "a.json", content))


def test_trc_in_pixels_and_no_other(tmp_path: Path) -> None:
    head = (
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n30\t30\t2\t1\t{unit}\n"
        "Frame#\tTime\tLKnee\t\t\n\t\tX1\tY1\tZ1\n1\t0\t5\t6\t0\n2\t0.03\t7\t8\t0\n"
    )
    path = tmp_path / "a.trc"
    path.write_text(head.format(unit="px"), encoding="utf-8")
    recording = keypoints.read(path)
    assert (recording.names, recording.frame_rate_hz, recording.n_frames) == (("LKnee",), 30.0, 2)
    assert recording.points[:, 0].tolist() == [[5.0, 6.0], [7.0, 8.0]]
    path.write_text(head.format(unit="m"), encoding="utf-8")
    with rejects("not_pixels", unit="m"):
        keypoints.read(path)


def test_trc_in_pixels_whose_rows_are_two_frames_apart(tmp_path: Path) -> None:
    head = (
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n60\t60\t20\t1\tpx\n"
        "Frame#\tTime\tLKnee\t\t\n\t\tX1\tY1\tZ1\n"
    )
    path = tmp_path / "a.trc"
    path.write_text(head + "".join(f"{2 * k}\t{k / 30}\t{k}\t6\t0\n" for k in range(20)), encoding="utf-8")
    recording = keypoints.read(path)
    assert (recording.frame_rate_hz, recording.n_frames, recording.frame.tolist()) == (
        30.0,
        20,
        list(range(20)),
    )
    assert recording.notes == (
        "All rows are 2 frames apart: their rate of 30 Hz is used instead of 60 Hz from the header or the option.",
    )
    path.write_text(head + "1\t0.1\t5\t6\t0\n2\t0.1\t7\t8\t0\n", encoding="utf-8")
    recording = keypoints.read(path)
    assert (recording.frame_rate_hz, recording.n_frames) == (60.0, 2)
    assert any(note.startswith("The times are ignored: a.trc, line 7: ") for note in recording.notes)


@pytest.mark.parametrize("people", [1, 2])
def test_a_table_whose_last_frame_is_cut(tmp_path: Path, people: int) -> None:
    points = ("left_knee", "right_knee", "left_hip", "right_hip")
    rows = [
        f"{frame},{who},{point},{frame + 10 * k + 1},{who + 2}\n"
        for frame in range(6)
        for who in range(people)
        for k, point in enumerate(points)
    ]
    path, whole = tmp_path / "a.csv", "frame,person,keypoint,x,y\n" + "".join(rows)
    path.write_text(whole, encoding="utf-8")
    assert keypoints.read(path).notes == ()
    path.write_text(whole.removesuffix("".join(rows[-3:])), encoding="utf-8")
    recording = keypoints.read(path)
    rest, every = 4 * people - 3, 4 * people
    assert recording.notes == (
        f"The last frame has {rest} rows, every other {every} or more: the file may be cut off.",
    )
    assert recording.n_frames == 6


@pytest.mark.parametrize(
    ("frames", "stated", "expected"),
    [([0, 2], 3, 3), ([0, 2], 9, 9), ([0, 2], 1, 3), ([0.0, 1.2, 2.7], 2, 3), ([4], 0, 5)],
)
def test_a_film_has_the_frames_that_are_stated_or_that_hold_people(
    frames: list[float], stated: int, expected: int
) -> None:
    rows = [(frame, "", np.column_stack([POINTS, np.ones(17)])) for frame in frames]
    unseen = (7.0, "", np.zeros((17, 3)))  # a row without a keypoint is a frame, too
    result = detections("csv", "a.csv", rows, stated)
    assert (result.n_frames, result.frame.tolist()) == (expected, frames)
    result = detections("csv", "a.csv", [*rows, unseen], stated)
    assert (result.n_frames, result.frame.tolist()) == (max(expected, 8), frames)


def test_an_array(tmp_path: Path) -> None:
    walk, path = np.stack([POINTS, POINTS + 1, POINTS + 2]), tmp_path / "a.npy"
    for array, people in ((walk, 1), (walk[None], 1), (walk[:, None], 1), (np.stack([walk, walk + 300]), 2)):
        np.save(path, array, allow_pickle=False)
        recording = keypoints.read(path)
        assert (recording.n_frames, recording.frame.tolist()) == (3, np.repeat(range(3), people).tolist())
        np.testing.assert_array_equal(recording.points[::people], walk)
    for array in (POINTS, walk.swapaxes(1, 2)):
        np.save(path, array, allow_pickle=False)
        with rejects("not_one_array"):
            keypoints.read(path)


def test_arrays_with_their_names_and_rate(tmp_path: Path) -> None:
    path, sure = tmp_path / "a.npz", np.full((2, 17), 0.5)
    np.savez(
        path,
        keypoints=np.stack([POINTS] * 2),
        scores=sure,
        names=np.array(NAMED),
        fps=30,
        width=640,
        height=480,
    )
    recording = keypoints.read(path)
    assert (recording.frame_rate_hz, recording.image_size, recording.names) == (
        30.0,
        (640, 480),
        tuple(NAMED),
    )
    np.testing.assert_array_equal(recording.confidence, sure)


@pytest.mark.parametrize("written", ["{} ({})", "{}_{}_px", "{1}_{0}", "{}{}", "{} {} [pixels]"])
def test_columns_of_a_table_by_whatever_titles(written: str, tmp_path: Path) -> None:
    titles = [written.format(name, axis) for name in ("left_knee", "nose") for axis in ("x", "y", "score")]
    (tmp_path / "a.csv").write_text(
        f"frame,{','.join(titles)}\n0,1,2,.5,3,4,.5\n1,1,2,,3,4,.5\n", encoding="utf-8"
    )
    recording = keypoints.read(tmp_path / "a.csv")
    assert recording.names == ("left_knee", "nose")
    np.testing.assert_array_equal(recording.points[0], [[1, 2], [3, 4]])
    np.testing.assert_array_equal(recording.confidence, [[0.5, 0.5], [0, 0.5]])


@pytest.mark.parametrize("nothing", ["", "0"])
def test_a_confidence_that_was_never_written_is_not_given(nothing: str, tmp_path: Path) -> None:
    rows = f"0,1,2,{nothing}\n1,3,4,{nothing}\n"
    (tmp_path / "a.csv").write_text(
        f"frame,left_knee_x,left_knee_y,left_knee_score\n{rows}", encoding="utf-8"
    )
    recording = keypoints.read(tmp_path / "a.csv")
    assert recording.confidence.tolist() == [[1.0], [1.0]]
    assert "The confidence is empty or 0 throughout, and is ignored." in recording.notes


@pytest.mark.parametrize("title", ["frame", "image", "Frame ID"])
@pytest.mark.parametrize("name", ["frame_{:06d}.png", "walk2/{}.jpg", "{:03d}.jpg"])
def test_frames_may_be_numbered_by_names_of_images(title: str, name: str, tmp_path: Path) -> None:
    rows = [f"{name.format(frame)},1,2\n" for frame in (12, 14, 15)]
    (tmp_path / "a.csv").write_text(f"{title},left_knee_x,left_knee_y\n{''.join(rows)}", encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.frame.tolist(), recording.n_frames) == ([0, 2, 3], 4)


def test_pixels_with_their_unit_and_titles_again(tmp_path: Path) -> None:
    title = "frame,left_knee_x,left_knee_y\n"
    text = f"{title}0,312.0px,1px\n1,missing,3\n{title}2,5 px,7px\n3,#REF!,\n"
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    recording = keypoints.read(tmp_path / "a.csv")
    assert (recording.frame.tolist(), recording.points[:, 0].tolist()) == ([0, 2], [[312, 1], [5, 7]])
    assert recording.notes[0] == "The titles are repeated below: does the file contain several tables?"


def test_a_folder_of_several_tables_is_refused(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text("left_knee_x,left_knee_y\n1,2\n3,4\n", encoding="utf-8")
    with rejects("several_films", files=["a.csv", "b.csv"]):
        keypoints.read(tmp_path)


def test_depths_are_no_confidence(tmp_path: Path) -> None:
    write(tmp_path / "a.json", [{"frame": k, "landmarks": MARKS[:, :3].tolist()} for k in (0, 1)])
    recording = keypoints.read(tmp_path / "a.json")
    assert (recording.confidence == 1).all()
    assert any("depths, not confidences" in note for note in recording.notes)


@pytest.mark.parametrize("objects", [False, True])
def test_points_in_3d_are_remarked_on(objects: bool, tmp_path: Path) -> None:
    """A note reports that points in 3D, here in mm from a depth camera, are not keypoints of a film."""
    marks = [[x, y, 2000.0 + k] for k, (x, y) in enumerate(POINTS.tolist())]
    points = [dict(zip("xyz", mark, strict=True)) for mark in marks] if objects else marks
    recording = keypoints.read(write(tmp_path / "a.json", [{"frame": k, "joints": points} for k in (0, 1)]))
    assert (recording.confidence == 1).all()
    assert any("they are not keypoints of a film: see `inspect`" in note for note in recording.notes)


@pytest.mark.parametrize("missing", [(0.0, 0.0, 0.9), (-1.0, -1.0, 0.9), (5.0, 5.0, 0.0), (np.nan, 1.0, 1.0)])
def test_what_is_missing_is_nan(missing: tuple[float, float, float], tmp_path: Path) -> None:
    values = np.array(flat()).reshape(-1, 3)
    values[3] = missing
    row = {"image_id": "1.jpg", "keypoints": np.where(np.isnan(values), None, values).ravel().tolist()}
    recording = keypoints.read(write(tmp_path / "a.json", [row]))
    assert np.isnan(recording.points[0, 3]).all()
    assert recording.confidence[0, 3] == 0
    assert np.isfinite(recording.points[0, [2, 4]]).all()


@pytest.mark.parametrize(
    ("content", "code"),
    [
        ([{"image_id": "1", "keypoints": [1, 2]}], "not_in_threes"),
        ([{"image_id": "1", "keypoints": ["a", 2, 3]}], "not_number"),
        ([{"image_id": "1", "keypoints": [0] * 51}], "nothing_measured"),
        (
            [{"image_id": "1", "keypoints": [1] * 51}, {"image_id": "2", "keypoints": [1] * 54}],
            "point_counts_differ",
        ),
        ({"people": []}, "one_frame"),
        ({"a": 1}, "unknown_keypoints"),
        ([], "unknown_keypoints"),
        ({"instance_info": [{"frame_id": 0, "instances": []}]}, "nobody_seen"),
    ],
)
def test_what_is_no_keypoints_is_refused(content: object, code: str, tmp_path: Path) -> None:
    with rejects(code):
        keypoints.read(write(tmp_path / "a.json", content))


def test_files_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{", encoding="utf-8")
    with rejects("not_json"):
        keypoints.read(tmp_path / "a.json")
    with rejects("no_file"):
        keypoints.read(tmp_path / "b.json")
    (tmp_path / "a.xyz").write_text("1", encoding="utf-8")
    with rejects("unknown_format", suffix=".xyz"):
        keypoints.read(tmp_path / "a.xyz")
    (tmp_path / "empty").mkdir()
    with rejects("no_recordings"):
        keypoints.read(tmp_path / "empty")


@given(cut=st.integers(1, 400))
def test_a_truncated_file_is_refused_in_a_sentence(
    cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = json.dumps([{"image_id": "1.jpg", "keypoints": flat(), "idx": 1}] * 2)
    path = tmp_path_factory.mktemp("cut") / "a.json"
    path.write_text(text[: min(cut, len(text) - 1)], encoding="utf-8")
    with pytest.raises(InvalidInput):
        keypoints.read(path)


def test_numbers_of_frames_and_people() -> None:
    assert frames_by_name(["walk2_000014_keypoints.json", "walk2_000012_keypoints.json"])[0] == {
        "walk2_000014_keypoints.json": 2, "walk2_000012_keypoints.json": 0,
    }  # fmt: skip
    of_layout = ["9_keypoints_25.json", "10_keypoints_25.json"]
    assert frames_by_name(of_layout) == (dict(zip(of_layout, (0, 1), strict=True)), [])
    in_order, (note,) = frames_by_name(["walk_7.json", "walk.json"])
    assert (list(in_order.values()), "order of the names" in note) == ([0, 1], True)
    assert identity_of([[3]]) == "3"
    assert identity_of(True) == ""


@pytest.mark.parametrize("number", [999.0, -999.0, 9999.0, 1e6])
def test_gaps_may_be_written_as_a_number_that_is_no_place(tmp_path: Path, number: float) -> None:
    walk = np.stack([POINTS + 3.0 * frame for frame in range(4)])
    walk[1, 9] = walk[2, 9] = walk[3] = number
    walk[0, 2] = walk[1, 2] = 20.0  # a place again and again
    np.save(tmp_path / "a.npy", walk, allow_pickle=False)
    recording = keypoints.read(tmp_path / "a.npy")
    assert np.argwhere(np.isnan(recording.points[:3, :, 0])).tolist() == [[1, 9], [2, 9]]
    assert np.isnan(recording.points[3:]).all()
    assert (recording.confidence[3:] == 0).all()
    assert f"19 keypoints are {number:.6g} in both coordinates and count as missing." in recording.notes


def test_people_of_one_time_without_a_frames_number_are_in_one_frame(tmp_path: Path) -> None:
    points = [[100.0 + k, 200.0 + 3 * k, 0.9] for k in range(17)]
    items = [
        {"timestamp": number / 30, "person_id": who, "keypoints": points}
        for number in range(20)
        for who in ("1", "2")
    ]
    (tmp_path / "walk.json").write_text(json.dumps(items))
    recording = keypoints.read(tmp_path / "walk.json")
    assert recording.frame.tolist() == np.repeat(np.arange(20), 2).tolist()
    assert recording.frame_rate_hz == pytest.approx(30.0, rel=1e-3)


def test_a_crowd_in_every_frame_is_not_taken_for_people_with_their_frames(tmp_path: Path) -> None:
    crowd = {str(frame): [{"keypoints": MARKS[:, [0, 1, 3]].ravel().tolist()}] * 43 for frame in range(40)}
    with rejects("too_many_people", people=43):
        keypoints.read(write(tmp_path / "a.json", crowd))


@pytest.mark.parametrize("width", [10**8, 10**30])
def test_a_picture_of_an_impossible_size_is_rejected(tmp_path: Path, width: int) -> None:
    (tmp_path / "walk.csv").write_text("frame,left_knee_x,left_knee_y\n0,1,2\n1,3,4\n")
    (tmp_path / "walk.json").write_text(f'{{"frame_rate_hz": 30, "width": {width}, "height": 480}}')
    with rejects("out_of_range", "walk.csv"):
        keypoints.read(tmp_path / "walk.csv")
