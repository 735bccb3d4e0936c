"""Correlated variation from stride to stride of stride time, joint angles and foot placement."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pipeline.synthetic.walkers import normative_gait as norm
from pipeline.synthetic.walkers.person import Person


@dataclass(frozen=True)
class Strides:
    """Phases, angle factors and foot positions of a walk in each frame, which vary from stride to stride.

    Attributes
    ----------
    phase : (2, T)
        Phase of each leg, cycles.
    gains : dict
        Factors on the excursions: ``thigh``, ``trunk`` (T,), ``knee``, ``arm`` (2, T).
    foot, lane : (2, T), (T,)
        Sideways shifts of the line of each foot, and of the walker, mm.
    """

    phase: np.ndarray
    gains: dict[str, np.ndarray]
    foot: np.ndarray
    lane: np.ndarray


def draw_strides(person: Person, rng: np.random.Generator, frames: int, frame_rate_hz: float) -> Strides:
    """Draw the strides of a walk with correlated variation; a shorter walk is the beginning of a longer one."""
    cycles = np.arange(frames) * person.frequency / frame_rate_hz
    # One row per stride, with spare rows for strides faster than the mean.
    rows = int(np.ceil(cycles[-1] * 1.2)) + 4
    fresh = rng.standard_normal((rows, 10))
    memory = np.full(10, norm.STRIDE_MEMORY)
    memory[9] = norm.BELT_WANDER_MEMORY
    memory[7:9] = 0.0
    new = np.sqrt(1.0 - memory**2)
    steady = new * fresh
    steady[0] += fresh[0] * (1.0 - new)  # the first stride has the variance of the others
    for before, stride in pairwise(steady):
        stride += memory * before
    knots = np.arange(rows)

    def at(stride: np.ndarray, column: int) -> np.ndarray:
        return np.interp(stride, knots, steady[:, column])

    # Interpolation between strides reduces the variance; the divisor restores it.
    slower = norm.STRIDE_TIME_CV * at(cycles, 0) / np.sqrt((2.0 + norm.STRIDE_MEMORY) / 3.0)
    left = person.start_phase + np.cumsum(person.frequency / frame_rate_hz / (1.0 + slower))
    phase = np.stack([left, left + 0.5 + person.step_asymmetry])
    leg, arm, trunk = (norm.STRIDE_GAIN_CV[part] for part in ("leg", "arm", "trunk"))
    gains = {
        "thigh": (1.0 + leg / 2.0 * at(left, 1)) * (1.0 + slower),
        "knee": np.stack([1.0 + leg * at(left, c) for c in (2, 3)]),
        "arm": np.stack([1.0 + arm * at(left, c) for c in (4, 5)]),
        "trunk": 1.0 + trunk * at(left, 6),
    }
    # A foot stays on its line in stance, and moves to the next line in swing.
    foot = np.empty_like(phase)
    for side in (0, 1):
        stride = np.floor(phase[side] - norm.TOE_OFF).astype(int) + 1
        within = phase[side] % 1.0
        swing = np.where(within < norm.TOE_OFF, 1.0, (within - norm.TOE_OFF) / (1.0 - norm.TOE_OFF))
        lines = norm.FOOT_PLACEMENT_SD_MM * steady[:, 7 + side]
        before, after = lines[np.maximum(stride - 1, 0)], lines[stride]
        foot[side] = before + (after - before) * swing**2 * (3.0 - 2.0 * swing)
    return Strides(phase, gains, foot, norm.BELT_WANDER_SD_MM * at(cycles, 9))
