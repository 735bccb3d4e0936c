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

from dataclasses import dataclass

import numpy as np

from pipeline.core.limb_chain import Chain
from pipeline.refusal import Refusal


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
    Refusal
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
        raise Refusal(
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
