"""Knees and elbows flex in one direction only, which distinguishes a limb from its mirror image in depth.

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
from pipeline.core.articulated_trajectory.limb_tree import LimbTree
from pipeline.core.limb_chain import Chain

_MARGIN = 1e-6
"""Relative cost difference that decides between two combinations of mirrored limbs with equally wrong flexion."""


@dataclass(frozen=True)
class Hinge:
    """A joint that flexes in one direction only.

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
        """Return True if the chain contains the limbs and the axis of this hinge.

        The hinge needs the upper limb, the lower limb as its child, and both joints of the axis.
        """
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
"""Hinges of the 15-joint walker skeleton: knees and elbows."""


def flexion(upper: np.ndarray, lower: np.ndarray, axis: np.ndarray, sense: float) -> np.ndarray:
    """Return the flexion (F,) of a hinge, from -1 to 1; it is negative where the joint bends in the wrong direction.

    Parameters
    ----------
    upper, lower : (F, 3)
        Relative trajectories of the limbs that meet at it, of any length.
    axis : (F, 3)
        From left to right, of any length.
    sense : float
        As of `Hinge`.

    Examples
    --------
    A thigh that hangs, a shank that swings backwards:

    >>> down, back, right = np.array([[0.0, 0, -1]]), np.array([[0.0, -1, 0]]), np.array([[1.0, 0, 0]])
    >>> flexion(down, back, right, -1.0)
    array([1.])
    """
    a, b, h = (v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12) for v in (upper, lower, axis))
    return sense * (np.cross(a, b) * h).sum(axis=1)


def wrong_share(bend: np.ndarray) -> float:
    """Return the fraction of all flexion that is in the wrong direction, from 0 to 1; 0.5 if the joint never flexes.

    Parameters
    ----------
    bend : (F,)
        Of `flexion`; frames of NaN do not count.
    """
    finite = bend[np.isfinite(bend)]
    total = np.abs(finite).sum()
    return (np.maximum(-finite, 0.0).sum() / total) if total > 1e-9 else 0.5


def resolve_mirrors(hinge: Hinge, tree: LimbTree, choose: Callable[[LimbTree, str], LimbChoice]) -> LimbTree:
    """Choose for both limbs at a hinge between the best solution and its mirror image, so that the hinge flexes
    correctly.

    Mirrors that cost more than `MARGIN_OF_DOUBT` times the best are out.  Of the others the combination with the
    smallest share of wrong flexion wins, and of equal ones the smoothest.

    Parameters
    ----------
    hinge : Hinge
        One that fits the chain, its limbs in the tree.
    tree : LimbTree
    choose : callable
        From a tree and a limb whose parent it has to the limb's choice.
    """
    axis = tree.end(hinge.right) - tree.end(hinge.left)
    best, best_share, best_cost = tree, np.inf, np.inf
    for upper in _with_mirror(tree.choices[hinge.upper]):
        if upper is tree.choices[hinge.upper]:
            above, first = tree, tree.choices[hinge.lower]
        else:
            above = tree.placed(hinge.upper, upper)
            first = choose(above, hinge.lower)
        for lower in _with_mirror(first):
            bend = flexion(upper.directions, lower.directions, axis, hinge.sense)
            share, cost = round(wrong_share(bend), 2), _cost_ratio(upper) * _cost_ratio(lower)
            # Costs that are equal to rounding, as with parallel rays, keep the first.
            if share < best_share or (share == best_share and cost < best_cost * (1.0 - _MARGIN)):
                same = lower is tree.choices[hinge.lower]
                best = tree if same else above.placed(hinge.lower, lower)
                best_share, best_cost = share, cost
    # Whatever else the upper limb carries is anchored elsewhere now.
    for limb in tree.chain.limbs:
        if limb in tree.choices and limb not in best.choices:
            best = best.placed(limb, choose(best, limb))
    return best


def _with_mirror(choice: LimbChoice) -> Sequence[LimbChoice]:
    return [choice, choice.mirror] if choice.undecided else [choice]


def _cost_ratio(choice: LimbChoice) -> float:
    return choice.solution.margin if choice.mirrored else 1.0
