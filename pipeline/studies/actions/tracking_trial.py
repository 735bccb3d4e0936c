"""Tracking of one held-out performance, with the action model as prior and with baselines."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
import pandas as pd

from pipeline.core import camera
from pipeline.core.resampling import interpolate
from pipeline.core.tracking import Likelihood, Track, best_phase, joint_error, track
from pipeline.studies.actions.held_out import HeldOut, Performance
from pipeline.studies.occlusion import occlusion


@dataclass(frozen=True, order=True)
class Condition:
    """Condition of tracking: number of particles, noise of the image, and share of hidden joints."""

    particles: int
    noise_mm: float
    occluded: float

    @property
    def words(self) -> tuple[int, ...]:
        """Condition as integers, for the seed of a random generator."""
        return self.particles, round(1e3 * self.noise_mm), round(1e6 * self.occluded)


FILTERS = ("prior", "no_prior", "no_prior_own_step")
"""Particle filters: one with the prior, and two random walks with different step sizes.

Without the prior, the step size is the diffusion of the prior (``no_prior``) or that of the data
(``no_prior_own_step``).
"""

METHODS = (*FILTERS, "mean_linear_phase", "mean_best_phase")


@dataclass(frozen=True)
class Tracked:
    """Tracks of one performance by K methods under several conditions of noise, occlusion and particle number.

    Attributes
    ----------
    rows : DataFrame
        A row for each condition and method, means over frames; only filters lose frames.
    joints : (K, T, 15, 3)
        Joints, mm, under the displayed condition.
    image : (T, 15, 2)
        Image under that condition, mm.
    """

    rows: pd.DataFrame
    joints: np.ndarray
    image: np.ndarray


@dataclass(frozen=True)
class Trial:
    """One performance in front of the camera, with the model, view angle and random seeds for tracking.

    Attributes
    ----------
    held_out : HeldOut
        Action learnt without the performance.
    performance : Performance
    view_angle_rad : float
    seed : tuple of int
        Seed of the image, the same for every kind of leaving out.
    way : tuple of int
        Number of the kind of leaving out, for the seed of the filters.
    occlusion_frames : float
        Mean length of a run of hidden frames.
    """

    held_out: HeldOut
    performance: Performance
    view_angle_rad: float
    seed: tuple[int, ...]
    way: tuple[int, ...]
    occlusion_frames: float

    def all(self, conditions: list[Condition], displayed: Condition) -> Tracked:
        """Return the tracks of the performance by every method under every condition."""
        true, body, space = self.performance.joints_mm, self.performance.body, self.held_out.action.space
        means = self._mean_alone()
        projected = self.held_out.joints(space.project(self.performance.postures), body)
        rows = []
        for condition in conditions:
            image = self.seen(condition)
            tracks = {method: self.filtered(method, condition, image) for method in FILTERS}
            joints = [*(self.held_out.joints(f.posture, body) for f in tracks.values()), *means]
            rows += [
                {
                    "method": method,
                    **asdict(condition),
                    "error_mm": joint_error(each, true).mean(),
                    "aspace_error_mm": joint_error(projected, true).mean(),
                    "lost_fraction": tracks[method].lost.mean() if method in tracks else 0.0,
                    "pruned_fraction": tracks[method].pruned_fraction.mean() if method in tracks else 0.0,
                }
                for method, each in zip(METHODS, joints, strict=True)
            ]
            if condition == displayed:
                display = np.stack(joints), image
        return Tracked(pd.DataFrame(rows), *display)

    def seen(self, condition: Condition) -> np.ndarray:
        """Return the image (T, 15, 2), mm, of an orthographic camera; NaN where a joint is hidden.

        The image is the same for every method and model.  All conditions share a seed, so that they differ only in the
        varied quantity: errors grow with the noise, and runs of hidden frames grow with the share of hidden joints.
        """
        true = self.performance.joints_mm
        noise, hides = (np.random.default_rng([*self.seed, stream]) for stream in (0, 1))
        image = camera.project(true, self.view_angle_rad)
        image += condition.noise_mm * noise.standard_normal(image.shape)
        frames, joints = image.shape[:2]
        image[occlusion(frames, joints, condition.occluded, self.occlusion_frames, hides)] = np.nan
        return image

    def filtered(self, method: str, condition: Condition, image: np.ndarray) -> Track:
        """Return the track that a particle filter estimates from an image."""
        held_out, model = self.held_out, self.held_out.action.model
        dynamics = held_out.dynamics
        if method == "no_prior_own_step":
            dynamics = replace(dynamics, diffusion=held_out.own_step)
        noise_mm = np.hypot(condition.noise_mm, held_out.misfit_mm)
        return track(
            model.mean,
            model.standard_deviation,
            # The floor is known, but not the position of the actor on it.
            Likelihood(image, self.view_angle_rad, noise_mm, place_known=False),
            to_joints=lambda x: held_out.joints(x, self.performance.body),
            n_particles=condition.particles,
            generator=np.random.default_rng(
                [*self.seed, 2, *self.way, FILTERS.index(method), *condition.words]
            ),
            dynamics=dynamics,
            prior=method == "prior",
        )

    def _mean_alone(self) -> list[np.ndarray]:
        """Return the mean performance with the tracked body's limb lengths, at constant rate and at the best phases.

        The best phase is that of the mean posture nearest to the true posture.
        """
        mean, true = self.held_out.action.model.mean, self.performance.joints_mm
        at_constant_rate = interpolate(mean, np.linspace(0.0, len(mean) - 1.0, len(true)))  # [mozerov2006 7]
        drawn = self.held_out.joints(mean, self.performance.body)
        nearest = best_phase(_about_pelvis(true), _about_pelvis(drawn)).astype(int)
        return [self.held_out.joints(at_constant_rate, self.performance.body), drawn[nearest]]


def _about_pelvis(joints: np.ndarray) -> np.ndarray:
    return joints - joints[:, [8]]
