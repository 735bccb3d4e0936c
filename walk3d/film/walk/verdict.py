"""Whether it was a walk.

Two numbers decide between walking and other motion: the residual after the fit over the height in the image, and how
unlikely the image is at the best heading and phase before it: a flexible walker follows a dancer closely, but only by
leaving the population.  Who stands is refused by the motion of the legs, who squats or jumps by ankles that move
together, and who runs by the cadence, or by a trunk that is highest where a walker's is lowest.  Knees that bend the
wrong way make a walk doubtful.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.core.fourier import cycle_basis
from walk3d.film.walk.path import TRUNK, median_of_seen
from walk3d.film.walk.reconstruction import Reconstruction
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.training import BLOCKS, HEIGHT_MM

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
MOST_TOGETHER = 0.1
"""Largest correlation of the two ankles of a walk, each about its hip; -0.9 to 0 is usual."""
SLOW_STRIDE_HZ = 0.6
"""Strides a second below which a wrong frame rate is more likely than such a walk."""
MOST_STRIDE_HZ = 1.35
"""Strides a second beyond which people run."""
LEAST_BOUNCE = -0.5
"""Least bounce of a walk, relative to the average walker's; runs have about -2."""
LEAST_KNEE_DEG = -15.0
"""Least flexion of a knee: lax knees give way by 10, and its 95 % bars are 15 wide."""
FORGETS_S = 0.3
"""Time in which errors of keypoints and the shake of a camera forget."""


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


def bounce(found: Reconstruction) -> float:
    """Rise and fall of the trunk twice a stride, along the average walker's, who rises and falls by 1 at that phase.

    Walkers are lowest where their feet are farthest apart, runners there fly.  What may be a trembling of the camera is
    no bounce: the estimate is raised by twice its standard error.
    """
    times, down = found.fit.times, found.filmed_px[..., 1]
    basis = cycle_basis(found.fit.phases_rad, BLOCKS)
    columns = np.hstack([times[:, None] ** np.arange(4), basis[:, 1:5]])
    trunk = [joint for joint in TRUNK if (found.keypoints.weights[:, joint] > 0).any()]
    seen = found.keypoints.weights[:, trunk] > 0
    rows = seen.any(axis=1)
    if rows.sum() < 2 * columns.shape[1]:
        return 1.0
    # Each joint about its own middle, so that a joint that is missing does not move the trunk.
    about = np.where(seen, down[:, trunk] - median_of_seen(down[:, trunk].T, seen.T), 0.0)[rows]
    height = -about.sum(axis=1) / seen[rows].sum(axis=1)
    columns = columns[rows]
    wave = np.linalg.lstsq(columns, height)[0]
    left = np.std(height - columns @ wave)
    average = found.fit.objective.prior.model.mean[TRUNK, 2, 3:5].mean(axis=0) * found.height_px / HEIGHT_MM
    # Errors forget in some FORGETS_S: there are fewer of them than frames.
    several = max((times[-1] - times[0]) / FORGETS_S, 1.0)
    error = left * np.sqrt(2.0 / several) / np.linalg.norm(average)
    return wave[-2:] @ average / (average @ average) + 2.0 * error


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
    if (together := found.starts.ankles_together) > MOST_TOGETHER:
        refused.append(f"the feet move together: correlation {together:.2f} (walks: {MOST_TOGETHER} or less)")
    steps = 120.0 * found.candidates[0].frequency_hz
    if steps > 120.0 * MOST_STRIDE_HZ:
        refused.append(f"a run: {steps:.0f} steps a minute (walks: {120 * MOST_STRIDE_HZ:.0f} or less)")
    elif (rise := bounce(found)) < LEAST_BOUNCE:
        refused.append(
            f"a run: the body is highest between steps, {-rise:.1f} times as far as a walker's is lowest"
        )
    if steps < 120.0 * SLOW_STRIDE_HZ:
        slow = f"slow: {steps:.0f} steps a minute (most walks: {120 * SLOW_STRIDE_HZ:.0f} or more)"
        doubts.append(f"{slow}, or the frame rate is wrong")
    if refused:
        return Judgement(Verdict.not_a_walk, tuple(refused))
    knees = [k for k, name in enumerate(ANGLES) if name.endswith("knee")]
    if (least := np.degrees(found.posterior.angles_rad[:, knees].min())) < LEAST_KNEE_DEG:
        doubts.append(
            f"a knee bends the wrong way, to {least:.0f}° (walks: {LEAST_KNEE_DEG:.0f} or more): somebody walks"
            " backwards, or left and right are exchanged"
        )
    return Judgement(Verdict.doubtful if doubts else Verdict.walk, tuple(doubts))
