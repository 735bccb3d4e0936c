"""Held-out performances tracked in 2D: with the action model as prior, without it, and the mean performance alone.

mozerov2006 learns the action model for this and leaves the tracker to the reader (its sections 1 and 4).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.core.resampling import interpolate
from pipeline.core.tracking import Track, best_phase, joint_error, linear_phase, track
from pipeline.storage.store import Artefact
from pipeline.studies.actions import tracking_conditions
from pipeline.studies.actions.held_out import (
    LEAVE_OUT,
    HeldOut,
    Performance,
    learn_without,
    left_out,
    performances_of,
)
from pipeline.studies.actions.observed_joints import Camera, camera_of, observe
from pipeline.studies.actions.tracking_conditions import Condition, conditions, demonstrated
from pipeline.studies.options import ActionSpaceModel, TrackingSweep
from pipeline.threads import map_threads

FILTERS = ("prior", "no_prior", "no_prior_own_step")
"""Particle filters: with the prior; a random walk with the prior's diffusion; one with steps of the data's size."""

METHODS = (*FILTERS, "mean_linear_phase", "mean_best_phase")
THREADS = 1
"""Arrays of one frame are so small that two threads wait for each other: measured, two take longer than one."""

_STREAM = 20060  # keeps these draws apart from those of other stages with the same seed


def measure(
    options: TrackingSweep, dataset: Artefact, model: Artefact, workers: int, seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of every method, on performances that the model has not seen, and one performance to look at.

    Parameters
    ----------
    options : TrackingSweep
    dataset, model : Artefact
        Of the model only the options are used: everything is learnt again.
    workers : int
        Not more than `THREADS` of them take part.
    seed : int

    Returns
    -------
    arrays : dict
        ``varied``, ``particles``, ``noise_mm``, ``occluded`` (C,) the conditions; ``leave_out`` (L,), ``methods``
        (K,), ``tracked`` (N,) indices of performances; ``error_mm`` (L, C, N, K) mean over frames and joints,
        relative to the pelvis; ``aspace_error_mm`` (L, N) of the true postures in the aSpace; ``lost_fraction``,
        ``pruned_fraction``, ``effective_sample_size`` (L, C, N, filters) means over frames; ``shown`` (1,) the
        performance that is shown, ``shown_true`` (T, 15, 3), ``shown_joints`` (K, T, 15, 3), ``shown_image``
        (T, 15, 2) all mm, ``shown_time_s`` (T,), ``shown_error_mm`` (K, T).
    notes : dict

    Raises
    ------
    InvalidInput
        Options that cannot be, or too few performances to leave one out.
    """
    varied, wanted = zip(*conditions(options), strict=True)
    learning = ActionSpaceModel(**model.notes["options"])
    performances, people = performances_of(dataset), dataset.arrays["person"]
    tracked = tracking_conditions.tracked(options.tracked, len(performances))
    ways, remarks = tracking_conditions.ways(options.leave_out, people)
    camera, shown = camera_of(options), demonstrated(options)
    distinct = sorted(set(wanted))

    def one(item: tuple[int, int]) -> Tracked:
        way, m = item
        held_out = learn_without(learning, performances, left_out(people, m, ways[way]))
        where = (seed, _STREAM, m)
        trial = Trial(options, held_out, performances[m], camera, where, (LEAVE_OUT.index(ways[way]),))
        return trial.all(distinct, shown)

    items = [(way, int(m)) for way in range(len(ways)) for m in tracked]
    found = map_threads(one, items, min(workers, THREADS))
    grid = (len(ways), len(tracked))
    row = [distinct.index(condition) for condition in wanted]

    def stacked(name: str) -> np.ndarray:
        """(L, C, N, …) of every item's (distinct, …)."""
        values = np.stack([getattr(f, name)[row] for f in found])
        return np.moveaxis(values.reshape(*grid, *values.shape[1:]), 1, 2)

    # The performance whose error with the prior is the median one, of the first way of leaving out.
    errors = np.array([f.errors[distinct.index(shown), 0] for f in found[: len(tracked)]])
    middle = int(np.argsort(errors, kind="stable")[len(errors) // 2])
    picked = found[middle]
    rate_hz = float(dataset.arrays["frame_rate_hz"][tracked[middle]])
    return {
        "varied": np.array(varied),
        "particles": np.array([c.particles for c in wanted]),
        "noise_mm": np.array([c.noise_mm for c in wanted]),
        "occluded": np.array([c.occluded for c in wanted]),
        "leave_out": np.array(ways),
        "methods": np.array(METHODS),
        "tracked": tracked,
        "error_mm": stacked("errors"),
        "aspace_error_mm": np.array([f.aspace_error for f in found]).reshape(grid),
        "lost_fraction": stacked("lost"),
        "pruned_fraction": stacked("pruned"),
        "effective_sample_size": stacked("size"),
        "shown": tracked[[middle]],
        "shown_true": performances[tracked[middle]].joints_mm,
        "shown_joints": picked.joints,
        "shown_image": camera.upright_mm(picked.image),
        "shown_time_s": np.arange(len(picked.image)) / rate_hz,
        "shown_error_mm": np.stack(
            [joint_error(j, performances[tracked[middle]].joints_mm) for j in picked.joints]
        ),
    }, {
        "shown_particles": shown.particles,
        "shown_noise_mm": shown.noise_mm,
        "shown_occluded": shown.occluded,
        "remarks": remarks,
    }


@dataclass(frozen=True)
class Tracked:
    """One performance under D conditions, by K methods, of which f are filters.

    Attributes
    ----------
    errors : (D, K)
        mm, mean over frames.
    lost, pruned : (D, f)
        Fractions of frames, and of predictions.
    size : (D, f)
        Mean effective sample size.
    aspace_error : float
        mm, of the true postures in the aSpace.
    joints : (K, T, 15, 3)
        mm, under the condition that is shown.
    image : (T, 15, 2)
        Under that condition, in image units.
    """

    errors: np.ndarray
    lost: np.ndarray
    pruned: np.ndarray
    size: np.ndarray
    aspace_error: float
    joints: np.ndarray
    image: np.ndarray


@dataclass(frozen=True)
class Trial:
    """One performance before the camera, and what tracks it.

    Attributes
    ----------
    options : TrackingSweep
    held_out : HeldOut
        What was learnt without the performance.
    performance : Performance
    camera : Camera
    seed : tuple of int
        Of the image: the same for every way of leaving out.
    way : tuple of int
        Goes into the seed of the filters.
    """

    options: TrackingSweep
    held_out: HeldOut
    performance: Performance
    camera: Camera
    seed: tuple[int, ...]
    way: tuple[int, ...]

    def all(self, wanted: list[Condition], shown: Condition) -> Tracked:
        """Every method under every condition."""
        true, body, space = self.performance.joints_mm, self.performance.body, self.held_out.action.space
        means = self._mean_alone()
        errors, tracks = [], []
        for condition in wanted:
            image = self.seen(condition)
            found = [self.filtered(method, condition, image) for method in FILTERS]
            joints = [*(self.held_out.joints(f.posture, body) for f in found), *means]
            errors.append([joint_error(j, true).mean() for j in joints])
            tracks.append(found)
            if condition == shown:
                kept = np.stack(joints), image
        projected = self.held_out.joints(space.project(self.performance.postures), body)
        return Tracked(
            errors=np.array(errors),
            lost=np.array([[t.lost.mean() for t in row] for row in tracks]),
            pruned=np.array([[t.pruned_fraction.mean() for t in row] for row in tracks]),
            size=np.array([[t.effective_sample_size.mean() for t in row] for row in tracks]),
            aspace_error=float(joint_error(projected, true).mean()),
            joints=kept[0],
            image=kept[1],
        )

    def seen(self, condition: Condition) -> np.ndarray:
        """The image (T, 15, 2): of this performance and condition the same for every method and model."""
        return observe(
            self.performance.joints_mm,
            self.camera,
            noise_mm=condition.noise_mm,
            occluded=condition.occluded,
            occlusion_frames=self.options.occlusion_frames,
            seed=self.seed,
        )

    def filtered(self, method: str, condition: Condition, image: np.ndarray) -> Track:
        """What a particle filter makes of an image."""
        held_out, model = self.held_out, self.held_out.action.model
        dynamics = held_out.dynamics
        if method == "no_prior_own_step":
            dynamics = replace(dynamics, diffusion=held_out.own_step)
        noise_mm = np.hypot(condition.noise_mm, held_out.misfit_mm)
        return track(
            model.mean,
            model.standard_deviation,
            self.camera.likelihood(image, noise_mm),
            to_joints=lambda x: held_out.joints(x, self.performance.body),
            n_particles=condition.particles,
            generator=np.random.default_rng(
                [*self.seed, 2, *self.way, FILTERS.index(method), *condition.words]
            ),
            dynamics=dynamics,
            prior=method == "prior",
            moves=self.options.moves,
        )

    def _mean_alone(self) -> list[np.ndarray]:
        """The mean performance on this body: at a constant rate, and at the phase nearest to the truth."""
        mean, true = self.held_out.action.model.mean, self.performance.joints_mm
        at_constant_rate = interpolate(mean, linear_phase(len(true), len(mean)))
        drawn = self.held_out.joints(mean, self.performance.body)
        nearest = best_phase(_about_pelvis(true), _about_pelvis(drawn)).astype(int)
        return [self.held_out.joints(at_constant_rate, self.performance.body), drawn[nearest]]


def _about_pelvis(joints: np.ndarray) -> np.ndarray:
    return np.asarray(joints - joints[:, [8]])
