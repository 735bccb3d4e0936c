"""Whether it was a walk.

Two numbers decide between walking and other motion: the residual after the fit over the height in the image, and how
unlikely the image is at the best heading and phase before it: a flexible walker follows a dancer closely, but only by
leaving the population.  Who stands is refused by the motion of the legs.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from pipeline.core.keypoint_walk.reconstruction import Reconstruction

MOST_RESIDUAL = 1.65
"""Largest residual of a walk, per cent of the height; 1 % of walks are above."""
DOUBTFUL_RESIDUAL = 1.3
MOST_DISTANCE = 2.6
"""Largest mean squared distance, per number, of a walk's image from the population's."""
DOUBTFUL_DISTANCE = 1.7
LEAST_MOTION = 0.5
"""Least motion of the legs in the image, relative to the average walker's from the same side."""
LEAST_STRIDES = 0.8
"""Strides below which nothing can be said to repeat."""


class Verdict(StrEnum):
    """What a clip shows."""

    walk = "walk"
    doubtful = "doubtful"
    not_a_walk = "not_a_walk"


@dataclass(frozen=True)
class Judgement:
    """A verdict and why.

    Attributes
    ----------
    verdict : Verdict
    reasons : tuple of str
        One sentence each; none for a walk.
    """

    verdict: Verdict
    reasons: tuple[str, ...]


def judge(found: Reconstruction) -> Judgement:
    """Judge whether the clip shows a walk."""
    g, distance = found.relative_residual, found.starts.least_distance
    strides = found.strides
    refused, doubts = [], []
    if g > MOST_RESIDUAL:
        refused.append(f"no walker moves like this: {g:.2f} % of the height is left (walks: 1.65 or less)")
    elif g > DOUBTFUL_RESIDUAL:
        doubts.append(f"the residual is large: {g:.2f} % of the height (most walks: 1.3 or less)")
    if distance > MOST_DISTANCE:
        refused.append(
            f"a walker looks like this from no side: distance {distance:.2f} (walks: {MOST_DISTANCE} or less)"
        )
    elif distance > DOUBTFUL_DISTANCE:
        doubts.append(
            f"the walker is unusual: distance {distance:.2f} (most walks: {DOUBTFUL_DISTANCE} or less)"
        )
    if strides < LEAST_STRIDES:
        refused.append(f"the clip holds {strides:.1f} strides: nothing repeats (needed: {LEAST_STRIDES})")
    elif strides < 1.2:
        doubts.append(f"the clip holds only {strides:.1f} strides")
    if found.leg_motion < LEAST_MOTION:
        refused.append(
            f"the legs hardly move: {found.leg_motion:.2f} of an average walker's motion in the image"
        )
    if refused:
        return Judgement(Verdict.not_a_walk, tuple(refused))
    return Judgement(Verdict.doubtful if doubts else Verdict.walk, tuple(doubts))
