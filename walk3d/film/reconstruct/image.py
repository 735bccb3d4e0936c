"""Keypoints as pixels of an upright image, whatever the file has."""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

USUAL_SIZES = tuple(
    size
    for width, height in ((640, 480), (854, 480), (1280, 720), (1920, 1080), (2560, 1440), (3840, 2160))
    for size in ((width, height), (height, width))
)
"""Sizes of videos, the smallest first: one of them is guessed where the file does not say."""

MOST_OUTSIDE = 0.1
"""Share of keypoints that may lie outside of the image by more than 6 % of its size, unless with width and height
exchanged half as many do: detectors guess feet below the picture, but not most of all."""

PERCENT = 100.0
"""All within so many pixels of the corner are of no picture more than four times as large."""

_HIPS = [number for number, joint in enumerate(WALKER15.joints) if joint.endswith("_hip")]


def in_pixels(
    pixels: np.ndarray, size: tuple[int, int], notes: list[str]
) -> tuple[np.ndarray, tuple[int, int]]:
    """Pixels (N, 15, 2), whatever the file's unit, and the size of the image.

    Parameters
    ----------
    pixels : (N, 15, 2)
        As the file has them: pixels, or shares of the image.
    size : (int, int)
        Width and height; 0 if not known.
    notes : list of str
        What is said of it is added here.

    Raises
    ------
    InvalidInput
        If the coordinates are shares of an image whose size is not known, per cent, pixels that are not in it, or not
        from its corner.
    """
    known = pixels[np.isfinite(pixels).all(axis=-1)]
    hips = pixels[:, _HIPS].mean(axis=1)
    hips = hips[np.isfinite(hips).all(axis=-1)]
    if len(hips) and np.median(np.abs(hips)) < 0.01 * np.median(np.abs(known)):
        raise InvalidInput(
            "the points are counted from the middle of the hips, and say nothing of the image",
            expected="landmarks in the image, as MediaPipe's pose_landmarks",
            received="hips at 0, 0 throughout, as in its pose_world_landmarks",
            code="about_hips",
        )
    if turned := len(known) and (known[:, 1] < 0).mean() > 0.95:
        pixels, known = pixels * [1, -1], known * [1, -1]
        notes.append("Rows are negative: they were counted upwards from the upper edge, and are turned.")
    if len(known) and np.percentile(np.abs(known), 95) <= 2.0:
        if not all(size):
            raise InvalidInput(
                "coordinates between 0 and 1 need the size of the image",
                "input.width, input.height",
                "pixels",
                code="unknown_size",
            )
        notes.append("Coordinates are shares of the image and were multiplied by its size.")
        if (
            middle := (known[:, 1] < 0).mean() > 0.25
        ):  # OpenPose's keypoint_scale 4, not a head out of the picture
            pixels, known = (pixels + 1) / 2, (known + 1) / 2
            notes.append("They were counted from its middle, from -1 to 1.")
        if (turned or middle or upside_down(pixels)) and _outside(known, (1, 1)) > MOST_OUTSIDE:
            raise InvalidInput(
                "the coordinates are neither pixels nor shares of an image, but a body's own",
                expected="landmarks in the image, as MediaPipe's pose_landmarks",
                received="many beyond -1 and 1",
                code="not_in_image",
            )
        pixels = pixels * np.array(size, float)
    elif len(known) and np.percentile(known, 99) <= PERCENT and not 0 < min(size) <= 4 * PERCENT:
        raise InvalidInput(
            "the keypoints lie within 100 x 100 pixels: are they per cent of the image, or of a smaller one?",
            "input.width, input.height",
            "the size of the image that they count pixels of",
            f"{size[0]} x {size[1]}" if all(size) else "nothing",
            code="tiny_image",
        )
    elif not all(size):
        reach = known.max(axis=0) if len(known) else np.array([1.0, 1.0])
        # Keypoints may lie a little outside of the image.
        fitting = [wh for wh in USUAL_SIZES if 1.06 * wh[0] >= reach[0] and 1.06 * wh[1] >= reach[1]]
        size = fitting[0] if fitting else (int(reach[0]) + 1, int(reach[1]) + 1)
        notes.append(
            f"The size of the image is not known; {size[0]} x {size[1]} is guessed, and the view with it."
        )
    elif (outside := _outside(known, size)) > MOST_OUTSIDE and outside > min(
        2 * _outside(known, size[::-1]), 0.6
    ):
        low, high = np.percentile(known, [1, 99], axis=0).round().astype(int).tolist()
        raise InvalidInput(
            "the keypoints are not in an image of this size: are width and height exchanged, or of another film?",
            "input.width, input.height",
            f"one that holds {low[0]} to {high[0]} x {low[1]} to {high[1]} pixels",
            f"{size[0]} x {size[1]}",
            code="outside_image",
        )
    return pixels, size


def _outside(pixels: np.ndarray, size: tuple[int, ...]) -> float:
    """Share of pixels (n, 2) that lie outside of an image by more than 6 % of its size."""
    return (np.abs(pixels / size - 0.5) > 0.56).any(axis=-1).mean() if len(pixels) else 0.0


def upside_down(pixels: np.ndarray) -> bool:
    """Whether shoulders are mostly below ankles."""
    rows = pixels[..., 1]
    top, bottom = rows[:, [2, 5]], rows[:, [11, 14]]
    both = np.isfinite(top).any(axis=1) & np.isfinite(bottom).any(axis=1)
    if not both.any():
        return False
    shoulders = np.where(np.isfinite(top[both]), top[both], np.inf).min(axis=1)
    ankles = np.where(np.isfinite(bottom[both]), bottom[both], -np.inf).max(axis=1)
    return bool((shoulders > ankles).mean() > 0.9)
