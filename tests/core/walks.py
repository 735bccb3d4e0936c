"""Clips of synthetic walkers with known frequency, phase and treadmill equivalent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from tests.strategies import walker

RATE_HZ, STRIDE_HZ, SPEED_MM_S = 100.0, 0.9, 1300.0
HIP_MM = 900.0
LEFT_HIP, RIGHT_HIP = WALKER15.index("left_hip"), WALKER15.index("right_hip")


@dataclass(frozen=True)
class Clip:
    """A synthetic overground clip with its true treadmill equivalent and its true steady frames."""

    positions: np.ndarray
    treadmill: np.ndarray
    steady: np.ndarray
    coefficients: np.ndarray


def clip(
    coefficients: np.ndarray, frequency_hz: float, rate_hz: float, cycles: float, phase_rad: float = 0.0
) -> np.ndarray:
    """Return the positions of a walker over a number of cycles, starting at a given phase."""
    times = np.arange(int(np.ceil(cycles / frequency_hz * rate_hz))) / rate_hz
    return fourier.synthesise(coefficients, frequency_hz, times + phase_rad / (2 * np.pi * frequency_hz))


def turned(positions: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Return positions (T, J, 3) rotated about the vertical axis, by one angle or by one angle for each frame."""
    c, s = np.cos(angle), np.sin(angle)
    if np.ndim(angle):
        c, s = c[:, None], s[:, None]
    x, y, z = np.moveaxis(positions, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def overground(
    seed: int,
    *,
    standing_s: tuple[float, float] = (1.5, 1.5),
    walking_s: float = 8.0,
    stop_s: float = 0.0,
    veer: float = 0.25,
    heading: float = 0.4,
    backwards: bool = False,
    excursion: float = 1.0,
) -> Clip:
    """Return a clip of a person who stands, walks along a curve, may stop once, and stands again.

    The legs' phase and excursion follow the speed, so that who stands has both feet together.
    """
    coefficients = walker(np.random.default_rng(seed), individual=0.3)
    total = standing_s[0] + walking_s + standing_s[1]
    t = np.arange(int(total * RATE_HZ)) / RATE_HZ
    begin, end, ramp = standing_s[0], standing_s[0] + walking_s, 0.8
    pace = np.clip((t - begin) / ramp, 0, 1) * np.clip((end - t) / ramp, 0, 1)
    if stop_s:
        middle = begin + 0.65 * walking_s
        pace *= np.clip((np.abs(t - middle) - stop_s / 2) / ramp, 0, 1)
    pace = pace**2 * (3 - 2 * pace)

    def integral(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values[:1] * 0, np.cumsum((values[1:] + values[:-1]) / 2, axis=0) / RATE_HZ])

    walked = fourier.synthesise(coefficients, STRIDE_HZ, integral(pace))
    body = coefficients[0] + excursion * pace[:, None, None] * (walked - coefficients[0])
    along = heading + veer * np.sin(np.pi * t / total)
    path = integral(SPEED_MM_S * pace[:, None] * np.stack([np.cos(along), np.sin(along)], axis=1))
    if backwards:
        path = -path
    positions = turned(body, along - np.pi / 2)
    positions[..., :2] += path[:, None]
    positions[..., 2] += HIP_MM
    return Clip(positions, body, pace >= 1.0, coefficients)
