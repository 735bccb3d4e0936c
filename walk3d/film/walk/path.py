"""Estimation of a walker's distance and path from the image in closed form, and of the motion about the trunk.

Symbols
-------
``s(t)``  pixels per millimetre of a walker of 1500 mm; ``1 / s = a + b t`` on a straight path: distance over f
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.fourier import SEARCH_HZ, design
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput
from walk3d.film.walk.objective import wander_basis

_SWINGING = [WALKER15.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("wrist", "ankle")]
TRUNK = [
    WALKER15.index(j)
    for j in ("sternum", "left_shoulder", "right_shoulder", "pelvis", "left_hip", "right_hip")
]
MIN_VISIBLE_SHARE = 0.2
"""Share of frames that show a joint, below which the joint counts as never visible."""


def often_seen(weights: np.ndarray) -> np.ndarray:
    """Return the mask (15,) of joints that are visible in enough frames, given the keypoints' weights (T, 15)."""
    return (weights > 0).mean(axis=0) >= MIN_VISIBLE_SHARE


@dataclass(frozen=True)
class Path:
    """Distance and path of a walker, and the remaining motion in the image.

    Attributes
    ----------
    distance : (2,)
        a and b of distance over focal length, mm per pixel, and mm per pixel and second.
    place_mm : (2,)
        Centre of the trunk at the middle of the clip, right and down.
    velocity_mm_s : (2,)
        Velocity to the right, and away from the camera.
    metric : (T, 15, 2)
        Pixels times distance over focal length, minus the path, mm.
    """

    distance: np.ndarray
    place_mm: np.ndarray
    velocity_mm_s: np.ndarray
    metric: np.ndarray


