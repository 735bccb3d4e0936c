"""One walk as the BioMotion Lab stores it: Fourier coefficients of markers, period, size and speed.

Axes are those of the files: x forwards, y to the walker's left, z up; on a treadmill.
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
"""Frames a second in which the laboratory counts periods and speeds."""

BLOCKS = 5
"""Mean, and sine and cosine of two harmonics."""

STRIDES, FRAMES_A_STRIDE = 16, 16
"""Length and sampling of the recording that a reader returns: whole strides, so that nothing is lost."""

ASIDE_MM = 1000.0
"""Distance between several people in a recording, who would be in one place."""

PERIODS = (12.0, 1200.0)
"""Shortest and longest stride, in frames: 10 to 0.1 Hz."""


@dataclass(frozen=True)
class FourierWalk:
    """A walk as a Fourier series of two harmonics.

    Attributes
    ----------
    coefficients : (5, P, 3)
        mm, in the order p0, p1, q1, p2, q2 (p: sine, q: cosine), in the axes of the file.
    period : float
        Of a stride, frames of `RATE_HZ`.
    size : float
        As the file has it; coordinates are not scaled by it.
    speed : float
        mm a frame, forwards; NaN if the file does not state it.
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
        """Speed over the ground, mm/s; 0 if it is not known."""
        return float(np.nan_to_num(self.speed * RATE_HZ))

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the positions (T, P, 3), mm, on the spot, at some times (T,)."""
        angle = 2.0 * np.pi * self.stride_hz * np.asarray(times_s)[:, None]
        waves = np.column_stack(
            [np.ones(len(angle)), *(f(h * angle) for h in (1, 2) for f in (np.sin, np.cos))]
        )
        return np.einsum("tb,bpx->tpx", waves, self.coefficients)


def in_world(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) of the files' axes in those of the world: the walk along +y, +x to the walker's right."""
    forwards, left, up = np.moveaxis(vectors, -1, 0)
    return np.stack([-left, forwards, up], axis=-1)


def from_world(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) of the world in the files' axes."""
    right, forwards, up = np.moveaxis(vectors, -1, 0)
    return np.stack([forwards, -right, up], axis=-1)


def from_blocks(blocks: np.ndarray, where: str) -> FourierWalk:
    """Return the walk of five blocks (5, 3 P + 1): all x, all y, all z, and one number more.

    The numbers more of the first three blocks are period, size and speed.

    Raises
    ------
    InvalidInput
        If a number cannot be used, or nobody has such a period.
    """
    if not (np.abs(blocks) <= LARGEST).all():
        raise damaged("a coefficient is not a usable number", where, code="not_number")
    period, size, speed = blocks[:3, -1]
    if not PERIODS[0] <= period <= PERIODS[1]:
        raise damaged(
            "the period is not a stride's",
            where,
            f"{PERIODS[0]:g} to {PERIODS[1]:g} frames of {RATE_HZ:g} Hz",
            f"{period:g}",
            code="unusable_period",
            period=float(period),
        )
    coefficients = blocks[:, :-1].reshape(BLOCKS, 3, -1).swapaxes(1, 2)
    return FourierWalk(coefficients, float(period), float(size), float(speed))


def marker_names(count: int) -> tuple[str, ...]:
    """Names of markers, which the files do not have: fifteen are the papers' joints in their order."""
    joints = WALKER15.joints
    return tuple(joints) if count == len(joints) else tuple(f"marker_{k + 1}" for k in range(count))


def motion_of(walks: Mapping[str, FourierWalk], notes: Iterable[str], where: str) -> MotionCapture:
    """Return walks as a recording of some strides; of several people, names of points begin with theirs.

    All have the period of the first, and several stand side by side.

    Raises
    ------
    InvalidInput
        If so many points are beyond the budget of a file.
    """
    first = next(iter(walks.values()))
    rate = FRAMES_A_STRIDE * first.stride_hz
    count = STRIDES * FRAMES_A_STRIDE
    require_points(count, sum(walk.coefficients.shape[1] for walk in walks.values()), where)
    times = np.arange(count) / rate
    names = [
        f"{who}:{name}" if len(walks) > 1 else name
        for who, walk in walks.items()
        for name in marker_names(walk.coefficients.shape[1])
    ]
    aside = [np.array([0.0, k * ASIDE_MM, 0.0]) for k in range(len(walks))]
    walking = [walk.positions(times) + moved for walk, moved in zip(walks.values(), aside, strict=True)]
    positions = np.concatenate(walking, axis=1)
    return motion_capture(names, positions, rate, "mm", notes)
