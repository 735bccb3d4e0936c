"""Conversion of keypoints to pixels of an upright image."""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

USUAL_SIZES = tuple(
    size
    for width, height in ((640, 480), (854, 480), (1280, 720), (1920, 1080), (2560, 1440), (3840, 2160))
    for size in ((width, height), (height, width))
)
"""Common sizes of videos, px, smallest first, for files that do not state their image size."""

MAX_OUTSIDE_SHARE = 0.1
"""Maximum share of keypoints that may lie more than 6 % outside the image before the image size is checked.

Detectors place unseen feet below the picture.  A larger share is an error if width and height exchanged would halve
it, or if it exceeds 0.6.
"""

TINY_PX = 100.0
"""Extent of all keypoints, px, below which they are rejected, unless the image is at most four times as large."""

_HIPS = [number for number, joint in enumerate(WALKER15.joints) if joint.endswith("_hip")]


def in_pixels(
    pixels: np.ndarray, size: tuple[int, int], notes: list[str]
) -> tuple[np.ndarray, tuple[int, int]]:
    """Convert keypoints (N, 15, 2) to pixels, and return the converted keypoints and the image size.

    Parameters
    ----------
    pixels : (N, 15, 2)
        Coordinates in the file: pixels, or shares of the image.
    size : (int, int)
        Width and height; 0 if unknown.
    notes : list of str
        Notes on the conversion are appended.

    Raises
    ------
    InvalidInput
        If the size of the image is needed but unknown, or if the coordinates are per cent, relative to the body, or
        outside the image.
    """
    visible = pixels[np.isfinite(pixels).all(axis=-1)]
    hips = pixels[:, _HIPS].mean(axis=1)
    hips = hips[np.isfinite(hips).all(axis=-1)]
    if len(hips) and np.median(np.abs(hips)) < 0.01 * np.median(np.abs(visible)):
        raise InvalidInput(
            "the points are relative to the middle of the hips and give no position in the image",
            expected="landmarks in the image, as MediaPipe's pose_landmarks",
            received="hips at 0, 0 throughout, as in pose_world_landmarks",
            code="about_hips",
        )
    if turned := len(visible) and (visible[:, 1] < 0).mean() > 0.95:
        pixels, visible = pixels * [1, -1], visible * [1, -1]
        notes.append("Rows are negative: image rows count upwards in this file and were flipped.")
    if len(visible) and np.percentile(np.abs(visible), 95) <= 2.0:
        if not all(size):
            raise InvalidInput(
                "coordinates between 0 and 1 need the size of the image",
                "input.width, input.height",
                "pixels",
                code="unknown_size",
            )
        notes.append("Coordinates are shares of the image and were multiplied by its size.")
        if (
            middle := (visible[:, 1] < 0).mean() > 0.25
        ):  # OpenPose's keypoint_scale 4, not a head out of the picture
            pixels, visible = (pixels + 1) / 2, (visible + 1) / 2
            notes.append("The shares range from -1 to 1 about the middle of the image.")
        if (turned or middle or upside_down(pixels)) and _outside(visible, (1, 1)) > MAX_OUTSIDE_SHARE:
            raise InvalidInput(
                "the coordinates are relative to the body, not to the image",
                expected="landmarks in the image, as MediaPipe's pose_landmarks",
                received="many coordinates below -1 or above 1",
                code="not_in_image",
            )
        pixels = pixels * np.array(size, float)
    elif len(visible) and np.percentile(visible, 99) <= TINY_PX and not 0 < min(size) <= 4 * TINY_PX:
        raise InvalidInput(
            "the keypoints lie within 100 x 100 pixels: they may be per cent, or belong to a smaller image",
            "input.width, input.height",
            "the size of the image to which they belong",
            f"{size[0]} x {size[1]}" if all(size) else "nothing",
            code="tiny_image",
        )
    elif not all(size):
        reach = visible.max(axis=0) if len(visible) else np.array([1.0, 1.0])
        # Keypoints may lie a little outside of the image.
        fitting = [wh for wh in USUAL_SIZES if 1.06 * wh[0] >= reach[0] and 1.06 * wh[1] >= reach[1]]
        size = fitting[0] if fitting else (int(reach[0]) + 1, int(reach[1]) + 1)
        notes.append(
            f"The size of the image is unknown: {size[0]} x {size[1]} is assumed, and the view depends on it."
        )
    elif (outside := _outside(visible, size)) > MAX_OUTSIDE_SHARE and outside > min(
        2 * _outside(visible, size[::-1]), 0.6
    ):
        low, high = np.percentile(visible, [1, 99], axis=0).round().astype(int).tolist()
        raise InvalidInput(
            "the keypoints are outside an image of this size: width and height are exchanged or belong to another film",
            "input.width, input.height",
            f"a size that contains {low[0]} to {high[0]} x {low[1]} to {high[1]} pixels",
            f"{size[0]} x {size[1]}",
            code="outside_image",
        )
    return pixels, size


def _outside(pixels: np.ndarray, size: tuple[int, ...]) -> float:
    """Return the share of pixels (n, 2) that are more than 6 % outside an image of the given size."""
    return (np.abs(pixels / size - 0.5) > 0.56).any(axis=-1).mean() if len(pixels) else 0.0


def upside_down(pixels: np.ndarray) -> bool:
    """Return True if the shoulders are below the ankles in most frames."""
    rows = pixels[..., 1]
    top, bottom = rows[:, [2, 5]], rows[:, [11, 14]]
    both = np.isfinite(top).any(axis=1) & np.isfinite(bottom).any(axis=1)
    if not both.any():
        return False
    shoulders = np.where(np.isfinite(top[both]), top[both], np.inf).min(axis=1)
    ankles = np.where(np.isfinite(bottom[both]), bottom[both], -np.inf).max(axis=1)
    return bool((shoulders > ankles).mean() > 0.9)
