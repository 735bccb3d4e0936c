"""Events of the gait cycle and the numbers that are read of it, with derivatives with respect to the walker.

A foot is set down soon after its ankle is farthest in front of the pelvis, and taken off soon after it is farthest
behind [Zeni 2008; of ankles from keypoints: Stenum 2021].  Everything is of the periodic walker: of one average cycle.

Symbols
-------
``u``       walker W (405), phase in the middle of the clip, logarithm of the frequency: 407 unknowns
``psi_e``   phase of an event: a root of ``y'(psi)``, ankle less pelvis;  ``d psi_e = -y'(psi_e; dW) / y''(psi_e)``
``belt``    speed of the ground, mm per radian of phase
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.fourier import cycle_basis, cycle_slope, equal_phases
from pipeline.skeleton import ANKLES, PELVIS
from walk3d.film.walk.posterior import angles_with_deviations
from walk3d.film.walk.sagittal_angles import ANGLES, SIDES, sagittal_angles, sagittal_slopes
from walk3d.film.walk.training import BLOCKS, SIZE

EVENTS = ("contact", "toe_off")
LATER = (0.032, 0.012)
"""Shares of a cycle by which events come after the ankle's turning points: means of 54 events that a laboratory marked
of 12 children, whose other events they give to 7 and 11 ms in the median (`tests/benchmarks/gait_events.py`)."""
SIDED = ("step_time", "stance", "step_length", "hip_most", "hip_least", "knee_most", "knee_least")
"""Numbers of either side: s, share of the cycle, mm, rad; of an angle its greatest and least value over the cycle."""
WHOLE = ("stride_time", "double_support", "stride_length", "step_width")
"""Numbers of the walk: s, share of the cycle, mm, mm."""
NUMBERS = (
    *((kind, side) for kind in SIDED for side in (*SIDES, "difference")),
    *((kind, "") for kind in WHOLE),
)
"""Kind and side of every number; a difference is left less right."""
_STEPS = 4
"""Of Newton, from within a degree of the root."""
_GRID = equal_phases(360)
_BASIS = cycle_basis(_GRID, BLOCKS)
_ORDER = np.repeat(np.arange(BLOCKS // 2 + 1), 2)[1:]
"""Harmonic (9,) of each coefficient."""
_ANGLES = [ANGLES.index(f"{side}_{kind}") for kind in ("hip", "knee") for side in SIDES]


@dataclass(frozen=True)
class GaitCycle:
    """Events and numbers of one average cycle.

    Attributes
    ----------
    phases : (2, 2)
        Of contact and toe-off, left and right, rad.
    phase_slopes : (2, 2, 407)
        Derivatives with respect to u.
    values : (25,)
        As `NUMBERS` names them.
    slopes : (25, 407)
    """

    phases: np.ndarray
    phase_slopes: np.ndarray
    values: np.ndarray
    slopes: np.ndarray


def _times(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Product of two numbers, each before its derivatives, (408,)."""
    found = one[0] * other + other[0] * one
    found[0] = one[0] * other[0]
    return found


def _place(walker: np.ndarray, joint: int, axis: int, psi: np.ndarray) -> np.ndarray:
    """Coordinate of a joint at a phase, before its derivatives, (408,); the phase likewise."""
    basis, along = cycle_basis(psi[0], BLOCKS), walker[joint, axis]
    found = (cycle_slope(psi[0], BLOCKS) @ along) * psi
    found[0] = basis @ along
    found[1 + (3 * joint + axis) * BLOCKS :][:BLOCKS] += basis
    return found


def _event(walker: np.ndarray, ankle: int, sign: float, later: float) -> np.ndarray:
    """Phase soon after an ankle is farthest in front of the pelvis (sign 1) or behind it, before its derivatives."""
    y = walker[ankle, 1] - walker[PELVIS, 1]
    psi = _GRID[np.argmax(np.round(sign * (_BASIS @ y), 6))]
    for _ in range(_STEPS):
        # Where nothing is bent as walkers are, the grid's phase is kept.
        bent = min(sign * (-(_ORDER**2) * cycle_basis(np.array(psi), BLOCKS) @ y), -1e-6)
        slope = cycle_slope(np.array(psi), BLOCKS)
        psi -= sign * (slope @ y) / bent if bent < -1e-6 else 0.0
    found = np.zeros(SIZE + 3)
    found[0] = (psi + 2.0 * np.pi * later) % (2.0 * np.pi)
    for joint, weight in ((ankle, -1.0), (PELVIS, 1.0)):
        found[1 + (3 * joint + 1) * BLOCKS :][:BLOCKS] = weight * slope * sign / bent
    return found


def _share(later: np.ndarray, earlier: np.ndarray) -> np.ndarray:
    """Share of the cycle from one phase to the next other one, before derivatives."""
    found = (later - earlier) / (2.0 * np.pi)
    found[0] %= 1.0
    return found


