"""Particle filter with the action model as prior: what mozerov2006 learns the model for (its sections 1 and 4).

"This knowledge is subsequently used in a particle filter tracking framework to prune those predictions which are
not likely to be found in that action": the paper leaves the framework to the reader; this is ours.  Predictions are
those of `prediction`, the likelihood that of `likelihood`.

Symbols
-------
``e``  innovations of a particle: the standard normal numbers that its prediction is made of
``L``  likelihood of a particle; ``w`` its weight, kept as a logarithm

Why more than the textbook filter: with sixteen unknowns and thirty coordinates seen sharply, one of a thousand
predictions has all the weight.  With `moves` the likelihood is brought in by powers (L^0.01, L^0.05, … L), each as
large as leaves half of the effective sample; after each the particles are resampled and make Metropolis moves of
their innovations, e -> sqrt(1 - c²) e + c xi.  Such a move keeps the standard normal, so it is accepted by the
likelihood alone (and by the bounds of the model), and the target is the textbook filter's own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pipeline.core.tracking import particles
from pipeline.core.tracking.likelihood import Likelihood
from pipeline.core.tracking.prediction import Dynamics, Walk
from pipeline.validation import InvalidInput, require_range

_POWERS = 60
"""Most powers of the likelihood in a frame; the last brings in all that is left."""

_ACCEPTED = 0.3
"""Fraction of accepted moves that their length is steered to."""

_UNDERFLOW = float(np.log(np.nextafter(0.0, 1.0)))
"""Logarithm of the smallest positive double: what is less likely has a weight of zero."""


@dataclass(frozen=True)
class Track:
    """Postures of T frames, each known from the frames up to it.

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
    seen : (T,) int
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
    seen: np.ndarray
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
    moves: int = 0,
) -> Track:
    """Postures in the aSpace of a performance seen in 2D, frame by frame.

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
    moves : int
        Metropolis moves after each power of the likelihood; 0 is the textbook (bootstrap) filter.

    Raises
    ------
    InvalidInput
        No particle, fewer than two frames, an action model or dynamics that cannot be (`Walk`), joints that are
        not those observed, or positions that are not finite.
    """
    walk = Walk(mean, standard_deviation, dynamics or Dynamics(), prior=prior)
    _require_sizes(walk, likelihood, to_joints, n_particles, moves)
    frames, equal = likelihood.frames, np.full(n_particles, -np.log(n_particles))
    posture, deviation = np.empty((2, frames, walk.mean.shape[1]))
    phase, size, pruned, evidence = np.zeros((4, frames))
    lost = np.zeros(frames, dtype=bool)
    state, log_weights = None, equal
    for frame in range(frames):
        innovations, pruned[frame] = walk.draw(state, n_particles, generator)
        after = walk.apply(state, innovations)
        cloud = _Cloud(state, innovations, after, walk.posture(after), log_weights)
        if likelihood.seen[frame].any():

            def log_density(x: np.ndarray, frame: int = frame) -> np.ndarray:
                return likelihood.log_density(to_joints(x), frame)

            cloud, evidence[frame], best = _weighed(cloud, log_density, walk, moves, generator)
            lost[frame] = best - likelihood.log_peak[frame] < _UNDERFLOW
        state, log_weights = cloud.after, cloud.log_weights
        weights, x = np.exp(log_weights), cloud.posture
        posture[frame] = weights @ x
        deviation[frame] = np.sqrt(weights @ (x - posture[frame]) ** 2)
        phase[frame] = weights @ state[:, 0]
        size[frame] = particles.effective_sample_size(log_weights)
        if size[frame] < n_particles / 2:
            state = state[particles.resample_systematically(log_weights, generator.random())]
            log_weights = equal
    return Track(posture, deviation, phase, size, pruned, evidence, likelihood.seen.sum(axis=1), lost)


@dataclass(frozen=True)
class _Cloud:
    """S particles of one frame: whence they come, by which innovations, where they are, what they weigh."""

    before: np.ndarray | None
    innovations: np.ndarray
    after: np.ndarray
    posture: np.ndarray
    log_weights: np.ndarray

    def weighing(self, log_weights: np.ndarray) -> _Cloud:
        return _Cloud(self.before, self.innovations, self.after, self.posture, log_weights)

    def resampled(self, chosen: np.ndarray) -> _Cloud:
        before = None if self.before is None else self.before[chosen]
        equal = np.full(len(chosen), -np.log(len(chosen)))
        return _Cloud(before, self.innovations[chosen], self.after[chosen], self.posture[chosen], equal)


