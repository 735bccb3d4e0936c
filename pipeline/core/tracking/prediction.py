"""Prediction of the particles' postures along the action model, within its bounds, at the rate of the performer.

Symbols
-------
``p``     phase: position along the mean performance, in samples, 0 … P - 1; ``v`` its rate, samples per frame
``m, s``  mean and standard deviation of the action model at a phase, (b,), linear between samples
``z``     deviation in units of the model: the posture in the aSpace is x = m(p) + s(p) z
``e``     innovations: independent standard normal numbers, one for the rate and b for the posture
``q``     the part of a standard deviation that a posture diffuses by from frame to frame

With the prior, v walks at random between bounds and never runs backwards, as [mozerov2006 13] has it for
synchronization (speeds and accelerations differ), p' = p + v', and z' = rho z + q e: the posture moves with the mean
performance and diffuses by a fraction of the learnt standard deviation; rho is sqrt(1 - q²), so that without an image
particles keep the learnt variance.

A prediction with a coordinate outside of m +- 3 s is pruned: rejected and redrawn.  Coordinates are independent, so
it is enough to redraw those outside, from the normal truncated to the bounds: the same distribution as rejecting
whole predictions until one is accepted, at a cost that is known beforehand.

Without the prior x walks at random by steps of the same size (root mean square over phases), and nothing is pruned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from pipeline.core.tracking import kernels
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Dynamics:
    """Parameters of the particles' motion from one frame to the next.

    Attributes
    ----------
    nominal_rate : float
        Samples of the mean performance per frame: (P - 1) / (F - 1) for a performance of about F frames.
    rate_bounds : (low, high)
        Of the rate, times the nominal; at the start it is anything between.
    rate_step : float
        Standard deviation of its change from frame to frame, times the nominal.  People pause and hurry on within
        a few frames; a rate that cannot follow loses the phase, which never runs back.
    diffusion : float
        q: standard deviation of a posture's own step, as a fraction of the learnt one; `learnt_diffusion` gives it.
    bound : float
        Predictions farther from the mean than this many standard deviations are pruned; infinite: none.
    start_phase : (low, high)
        Where performances may stand in the first frame, as fractions of the mean performance.
    """

    nominal_rate: float = 1.0
    rate_bounds: tuple[float, float] = (0.0, 2.0)
    rate_step: float = 0.3
    diffusion: float = 0.2
    bound: float = 3.0
    start_phase: tuple[float, float] = (0.0, 0.0)


class Walk:
    """Random walk of the particles along the action model: phase, rate, and deviation from the mean performance.

    States (S, 2 + b) contain phase p, rate v, and the deviation z with the prior or the posture x without it.

    Parameters
    ----------
    mean, standard_deviation : (P, b)
    dynamics : Dynamics
    prior : bool
    """

    def __init__(
        self, mean: np.ndarray, standard_deviation: np.ndarray, dynamics: Dynamics, *, prior: bool
    ) -> None:
        self.mean, self.sd = mean, standard_deviation
        self.prior, self.dynamics = prior, dynamics
        self.last = len(self.mean) - 1.0
        size = np.ones(self.mean.shape[1]) if prior else np.sqrt((self.sd**2).mean(axis=0))
        self.step = dynamics.diffusion * size
        self.keep = np.sqrt(max(0.0, 1.0 - dynamics.diffusion**2)) if prior else 1.0
        self.bound = dynamics.bound if prior else np.inf

    def draw(
        self, state: np.ndarray | None, count: int, generator: np.random.Generator
    ) -> tuple[np.ndarray, float]:
        """Draw random innovations (S, 2 + b) whose predictions the action model accepts; also return the rejected
        fraction.
        """
        innovations = generator.standard_normal((count, 2 + self.mean.shape[1]))
        if not np.isfinite(self.bound) or (state is not None and self.dynamics.diffusion == 0.0):
            return innovations, 0.0
        e = innovations[:, 2:]
        if state is None:
            centre, step = np.zeros_like(e), np.ones_like(e)
        else:
            centre, step = self.keep * state[:, 2:], np.broadcast_to(self.step, e.shape)
        outside = np.abs(centre + step * e) > self.bound
        if outside.any():
            low, high = (ndtr((edge - centre[outside]) / step[outside]) for edge in (-self.bound, self.bound))
            e[outside] = ndtri(low + generator.random(len(low)) * (high - low))
        return innovations, outside.any(axis=1).mean()

    def apply(self, state: np.ndarray | None, innovations: np.ndarray) -> np.ndarray:
        """Return the particles' next states (S, 2 + b) from states and innovations; the first states need innovations
        only.
        """
        d = self.dynamics
        after = np.empty_like(innovations)
        low, high = np.multiply(d.rate_bounds, d.nominal_rate)
        if state is None:
            first, final = np.multiply(d.start_phase, self.last)
            after[:, 0] = first + (final - first) * ndtr(innovations[:, 0])
            after[:, 1] = low + (high - low) * ndtr(innovations[:, 1])
            after[:, 2:] = (
                innovations[:, 2:] if self.prior else self.mean[0] + self.sd[0] * innovations[:, 2:]
            )
        else:
            rate_step = d.rate_step * d.nominal_rate
            kernels.step_forward(
                state, innovations, self.keep, self.step, rate_step, (low, high), self.last, after
            )
        if not self.prior:
            after[:, :2] = np.nan
        return after

    def posture(self, state: np.ndarray) -> np.ndarray:
        """Return the postures (S, b) in the aSpace that belong to the particles' states."""
        if not self.prior:
            return state[:, 2:]
        x = np.empty((len(state), self.mean.shape[1]))
        kernels.deviate(state, self.mean, self.sd, x)
        return x


def learnt_diffusion(performances: np.ndarray, mean: np.ndarray, standard_deviation: np.ndarray) -> float:
    """Estimate the diffusion q of the deviations from the mean, per sample, from the training performances.

    Parameters
    ----------
    performances : (M, P, b)
        Synchronized, the ones of the model.
    mean, standard_deviation : (P, b)

    Raises
    ------
    InvalidInput
        If nothing deviates from the mean.

    Notes
    -----
    From the correlation of the deviations z with those one sample on, rho = sqrt(1 - q²).
    """
    z = (performances - mean) / np.where(standard_deviation > 0, standard_deviation, np.inf)
    power = np.sqrt((z[:, 1:] ** 2).sum() * (z[:, :-1] ** 2).sum())
    if not power > 0:
        raise InvalidInput(
            "the performances are identical to their mean, so their diffusion cannot be estimated",
            "learnt diffusion",
            code="identical_performances",
        )
    rho = (z[:, 1:] * z[:, :-1]).sum() / power
    return np.sqrt(max(0.0, 1.0 - rho**2))
