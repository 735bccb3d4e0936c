"""Performances to be tracked, and what the others teach: the action learnt anew without them.

What a tracker is told of the actor it follows: the lengths of the limbs, the level of the floor, the way the actor
faces at first.  Everything else comes from the other performances: aSpace, pattern, synchronization, action model,
how fast deviations change, how long the action takes, and how far joints lie from what the aSpace can say.
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
    """What the model of a performance must not have seen."""

    performance = "performance"
    """The performance itself."""
    person = "person"
    """All performances of its person."""


_PELVIS, _HIPS = WALKER15.index("pelvis"), [WALKER15.index(f"{side}_hip") for side in ("left", "right")]
_HIP_COSINES = slice(1, 3)
"""Horizontal direction cosines of the hip in a posture."""


@dataclass(frozen=True)
class Performance:
    """One performance as it is learnt from and as it is seen.

    Attributes
    ----------
    postures : (F, 37)
    joints_mm : (F, 15, 3)
        As recorded, but with the pelvis over the origin, the floor at z = 0 and turned as the postures are.
    body : LimbLengths
    frame : str
        What the direction cosines are relative to.
    """

    postures: np.ndarray
    joints_mm: np.ndarray
    body: LimbLengths
    frame: str


@dataclass(frozen=True)
class HeldOut:
    """What the other performances teach.

    Attributes
    ----------
    action : LearntAction
    dynamics : Dynamics
        The diffusion and the nominal rate are learnt.
    own_step : float
        Diffusion of a random walk whose steps are as large as those from frame to frame, movement included.
    misfit_mm : (15,)
        Root mean square of a coordinate of each joint less the same out of the aSpace.
    frame : str
        As `Performance`.
    """

    action: LearntAction
    dynamics: Dynamics
    own_step: float
    misfit_mm: np.ndarray
    frame: str

    def joints(self, coordinates: np.ndarray, body: LimbLengths) -> np.ndarray:
        """Return joints (S, 15, 3) in mm of a body at points (S, b) of the aSpace; NaN where they are no posture.

        A random walk through the aSpace comes, once in millions of steps, upon a limb that points against its rest
        direction: no frame is defined there, and a particle without joints has no weight.
        """
        postures = self.action.space.postures(coordinates)
        return posture.joints_where_defined(postures, body, frame=self.frame)


def performances_of(dataset: Postures) -> list[Performance]:
    """Return every performance."""
    each = zip(dataset.split(dataset.postures), dataset.split(dataset.positions), strict=True)
    return [
        Performance(p, standing(r, p, dataset.floor_mm[m]), dataset.body(m), dataset.frame)
        for m, (p, r) in enumerate(each)
    ]


def standing(recorded: np.ndarray, postures: np.ndarray, floor_mm: float) -> np.ndarray:
    """Return joints (F, 15, 3) in mm as recorded, pelvis over the origin, floor at z = 0, facing as the postures say.

    Parameters
    ----------
    recorded : (F, 15, 3)
        Joints in mm, anywhere.
    postures : (F, 37)
        Of the same frames, with any heading.
    floor_mm : float
    """
    across = recorded[:, _HIPS[1]] - recorded[:, _HIPS[0]]
    wanted = postures[:, _HIP_COSINES]
    turn = np.arctan2(wanted[:, 1], wanted[:, 0]) - np.arctan2(across[:, 1], across[:, 0])
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y, z = np.moveaxis(recorded - recorded[:, [_PELVIS]] * [1.0, 1.0, 0.0], -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z - floor_mm], axis=-1)


def left_out(people: np.ndarray, performance: int, leave_out: LeaveOut) -> np.ndarray:
    """Return which performances (M,) the model of one performance must not have seen.

    Parameters
    ----------
    people : (M,)
        Who gave each performance.
    performance : int
    leave_out : LeaveOut

    Raises
    ------
    InvalidInput
        If too few are left to learn from.
    """
    alone = np.arange(len(people)) == performance
    out = alone if leave_out is LeaveOut.performance else people == people[performance]
    if (~out).sum() < 2:
        raise InvalidInput(
            "too few performances are left to learn from",
            f"leave one {leave_out} out, performance {performance}",
            "2 or more",
            (~out).sum(),
            code="too_few_performances",
            count=(~out).sum(),
        )
    return out


def learn_without(options: ActionSpaceModel, performances: Sequence[Performance], out: np.ndarray) -> HeldOut:
    """Return what all performances but those left out teach.

    Parameters
    ----------
    options : ActionSpaceModel
    performances : sequence of Performance
    out : (M,) bool
        Those of which nothing is read.
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