def median_of_seen(values: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """Return the medians (…) of the visible values (…, n) over the last axis; at least one value must be visible."""
    ordered = np.sort(np.where(visible, values, np.inf))
    count = np.broadcast_to(visible, values.shape).sum(axis=-1, keepdims=True)
    middle = [np.take_along_axis(ordered, at // 2, axis=-1)[..., 0] for at in (count - 1, count)]
    return (middle[0] + middle[1]) / 2.0


def _robust_regression(columns: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the coefficients (n,) of a robust linear regression on columns (T, n), with Cauchy weights.

    The first column must be constant.
    """
    robust = weights
    line = np.zeros(columns.shape[1])
    for _ in range(6):
        left = columns * robust[:, None]
        line = np.linalg.lstsq(left.T @ columns, left.T @ values)[0]
        off = np.abs(values - columns @ line)
        scale = max(1.4826 * np.median(off[weights > 0]), 1e-9 * abs(line[0]), 1e-12)
        robust = weights / (1.0 + (off / (2.385 * scale)) ** 2)
    return line


def image_scale(rows: np.ndarray, weights: np.ndarray, heights_mm: np.ndarray) -> np.ndarray:
    """Return the scale of the image (T,), pixels per mm, given the joints' image rows (T, 15) and heights (15,), mm.

    The scale is 0 in frames without joints.
    """
    total = weights.sum(axis=1)
    z = heights_mm - (weights @ heights_mm / np.where(total > 0, total, 1.0))[:, None]
    return -(weights * z * rows).sum(axis=1) / np.maximum((weights * z**2).sum(axis=1), 1e-9)


def distance_profile(
    pixels: np.ndarray, weights: np.ndarray, times: np.ndarray, heights_mm: np.ndarray, cosines: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the walker's distance over the focal length, mm per pixel, as a line in time (2,) and in each frame (T,).

    The slope of the line is in mm per pixel and second.

    Parameters
    ----------
    pixels : (T, 15, 2)
    weights : (T, 15)
        0 where a keypoint is missing.
    times : (T,)
        Seconds, 0 in the middle.
    heights_mm : (15,)
        Mean heights of the average walker's joints.
    cosines : int
        Number of cosines beyond the line, for a following camera.

    Raises
    ------
    InvalidInput
        If no person is upright in the image.
    """
    w = weights.copy()
    w[:, _SWINGING] *= 0.3
    scale = image_scale(pixels[..., 1], w, heights_mm)
    good = ((w > 0).sum(axis=1) >= 3) & (scale > 0)
    if good.sum() < max(5, 0.2 * len(times)):
        raise InvalidInput(
            "no upright person is visible in the image",
            expected="heads above feet, image rows counted downwards",
            received=f"{good.sum()} of {len(times)} frames with an upright person",
            code="not_upright",
        )
    inverse = np.where(good, 1.0 / np.where(good, scale, 1.0), 0.0)
    waves = wander_basis(times, cosines)
    columns = np.column_stack([np.ones(len(times)), times, waves])
    coefficients = _robust_regression(columns, inverse, good.astype(float))
    a, b = coefficients[0], coefficients[1]
    half = np.abs(times).max()
    a = a if a > 0 else np.median(inverse[good])
    b = np.clip(b, -0.8 * a / half, 0.8 * a / half)  # the walker stays in front of the camera
    series = np.maximum(a + b * times + waves @ coefficients[2:], 0.2 * a)
    return np.array([a, b]), series


def regress_tracks(
    columns: np.ndarray, values: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Fit tracks of joints (T, J, 2) by linear regression on columns (F, T, n), for each of F stride frequencies.

    Return the coefficients (F, J, n, 2) and the sums of squared residuals (F,).
    """
    F, T, n = columns.shape
    outer = (columns[:, :, :, None] * columns[:, :, None]).reshape(F, T, n * n)
    gram = (weights.T @ outer).reshape(F, -1, n, n)
    gram[..., range(n), range(n)] += 1e-9 * len(weights)
    right = (values * weights[..., None]).reshape(T, -1)
    right = np.swapaxes(columns, 1, 2) @ right
    right = right.reshape(F, n, -1, 2).swapaxes(1, 2)
    coefficients = np.linalg.solve(gram, right)
    squares = (weights[..., None] * values**2).sum() - (coefficients * right).sum(axis=(1, 2, 3))
    return coefficients, np.maximum(squares, 1e-12)


def lowest_hz(duration_s: float) -> float:
    """Return the lowest stride frequency that the search considers for a clip of this duration, Hz.

    Raises
    ------
    InvalidInput
        If the clip is shorter than half a fast stride.
    """
    lowest = max(SEARCH_HZ[0], 0.8 / duration_s)
    if lowest >= SEARCH_HZ[1]:
        raise InvalidInput(
            "the clip is shorter than half a stride",
            received=f"{duration_s:.2f} s",
            code="too_short",
        )
    return lowest


def straighten(
    pixels: np.ndarray,
    weights: np.ndarray,
    times: np.ndarray,
    heights_mm: np.ndarray,
    focal_px: float,
    typical_hz: float,
    cosines: int,
) -> Path:
    """Remove the walker's distance and path from the image, so that only the motion about the trunk remains.

    Parameters
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point.
    weights : (T, 15)
    times : (T,)
    heights_mm : (15,)
    focal_px : float
    typical_hz : float
        Typical stride frequency, which gives the number of cycles in the clip.
    cosines : int
        Number of cosines of a wandering path; 0 for a polynomial path.
    """
    line, series = distance_profile(pixels, weights, times, heights_mm, cosines)
    metric = pixels * series[:, None, None]
    visible = often_seen(weights)
    trunk = [j for j in TRUNK if visible[j]] or np.flatnonzero(visible).tolist()
    if not trunk:
        raise InvalidInput("no joint is visible in a fifth of the frames or more", code="joints_rarely_seen")
    duration = times[-1] - times[0]
    order = 3 if duration * typical_hz >= 1.8 else 2
    unit = times / max(duration / 2.0, 1e-9)
    powers = unit[:, None] ** np.arange(1, order + 1)
    if cosines:
        powers = np.column_stack([unit, wander_basis(times, cosines)])
    frequencies = np.exp(np.arange(np.log(lowest_hz(duration)), np.log(SEARCH_HZ[1]), 0.05))
    w = weights[:, trunk]
    values = metric[:, trunk]
    # One path for all trunk joints: remove the median position of each joint first.
    centres = np.stack([np.median(values[w[:, k] > 0, k], axis=0) for k in range(len(trunk))])
    total = w.sum(axis=1)
    mean = ((values - centres) * w[..., None]).sum(axis=1) / np.where(total > 0, total, 1.0)[:, None]
    powers_of_each = np.broadcast_to(powers, (len(frequencies), *powers.shape))
    columns = np.concatenate([design(frequencies[:, None], times, 2), powers_of_each], axis=2)
    coefficients, squares = regress_tracks(columns, mean[:, None], total[:, None])
    best = coefficients[np.argmin(squares), 0]
    path = powers @ best[5:] + best[0]
    slope = np.polyfit(times, path, 1)[0]
    middle = best[0] + centres.mean(axis=0)
    return Path(
        distance=line,
        place_mm=middle,
        velocity_mm_s=np.array([slope[0], line[1] * focal_px]),
        metric=metric - path[:, None],
    )