def gait_cycle(walker: np.ndarray, frequency_hz: float, belt: np.ndarray) -> GaitCycle:
    """Return the events and numbers of a walker's cycle.

    Parameters
    ----------
    walker : (15, 3, 9)
        mm.
    frequency_hz : float
    belt : (405,)
        Speed of the ground, mm per radian of phase, as a functional of the walker.

    Notes
    -----
    A step's length is that of the foot's place on the ground before the other foot's, so that both make a stride.
    """
    events = np.array([
        [_event(walker, ankle, sign, later) for ankle in ANKLES]
        for sign, later in zip((1.0, -1.0), LATER, strict=True)
    ])  # fmt: skip
    (contact, toe_off), found = events, dict[tuple[str, str], np.ndarray]()
    period = np.zeros(SIZE + 3)
    period[[0, -1]] = 1.0 / frequency_hz, -1.0 / frequency_hz
    ground = 2.0 * np.pi * np.concatenate([[belt @ walker.ravel()], belt, [0.0, 0.0]])
    across, ahead = ([_place(walker, *at, psi) for at, psi in zip(((a, axis) for a in ANKLES), contact, strict=True)]
                     for axis in (0, 1))  # fmt: skip
    for side, name in enumerate(SIDES):
        step = _share(contact[side], contact[1 - side])
        found["step_time", name] = _times(period, step)
        found["stance", name] = _share(toe_off[side], contact[side])
        found["step_length", name] = ahead[side] - ahead[1 - side] + _times(ground, step)
    angles = sagittal_angles(np.moveaxis(walker @ _BASIS.T, -1, 0))
    rounded = np.round(angles[:, _ANGLES], 9)
    instants = np.concatenate([rounded.argmax(axis=0), rounded.argmin(axis=0)])
    # At a greatest or least value the derivative with respect to the phase is zero.
    slopes = sagittal_slopes(np.moveaxis(walker @ _BASIS[instants].T, -1, 0))
    for n, (instant, number) in enumerate(zip(instants.tolist(), 2 * _ANGLES, strict=True)):
        name, kind = ANGLES[number].split("_")
        slope = slopes[n, number][..., None] * _BASIS[instant]
        row = np.concatenate([[angles[instant, number]], slope.ravel(), [0.0, 0.0]])
        found[f"{kind}_{'most' if n < len(_ANGLES) else 'least'}", name] = row
    for kind in SIDED:
        found[kind, "difference"] = found[kind, "left"] - found[kind, "right"]
    found["stride_time", ""], found["stride_length", ""] = period, ground
    found["double_support", ""] = found["stance", "left"] + found["stance", "right"]
    found["double_support", ""][0] -= 1.0
    found["step_width", ""] = across[1] - across[0]
    table = np.stack([found[number] for number in NUMBERS])
    return GaitCycle(events[..., 0], events[..., 1:], table[:, 0], table[:, 1:])


def deviations(slopes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviations (…) of numbers with these derivatives (…, 407)."""
    return np.sqrt(np.maximum(((slopes @ covariance) * slopes).sum(axis=-1), 0.0))


def event_times(
    cycle: GaitCycle, covariance: np.ndarray, phase_rad: float, frequency_hz: float, times: np.ndarray
) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return the times at which each foot is set down and taken off in a clip, and their standard deviations, s.

    Parameters
    ----------
    cycle : GaitCycle
    covariance : (407, 407)
    phase_rad, frequency_hz : float
        Phase at time 0.
    times : (T,)
        Of the frames.

    Returns
    -------
    list of list of ((n,), (n,))
        As `GaitCycle.phases`.
    """
    omega = 2.0 * np.pi * frequency_hz
    found = []
    for phases, slopes in zip(cycle.phases, cycle.phase_slopes, strict=True):
        of_sides = []
        for psi, slope in zip(phases, slopes, strict=True):
            ends = (omega * times[[0, -1]] + phase_rad - psi) / (2.0 * np.pi)
            turns = np.arange(np.ceil(ends[0]), np.floor(ends[1]) + 1)
            at = (psi + 2.0 * np.pi * turns - phase_rad) / omega
            rows = np.tile(slope / omega, (len(at), 1))
            rows[:, SIZE] -= 1.0 / omega
            rows[:, SIZE + 1] -= at
            of_sides.append((at, deviations(rows, covariance)))
        found.append(of_sides)
    return found


def angle_curves(
    walker: np.ndarray, covariance: np.ndarray, cycle: GaitCycle, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return angles (2, K, 11) over the cycle and their standard deviations, rad, from each foot's contact to its next.

    Parameters
    ----------
    walker : (15, 3, 9)
    covariance : (407, 407)
        Of one walker, or of walkers.
    cycle : GaitCycle
        Of the walker.
    count : int
        Instants K, first and last contact included.
    """
    share = np.linspace(0.0, 2.0 * np.pi, count)
    sides = [
        angles_with_deviations(walker, covariance, psi + share, np.tile(slope, (count, 1)))
        for psi, slope in zip(cycle.phases[0], cycle.phase_slopes[0], strict=True)
    ]
    return np.stack([angles for angles, _ in sides]), np.stack([sd for _, sd in sides])
