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

from pipeline.core.anatomical.stance import ANKLES
from pipeline.core.fourier import cycle_basis, cycle_slope, equal_phases
from pipeline.core.keypoint_walk.posterior import PELVIS, angles_with_deviations
from pipeline.core.keypoint_walk.training import BLOCKS, SIZE
from pipeline.core.sagittal_angles import ANGLES, SIDES, sagittal_angles, sagittal_slopes

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


def _coordinate(joint: int, axis: int, rows: np.ndarray) -> np.ndarray:
    """Derivatives (407,) of a coordinate of a joint, or of its slopes in phase, whose basis is `rows` (9,)."""
    found = np.zeros(SIZE + 2)
    start = (3 * joint + axis) * BLOCKS
    found[start : start + BLOCKS] = rows
    return found


def _event(walker: np.ndarray, ankle: int, sign: float) -> tuple[float, np.ndarray]:
    """Phase of contact, after an ankle is farthest in front (sign 1), or of toe-off (-1), and its derivatives."""
    y = walker[ankle, 1] - walker[PELVIS, 1]
    psi = float(_GRID[np.argmax(np.round(sign * (_BASIS @ y), 6))])
    for _ in range(_STEPS):
        curved = -(_ORDER**2) * cycle_basis(np.array(psi), BLOCKS) @ y
        # Away from a maximum's bend, where walkers are none, the grid's phase is kept.
        psi -= float(cycle_slope(np.array(psi), BLOCKS) @ y / curved) if sign * curved < 0 else 0.0
    slope = cycle_slope(np.array(psi), BLOCKS)
    moved = _coordinate(ankle, 1, slope) - _coordinate(PELVIS, 1, slope)
    later = 2.0 * np.pi * LATER[0 if sign > 0 else 1]
    return (psi + later) % (2.0 * np.pi), -moved / (-(_ORDER**2) * cycle_basis(np.array(psi), BLOCKS) @ y)


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
    phases, slopes = np.empty((2, 2)), np.empty((2, 2, SIZE + 2))
    for event, sign in enumerate((1.0, -1.0)):
        for side, ankle in enumerate(ANKLES):
            phases[event, side], slopes[event, side] = _event(walker, ankle, sign)
    period, turn = 1.0 / frequency_hz, 2.0 * np.pi
    of_log_f = np.zeros(SIZE + 2)
    of_log_f[-1] = 1.0
    ground = np.concatenate([belt, [0.0, 0.0]])
    speed = float(belt @ walker.ravel())
    found: dict[tuple[str, str], tuple[float, np.ndarray]] = {}
    at = [cycle_basis(psi, BLOCKS) for psi in phases[0]]
    set_down = [float(at[side] @ walker[ankle, 1]) for side, ankle in enumerate(ANKLES)]
    places = []
    for side, ankle in enumerate(ANKLES):
        moving = float(cycle_slope(phases[0, side], BLOCKS) @ walker[ankle, 1])
        places.append(_coordinate(ankle, 1, at[side]) + moving * slopes[0, side])
    for side, name in enumerate(SIDES):
        other = 1 - side
        between = (phases[0, side] - phases[0, other]) % turn
        of_between = slopes[0, side] - slopes[0, other]
        found["step_time", name] = (
            period * between / turn, period * (of_between / turn - between / turn * of_log_f),
        )  # fmt: skip
        found["stance", name] = (
            float((phases[1, side] - phases[0, side]) % turn) / turn, (slopes[1, side] - slopes[0, side]) / turn,
        )  # fmt: skip
        found["step_length", name] = (
            set_down[side] - set_down[other] + speed * between,
            places[side] - places[other] + between * ground + speed * of_between,
        )
    angles = sagittal_angles(np.moveaxis(walker @ _BASIS.T, -1, 0))[:, _ANGLES]
    for end, pick in (("most", np.argmax), ("least", np.argmin)):
        for number, instant in zip(_ANGLES, pick(np.round(angles, 9), axis=0), strict=True):
            side_name, _, kind = ANGLES[number].partition("_")
            # At a greatest or least value the derivative with respect to the phase is zero.
            slope = sagittal_slopes(walker @ _BASIS[instant])[number]
            row = np.concatenate([(slope[..., None] * _BASIS[instant]).ravel(), [0.0, 0.0]])
            found[f"{kind}_{end}", side_name] = float(angles[instant, _ANGLES.index(number)]), row
    for kind in SIDED:
        (left, of_left), (right, of_right) = (found[kind, side] for side in SIDES)
        found[kind, "difference"] = left - right, of_left - of_right
    stances = [found["stance", side] for side in SIDES]
    found["stride_time", ""] = period, -period * of_log_f
    found["double_support", ""] = stances[0][0] + stances[1][0] - 1.0, stances[0][1] + stances[1][1]
    found["stride_length", ""] = turn * speed, turn * ground
    across = [float(at[side] @ walker[ankle, 0]) for side, ankle in enumerate(ANKLES)]
    of_across = [
        _coordinate(ankle, 0, at[side])
        + float(cycle_slope(phases[0, side], BLOCKS) @ walker[ankle, 0]) * slopes[0, side]
        for side, ankle in enumerate(ANKLES)
    ]
    found["step_width", ""] = across[1] - across[0], of_across[1] - of_across[0]
    values, rows = zip(*(found[number] for number in NUMBERS), strict=True)
    return GaitCycle(phases, slopes, np.array(values), np.array(rows))


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
