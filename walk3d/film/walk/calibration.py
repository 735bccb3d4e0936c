"""Calibration of error bars by multipliers that are learnt on people who were left out of the model.

The posterior's standard deviations are multiplied so that bars of each level cover that share of the errors of
left-out people.  Joints have multipliers by group and camera axis, angles by kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.skeleton import WALKER15
from walk3d.film.walk.cycle import EVENTS, NUMBERS, SIDED, WHOLE
from walk3d.film.walk.sagittal_angles import ANGLES, KINDS

LEVELS = (0.5, 0.8, 0.95)
NORMAL = (0.6744897501960817, 1.2815515655446004, 1.959963984540054)
"""Half widths, in standard deviations, of the central intervals of a normal distribution at each of `LEVELS`."""
GROUPS = ("head", "sternum", "shoulder", "elbow", "wrist", "hip", "knee", "ankle")
"""Groups of joints that share the multipliers of their error bars.

The pelvis is the origin and has no error bar.
"""
GROUP_OF = np.array([
    -1 if joint == "pelvis" else GROUPS.index(joint.split("_")[-1]) for joint in WALKER15.joints
])  # fmt: skip
KIND_OF = np.array([KINDS.index(name.split("_")[-1]) for name in ANGLES])
CYCLE_KINDS = (*EVENTS, *SIDED, *(f"{kind}_difference" for kind in SIDED), *WHOLE)
"""Kinds of gait-cycle quantities, each with separate multipliers of its error bars.

In order: event times, numbers of one side, left-right differences of these numbers, numbers of the whole walk.
"""
CYCLE_KIND_OF = np.array([
    CYCLE_KINDS.index(f"{kind}_{side}" if side == "difference" else kind) for kind, side in NUMBERS
])  # fmt: skip
VIEW_EXTRA_RAD = np.radians(2.5)
"""Standard deviation, rad, that is added in quadrature to that of the heading.

The reason is that people walk a few degrees sideways.
"""
CADENCE_EXTRA = 0.005
"""Relative standard deviation that is added in quadrature to that of the cadence."""
AS_OURS, ANYBODY = "measured_as_ours", "anybody"
"""Kinds of error bars.

The first is for people from the model's own laboratories, the second for people from any other laboratory.
"""


@dataclass(frozen=True)
class Calibration:
    """Multipliers that scale standard deviations to calibrated error bars.

    Attributes
    ----------
    joints : (8, 3, 3)
        By group of joints, camera axis (right, down, away) and level.
    angles : (6, 3)
        By kind of angle and level.
    cycle : (20, 3)
        By `CYCLE_KINDS` and level.
    view : (2, 3)
        By heading and cadence, and level, without `VIEW_EXTRA_RAD` and `CADENCE_EXTRA`.
    """

    joints: np.ndarray
    angles: np.ndarray
    cycle: np.ndarray
    view: np.ndarray


@dataclass(frozen=True)
class StandardErrors:
    """Errors of the reconstruction of one clip, in units of the posterior's standard deviations.

    Attributes
    ----------
    joints : (T, 15, 3)
        0 for the pelvis.
    angles : (T, 11)
    events : two of (n,)
        Errors of contact and of toe-off times.
    numbers : (25,)
        Errors of `NUMBERS` of the gait cycle.
    view : (2,)
        Errors of the heading and of the logarithm of the frequency.
    """

    joints: np.ndarray
    angles: np.ndarray
    events: Sequence[np.ndarray]
    numbers: np.ndarray
    view: np.ndarray

    @property
    def cycle(self) -> list[np.ndarray]:
        """Absolute standardised errors of gait-cycle quantities, in the order of `CYCLE_KINDS`."""
        rest = range(len(EVENTS), len(CYCLE_KINDS))
        return [np.abs(z) for z in (*self.events, *(self.numbers[k == CYCLE_KIND_OF] for k in rest))]


def learn(clips: Sequence[StandardErrors]) -> Calibration:
    """Learn the multipliers of error bars from the standardised errors in clips of left-out people."""
    joints_off = np.abs(np.concatenate([clip.joints for clip in clips]))
    angles_off = np.abs(np.concatenate([clip.angles for clip in clips]))
    joints = np.empty((len(GROUPS), 3, len(LEVELS)))
    for group in range(len(GROUPS)):
        part = joints_off[:, group == GROUP_OF]
        joints[group] = (np.quantile(part, LEVELS, axis=(0, 1)) / np.array(NORMAL)[:, None]).T
    angles = [np.quantile(angles_off[:, kind == KIND_OF], LEVELS) / NORMAL for kind in range(len(KINDS))]
    # An event that no clip contains keeps a multiplier of 1.
    by_kind = [np.concatenate(z) for z in zip(*(clip.cycle for clip in clips), strict=True)]
    cycle = [np.quantile(z, LEVELS) / NORMAL if z.size else np.ones(len(LEVELS)) for z in by_kind]
    view = np.quantile(np.abs([clip.view for clip in clips]), LEVELS, axis=0).T / NORMAL
    return Calibration(joints, np.stack(angles), np.stack(cycle), view)


def joint_half_widths(calibration: Calibration, sd_mm: np.ndarray, level: int) -> np.ndarray:
    """Return half widths (…, 15, 3) of joint error bars at one of `LEVELS`, from standard deviations (…, 15, 3)."""
    return sd_mm * calibration.joints[GROUP_OF][:, :, level] * NORMAL[level]


def angle_half_widths(calibration: Calibration, sd_rad: np.ndarray, level: int) -> np.ndarray:
    """Return half widths (…, 11) of angle error bars at one of `LEVELS`, from standard deviations (…, 11)."""
    return sd_rad * calibration.angles[KIND_OF][:, level] * NORMAL[level]


def cycle_half_widths(calibration: Calibration, sd: np.ndarray, level: int) -> np.ndarray:
    """Return half widths (…, 25) of the error bars of gait-cycle numbers, from their standard deviations (…, 25)."""
    return sd * calibration.cycle[CYCLE_KIND_OF][:, level] * NORMAL[level]
