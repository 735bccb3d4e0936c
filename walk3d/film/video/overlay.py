"""Video overlay of the detected keypoints (dots) and the reprojection of the reconstructed walk (lines)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from pipeline.palette import rgb_colour
from pipeline.validation import InvalidInput

FOURCC = "mp4v"
SIDE_COLOURS = {"left": "blue", "right": "orange", "middle": "silver"}
"""Colours of bones on the left, on the right and in the middle, as on the page of the walk."""
_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)


def side_of(joints: Iterable[str]) -> str:
    """Return the side of a bone: left, right or middle.

    Examples
    --------
    >>> side_of(["pelvis", "left_hip"]), side_of(["head", "sternum"])
    ('left', 'middle')
    """
    return next((side for joint in joints for side in ("left", "right") if joint.startswith(side)), "middle")


def write_overlay(
    path: Path,
    frames: Iterable[tuple[int, np.ndarray]],
    frame_rate_hz: float,
    bones: Mapping[tuple[int, int], str],
    seen_px: Mapping[int, np.ndarray],
    drawn_px: Mapping[int, np.ndarray],
) -> None:
    """Write a copy of the video, with keypoints and skeleton drawn in all frames where they exist.

    Parameters
    ----------
    path : Path
    frames : iterable of (int, (H, W, 3))
        Numbers and RGB pictures of the film's frames.
    frame_rate_hz : float
    bones : mapping of (int, int) to str
        Pairs of joints, and the name of their colour.
    seen_px, drawn_px : mapping of frame to (J, 2)
        Pixels of the picture; NaN where missing.

    Raises
    ------
    InvalidInput
        If the film cannot be written.
    """
    import cv2

    writer = None
    lines = {bone: rgb_colour(colour)[::-1] for bone, colour in bones.items()}
    try:
        for number, picture in frames:
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
            # A dark rim separates the colours from any background.
            for rim in (2, 0):
                for bone, colour in lines.items() if number in drawn_px else ():
                    ends = drawn_px[number][list(bone)]
                    if np.isfinite(ends).all():
                        start, end = ends.round().astype(int).tolist()
                        cv2.line(canvas, start, end, _BLACK if rim else colour, thick + rim, cv2.LINE_AA)
            for point in seen_px.get(number, np.empty((0, 2))):
                if np.isfinite(point).all():
                    at = point.round().astype(int).tolist()
                    cv2.circle(canvas, at, thick + 1, _BLACK, -1, cv2.LINE_AA)
                    cv2.circle(canvas, at, thick, _WHITE, -1, cv2.LINE_AA)
            writer.write(canvas)
    finally:
        if writer is not None:
            writer.release()
