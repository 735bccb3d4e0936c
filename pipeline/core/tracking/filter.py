"""Particle filter that uses the action model as prior, the application in mozerov2006 sections 1 and 4.

"This knowledge is subsequently used in a particle filter tracking framework to prune those predictions which are
not likely to be found in that action": the paper leaves the framework to the reader; this is ours.  Predictions are
those of `prediction`, the likelihood that of `likelihood`.

Symbols
-------
``L``  likelihood of a particle; ``w`` its weight, kept as a logarithm
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.core.tracking import particles
from pipeline.core.tracking.likelihood import Likelihood
from pipeline.core.tracking.prediction import Dynamics, Walk
from pipeline.validation import InvalidInput

_UNDERFLOW = np.log(np.nextafter(0.0, 1.0))
"""Logarithm of the smallest positive double; smaller likelihoods become weights of zero."""


@dataclass(frozen=True)
class Track:
    """Tracked performance: the posture in each of T frames, estimated from the images up to that frame.

    Attributes
    ----------
    posture : (T, b)
        Posterior mean in the aSpace.
    standard_deviation : (T, b)
        Posterior standard deviation.
    phase : (T,)
        Posterior mean position along the mean performance, in samples; NaN without the prior.
    effective_sample_size : (T,)
        Before resampling.
    pruned_fraction : (T,)
        Predictions that the action model rejected, before they were redrawn.
    log_evidence : (T,)
        Logarithm of the density of each image given those before; 0 with nothing seen, minus infinity where no
        particle has an image.  The sums of two action models say which action it was.
    visible : (T,) int
        Joints that took part; with none the frame coasts on the prediction.
    lost : (T,) bool
        The likelihood of every particle, next to that of a perfect fit, is zero to double precision (some seven
        sigma in every coordinate): the posture given is the least bad one, not a good one.
    """

    posture: np.ndarray
    standard_deviation: np.ndarray
    phase: np.ndarray
    effective_sample_size: np.ndarray
    pruned_fraction: np.ndarray
    log_evidence: np.ndarray
    visible: np.ndarray
    lost: np.ndarray


def track(
    mean: np.ndarray,
    standard_deviation: np.ndarray,
    likelihood: Likelihood,
    *,
    to_joints: Callable[[np.ndarray], np.ndarray],
    n_particles: int,
    generator: np.random.Generator,
    dynamics: Dynamics | None = None,
    prior: bool = True,
) -> Track:
    """Track a performance in 2D images: estimate its posture in the aSpace, frame by frame, by a particle filter.

    Parameters
    ----------
    mean, standard_deviation : (P, b)
        The action model, learnt without this performance.
    likelihood : Likelihood
        What the camera saw, and how well.
    to_joints : callable
        Joint positions (S, J, 3) in mm of S postures (S, b) of the aSpace.
    n_particles : int
    generator : numpy.random.Generator
    dynamics : Dynamics, optional
    prior : bool
        Whether the action model predicts and prunes.  Without, postures walk at random by steps of the same
        size; both begin at the model's first posture, plus or minus its standard deviation, for the first
        posture is another subject than how to go on from it.

    Raises
    ------
    InvalidInput
        Positions of the mean performance that are not finite.
    """
    walk = Walk(mean, standard_deviation, dynamics or Dynamics(), prior=prior)
    nowhere = ~np.isfinite(to_joints(walk.mean)).all(axis=(1, 2))
    if nowhere.any():
        raise InvalidInput(
            "to_joints returned a position that is not finite",
            f"sample {nowhere.argmax()} of the mean performance",
            code="not_finite",
        )
    frames, equal = likelihood.frames, np.full(n_particles, -np.log(n_particles))
    posture, deviation = np.empty((2, frames, walk.mean.shape[1]))
    phase, size, pruned, evidence = np.zeros((4, frames))
    lost = np.zeros(frames, bool)
    state, log_weights = None, equal
    for frame in range(frames):
        innovations, pruned[frame] = walk.draw(state, n_particles, generator)
        state = walk.apply(state, innovations)
        x = walk.posture(state)
        if likelihood.visible[frame].any():
            value = likelihood.log_density(to_joints(x), frame)
            best = value.max()
            # Without an image all particles weigh the same, so the prediction is kept.
            evidence[frame] = -np.inf
            if np.isfinite(value).any():
                log_weights, evidence[frame] = particles.normalise(log_weights + value)
            lost[frame] = best - likelihood.log_peak[frame] < _UNDERFLOW
        weights = np.exp(log_weights)
        posture[frame] = weights @ x
        deviation[frame] = np.sqrt(weights @ (x - posture[frame]) ** 2)
        phase[frame] = weights @ state[:, 0]
        size[frame] = particles.effective_sample_size(log_weights)
        if size[frame] < n_particles / 2:
            state = state[particles.resample_systematically(log_weights, generator.random())]
            log_weights = equal
    return Track(posture, deviation, phase, size, pruned, evidence, likelihood.visible.sum(axis=1), lost)
