"""Reduced copies of a film: key frames for the page, and a video for the recording."""

from __future__ import annotations

import base64
import itertools
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from pipeline.validation import InvalidInput

FILM_PX = 640
"""Longer side of an image of the reduced video, px."""
MAX_PICTURES = 300
"""Maximum number of images of the reduced video, which limits the memory to about 200 MB."""
FILM_QUALITY, FILM_SPEED = 60, 9
"""Quality, 0 to 100, and speed, 0 to 10, of the AV1 encoder for the reduced video."""
MARGIN_SHARE = 0.2
"""Margin around the walker in key frames, as a share of the walker's height in the image."""
KEY_PX = 360
"""Longer side of a key frame, px."""
MAX_KEY_CHARACTERS = 590_000
"""Maximum total number of base64 characters of the key frames."""
_COUNTS, _QUALITIES = (80, 40, 20, 10), (70, 50)
"""Candidate values of the maximum number of key frames, and candidate JPEG qualities.

The first combination within `MAX_KEY_CHARACTERS` is used.
"""


def thinned(numbers: Sequence[int] | np.ndarray, most: int) -> np.ndarray:
    """Return every k-th number of a sequence, with the smallest k that leaves at most `most` numbers.

    Examples
    --------
    >>> thinned([4, 5, 6, 7, 8, 9, 10], 3)
    array([ 4,  7, 10])
    """
    return np.asarray(numbers)[:: -(-len(numbers) // most)]


def small_pictures(frames: Iterable[tuple[int, np.ndarray]], numbers: np.ndarray) -> dict[int, np.ndarray]:
    """Return reduced BGR images (h, w, 3) of the given frames of a film, by frame index; height and width are even.

    Parameters
    ----------
    frames : iterable of (int, (H, W, 3))
        Numbers and RGB pictures of the film's frames.
    numbers : (N,) int
        Numbers of the frames to return, increasing.
    """
    import cv2

    small: dict[int, np.ndarray] = {}
    for number, picture in frames:
        if number > numbers[-1]:
            break
        if number in numbers:
            small[number] = _shrunk(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), FILM_PX)
    return small


def walkers_part(points_px: np.ndarray, size_px: np.ndarray) -> tuple[float, float, float, float]:
    """Return the part of an image that contains the walker: left, top, right and bottom, as shares of the image size.

    Parameters
    ----------
    points_px : (T, J, 2)
        Points of the walker in all frames.
    size_px : (2,)
        Width and height of the image.
    """
    margin = MARGIN_SHARE * np.ptp(points_px[..., 1], axis=1).max()
    corners = np.stack([points_px.min(axis=(0, 1)) - margin, points_px.max(axis=(0, 1)) + margin]) / size_px
    left, top, right, bottom = np.clip(corners, 0.0, 1.0).ravel().tolist()
    return left, top, right, bottom


def key_frames(small: Mapping[int, np.ndarray], part: Sequence[float]) -> list[tuple[int, str]]:
    """Return key frames of a film as pairs of frame index and JPEG image in base64.

    They have at most `MAX_KEY_CHARACTERS` in all.

    Parameters
    ----------
    small : mapping of int to (h, w, 3)
        Small pictures of a film by number.
    part : (4,)
        Left, top, right and bottom of the part that is kept, as shares of the picture.

    Raises
    ------
    InvalidInput
        If even a few pictures are too large.
    """
    import cv2

    left, top, right, bottom = part
    total = 0
    for most, quality in itertools.product(_COUNTS, _QUALITIES):
        parameters, chosen = [cv2.IMWRITE_JPEG_QUALITY, quality], list[tuple[int, str]]()
        for number in thinned([*small], most).tolist():
            rows, columns = small[number].shape[:2]
            cut = small[number][round(top * rows) : round(bottom * rows)]
            cut = cut[:, round(left * columns) : round(right * columns)]
            content = cv2.imencode(".jpg", _shrunk(cut, KEY_PX), parameters)[1]
            chosen.append((number, base64.b64encode(content).decode()))
        if (total := sum(len(content) for _, content in chosen)) <= MAX_KEY_CHARACTERS:
            return chosen
    raise InvalidInput(
        "the key frames are too large", "walk.html", f"at most {MAX_KEY_CHARACTERS} characters", total,
        code="file_too_large",
    )  # fmt: skip


def film_of(pictures: Sequence[np.ndarray], frame_rate_hz: float) -> bytes:
    """Return an MP4 video with the AV1 codec, which the viewer decodes without other programs.

    OpenCV writes AV1 as an animated AVIF alone.  This is an MP4 file whose track is declared as pictures; here it is
    declared as video.

    Parameters
    ----------
    pictures : sequence of (h, w, 3)
        Blue, green and red; equal, even sizes.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If OpenCV cannot write AV1.
    """
    import cv2

    animation = cv2.Animation()
    animation.frames = [*pictures]
    animation.durations = np.full(len(pictures), max(round(1000.0 / frame_rate_hz), 1), np.int32)
    parameters = [cv2.IMWRITE_AVIF_QUALITY, FILM_QUALITY, cv2.IMWRITE_AVIF_SPEED, FILM_SPEED]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.avif"
        if not cv2.imwriteanimation(str(path), animation, parameters):
            raise InvalidInput(
                "the small film cannot be written", path.name, "OpenCV with AVIF", code="cannot_write"
            )
        content = path.read_bytes()
    start = content.index(b"hdlr", content.index(b"moov"))
    return content[:start] + content[start:].replace(b"pict", b"vide", 1)


def _shrunk(picture: np.ndarray, side: int) -> np.ndarray:
    """Return an image (H, W, 3), reduced so that its longer side is at most `side`; both sides are even."""
    import cv2

    scale = min(side / max(picture.shape[:2]), 1.0)
    height, width = (max(2 * round(scale * length / 2.0), 2) for length in picture.shape[:2])
    return cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
