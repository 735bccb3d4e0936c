"""Accepted postures drawn from the action model, and how far they lie from what was recorded: mozerov2006 figure 4.

"For each selected mean posture, only similar and meaningful postures are generated."  Similar is measured by the
distance from the mean posture, meaningful by that to the nearest recorded posture; both are to be read beside the
recorded postures of the same frame, and beside postures that the action model rejects.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.core import action_model, bootstrap, posture
from pipeline.core.action_model import ActionModel
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import Action
from pipeline.studies.study import Sweep, SweepInputs
from pipeline.validation import Count, Distinct, require_range

KINDS = ("accepted", "outside", "training", "unsynchronized")
"""Drawn within the bounds; every coordinate drawn beyond them; recorded, synchronized, at this frame; drawn within the
bounds of a model learnt of linearly normalised performances, without synchronization."""

BEYOND = (1.0, 3.0)
"""How many standard deviations beyond the bounds the rejected postures are drawn."""

_STREAM = 20064  # keeps these draws apart from those of other stages with the same seed
_BLOCK = 64


@dataclass(frozen=True)
class SampledPostures:
    """Mean postures, accepted ones to be shown, and distances of many to the recorded ones.

    Attributes
    ----------
    frames : (N,) int
        Of the mean performance, counted from 1.
    mean_joints, sample_joints, mean_performance : (N, 15, 3), (N, S, 15, 3), (P, 15, 3)
        Millimetres, of a body with the actors' mean limb lengths.
    kinds : (K,) text
        See `KINDS`.
    draws : (N, K) int
    acceptance, bounds_held_fraction : (N, K)
        Share of postures that the model accepts, and of coordinates within the bounds.
    nearest_training_mm, nearest_training_max_mm : (N, K)
        Median and largest distance to the nearest recorded posture, mean over joints.
    spread_mm : (N, K)
        Median distance from the mean posture.
    limb_direction_norm_min, limb_direction_norm_max : (N, K)
    drawn_nearest_training_mm, drawn_spread_mm : (B, N, K)
        The medians above, by models learnt of people drawn again, and of fewer postures; B is 0 for one person alone.
    """

    frames: np.ndarray
    mean_joints: np.ndarray
    sample_joints: np.ndarray
    mean_performance: np.ndarray
    kinds: np.ndarray
    draws: np.ndarray
    acceptance: np.ndarray
    nearest_training_mm: np.ndarray
    nearest_training_max_mm: np.ndarray
    spread_mm: np.ndarray
    limb_direction_norm_min: np.ndarray
    limb_direction_norm_max: np.ndarray
    bounds_held_fraction: np.ndarray
    drawn_nearest_training_mm: np.ndarray
    drawn_spread_mm: np.ndarray


@dataclass(kw_only=True)
class PostureSampling(Sweep):
    """Accepted postures drawn from the action model."""

    draws_random_numbers = True

    frames: Distinct[Count] = field(
        default_factory=lambda: [10, 40]
    )  # of the mean performance, counted from 1
    samples: Count = 8  # of them shown
    measured: int = 2000  # drawn at each frame
    resamples: Count = 40  # models of people drawn again, for intervals
    measured_again: Count = 64  # postures drawn at each frame of each of these

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("sweep.samples", self.samples, at_most=self.measured)

    def measure(self, inputs: SweepInputs[None, Postures, Action]) -> SampledPostures:
        """Return postures drawn at each frame, as joints, and what is said of them."""
        action, bound = inputs.model, float(inputs.model_options.bound)
        performances, learnt = action.synchronized, action.model
        unsynchronized = action_model.learn(action.linear)
        body = inputs.dataset.mean_body()

        def joints(coordinates: np.ndarray) -> np.ndarray:
            return posture.joints(action.space.postures(coordinates), body, frame=inputs.dataset.frame)

        training, mean_performance = joints(performances), joints(learnt.mean)
        samples, rows = [], []
        for number in self.frames:
            at = number - 1
            generator = np.random.default_rng([inputs.seed, _STREAM, number])
            drawn = {
                "accepted": action_model.sample(learnt, self.measured, generator, at=at, bound=bound),
                "outside": beyond(learnt, self.measured, generator, at=at, bound=bound),
                "training": performances[:, at],
                "unsynchronized": action_model.sample(
                    unsynchronized, self.measured, generator, at=at, bound=bound
                ),
            }
            samples.append(joints(drawn["accepted"][: self.samples]))
            for kind in KINDS:
                coordinates = drawn[kind]
                bodies = joints(coordinates)
                distances = nearest(bodies, training, inputs.workers)
                if kind == "training":
                    # The nearest of the other performances: its own posture is no distance away.
                    np.fill_diagonal(distances, np.inf)
                closest = distances.min(axis=1)
                about = unsynchronized if kind == "unsynchronized" else learnt
                from_mean = np.linalg.norm(bodies - joints(about.mean[at]), axis=-1).mean(axis=-1)
                cosines = action.space.postures(coordinates)[:, 1:].reshape(len(coordinates), -1, 3)
                norms = np.linalg.norm(cosines, axis=-1)
                within = np.abs(coordinates - learnt.mean[at]) <= bound * learnt.standard_deviation[at]
                row = {
                    "draws": len(coordinates),
                    "acceptance": action_model.accepted(learnt, coordinates, at=at, bound=bound).mean(),
                    "nearest_training_mm": np.median(closest),
                    "nearest_training_max_mm": closest.max(),
                    "spread_mm": np.median(from_mean),
                    "limb_direction_norm_min": norms.min(),
                    "limb_direction_norm_max": norms.max(),
                    "bounds_held_fraction": within.mean(),
                }
                rows.append(row)
        people, place = np.unique(inputs.dataset.person, return_inverse=True)
        weights = bootstrap.resampling_weights(len(people), derive_generator(0, "people"))
        weights = weights[(weights > 0).sum(axis=1) > 1][: self.resamples]  # one person alone may not vary

        def again(draw: int) -> np.ndarray:
            """Nearest and spread (2, N, K) of people drawn again."""
            held = np.repeat(np.arange(len(performances)), weights[draw, place])
            models = action_model.learn(performances[held]), action_model.learn(action.linear[held])
            found = np.empty((2, len(self.frames), len(KINDS)))
            for f, number in enumerate(self.frames):
                at, generator = number - 1, np.random.default_rng([inputs.seed, _STREAM, number, draw])
                for k, kind in enumerate(KINDS):
                    model = models[kind == "unsynchronized"]
                    if kind == "training":
                        coordinates = performances[held, at]
                    else:
                        draws = beyond if kind == "outside" else action_model.sample
                        coordinates = draws(model, self.measured_again, generator, at=at, bound=bound)
                    bodies = joints(coordinates)
                    distances = nearest(bodies, training, 1)
                    if kind == "training":
                        distances[np.arange(len(held)), held] = np.inf
                    from_mean = np.linalg.norm(bodies - joints(model.mean[at]), axis=-1).mean(axis=-1)
                    found[:, f, k] = np.median(distances[:, held].min(axis=1)), np.median(from_mean)
            return found

        shape = (len(self.frames), len(KINDS))
        drawn_again = np.array(map_processes(again, range(len(weights)), inputs.workers))
        drawn_again = drawn_again.reshape(-1, 2, *shape)
        return SampledPostures(
            frames=np.array(self.frames),
            mean_joints=mean_performance[np.array(self.frames) - 1],
            sample_joints=np.stack(samples),
            mean_performance=mean_performance,
            kinds=np.array(KINDS),
            **{name: np.array([row[name] for row in rows]).reshape(shape) for name in rows[0]},
            drawn_nearest_training_mm=drawn_again[:, 0],
            drawn_spread_mm=drawn_again[:, 1],
        )


def beyond(
    model: ActionModel, count: int, generator: np.random.Generator, *, at: int, bound: float
) -> np.ndarray:
    """Return postures (count, b) that the action model rejects: every coordinate beyond the bounds, on either side.

    Parameters
    ----------
    model : ActionModel
    count : int
    generator : numpy.random.Generator
    at : int
        The sample at which to draw.
    bound : float
        Standard deviations.
    """
    shape = (count, model.mean.shape[1])
    far = bound + generator.uniform(*BEYOND, shape)
    side = np.where(generator.random(shape) < 0.5, -1.0, 1.0)
    return np.asarray(model.mean[at] + side * far * model.standard_deviation[at])


def nearest(joints: np.ndarray, recorded: np.ndarray, workers: int) -> np.ndarray:
    """Return the mean joint distance (S, M) in mm from each posture to the nearest one of each performance.

    Parameters
    ----------
    joints : (S, J, 3)
        mm.
    recorded : (M, P, J, 3)
        mm.
    workers : int
    """
    count, length = recorded.shape[:2]
    flat = recorded.reshape(count * length, *recorded.shape[2:])
    powers = (flat**2).sum(axis=-1)

    def block(first: int) -> np.ndarray:
        some = joints[first : first + _BLOCK]
        total = np.zeros((len(some), len(flat)))
        for j in range(joints.shape[1]):
            # |a - b|² by one product of matrices: a hundredth of a millimetre is lost in it at most.
            squares = (some[:, j] ** 2).sum(axis=-1)[:, None] + powers[:, j] - 2.0 * some[:, j] @ flat[:, j].T
            total += np.sqrt(np.maximum(squares, 0.0))
        return total.reshape(len(some), count, length).min(axis=-1) / joints.shape[1]

    return np.concatenate(map_processes(block, range(0, len(joints), _BLOCK), workers))
