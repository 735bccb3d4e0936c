"""Events and numbers of the average gait cycle, with derivatives with respect to the walker's coefficients.

A foot's contact is soon after its ankle is farthest in front of the pelvis.  Its toe-off is soon after the ankle is
farthest behind [Zeni 2008; of ankles from keypoints: Stenum 2021].  The walker is periodic: one average cycle.

Symbols
-------
``u``       407 unknowns: walker W (405), phase in the middle of the clip, logarithm of the frequency
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
EVENT_DELAYS = (0.032, 0.012)
"""Delay of contact and of toe-off after the nearest turning point of the ankle, as a share of the gait cycle.

They are means of 54 events that a laboratory marked for 12 children.  They predict the other events of these children
with a median error of 7 and 11 ms (`tests/benchmarks/gait_events.py`).
"""
SIDED = ("step_time", "stance", "step_length", "hip_most", "hip_least", "knee_most", "knee_least")
"""Names of the gait-cycle numbers of one side, in s, shares of the cycle, mm or rad.

``most`` and ``least`` are the maximum and the minimum of an angle.
"""
WHOLE = ("stride_time", "double_support", "stride_length", "step_width")
"""Names of the gait-cycle numbers of the whole walk, in s, shares of the cycle or mm."""
NUMBERS = (
    *((kind, side) for kind in SIDED for side in (*SIDES, "difference")),
    *((kind, "") for kind in WHOLE),
)
"""Kind and side of each gait-cycle number; ``difference`` is left minus right."""
_STEPS = 4
"""Number of Newton steps that refine the phase of a gait event, from an initial error of less than a degree."""
_GRID = equal_phases(360)
_BASIS = cycle_basis(_GRID, BLOCKS)
_ORDER = np.repeat(np.arange(BLOCKS // 2 + 1), 2)[1:]
"""Number of the harmonic to which each of the nine Fourier coefficients belongs."""
_ANGLES = [ANGLES.index(f"{side}_{kind}") for kind in ("hip", "knee") for side in SIDES]


@dataclass(frozen=True)
class GaitCycle:
    """Events and numbers of the average gait cycle of one walk.

    Attributes
    ----------
    phases : (2, 2)
        Phases of contact and toe-off, left and right, rad.
    phase_slopes : (2, 2, 407)
        Derivatives with respect to u.
    values : (25,)
        Values in the order of `NUMBERS`.
    slopes : (25, 407)
    """

    phases: np.ndarray
    phase_slopes: np.ndarray
    values: np.ndarray
    slopes: np.ndarray


def _product(factor: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the product of two quantities with derivatives, each an array (408,) of the value and its derivatives."""
    product = factor[0] * other + other[0] * factor
    product[0] = factor[0] * other[0]
    return product


def _at(walker: np.ndarray, joint: int, axis: int, psi: np.ndarray) -> np.ndarray:
    """Return a joint's coordinate at a phase of the gait cycle, with its derivatives.

    Coordinate and phase are arrays (408,) of a value and its derivatives.
    """
    basis, along = cycle_basis(psi[0], BLOCKS), walker[joint, axis]
    coordinate = (cycle_slope(psi[0], BLOCKS) @ along) * psi
    coordinate[0] = basis @ along
    coordinate[1 + (3 * joint + axis) * BLOCKS :][:BLOCKS] += basis
    return coordinate


def _event(walker: np.ndarray, ankle: int, sign: float, later: float) -> np.ndarray:
    """Return the phase of a gait event and its derivatives, as an array (408,).

    The event comes soon after the ankle is farthest in front (sign 1) or farthest behind (sign -1).
    """
    y = walker[ankle, 1] - walker[PELVIS, 1]
    psi = _GRID[np.argmax(np.round(sign * (_BASIS @ y), 6))]
    for _ in range(_STEPS):
        # The phase of the grid is kept if the curve lacks a walker's curvature.
        bent = min(sign * (-(_ORDER**2) * cycle_basis(np.array(psi), BLOCKS) @ y), -1e-6)
        slope = cycle_slope(np.array(psi), BLOCKS)
        psi -= sign * (slope @ y) / bent if bent < -1e-6 else 0.0
    event = np.zeros(SIZE + 3)
    event[0] = (psi + 2.0 * np.pi * later) % (2.0 * np.pi)
    for joint, weight in ((ankle, -1.0), (PELVIS, 1.0)):
        event[1 + (3 * joint + 1) * BLOCKS :][:BLOCKS] = weight * slope * sign / bent
    return event


def _share(later: np.ndarray, earlier: np.ndarray) -> np.ndarray:
    """Return the share of the cycle from the phase `earlier` to the next phase `later`, with its derivatives."""
    share = (later - earlier) / (2.0 * np.pi)
    share[0] %= 1.0
    return share


