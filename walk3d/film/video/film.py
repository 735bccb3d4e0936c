"""Keypoints of everybody in a video: people found, followed from frame to frame, and their landmarks.

A person is followed by a square about the body that the landmarks of one frame give for the next; every so many frames,
and whenever nobody is followed, the detector looks for others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.validation import InvalidInput
from walk3d.film.video.pose import LEAST_SCORE, Pose, silent

DETECT_EVERY = 15
"""Frames between two looks for people who are not followed yet."""
MOST_PEOPLE = 4
SAME = 0.25
"""Share of the square's side below which the middles of two are those of one person."""
UNEVEN = 0.2
"""Share of the usual step by which a step in time may differ before the frames are put on an even grid."""
LONGEST_GAP = 3.0
"""Steps over which a keypoint is interpolated on that grid."""
_SHOULDERS, _HIPS = slice(11, 13), slice(23, 25)
"""Places of these landmarks among the 33."""


@dataclass(frozen=True)
class Filmed:
    """Keypoints of a video.

    Attributes
    ----------
    frame_rate_hz : float
    width, height : int
        px, of the upright picture.
    frame, person : (N,) int
    points : (N, 33, 3)
        Column, row, px, and visibility, 0 to 1.
    uneven : bool
        Whether the frames were not evenly spaced, and were put on an even grid.
    """

    frame_rate_hz: float
    width: int
    height: int
    frame: np.ndarray
    person: np.ndarray
    points: np.ndarray
    uneven: bool


def pictures(path: Path) -> Iterator[tuple[float, np.ndarray]]:
    """Seconds and upright RGB pictures (H, W, 3) of a video.

    Raises
    ------
    InvalidInput
        If it cannot be opened.
    """
    import cv2

    with silent():
        video = cv2.VideoCapture(str(path))
    try:
        if not video.isOpened():
            raise InvalidInput(
                "the video cannot be opened", path.name, "a film that FFmpeg reads", code="unreadable"
            )
        while True:
            there, picture = video.read()
            if not there:
                return
            yield video.get(cv2.CAP_PROP_POS_MSEC) / 1000.0, cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
    finally:
        video.release()


def frames_of(path: Path) -> tuple[int, float]:
    """Frames, as far as the file tells, and frames a second as it states them."""
    import cv2

    with silent():
        video = cv2.VideoCapture(str(path))
    found = max(int(video.get(cv2.CAP_PROP_FRAME_COUNT)), 0), float(video.get(cv2.CAP_PROP_FPS))
    video.release()
    return found


def followed(path: Path, pose: Pose) -> Iterator[tuple[float, np.ndarray, dict[int, np.ndarray]]]:
    """Seconds, pictures, and landmarks (33, 3) of everybody in them by number, from one picture to the next."""
    regions: dict[int, np.ndarray] = {}
    known = 0
    for number, (time_s, picture) in enumerate(pictures(path)):
        if not regions or number % DETECT_EVERY == 0:
            for region in pose.detect(picture, closer=number % DETECT_EVERY == 0):
                if len(regions) < MOST_PEOPLE and not any(_same(region, other) for other in regions.values()):
                    regions[known] = region
                    known += 1
        found: dict[int, np.ndarray] = {}
        kept: dict[int, np.ndarray] = {}
        for person, region in regions.items():
            points, following, score = pose.place(picture, region)
            if score >= LEAST_SCORE and not any(_same(following, other) for other in kept.values()):
                kept[person], found[person] = following, points
        regions = kept
        yield time_s, picture, found


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.hypot(*(one[:2] - other[:2])) < SAME * max(one[2], other[2]))


def keypoints_of(path: Path, pose: Pose, progress: Callable[[int], None] = lambda _: None) -> Filmed:
    """Keypoints of everybody in a video.

    Parameters
    ----------
    path : Path
    pose : Pose
    progress : callable
        Told the number of frames that are done.

    Raises
    ------
    InvalidInput
        If the video cannot be read, shows nobody, or people upside down: their mirror images would be found.
    """
    times: list[float] = []
    seen: list[tuple[int, int, np.ndarray]] = []
    size = (0, 0)
    for number, (time_s, picture, people) in enumerate(followed(path, pose)):
        times.append(time_s)
        size = picture.shape[1], picture.shape[0]
        seen += [(number, person, points) for person, points in people.items()]
        progress(number + 1)
    if not seen:
        expected = "people of a tenth of its longer side or more"
        raise InvalidInput(
            "nobody is seen in the video", path.name, expected, f"{len(times)} frames", code="nobody_seen"
        )
    rate, uneven = frame_rate(np.array(times), frames_of(path)[1])
    frame, person = (np.array([one[k] for one in seen]) for k in (0, 1))
    points = np.stack([one[2] for one in seen])
    trunk = points[:, _SHOULDERS] - points[:, _HIPS]
    if np.median(trunk[..., 1] - np.abs(trunk[..., 0])) > 0:  # who lies would lie turned by half, too
        raise InvalidInput(
            "people are upside down in the film", path.name, "the film, turned by half", code="upside_down"
        )
    if uneven:
        at = (np.array(times)[frame] - times[0]) * rate
        frame, person, points = on_even_grid(at, person, points)
    return Filmed(rate, *size, frame, person, points, uneven)


def frame_rate(times: np.ndarray, stated_hz: float) -> tuple[float, bool]:
    """Frames a second by the time stamps (n,), s, and whether these are uneven; as stated where there are none.

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
    uneven = bool((np.abs(steps - usual) > UNEVEN * usual).any())
    rate = 1.0 / usual if uneven else (len(times) - 1) / float(times[-1] - times[0])
    return round(rate, 4), uneven


def on_even_grid(
    at: np.ndarray, person: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames, people and points on whole frames, interpolated between those at the places `at` (N,), frames."""
    parts = []
    for who in np.unique(person):
        mine = np.flatnonzero(person == who)
        own = at[mine]
        grid = np.arange(int(np.ceil(own[0] - 1e-6)), int(np.floor(own[-1] + 1e-6)) + 1)
        after = np.clip(np.searchsorted(own, grid - 1e-6), 1, max(len(own) - 1, 1))
        if len(own) == 1:
            continue
        gap = own[after] - own[after - 1]
        near = gap <= LONGEST_GAP
        share = np.clip((grid - own[after - 1]) / gap, 0.0, 1.0)[:, None, None]
        between = (1.0 - share) * points[mine[after - 1]] + share * points[mine[after]]
        parts.append((grid[near], np.full(int(near.sum()), who), between[near]))
    frame, who, found = (np.concatenate([part[k] for part in parts]) for k in range(3))
    order = np.lexsort((who, frame))
    return frame[order], who[order], found[order]
