"""Keypoints of all people in a video: detection of people, tracking from frame to frame, and landmarks.

The landmarks of one frame give the square about the person in the next.  Every `DETECT_EVERY` frames, and whenever no
person is tracked, the detector looks for others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.validation import InvalidInput
from walk3d.film.video.pose import MIN_SCORE, Pose, silent

DETECT_EVERY = 15
"""Number of frames between two searches for new people in a video."""
MAX_PEOPLE = 4
SAME_PERSON_SHARE = 0.25
"""Distance between the centres of two squares around people below which both squares belong to the same person.

It is relative to the side of the larger square.
"""
STEP_TOLERANCE = 0.2
"""Relative deviation of a time step from the median step above which the video is resampled to uniform steps."""
MAX_GAP_FRAMES = 3.0
"""Longest gap over which keypoints are interpolated, in frames of the resampled video."""
_SHOULDERS, _HIPS = slice(11, 13), slice(23, 25)
"""Indices of the shoulders and of the hips among the 33 landmarks."""


@dataclass(frozen=True)
class Filmed:
    """Keypoints of all people in a video.

    Attributes
    ----------
    frame_rate_hz : float
    width, height : int
        Size of the upright picture, px.
    frame, person : (N,) int
    points : (N, 33, 3)
        Column, row, px, and visibility, 0 to 1.
    uneven : bool
        True if the frames were unevenly spaced and were resampled to an even grid.
    """

    frame_rate_hz: float
    width: int
    height: int
    frame: np.ndarray
    person: np.ndarray
    points: np.ndarray
    uneven: bool


def pictures(path: Path) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the time, s, and the upright RGB image (H, W, 3) of each frame of a video.

    Raises
    ------
    InvalidInput
        If the video cannot be opened.
    """
    import cv2

    with silent():
        video = cv2.VideoCapture(str(path))
    try:
        if not video.isOpened():
            raise InvalidInput(
                "the video cannot be opened",
                path.name,
                "a video file that FFmpeg can read",
                code="unreadable",
            )
        while True:
            has_picture, picture = video.read()
            if not has_picture:
                return
            yield video.get(cv2.CAP_PROP_POS_MSEC) / 1000.0, cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
    finally:
        video.release()