def _weighed(
    cloud: _Cloud,
    log_density: Callable[[np.ndarray], np.ndarray],
    walk: Walk,
    moves: int,
    generator: np.random.Generator,
) -> tuple[_Cloud, float, float]:
    """The cloud weighed by an image, the logarithm of that image's density, and the best particle's likelihood."""
    value = log_density(cloud.posture)
    if not np.isfinite(value).any():
        # Nobody has an image: there is no telling them apart, so the prediction stands.
        return cloud, -np.inf, -np.inf
    if not moves:
        log_weights, total = particles.normalise(cloud.log_weights + value)
        return cloud.weighing(log_weights), total, float(value.max())
    half, power, evidence, length = len(value) / 2, 0.0, 0.0, 0.5
    for step in range(_POWERS):
        part = (
            1.0 - power if step == _POWERS - 1 else _next_power(cloud.log_weights, value, 1.0 - power, half)
        )
        log_weights, total = particles.normalise(cloud.log_weights + part * value)
        cloud = cloud.weighing(log_weights)
        power, evidence = power + part, evidence + total
        if particles.effective_sample_size(log_weights) < 1.01 * half:
            chosen = particles.resample_systematically(log_weights, generator.random())
            cloud, value = cloud.resampled(chosen), value[chosen]
        for _ in range(moves):
            cloud, value, accepted = _moved(cloud, value, log_density, walk, power, length, generator)
            length = float(np.clip(length * np.exp(accepted - _ACCEPTED), 1e-3, 1.0))
        if power >= 1.0:
            break
    return cloud, evidence, float(value.max())


def _next_power(log_weights: np.ndarray, value: np.ndarray, most: float, wanted: float) -> float:
    """Largest power, up to `most`, of a likelihood that leaves an effective sample of the wanted size."""

    def size(power: float) -> float:
        return particles.effective_sample_size(particles.normalise(log_weights + power * value)[0])

    if size(most) >= wanted:
        return most
    low, high = 0.0, most
    # Halving the logarithm as long as even the smallest is too large, then the interval.
    while high > 1e-12 * most and size(high / 16.0) < wanted:
        high /= 16.0
    for _ in range(12):
        middle = (low + high) / 2.0
        low, high = (middle, high) if size(middle) >= wanted else (low, middle)
    return high


def _moved(
    cloud: _Cloud,
    value: np.ndarray,
    log_density: Callable[[np.ndarray], np.ndarray],
    walk: Walk,
    power: float,
    length: float,
    generator: np.random.Generator,
) -> tuple[_Cloud, np.ndarray, float]:
    """The cloud after a Metropolis move of every particle, the likelihoods, and the fraction that moved."""
    fresh = generator.standard_normal(cloud.innovations.shape)
    innovations = np.sqrt(1.0 - length**2) * cloud.innovations + length * fresh
    after = walk.apply(cloud.before, innovations)
    posture = walk.posture(after)
    proposed = log_density(posture)
    # Particles of no likelihood have no weight either; one that finds some is welcome.
    gain = proposed - np.where(np.isfinite(value), value, np.finfo(float).min)
    moved = (np.log(generator.random(len(value))) < power * gain) & walk.accepted(after)
    keep = ~moved[:, None]
    cloud = replace(
        cloud,
        innovations=np.where(keep, cloud.innovations, innovations),
        after=np.where(keep, cloud.after, after),
        posture=np.where(keep, cloud.posture, posture),
    )
    return cloud, np.where(moved, proposed, value), float(moved.mean())


def _require_sizes(
    walk: Walk,
    likelihood: Likelihood,
    to_joints: Callable[[np.ndarray], np.ndarray],
    n_particles: int,
    moves: int,
) -> None:
    require_range("n_particles", n_particles, at_least=1, whole=True)
    require_range("moves", moves, at_least=0, whole=True)
    if likelihood.frames < 2:
        raise InvalidInput("one frame is no performance to track", expected="two or more", received="1")
    joints = to_joints(walk.mean)
    if joints.shape != (len(walk.mean), likelihood.joints, 3):
        raise InvalidInput(
            "to_joints and the image have different joints",
            expected=f"({len(walk.mean)}, {likelihood.joints}, 3) for {len(walk.mean)} postures",
            received=str(joints.shape),
        )
    if not np.isfinite(joints).all():
        sample = int((~np.isfinite(joints)).any(axis=(1, 2)).argmax())
        raise InvalidInput(
            "to_joints gives a position that is not finite", where=f"sample {sample} of the mean"
        )
