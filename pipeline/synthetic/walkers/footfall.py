"""Contact of the feet with the belt: rolling of the foot, weight on each leg, and correction of the motion.

Legend: e thigh elevation, k knee flexion, l1 thigh, l2 shank.  Arrays are (space, side, frame); sides are
ordered left, right; phases (side, frame) are in cycles, 0 at a leg's own contact.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from pipeline.core import anthropometry as body
from pipeline.synthetic.walkers import normative_gait as norm
from pipeline.synthetic.walkers.person import Person

_STEP = 1e-5
"""Step size of finite differences: radians for angles, a fraction for scale factors."""

_FOOT_PITCH = PchipInterpolator(norm.FOOT_PHASES, np.radians(norm.FOOT_PITCH_DEG))


def rolling_foot(person: Person, phase: np.ndarray, gains: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the forward shift and the height, both (2, T), mm, of the ankles above feet that roll on the belt.

    The shift is relative to the ankle over a flat foot.
    """
    pitch = _FOOT_PITCH(phase % 1.0)
    pitch = pitch * np.where(pitch > 0, gains[0], gains[1])
    # The foot rotates about the heel while the toes are up, and about the ball while the heel is up.
    pivot = person.body.stature * np.where(pitch > 0, -body.FOOT_HEEL, body.FOOT_BALL)
    height = person.body.stature * body.SEGMENTS["ankle_height"]
    sin, cos = np.sin(pitch), np.cos(pitch)
    return pivot - pivot * cos - height * sin, height * cos - pivot * sin


def weight_shares(phase: np.ndarray) -> np.ndarray:
    """Return the shares (2, T) of body weight on the left and right leg; they sum to one."""
    within = phase % 1.0
    handover = norm.TOE_OFF - 0.5
    share = np.clip(np.minimum(within, norm.TOE_OFF - within) / handover, 0.0, 1.0)
    smooth = share**2 * (3.0 - 2.0 * share)
    return smooth / smooth.sum(axis=0)


def keep_to_floor(person: Person) -> Person:
    """Return the walker after the smallest changes that keep the feet on the floor and moving with the belt.

    Independently drawn angles do not satisfy this.  Gauss–Newton least squares adjusts the landmark values of thigh and
    knee, the scale of the thigh's excursion, the excursions of the foot, and the surge and bob of the pelvis.  The
    scale of the thigh's excursion sets the stride length.  Each change is in units of its standard deviation.  In the
    result, the ankles in stance are where a
    foot that rolls on the belt puts them.
    """
    stance = np.linspace(0.0, norm.FLOOR_UNTIL, 24)
    belt = person.speed / person.frequency * stance
    lag = np.array([[0.0], [0.5 + person.step_asymmetry]])
    thigh, knee = (person.manner[name].values for name in ("thigh", "knee"))
    thigh_basis, knee_basis = (person.basis(name, stance) for name in ("thigh", "knee"))
    centre = thigh.mean(axis=1)
    sizes = [thigh.shape[1]] * 2 + [knee.shape[1]] * 2 + [1, 2, 2, 4, 1, 6]
    *angles, scale, gains, footholds, surge, level, bob = (
        slice(end - size, end) for size, end in zip(sizes, np.cumsum(sizes), strict=True)
    )
    thighs, knees = angles[:2], angles[2:]
    expected = np.zeros(sum(sizes))
    expected[surge] = norm.SURGE_MM
    sd = np.full(
        expected.size, person.body.stature
    )  # footholds on the belt and the level of the pelvis are free
    sd[: knees[0].start] = np.radians(norm.CORRECTION_SD_DEG["thigh"])
    sd[knees[0].start : scale.start] = np.radians(norm.CORRECTION_SD_DEG["knee"])
    sd[scale], sd[gains] = norm.CORRECTION_SCALE_SD, norm.FOOT_GAIN_CV
    sd[surge], sd[bob] = norm.SURGE_SD_MM, norm.BOB_SD_MM
    sides = []
    for side in (0, 1):
        clock = stance - lag[side]
        waves = np.column_stack([f(2.0 * np.pi * h * clock) for h in (1, 2, 4) for f in (np.sin, np.cos)])
        hip = person.hips(clock + lag)[:, side]
        across = person.ankle_lines[side] - person.sideways(clock + lag) - hip[0]
        sides.append((side, waves, hip, across))

    x = expected.copy()
    for _ in range(4):
        factor = person.foot_gains * (1.0 + x[gains])
        foot = rolling_foot(person, stance, factor)
        shifted = [rolling_foot(person, stance, factor + _STEP * unit) for unit in np.eye(2)]
        jacobian, residual = [np.diag(1.0 / sd)], [(x - expected) / sd]
        for side, waves, hip, across in sides:
            excursion = thigh_basis @ (thigh[side] - centre[side])
            e = centre[side] + (1.0 + x[scale]) * excursion + thigh_basis @ x[thighs[side]]
            free = knee_basis @ (knee[side] + x[knees[side]])
            k = norm.stopped(free, norm.KNEE_STOP_DEG)
            slope = (norm.stopped(free + _STEP, norm.KNEE_STOP_DEG) - k) / _STEP
            l1, l2 = person.body.thigh[side], person.body.shank[side]
            reach, length = l1 * np.sin(e) + l2 * np.sin(e - k), l1 * np.cos(e) + l2 * np.cos(e - k)
            upright = np.sqrt(1.0 - (across / length) ** 2)
            ahead = x[surge] @ waves[:, :4].T + belt - x[footholds][side] + hip[1] + reach - foot[0]
            above = x[level] + waves @ x[bob] + hip[2] - length * upright - foot[1]
            slopes = (length, -l2 * np.cos(e - k)), (reach * upright, -l2 * np.sin(e - k) * upright)
            for direction, (error, (by_thigh, by_knee)) in enumerate(
                zip((ahead, above), slopes, strict=True)
            ):
                rows = np.zeros((stance.size, x.size))
                rows[:, thighs[side]] = by_thigh[:, None] * thigh_basis
                rows[:, scale] = (by_thigh * excursion)[:, None]
                rows[:, knees[side]] = (by_knee * slope)[:, None] * knee_basis
                rows[:, gains] = np.stack([foot[direction] - s[direction] for s in shifted], axis=1)
                rows[:, gains] *= person.foot_gains / _STEP
                if direction == 0:
                    rows[:, surge], rows[:, footholds.start + side] = waves[:, :4], -1.0
                else:
                    rows[:, bob], rows[:, level] = waves, 1.0
                jacobian.append(rows / norm.FLOOR_SD_MM)
                residual.append(error / norm.FLOOR_SD_MM)
        j = np.vstack(jacobian)
        x -= np.linalg.solve(j.T @ j, j.T @ np.concatenate(residual))

    corrected = {
        "thigh": centre[:, None] + (1.0 + x[scale]) * (thigh - centre[:, None]) + [x[s] for s in thighs],
        "knee": knee + [x[s] for s in knees],
    }
    manner = {n: replace(m, values=corrected.get(n, m.values)) for n, m in person.manner.items()}
    return replace(person, manner=manner, foot_gains=person.foot_gains * (1.0 + x[gains]))
