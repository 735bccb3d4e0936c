"""Tests of the processing of videos, with and without the pose networks."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import struct
import subprocess
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from pipeline.palette import rgb_colour
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput
from tests.rejects import rejects
from walk3d.film import keypoints
from walk3d.film.reconstruct.clip import Input, reconstruct_clip
from walk3d.film.reconstruct.video import is_video, with_keypoints
from walk3d.film.video import cached, film, networks, small
from walk3d.film.video.film import frame_rate, on_even_grid, pictures
from walk3d.film.video.overlay import SIDE_COLOURS, side_of, write_overlay
from walk3d.film.video.pose import LANDMARKS, Pose, _shared, _to_square, anchors, region_of


def test_anchors_are_those_of_three_grids() -> None:
    result = anchors()
    assert result.shape == (2254, 2)
    assert np.allclose(result[0], 0.5 / 28)
    assert np.allclose(result[-1], 1.0 - 0.5 / 7)
    assert np.allclose(result[2], [1.5 / 28, 0.5 / 28])  # columns first


@pytest.mark.parametrize("turn", [0.0, 0.4, -2.0])
def test_a_region_maps_its_centre_to_the_middle_and_its_rim_above_it(turn: float) -> None:
    centre, radius = np.array([300.0, 200.0]), 80.0
    rim = centre + radius * np.array([np.sin(turn), -np.cos(turn)])
    region = region_of(centre, rim)
    square = _to_square(region, 256)
    assert region[3] == pytest.approx(turn)
    assert np.allclose(square @ [*centre, 1.0], 128.0)
    assert np.allclose(square @ [*rim, 1.0], [128.0, 128.0 - 256.0 / 2.5])


def test_people_who_are_small_are_sought_in_squares_that_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[np.ndarray] = []

    def within(self: Pose, picture: np.ndarray, window: np.ndarray) -> list[np.ndarray]:
        looked.append(window)
        return [window] * (len(looked) == 3)

    monkeypatch.setattr(Pose, "_within", within)
    pose, picture = Pose.__new__(Pose), np.zeros((1080, 1920, 3), dtype=np.uint8)
    assert pose.detect(picture) == []
    (result,) = pose.detect(picture, closer=True)
    assert result[2] == 960.0
    assert len(looked) == 1 + 1 + 6
    covered = np.zeros((1080, 1920), dtype=bool)
    for x, y, side, _ in np.array(looked[2:], dtype=int):
        covered[max(y - side // 2, 0) : y + side // 2, max(x - side // 2, 0) : x + side // 2] = True
    assert covered.all()


def test_boxes_share_their_intersection_over_their_union() -> None:
    box = np.array([0.0, 0.0, 2.0, 1.0])
    assert _shared(box, box) == pytest.approx(1.0)
    assert _shared(box, box + np.array([1.0, 0.0, 1.0, 0.0])) == pytest.approx(1.0 / 3.0)
    assert _shared(box, box + 5.0) == 0.0


def test_uneven_time_stamps_are_put_on_an_even_grid_and_long_gaps_stay_open() -> None:
    times = np.array([0.0, 0.04, 0.07, 0.12, 0.16, 0.5, 0.54])
    rate, uneven = frame_rate(times, 30.0)
    assert uneven
    at = times * rate
    points = np.repeat(at[:, None, None], LANDMARKS, axis=1) * np.array([1.0, 2.0, 0.0])
    frame, person, result = on_even_grid(at, np.zeros(len(at), dtype=int), points)
    assert np.allclose(result[..., 0], frame[:, None])
    assert np.allclose(result[..., 1], 2.0 * frame[:, None])
    assert set(person) == {0}
    assert not {5, 6, 7, 8, 9, 10, 11} & set(frame.tolist())
    assert frame_rate(np.zeros(4), 25.0) == (25.0, False)


def test_a_film_that_hangs_upside_down_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    body = np.zeros((LANDMARKS, 3))
    body[list(map(keypoints.MEDIAPIPE.index, ("left_hip", "right_hip", "left_ankle", "right_ankle"))), 1] = (
        300.0,
        300.0,
        700.0,
        700.0,
    )
    picture = np.zeros((720, 480, 3), dtype=np.uint8)
    monkeypatch.setattr(film, "frames_of", lambda _: (2, 30.0))
    lying = np.column_stack([body[:, 1], -0.1 * body[:, 1], body[:, 2]])
    for points, upright in ((body, True), (lying, True), (body * [1, -1, 1], False)):
        frames = [(at, picture, {0: points}) for at in (0.0, 1 / 30)]
        monkeypatch.setattr(film, "followed", lambda *_, frames=frames: iter(frames))
        with nullcontext() if upright else rejects("upside_down", "walk.mp4"):
            assert film.keypoints_of(Path("walk.mp4"), Pose.__new__(Pose)).width == 480


def rewritten(content: bytes, change: Callable[[bytes, bytes], bytes]) -> bytes:
    """Return the boxes of an MP4 file, after a change of the bodies of all boxes that contain no other boxes."""
    written, at = b"", 0
    while at < len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        body = content[at + 8 : at + size]
        holds = kind in (b"moov", b"trak", b"mdia", b"minf", b"stbl")
        body = rewritten(body, change) if holds else change(kind, body)
        written += struct.pack(">I4s", len(body) + 8, kind) + body
        at += size
    return written


def grey_film(path: Path, count: int = 20) -> None:
    """Write a film in which the image number n has the brightness 10 n."""
    cv2 = pytest.importorskip("cv2")
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 30, (720, 480))
    for number in range(count):
        writer.write(np.full((480, 720, 3), 10 * number, dtype=np.uint8))
    writer.release()


def test_key_frames_are_parts_of_some_frames(tmp_path: Path) -> None:
    cv2 = pytest.importorskip("cv2")
    grey_film(tmp_path / "film.mp4")
    chosen = np.array([3, 8, 13, 18])
    pictures = small.small_pictures(film.numbered(tmp_path / "film.mp4"), chosen)
    assert list(pictures) == chosen.tolist()
    assert {picture.shape for picture in pictures.values()} == {(426, 640, 3)}
    points = np.full((4, 15, 2), [300.0, 100.0])
    points[:, 0, 1] += 200.0
    part = small.walkers_part(points, np.array([720.0, 480.0]))
    np.testing.assert_allclose(
        part, [260 / 720, 60 / 480, 340 / 720, 340 / 480]
    )  # a fifth of the height on each side
    for number, content in small.key_frames(pictures, part):
        picture = cv2.imdecode(np.frombuffer(base64.b64decode(content), dtype=np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (248, 72, 3)  # even sides
        assert picture.mean() == pytest.approx(10 * number, abs=6.0)


def test_key_frames_of_ten_seconds_fit_the_page() -> None:
    """Key frames of ten seconds of noise, which JPEG compresses least, are small enough for the page."""
    pytest.importorskip("cv2")
    generator = np.random.default_rng(1)
    pictures = {number: generator.integers(0, 256, (360, 640, 3), np.uint8) for number in range(300)}
    chosen = small.key_frames(pictures, (0.0, 0.0, 1.0, 1.0))
    assert 5 <= len(chosen) <= 20
    assert sum(len(content) for _, content in chosen) <= 600_000
    plain = {number: np.full((360, 640, 3), 90, np.uint8) for number in range(300)}
    assert len(small.key_frames(plain, (0.0, 0.0, 1.0, 1.0))) == 75


def test_the_small_film_is_the_pictures_in_order(tmp_path: Path) -> None:
    """The reduced film contains the images in order, with their times.

    The viewer reads it as a video; OpenCV reads it as an animated image after a change of its type.
    """
    cv2 = pytest.importorskip("cv2")
    content = small.film_of([np.full((48, 64, 3), 30 * n, np.uint8) for n in range(8)], 25.0)
    times = rr.AssetVideo(contents=content, media_type="video/mp4").read_frame_timestamps_nanos()
    assert times.tolist() == [40_000_000 * n for n in range(8)]
    (tmp_path / "a.avif").write_bytes(content.replace(b"vide", b"pict", 1))
    _, animation = cv2.imreadanimation(str(tmp_path / "a.avif"))
    np.testing.assert_allclose(
        [frame[..., :3].mean() for frame in animation.frames], 30.0 * np.arange(8), atol=4.0
    )


def test_pictures_of_an_uneven_film_are_those_nearest_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    times = [0.0, 0.04, 0.07, 0.2, 0.24]
    uneven = [(time, np.full((2, 2, 3), n)) for n, time in enumerate(times)]
    monkeypatch.setattr(film, "pictures", lambda _: iter(uneven))
    result = [(number, int(picture[0, 0, 0])) for number, picture in film.numbered(Path("a.mp4"), 25.0)]
    assert result == [(0, 0), (1, 1), (2, 2), (3, 3), (4, 3), (5, 3), (6, 4)]
    assert [number for number, _ in film.numbered(Path("a.mp4"))] == [0, 1, 2, 3, 4]


def test_the_overlay_has_the_colours_of_the_page(tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    joints = np.full((15, 2), np.nan)
    for (a, b), row in zip(((9, 10), (12, 13), (0, 1)), (40.0, 80.0, 120.0), strict=True):
        joints[a], joints[b] = (20.0, row), (140.0, row)
    bones = {
        bone: SIDE_COLOURS[side_of(WALKER15.joints[j] for j in bone)] for bone in ((9, 10), (12, 13), (0, 1))
    }
    frames = [(n, np.full((160, 160, 3), 90, np.uint8)) for n in range(3)]
    dots = np.array([[80.0, 20.0]])
    write_overlay(tmp_path / "o.mp4", frames, 30.0, bones, {1: dots}, {1: joints})
    _, (before, picture, _) = zip(*pictures(tmp_path / "o.mp4"), strict=True)
    assert np.abs(before.astype(int) - 90).max() < 8
    for row, name in ((40, "blue"), (80, "orange"), (120, "silver")):
        np.testing.assert_allclose(picture[row, 60:100].mean(axis=0), rgb_colour(name), atol=30.0)
    assert picture[20, 80].min() > 170


@pytest.mark.parametrize(
    ("matrix", "corner"),
    [
        ((1, 0, 0, 1, 0, 0), (0, 0)),
        ((0, 1, -1, 0, 48, 0), (0, 1)),
        ((-1, 0, 0, -1, 64, 48), (1, 1)),
        ((0, -1, 1, 0, 0, 64), (1, 0)),
    ],
    ids=["0", "90", "180", "270"],
)
def test_a_phones_film_is_upright_and_keeps_its_time_stamps(
    matrix: tuple[int, ...], corner: tuple[int, int], tmp_path: Path
) -> None:
    """A video that is rotated by the matrix in its file is upright, and keeps its time stamps.

    One frame of twenty lasts three times as long as the others.
    """
    cv2 = pytest.importorskip("cv2")
    path = tmp_path / "film.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 30, (64, 48))
    picture = np.zeros((48, 64, 3), dtype=np.uint8)
    picture[:24, :32] = 255
    for _ in range(20):
        writer.write(picture)
    writer.release()

    def as_a_phone_writes(kind: bytes, body: bytes) -> bytes:
        if kind == b"tkhd":
            a, b, c, d, x, y = (value << 16 for value in matrix)
            return body[:40] + struct.pack(">9i", a, b, 0, c, d, 0, x, y, 1 << 30) + body[76:]
        if kind == b"stts":
            count, step = struct.unpack_from(">2I", body, 8)
            return body[:4] + struct.pack(">7I", 3, 10, step, 1, 3 * step, count - 11, step)
        return body

    path.write_bytes(rewritten(path.read_bytes(), as_a_phone_writes))
    times, displayed = zip(*pictures(path), strict=True)
    upright = displayed[5][..., 0]
    assert upright.shape == ((48, 64) if matrix[0] else (64, 48))
    rows, columns = np.array(upright.shape) // 2
    quarters = [
        upright[:rows, :columns],
        upright[:rows, columns:],
        upright[rows:, :columns],
        upright[rows:, columns:],
    ]
    assert int(np.argmax([quarter.mean() for quarter in quarters])) == 2 * corner[0] + corner[1]
    steps = np.diff(times) * 30
    assert len(steps) >= 17  # the file's edit list is of the duration before
    np.testing.assert_allclose(steps, np.where(np.arange(len(steps)) == 10, 3.0, 1.0), atol=0.02)
    assert frame_rate(np.array(times), 30.0) == (pytest.approx(30.0), True)


def test_keypoints_of_the_same_film_are_taken_from_an_earlier_run(tmp_path: Path) -> None:
    film = tmp_path / "walk.mp4"
    film.write_bytes(b"not looked at")
    earlier = tmp_path / "earlier"
    earlier.mkdir()
    names = keypoints.MEDIAPIPE
    heading = ",".join(f"{name}_{what}" for name in names for what in ("x", "y", "visibility"))
    (earlier / cached.TABLE).write_text(f"frame,person,{heading}\n0,0,{','.join(map(str, range(1, 100)))}\n")
    about = {
        "sha256": hashlib.sha256(film.read_bytes()).hexdigest(),
        "frame_rate_hz": 30.0,
        "width": 640,
        "height": 480,
    }
    (earlier / cached.ABOUT).write_text(json.dumps(about))
    inputs = Input(path=str(film))
    assert is_video(inputs)
    with with_keypoints(inputs, earlier) as result:
        read = keypoints.read(result.path)
    assert (read.frame_rate_hz, read.image_size) == (30.0, (640, 480))
    assert result.layout == "mediapipe33"
    film.write_bytes(b"another film")
    with pytest.raises(InvalidInput), with_keypoints(inputs, earlier):
        pass  # cannot be opened, or nothing is installed that could


def test_files_other_than_the_published_ones_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(networks.CACHE, str(tmp_path))
    networks.folder().mkdir()
    for name in networks.FILES:
        (networks.folder() / name).write_bytes(b"something else")
    with rejects("wrong_digest"):
        networks.networks()


def test_networks_that_do_not_come_are_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(networks.CACHE, str(tmp_path))

    def nothing(*_: object, **__: object) -> None:
        raise subprocess.TimeoutExpired("pip", networks.WAIT_S)

    monkeypatch.setattr(networks.subprocess, "run", nothing)
    with rejects("not_fetched", output="nothing within 600 s"):
        networks.networks()
    assert list(networks.folder().iterdir()) == []


@pytest.mark.thorough
def test_a_film_of_a_walk_is_found_and_one_of_squats_is_none(tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    pytest.importorskip("ai_edge_litert")
    folder = os.environ.get("KEYPOINTS_RECORDINGS")
    if not folder or not all((networks.folder() / name).is_file() for name in networks.FILES):
        pytest.skip("needs films (KEYPOINTS_RECORDINGS) and the pose networks")
    film = Path(folder) / "mediapipe_oblique_with_truth" / "video.mp4"
    with with_keypoints(Input(path=str(film))) as result:
        walk = reconstruct_clip(result)
    assert walk.best.judgement.verdict == "walk"
    assert walk.best.reconstruction is not None
    assert np.degrees(walk.best.reconstruction.candidates[0].heading_rad) == pytest.approx(-45.0, abs=8.0)