def numbered(path: Path, resampled_hz: float = 0.0) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the index and the image of each frame of a video.

    Parameters
    ----------
    path : Path
    resampled_hz : float
        Frames per second of the even grid of a video with uneven frames, whose pictures are then the nearest in time;
        0 for a video with even frames.
    """
    start, following = 0.0, 0
    for index, (time_s, picture) in enumerate(pictures(path)):
        if not resampled_hz:
            yield index, picture
            continue
        start = time_s if index == 0 else start
        last = round((time_s - start) * resampled_hz)
        yield from ((number, picture) for number in range(following, last + 1))
        following = max(following, last + 1)


def frames_of(path: Path) -> tuple[int, float]:
    """Return the number of frames, 0 if unknown, and the frame rate, Hz, that a video file states."""
    import cv2

    with silent():
        video = cv2.VideoCapture(str(path))
    count_and_rate = max(int(video.get(cv2.CAP_PROP_FRAME_COUNT)), 0), float(video.get(cv2.CAP_PROP_FPS))
    video.release()
    return count_and_rate


def followed(path: Path, pose: Pose) -> Iterator[tuple[float, np.ndarray, dict[int, np.ndarray]]]:
    """Yield, for each frame, its time, s, its image, and the landmarks (33, 3) of each tracked person."""
    regions: dict[int, np.ndarray] = {}
    next_number = 0
    for number, (time_s, picture) in enumerate(pictures(path)):
        if not regions or number % DETECT_EVERY == 0:
            for region in pose.detect(picture, closer=number % DETECT_EVERY == 0):
                if len(regions) < MAX_PEOPLE and not any(_same(region, other) for other in regions.values()):
                    regions[next_number] = region
                    next_number += 1
        landmarks: dict[int, np.ndarray] = {}
        next_regions: dict[int, np.ndarray] = {}
        for person, region in regions.items():
            points, following, score = pose.place(picture, region)
            if score >= MIN_SCORE and not any(_same(following, other) for other in next_regions.values()):
                next_regions[person], landmarks[person] = following, points
        regions = next_regions
        yield time_s, picture, landmarks


def _same(region: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.hypot(*(region[:2] - other[:2])) < SAME_PERSON_SHARE * max(region[2], other[2]))


def keypoints_of(path: Path, pose: Pose, progress: Callable[[int], None] = lambda _: None) -> Filmed:
    """Return the keypoints of all people in a video.

    Parameters
    ----------
    path : Path
    pose : Pose
    progress : callable
        Called with the number of processed frames.

    Raises
    ------
    InvalidInput
        If the video cannot be read, shows no person, or shows people upside down, whose mirror images would be
        detected.
    """
    times: list[float] = []
    detections: list[tuple[int, int, np.ndarray]] = []
    size = (0, 0)
    for number, (time_s, picture, people) in enumerate(followed(path, pose)):
        times.append(time_s)
        size = picture.shape[1], picture.shape[0]
        detections += [(number, person, points) for person, points in people.items()]
        progress(number + 1)
    if not detections:
        expected = "people of a tenth of its longer side or more"
        raise InvalidInput(
            "no person is visible in the video",
            path.name,
            expected,
            f"{len(times)} frames",
            code="nobody_seen",
        )
    rate, uneven = frame_rate(np.array(times), frames_of(path)[1])
    frame, person = (np.array([detection[k] for detection in detections]) for k in (0, 1))
    points = np.stack([detection[2] for detection in detections])
    trunk = points[:, _SHOULDERS] - points[:, _HIPS]
    if np.median(trunk[..., 1] - np.abs(trunk[..., 0])) > 0:  # except people who lie
        raise InvalidInput(
            "people are upside down in the film", path.name, "the film, rotated by 180°", code="upside_down"
        )
    if uneven:
        at = (np.array(times)[frame] - times[0]) * rate
        frame, person, points = on_even_grid(at, person, points)
    return Filmed(rate, *size, frame, person, points, uneven)


def frame_rate(times: np.ndarray, stated_hz: float) -> tuple[float, bool]:
    """Return the frame rate, Hz, from time stamps (n,), s, and whether the stamps are non-uniform.

    If the time stamps do not increase, the frame rate is the one that the file states.

    Examples
    --------
    >>> frame_rate(np.array([0.0, 0.04, 0.08, 0.12]), 30.0)
    (25.0, False)
    >>> frame_rate(np.array([0.0, 0.04, 0.08, 0.16, 0.2]), 30.0)
    (25.0, True)
    """
    steps = np.diff(times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if usual <= 0:
        return stated_hz, False
    uneven = bool((np.abs(steps - usual) > STEP_TOLERANCE * usual).any())
    rate = 1.0 / usual if uneven else (len(times) - 1) / float(times[-1] - times[0])
    return round(rate, 4), uneven


def on_even_grid(
    at: np.ndarray, person: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Interpolate the points of each person at whole frames, from points at fractional frames `at` (N,).

    Return the frame, the person and the points of each row.
    """
    parts = []
    for number in np.unique(person):
        rows = np.flatnonzero(person == number)
        stamps = at[rows]
        grid = np.arange(int(np.ceil(stamps[0] - 1e-6)), int(np.floor(stamps[-1] + 1e-6)) + 1)
        after = np.clip(np.searchsorted(stamps, grid - 1e-6), 1, max(len(stamps) - 1, 1))
        if len(stamps) == 1:
            continue
        gap = stamps[after] - stamps[after - 1]
        near = gap <= MAX_GAP_FRAMES
        share = np.clip((grid - stamps[after - 1]) / gap, 0.0, 1.0)[:, None, None]
        between = (1.0 - share) * points[rows[after - 1]] + share * points[rows[after]]
        parts.append((grid[near], np.full(int(near.sum()), number), between[near]))
    frame, number, points_on_grid = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.lexsort((number, frame))
    return frame[order], number[order], points_on_grid[order]
