"""Knees and elbows flex one way: what tells a limb from its mirror without knowing the activity.

park2011 uses no such constraint; with a still camera its programme cannot tell a motion from its mirror
(see `pipeline.core.binary_quadratic`), and a hinge is the least that anatomy adds.

Symbols
-------
``a``  direction of the upper limb (thigh, upper arm), ``b`` of the lower one (shank, forearm)
``h``  direction from the left hip to the right one, or from the left shoulder to the right one
``f``  flexion: ``-(a x b) . h`` at a knee, ``(a x b) . h`` at an elbow; positive where it bends as joints do

A knee bends about the axis of the hips, for the thigh turns little about its length; an upper arm turns, so an elbow
bends about the axis of the shoulders only roughly, and the rule is kept on average over a clip, not in every frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.core.articulated_trajectory.limb_choice import LimbChoice
from pipeline.core.limb_chain import Chain
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Hinge:
    """A joint that flexes one way.

    Attributes
    ----------
    upper, lower : str
        Limbs that meet at it, by the joints at their ends.
    left, right : str
        Joints whose line is its axis, roughly.
    sense : float
        +1 where it flexes forwards, as an elbow, -1 where backwards, as a knee.
    """

    upper: str
    lower: str
    left: str
    right: str
    sense: float

    def fits(self, chain: Chain) -> bool:
        """Whether the chain has it: the lower limb hangs on the upper one, and the joints of its axis are there."""
        limbs = {joint: parent for joint, parent in zip(chain.joints, chain.parents, strict=True) if parent}
        return (
            limbs.get(self.lower) == self.upper
            and self.upper in limbs
            and {self.left, self.right} <= set(chain.joints)
        )


HINGES = (
    *(Hinge(f"{side}_knee", f"{side}_ankle", "left_hip", "right_hip", -1.0) for side in ("left", "right")),
    *(
        Hinge(f"{side}_elbow", f"{side}_wrist", "left_shoulder", "right_shoulder", 1.0)
        for side in ("left", "right")
    ),
)
"""Of WALKER15."""


def flexion(upper: np.ndarray, lower: np.ndarray, axis: np.ndarray, sense: float) -> np.ndarray:
    """Flexion (F,) of a hinge, -1 to 1; negative where the joint bends the wrong way.

    Parameters
    ----------
    upper, lower : (F, 3)
        Relative trajectories of the limbs that meet at it, of any length.
    axis : (F, 3)
        From left to right, of any length.
    sense : float
        As of `Hinge`.

    Raises
    ------
    InvalidInput
        If shapes disagree.

    Examples
    --------
    A thigh that hangs, a shank that swings backwards:

    >>> down, back, right = np.array([[0.0, 0, -1]]), np.array([[0.0, -1, 0]]), np.array([[1.0, 0, 0]])
    >>> flexion(down, back, right, -1.0)
    array([1.])
    """
    arrays = [np.asarray(value, dtype=float) for value in (upper, lower, axis)]
    if arrays[0].ndim != 2 or len({value.shape for value in arrays}) > 1 or arrays[0].shape[1] != 3:
        raise InvalidInput(
            "the limbs of a hinge differ in shape",
            expected="(F, 3) for all three",
            received=" ".join(str(value.shape) for value in arrays),
        )
    a, b, h = (value / np.maximum(np.linalg.norm(value, axis=1, keepdims=True), 1e-12) for value in arrays)
    return np.asarray(sense * (np.cross(a, b) * h).sum(axis=1))


def wrong_share(bend: np.ndarray) -> float:
    """How much of all flexion is the wrong way, 0 to 1; 0.5 where there is none to judge by.

    Parameters
    ----------
    bend : (F,)
        Of `flexion`; frames of NaN do not count.
    """
    known = bend[np.isfinite(bend)]
    total = np.abs(known).sum()
    return float(np.maximum(-known, 0.0).sum() / total) if total > 1e-9 else 0.5


def settle(
    hinge: Hinge,
    limbs: dict[str, LimbChoice],
    hung: np.ndarray,
    chain: Chain,
    choose: Callable[[str, np.ndarray], LimbChoice],
    place: Callable[[str, LimbChoice], None],
) -> None:
    """Take upper and lower limb, each or its mirror, so that the hinge bends the right way, where data are in doubt.

    Mirrors that cost more than `MARGIN_OF_DOUBT` times the best are out.  Of the others the combination with the
    smallest share of wrong flexion wins, and of equal ones the smoothest.

    Parameters
    ----------
    hinge : Hinge
        One that fits the chain, its limbs among `limbs`.
    limbs : dict
        The choice by the name of each limb so far.
    hung : (F, J, 3)
        Trajectories in the basis, on which children hang, mm; NaN for joints that have none yet.
    chain : Chain
    choose : callable
        From a limb and the trajectory (F, 3) of its parent to its choice.
    place : callable
        Takes a limb's name and its choice into `limbs` and `hung`.
    """
    axis = hung[:, chain.joints.index(hinge.right)] - hung[:, chain.joints.index(hinge.left)]
    above = hung[:, chain.joints.index(chain.held_by(hinge.upper))].copy()
    best: tuple[float, float] | None = None
    winner: tuple[LimbChoice, LimbChoice] | None = None
    for upper in _with_mirror(limbs[hinge.upper]):
        parents = above + upper.hits.radius * upper.directions
        first = limbs[hinge.lower] if upper is limbs[hinge.upper] else choose(hinge.lower, parents)
        for lower in _with_mirror(first):
            bend = flexion(upper.directions, lower.directions, axis, hinge.sense)
            cost = (_cost_ratio(upper)) * (_cost_ratio(lower))
            score = (round(wrong_share(bend), 2), cost)
            # Costs that are equal to rounding, as with parallel rays, keep the first.
            if (
                best is None
                or score[0] < best[0]
                or (score[0] == best[0] and score[1] < best[1] * (1 - 1e-6))
            ):
                best, winner = score, (upper, lower)
    if winner is None or (winner[0] is limbs[hinge.upper] and winner[1] is limbs[hinge.lower]):
        return
    place(hinge.upper, winner[0])
    place(hinge.lower, winner[1])
    # Whatever else was hung on the upper limb before hangs elsewhere now.
    end = hung[:, chain.joints.index(hinge.upper)]
    for limb in [name for name in limbs if name != hinge.lower and chain.held_by(name) == hinge.upper]:
        place(limb, choose(limb, end))


def _with_mirror(choice: LimbChoice) -> Sequence[LimbChoice]:
    return [choice, choice.mirror()] if choice.undecided else [choice]


def _cost_ratio(choice: LimbChoice) -> float:
    return choice.solution.margin if choice.mirrored else 1.0
