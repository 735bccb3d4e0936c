"""Fourier series of a walk as the BioMotion Lab stores it: coefficients of markers, period, size and speed.

The axes are those of the files: x forwards, y to the walker's left, z up.  The walker is on a treadmill.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import LARGEST, damaged, motion_capture
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture

RATE_HZ = 120.0
"""Frame rate, Hz, of the frames in which files state stride periods (frames) and speeds (mm per frame)."""

BLOCKS = 5
"""Number of Fourier coefficients: the mean, and a sine and a cosine for each of two harmonics."""

STRIDES, FRAMES_A_STRIDE = 16, 16
"""Number of strides in the recording that a reader returns, and number of frames per stride.

The recording has whole strides, from which the Fourier coefficients can be recovered exactly.
"""

SPACING_MM = 1000.0
"""Distance, mm, between neighbouring people in a recording; at distance 0, all would walk at the same position."""

PERIODS = (12.0, 1200.0)
"""Shortest and longest stride period, in frames (10 Hz and 0.1 Hz)."""


@dataclass(frozen=True)
class FourierWalk:
    """A walk as a Fourier series of two harmonics.

    Attributes
    ----------
    coefficients : (5, P, 3)
        Coefficients p0, p1, q1, p2, q2 (p: sine, q: cosine), mm, in the axes of the file.
    period : float
        Duration of a stride, in frames at `RATE_HZ`.
    size : float
        Size of the walker in the file; coordinates are not scaled by it.
    speed : float
        Forward speed, mm per frame; NaN if the file does not state it.
    """

    coefficients: np.ndarray
    period: float
    size: float = 1.0
    speed: float = np.nan

    @property
    def stride_hz(self) -> float:
        """Stride frequency, Hz."""
        return RATE_HZ / self.period

    @property
    def speed_mm_s(self) -> float:
        """Walking speed over the ground, mm/s; 0 if the speed is not known."""
        return float(np.nan_to_num(self.speed * RATE_HZ))

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the positions (T, P, 3), mm, at the given times (T,), s, without forward motion."""
        angle = 2.0 * np.pi * self.stride_hz * np.asarray(times_s)[:, None]
        waves = np.column_stack(
            [np.ones(len(angle)), *(f(h * angle) for h in (1, 2) for f in (np.sin, np.cos))]
        )
        return np.einsum("tb,bpx->tpx", waves, self.coefficients)


def in_world(vectors: np.ndarray) -> np.ndarray:
    """Transform vectors (…, 3) from the file's axes to world axes: +y forwards, +x to the walker's right."""
    forwards, left, up = np.moveaxis(vectors, -1, 0)
    return np.stack([-left, forwards, up], axis=-1)


def from_world(vectors: np.ndarray) -> np.ndarray:
    """Transform vectors (…, 3) from world axes to the file's axes."""
    right, forwards, up = np.moveaxis(vectors, -1, 0)
    return np.stack([forwards, -right, up], axis=-1)


def from_blocks(blocks: np.ndarray, where: str) -> FourierWalk:
    """Build a walk from five blocks (5, 3 P + 1), each with all x, all y, all z, and one further number.

    The last numbers of the first three blocks are period, size and speed.

    Raises
    ------
    InvalidInput
        If a number cannot be used, or the period is outside the range of human strides.
    """
    if not (np.abs(blocks) <= LARGEST).all():
        raise damaged(
            "a Fourier coefficient is not a finite number, or is too large", where, code="not_number"
        )
    period, size, speed = blocks[:3, -1]
    if not PERIODS[0] <= period <= PERIODS[1]:
        raise damaged(
            "the period is outside the range of human strides",
            where,
            f"{PERIODS[0]:g} to {PERIODS[1]:g} frames at {RATE_HZ:g} Hz",
            f"{period:g}",
            code="unusable_period",
            period=float(period),
        )
    coefficients = blocks[:, :-1].reshape(BLOCKS, 3, -1).swapaxes(1, 2)
    return FourierWalk(coefficients, float(period), float(size), float(speed))


def marker_names(count: int) -> tuple[str, ...]:
    """Return names for markers, because files store none; fifteen markers are the joints of the papers."""
    joints = WALKER15.joints
    return tuple(joints) if count == len(joints) else tuple(f"marker_{k + 1}" for k in range(count))


def motion_of(walks: Mapping[str, FourierWalk], notes: Iterable[str], where: str) -> MotionCapture:
    """Return walks as a recording of several strides.

    If there are several people, each point name begins with the name of its person.

    All walks get the period of the first one.  Several people walk side by side.

    Raises
    ------
    InvalidInput
        If the points exceed the memory budget of a file.
    """
    first = next(iter(walks.values()))
    rate = FRAMES_A_STRIDE * first.stride_hz
    count = STRIDES * FRAMES_A_STRIDE
    require_points(count, sum(walk.coefficients.shape[1] for walk in walks.values()), where)
    times = np.arange(count) / rate
    names = [
        f"{person}:{name}" if len(walks) > 1 else name
        for person, walk in walks.items()
        for name in marker_names(walk.coefficients.shape[1])
    ]
    offsets = [np.array([0.0, k * SPACING_MM, 0.0]) for k in range(len(walks))]
    walking = [walk.positions(times) + offset for walk, offset in zip(walks.values(), offsets, strict=True)]
    positions = np.concatenate(walking, axis=1)
    return motion_capture(names, positions, rate, "mm", notes)