def gait_cycle(walker: np.ndarray, frequency_hz: float, belt: np.ndarray) -> GaitCycle:
    """Return the events and numbers of a walker's average gait cycle.

    Parameters
    ----------
    walker : (15, 3, 9)
        Fourier coefficients, mm.
    frequency_hz : float
    belt : (405,)
        Speed of the ground, mm per radian of phase, as a functional of the walker.

    Notes
    -----
    A step length is the distance on the ground from the other foot to this one; left and right make a stride length.
    """
    events = np.array([
        [_event(walker, ankle, sign, later) for ankle in ANKLES]
        for sign, later in zip((1.0, -1.0), EVENT_DELAYS, strict=True)
    ])  # fmt: skip
    (contact, toe_off), numbers = events, dict[tuple[str, str], np.ndarray]()
    period = np.zeros(SIZE + 3)
    period[[0, -1]] = 1.0 / frequency_hz, -1.0 / frequency_hz
    ground = 2.0 * np.pi * np.concatenate([[belt @ walker.ravel()], belt, [0.0, 0.0]])
    across, ahead = ([_at(walker, *at, psi) for at, psi in zip(((a, axis) for a in ANKLES), contact, strict=True)]
                     for axis in (0, 1))  # fmt: skip
    for side, name in enumerate(SIDES):
        step = _share(contact[side], contact[1 - side])
        numbers["step_time", name] = _product(period, step)
        numbers["stance", name] = _share(toe_off[side], contact[side])
        numbers["step_length", name] = ahead[side] - ahead[1 - side] + _product(ground, step)
    angles = sagittal_angles(np.moveaxis(walker @ _BASIS.T, -1, 0))
    rounded = np.round(angles[:, _ANGLES], 9)
    instants = np.concatenate([rounded.argmax(axis=0), rounded.argmin(axis=0)])
    # At an extreme the derivative with respect to the phase is zero.
    slopes = sagittal_slopes(np.moveaxis(walker @ _BASIS[instants].T, -1, 0))
    for n, (instant, number) in enumerate(zip(instants.tolist(), 2 * _ANGLES, strict=True)):
        name, kind = ANGLES[number].split("_")
        slope = slopes[n, number][..., None] * _BASIS[instant]
        row = np.concatenate([[angles[instant, number]], slope.ravel(), [0.0, 0.0]])
        numbers[f"{kind}_{'most' if n < len(_ANGLES) else 'least'}", name] = row
    for kind in SIDED:
        numbers[kind, "difference"] = numbers[kind, "left"] - numbers[kind, "right"]
    numbers["stride_time", ""], numbers["stride_length", ""] = period, ground
    numbers["double_support", ""] = numbers["stance", "left"] + numbers["stance", "right"]
    numbers["double_support", ""][0] -= 1.0
    numbers["step_width", ""] = across[1] - across[0]
    table = np.stack([numbers[number] for number in NUMBERS])
    return GaitCycle(events[..., 0], events[..., 1:], table[:, 0], table[:, 1:])


def deviations(slopes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return standard deviations (…) of quantities, given their derivatives (…, 407) and the walker's covariance."""
    return np.sqrt(np.maximum(((slopes @ covariance) * slopes).sum(axis=-1), 0.0))


def event_times(
    cycle: GaitCycle, covariance: np.ndarray, phase_rad: float, frequency_hz: float, times: np.ndarray
) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Return the contact and toe-off times of each foot in a clip, s, and the standard deviations of these times, s.

    Parameters
    ----------
    cycle : GaitCycle
    covariance : (407, 407)
    phase_rad, frequency_hz : float
        Phase at time 0.
    times : (T,)
        Times of the frames, s.

    Returns
    -------
    list of list of ((n,), (n,))
        Times and standard deviations, in the order of `GaitCycle.phases`.
    """
    omega = 2.0 * np.pi * frequency_hz
    times_of_events = []
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
        times_of_events.append(of_sides)
    return times_of_events


def angle_curves(
    walker: np.ndarray, covariance: np.ndarray, cycle: GaitCycle, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint angles (2, K, 11), rad, from each foot's contact to its next contact, and their standard deviations.

    Parameters
    ----------
    walker : (15, 3, 9)
    covariance : (407, 407)
        Covariance of one walker, or of a population of walkers.
    cycle : GaitCycle
        Gait cycle of the walker.
    count : int
        Number of instants K, including the first and the next contact.
    """
    share = np.linspace(0.0, 2.0 * np.pi, count)
    sides = [
        angles_with_deviations(walker, covariance, psi + share, np.tile(slope, (count, 1)))
        for psi, slope in zip(cycle.phases[0], cycle.phase_slopes[0], strict=True)
    ]
    return np.stack([angles for angles, _ in sides]), np.stack([sd for _, sd in sides])
