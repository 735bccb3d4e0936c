"""Verdict on a clip: a walk, doubtful, or not a walk.

Two numbers distinguish walking from other motion: the residual of the fit over the height in the image, and the
distance of the image from the population at the best heading and phase.  A flexible walker can follow a dancer closely,
but only far from the population.  Standing is rejected by the motion of the legs, squats and jumps by ankles that move
together, running by the cadence or by a trunk that is highest where a walker's is lowest.  Knees that bend the wrong
way make a walk doubtful.
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

MAX_RESIDUAL = 1.65
"""Maximum residual of a walk, per cent of the walker's height in the image; 1 % of walks have a larger residual."""
DOUBTFUL_RESIDUAL = 1.3
MAX_DISTANCE = 2.6
"""Maximum squared Mahalanobis distance of a walk's image from the population's images, per coefficient."""
DOUBTFUL_DISTANCE = 1.7
MIN_LEG_MOTION = 0.5
"""Minimum motion of the legs in the image, relative to the average walker's motion seen from the same side."""
MIN_STRIDES = 0.8
"""Minimum number of strides of a walk; shorter clips contain no repetition."""
MAX_ANKLE_CORRELATION = 0.1
"""Maximum correlation between the motions of the two ankles of a walk, each relative to its hip.

Usual correlations are -0.9 to 0.
"""
SLOW_STRIDE_HZ = 0.6
"""Stride frequency, Hz, below which a wrong frame rate is more likely than a slow walk."""
MAX_STRIDE_HZ = 1.35
"""Stride frequency, Hz, above which people run."""
MIN_BOUNCE = -0.5
"""Minimum vertical motion of a walk's trunk, relative to the average walker's; runs have about -2."""
MIN_KNEE_DEG = -15.0
"""Minimum flexion of a walker's knee, degrees.

Lax knees hyperextend by 10°, and the 95 % error bars are 15° wide.
"""
NOISE_MEMORY_S = 0.3
"""Time, s, after which the errors of keypoints and the shake of a camera are uncorrelated."""


class Verdict(StrEnum):
    """Verdict on a clip."""

    walk = "walk"
    doubtful = "doubtful"
    not_a_walk = "not_a_walk"


@dataclass(frozen=True)
class Judgement:
    """Verdict on a clip, with the reasons for it.

    Attributes
    ----------
    verdict : Verdict
    reasons : tuple of str
        Reasons, one sentence each; empty for a clear walk.
    """

    verdict: Verdict
    reasons: tuple[str, ...]


def bounce(reconstruction: Reconstruction) -> float:
    """Return the trunk's vertical motion at twice the stride frequency, relative to the average walker's.

    It is 1 if amplitude and phase are those of the average walker.

    Walkers are lowest where their feet are farthest apart; runners are then in flight.  The estimate is raised by twice
    its standard error, so that a shaking camera does not count as a bounce.
    """
    times, down = reconstruction.fit.times, reconstruction.filmed_px[..., 1]
    basis = cycle_basis(reconstruction.fit.phases_rad, BLOCKS)
    columns = np.hstack([times[:, None] ** np.arange(4), basis[:, 1:5]])
    trunk = [joint for joint in TRUNK if (reconstruction.keypoints.weights[:, joint] > 0).any()]
    visible = reconstruction.keypoints.weights[:, trunk] > 0
    rows = visible.any(axis=1)
    if rows.sum() < 2 * columns.shape[1]:
        return 1.0
    # Each joint is relative to its own median, so that a missing joint does not move the trunk.
    about = np.where(visible, down[:, trunk] - median_of_seen(down[:, trunk].T, visible.T), 0.0)[rows]
    height = -about.sum(axis=1) / visible[rows].sum(axis=1)
    columns = columns[rows]
    wave = np.linalg.lstsq(columns, height)[0]
    left = np.std(height - columns @ wave)
    average = (
        reconstruction.fit.objective.prior.model.mean[TRUNK, 2, 3:5].mean(axis=0)
        * reconstruction.height_px
        / HEIGHT_MM
    )
    # Errors decorrelate in NOISE_MEMORY_S: fewer of them are independent than there are frames.
    several = max((times[-1] - times[0]) / NOISE_MEMORY_S, 1.0)
    error = left * np.sqrt(2.0 / several) / np.linalg.norm(average)
    return wave[-2:] @ average / (average @ average) + 2.0 * error


def judge(reconstruction: Reconstruction) -> Judgement:
    """Judge whether a reconstructed clip shows a walk."""
    g, distance = reconstruction.relative_residual, reconstruction.starts.least_distance
    strides = reconstruction.strides
    rejections, doubts = [], []
    if g > MAX_RESIDUAL:
        rejections.append(
            f"no walker moves like this: residual {g:.2f} % of the height (walks: {MAX_RESIDUAL} or less)"
        )
    elif g > DOUBTFUL_RESIDUAL:
        doubts.append(
            f"the residual is large: {g:.2f} % of the height (most walks: {DOUBTFUL_RESIDUAL} or less)"
        )
    if distance > MAX_DISTANCE:
        rejections.append(
            f"no view of a walker fits the keypoints: distance {distance:.2f} (walks: {MAX_DISTANCE} or less)"
        )
    elif distance > DOUBTFUL_DISTANCE:
        doubts.append(
            f"the walker is unusual: distance {distance:.2f} (most walks: {DOUBTFUL_DISTANCE} or less)"
        )
    if strides < MIN_STRIDES:
        rejections.append(
            f"the clip contains {strides:.1f} strides: nothing repeats (needed: {MIN_STRIDES} or more)"
        )
    elif strides < 1.2:
        doubts.append(f"the clip contains only {strides:.1f} strides")
    if reconstruction.leg_motion < MIN_LEG_MOTION:
        rejections.append(
            f"the legs hardly move: {reconstruction.leg_motion:.2f} of an average walker's motion in the image"
        )
    if (together := reconstruction.starts.ankles_together) > MAX_ANKLE_CORRELATION:
        rejections.append(
            f"the feet move together: correlation {together:.2f} (walks: {MAX_ANKLE_CORRELATION} or less)"
        )
    steps = 120.0 * reconstruction.candidates[0].frequency_hz
    if steps > 120.0 * MAX_STRIDE_HZ:
        rejections.append(f"a run: {steps:.0f} steps a minute (walks: {120 * MAX_STRIDE_HZ:.0f} or less)")
    elif (rise := bounce(reconstruction)) < MIN_BOUNCE:
        rejections.append(
            f"a run: the body rises where a walker's falls (bounce {rise:.1f}; walks: {MIN_BOUNCE} or more)"
        )
    if steps < 120.0 * SLOW_STRIDE_HZ:
        slow = f"slow: {steps:.0f} steps a minute (most walks: {120 * SLOW_STRIDE_HZ:.0f} or more)"
        doubts.append(f"{slow}, or the frame rate is wrong")
    if rejections:
        return Judgement(Verdict.not_a_walk, tuple(rejections))
    knees = [k for k, name in enumerate(ANGLES) if name.endswith("knee")]
    if (least := np.degrees(reconstruction.posterior.angles_rad[:, knees].min())) < MIN_KNEE_DEG:
        doubts.append(
            f"a knee bends the wrong way, to {least:.0f}° (walks: {MIN_KNEE_DEG:.0f} or more): the person walks"
            " backwards, or left and right are exchanged"
        )
    return Judgement(Verdict.doubtful if doubts else Verdict.walk, tuple(doubts))
