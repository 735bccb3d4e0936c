"""Held-out performances for tracking, and the action model learnt from the remaining performances.

A tracker knows the lengths of the actor's limbs, the level of the floor and the actor's first heading.  Everything else
comes from the other performances: aSpace, pattern, synchronization, action model, diffusion of deviations, duration of
the action, and misfit of joints in the aSpace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.core import posture
from pipeline.core.action_model import LearntAction
from pipeline.core.posture import LimbLengths
from pipeline.core.tracking import Dynamics, learnt_diffusion
from pipeline.skeleton import WALKER15
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.validation import InvalidInput


class LeaveOut(StrEnum):
    """Choice of the performances that are excluded from the model with which one performance is tracked."""

    performance = "performance"
    """Only the tracked performance is excluded."""
    person = "person"
    """All performances of the tracked person are excluded."""


_PELVIS, _HIPS = WALKER15.index("pelvis"), [WALKER15.index(f"{side}_hip") for side in ("left", "right")]
_HIP_COSINES = slice(1, 3)
"""Indices of the horizontal direction cosines of the hip in the 37 numbers of a posture."""


@dataclass(frozen=True)
class Performance:
    """A single performance, as postures for learning and as joints for tracking.

    Attributes
    ----------
    postures : (F, 37)
    joints_mm : (F, 15, 3)
        Recorded joints, with the pelvis over the origin, the floor at z = 0 and the heading of the postures.
    body : LimbLengths
    frame : str
        Reference frame of the direction cosines.
    """

    postures: np.ndarray
    joints_mm: np.ndarray
    body: LimbLengths
    frame: str


@dataclass(frozen=True)
class HeldOut:
    """Action model that is learnt without the held-out performances.

    Attributes
    ----------
    action : LearntAction
    dynamics : Dynamics
        Dynamics with learnt diffusion and nominal rate.
    own_step : float
        Diffusion of a random walk with steps as large as those between frames, including the movement.
    misfit_mm : (15,)
        Root mean square difference of each joint's coordinates from those reconstructed from the aSpace.
    frame : str
        As in `Performance`.
    """

    action: LearntAction
    dynamics: Dynamics
    own_step: float
    misfit_mm: np.ndarray
    frame: str

    def joints(self, coordinates: np.ndarray, body: LimbLengths) -> np.ndarray:
        """Return the joints (S, 15, 3), mm, of a body from aSpace coordinates (S, b); NaN where no posture is defined.

        Once in millions of steps, a random walk through the aSpace reaches a limb that points against its rest
        direction.  Its frame is undefined there, and a particle without joints gets no weight.
        """
        postures = self.action.space.postures(coordinates)
        return posture.joints_where_defined(postures, body, frame=self.frame)


def performances_of(dataset: Postures) -> list[Performance]:
    """Return all performances of a data set."""
    each = zip(dataset.split(dataset.postures), dataset.split(dataset.positions), strict=True)
    return [
        Performance(p, standing(r, p, dataset.floor_mm[m]), dataset.body(m), dataset.frame)
        for m, (p, r) in enumerate(each)
    ]


def standing(recorded: np.ndarray, postures: np.ndarray, floor_mm: float) -> np.ndarray:
    """Return joints (F, 15, 3), mm, shifted to the origin and the floor, and rotated to the heading of the postures.

    Parameters
    ----------
    recorded : (F, 15, 3)
        Joints, mm, at any position.
    postures : (F, 37)
        Postures of the same frames, with any heading.
    floor_mm : float
    """
    across = recorded[:, _HIPS[1]] - recorded[:, _HIPS[0]]
    hip = postures[:, _HIP_COSINES]
    turn = np.arctan2(hip[:, 1], hip[:, 0]) - np.arctan2(across[:, 1], across[:, 0])
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y, z = np.moveaxis(recorded - recorded[:, [_PELVIS]] * [1.0, 1.0, 0.0], -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z - floor_mm], axis=-1)


def left_out(people: np.ndarray, performance: int, leave_out: LeaveOut) -> np.ndarray:
    """Return a mask (M,) of the performances to exclude from the model with which one performance is tested.

    Parameters
    ----------
    people : (M,)
        Person of each performance.
    performance : int
    leave_out : LeaveOut

    Raises
    ------
    InvalidInput
        If fewer than two performances remain.
    """
    alone = np.arange(len(people)) == performance
    out = alone if leave_out is LeaveOut.performance else people == people[performance]
    if (~out).sum() < 2:
        raise InvalidInput(
            "too few performances are left to learn a model from",
            f"leave one {leave_out} out, performance {performance}",
            "2 or more",
            (~out).sum(),
            code="too_few_performances",
            count=(~out).sum(),
        )
    return out


def learn_without(options: ActionSpaceModel, performances: Sequence[Performance], out: np.ndarray) -> HeldOut:
    """Return the action model that is learnt from all performances except the excluded ones.

    Parameters
    ----------
    options : ActionSpaceModel
    performances : sequence of Performance
    out : (M,) bool
        Mask of the performances that are left out.
    """
    others = [p for p, left in zip(performances, out, strict=True) if not left]
    action = options.teach([p.postures for p in others])
    model, frame = action.model, others[0].frame
    frames = float(np.mean([len(p.postures) for p in others]))
    dynamics = Dynamics(
        nominal_rate=(len(model.mean) - 1.0) / (frames - 1.0),
        diffusion=learnt_diffusion(action.synchronized, model.mean, model.standard_deviation),
        bound=options.bound,
    )
    steps = np.concatenate([np.diff(x, axis=0) for x in action.raw])
    size = np.sqrt((model.standard_deviation**2).mean(axis=0))
    misfit = np.concatenate(
        [
            posture.joints(action.space.postures(x), p.body, frame=frame) - p.joints_mm
            for x, p in zip(action.raw, others, strict=True)
        ]
    )
    return HeldOut(
        action=action,
        dynamics=dynamics,
        own_step=np.sqrt((steps**2 / size**2).mean()),
        misfit_mm=np.sqrt((misfit**2).mean(axis=(0, 2))),
        frame=frame,
    )
