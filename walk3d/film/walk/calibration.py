"""Error bars that cover what they say: multipliers learnt on people who were left out.

The posterior's standard deviations are multiplied, for each level, by what made the bars cover that share of the errors
of people whom the model had not seen: by group of joints and camera axis, and by kind of angle.
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
"""Half widths of a normal distribution's bars at these levels, in standard deviations."""
GROUPS = ("head", "sternum", "shoulder", "elbow", "wrist", "hip", "knee", "ankle")
"""Groups of joints; the pelvis is the origin and has no bar."""
GROUP_OF = np.array([
    -1 if joint == "pelvis" else GROUPS.index(joint.split("_")[-1]) for joint in WALKER15.joints
])  # fmt: skip
KIND_OF = np.array([KINDS.index(name.split("_")[-1]) for name in ANGLES])
CYCLE_KINDS = (*EVENTS, *SIDED, *(f"{kind}_difference" for kind in SIDED), *WHOLE)
"""Kinds of what is read of the gait cycle: times of events, numbers of either side, their differences, of the walk."""
CYCLE_KIND_OF = np.array([
    CYCLE_KINDS.index(f"{kind}_{side}" if side == "difference" else kind) for kind, side in NUMBERS
])  # fmt: skip
VIEW_EXTRA_RAD = np.radians(2.5)
"""Added to the standard deviation of the heading: people walk a few degrees crabwise."""
CADENCE_EXTRA = 0.005
"""Added to the relative standard deviation of the cadence."""
AS_OURS, ANYBODY = "measured_as_ours", "anybody"
"""For whom bars hold: a person left out of the laboratories that are known, or one of a laboratory left out."""


@dataclass(frozen=True)
class Calibration:
    """Multipliers of error bars.

    Attributes
    ----------
    joints : (8, 3, 3)
        By group of joints, camera axis (right, down, away) and level.
    angles : (6, 3)
        By kind of angle and level.
    cycle : (20, 3)
        By kind of what is read of the gait cycle and level.
    view : (2, 3)
        Of heading and cadence, by level, before what is added to them.
    """

    joints: np.ndarray
    angles: np.ndarray
    cycle: np.ndarray
    view: np.ndarray


@dataclass(frozen=True)
class StandardErrors:
    """Errors of one clip over their standard deviations.

    Attributes
    ----------
    joints : (T, 15, 3)
        0 for the pelvis.
    angles : (T, 11)
    events : two of (n,)
        Of contacts and of toe-offs.
    numbers : (25,)
        Of the gait cycle.
    view : (2,)
        Of the heading and the logarithm of the frequency.
    """

    joints: np.ndarray
    angles: np.ndarray
    events: Sequence[np.ndarray]
    numbers: np.ndarray
    view: np.ndarray

    @property
    def cycle(self) -> list[np.ndarray]:
        """Absolute errors by `CYCLE_KINDS`."""
        rest = range(len(EVENTS), len(CYCLE_KINDS))
        return [np.abs(z) for z in (*self.events, *(self.numbers[k == CYCLE_KIND_OF] for k in rest))]


def learn(clips: Sequence[StandardErrors]) -> Calibration:
    """Learn multipliers from errors over standard deviations, of clips of people who were left out."""
    joints_off = np.abs(np.concatenate([clip.joints for clip in clips]))
    angles_off = np.abs(np.concatenate([clip.angles for clip in clips]))
    joints = np.empty((len(GROUPS), 3, len(LEVELS)))
    for group in range(len(GROUPS)):
        part = joints_off[:, group == GROUP_OF]
        joints[group] = (np.quantile(part, LEVELS, axis=(0, 1)) / np.array(NORMAL)[:, None]).T
    angles = [np.quantile(angles_off[:, kind == KIND_OF], LEVELS) / NORMAL for kind in range(len(KINDS))]
    # Of an event that no clip held nothing is learnt: as computed.
    by_kind = [np.concatenate(z) for z in zip(*(clip.cycle for clip in clips), strict=True)]
    cycle = [np.quantile(z, LEVELS) / NORMAL if z.size else np.ones(len(LEVELS)) for z in by_kind]
    view = np.quantile(np.abs([clip.view for clip in clips]), LEVELS, axis=0).T / NORMAL
    return Calibration(joints, np.stack(angles), np.stack(cycle), view)


def joint_half_widths(calibration: Calibration, sd_mm: np.ndarray, level: int) -> np.ndarray:
    """Half widths (…, 15, 3) of the bars of joints at one of `LEVELS`, from standard deviations (…, 15, 3)."""
    return sd_mm * calibration.joints[GROUP_OF][:, :, level] * NORMAL[level]


def angle_half_widths(calibration: Calibration, sd_rad: np.ndarray, level: int) -> np.ndarray:
    """Half widths (…, 11) of the bars of angles at one of `LEVELS`."""
    return sd_rad * calibration.angles[KIND_OF][:, level] * NORMAL[level]


def cycle_half_widths(calibration: Calibration, sd: np.ndarray, level: int) -> np.ndarray:
    """Half widths (…, 25) of the bars of `NUMBERS` at one of `LEVELS`."""
    return sd * calibration.cycle[CYCLE_KIND_OF][:, level] * NORMAL[level]
