"""Overlay on the video: detected keypoints (dots) and the reprojection of the reconstructed walk (lines)."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pipeline.palette import rgb_colour
from pipeline.validation import InvalidInput
from walk3d.film.video.film import pictures

FOURCC = "mp4v"
KEY_FRAMES = 4
KEY_PX = 400
"""Longer side of a key frame, px."""


def write_overlay(
    path: Path,
    video: Path,
    frame_rate_hz: float,
    bones: Sequence[tuple[int, int]],
    seen_px: Mapping[int, np.ndarray],
    drawn_px: Mapping[int, np.ndarray],
) -> None:
    """Write the video with keypoints and skeleton drawn in the frames that have them.

    Parameters
    ----------
    path, video : Path
    frame_rate_hz : float
    bones : sequence of (int, int)
    seen_px, drawn_px : mapping of frame to (J, 2)
        Pixels of the picture; NaN where missing.

    Raises
    ------
    InvalidInput
        If the film cannot be written.
    """
    import cv2

    writer = None
    dots, lines = rgb_colour("orange")[::-1], rgb_colour("map")[::-1]
    try:
        for number, (_, picture) in enumerate(pictures(video)):
            height, width = picture.shape[:2]
            if writer is None:
                code = cv2.VideoWriter.fourcc(*FOURCC)
                writer = cv2.VideoWriter(str(path), code, frame_rate_hz, (width, height))
                if not writer.isOpened():
                    raise InvalidInput(
                        "the film cannot be written", path.name, "OpenCV with MPEG-4", code="cannot_write"
                    )
            canvas = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
            thick = max(round(height / 300), 2)
            for a, b in bones if number in drawn_px else ():
                ends = drawn_px[number][[a, b]]
                if np.isfinite(ends).all():
                    start, end = ends.round().astype(int).tolist()
                    cv2.line(canvas, start, end, lines, thick, cv2.LINE_AA)
            for point in seen_px.get(number, np.empty((0, 2))):
                if np.isfinite(point).all():
                    cv2.circle(canvas, point.round().astype(int).tolist(), thick, dots, -1, cv2.LINE_AA)
            writer.write(canvas)
    finally:
        if writer is not None:
            writer.release()


def key_frames(film: Path, numbers: np.ndarray, points_px: np.ndarray) -> list[tuple[int, str]]:
    """Return some frames of a film, cropped to the walker: numbers, and JPEG as data URIs.

    Parameters
    ----------
    film : Path
    numbers : (T,) int
        Numbers of the frames to choose from.
    points_px : (T, J, 2)
        Points of the walker; the pictures show them with a margin.
    """
    import cv2

    indices = np.linspace(0, len(numbers) - 1, KEY_FRAMES).round().astype(int)
    drawn = points_px[indices].reshape(-1, 2)
    margin = 0.2 * np.ptp(points_px[indices, :, 1], axis=1).max()
    left, top = np.maximum(drawn.min(axis=0) - margin, 0).astype(int)
    right, bottom = (drawn.max(axis=0) + margin).astype(int)
    images = []
    for number, (_, picture) in enumerate(pictures(film)):
        if number in numbers[indices] and (part := picture[top:bottom, left:right]).size:
            part = cv2.cvtColor(part, cv2.COLOR_RGB2BGR)
            scale = min(KEY_PX / max(part.shape[:2]), 1.0)
            small = cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
            content = base64.b64encode(cv2.imencode(".jpg", small)[1].tobytes()).decode()
            images.append((number, f"data:image/jpeg;base64,{content}"))
    return images
